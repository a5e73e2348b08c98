"""The observation of a link in space: the same as in the plane, with cells of the attitude as well.

A strip for each image coordinate, across the gradient of what is shown at the middle of the cells, holds all of them.

Source: Shimada 1997, section 5.2, eqs. 5.22 to 5.25, and section 5.5.
"""

import numpy as np
from numpy.typing import NDArray

from pftrack.core.numerics.compiled import compiled
from pftrack.experiments.linkage.sets.connected import label_components
from pftrack.experiments.linkage.sets.regions import HIGH, LOW, Ways
from pftrack.experiments.linkage.sets.space_cells import TURNS, Grid, Link, image, rotate, space_cells
from pftrack.experiments.linkage.sets.steps import apply_strip, settle
from pftrack.experiments.linkage.sets.strips import SLACK

__all__ = ["observe_in_space"]


@compiled
def observe_in_space(
    region: NDArray[np.float64],
    link: Link,
    seen: NDArray[np.float64],
    bound: NDArray[np.float64],
    cells: int,
    most: int,
    ways: Ways,
) -> NDArray[np.float64]:
    """Return what an observation leaves of a region: none, one or several (K, n + 3, n).

    Args:
        region: (n + 3, n), coordinates (S omega, S theta*_2, S theta*_3, r_1, r_2, r_3).
        link: Which is observed.
        seen: (2,) its end less its beginning, px.
        bound: (2,) of the error of each, px; infinite where it was not seen.
        cells: Along each axis.
        most: Into how many it may split; what would be more stays one.
        ways: How.
    """
    grid = space_cells(region, link, seen, bound, cells, ways)
    total = grid.shortest.shape[0]
    feasible, sizes = np.empty(total, np.bool_), np.empty(grid.axes.shape[0], np.int64)
    for axis in range(sizes.shape[0]):
        sizes[axis] = cells
    for n in range(total):
        feasible[n] = grid.shortest[n] <= grid.longest[n]
    labels, runs = label_components(feasible, sizes)
    apart = ways.splitting and 1 < runs <= most
    if runs > 1 and not apart:
        runs = 1
        for n in range(total):
            labels[n] = min(labels[n], 0)
    children = np.empty((runs, region.shape[0], region.shape[1]))
    left = 0
    for run in range(runs):
        for i in range(region.shape[0]):
            for j in range(region.shape[1]):
                children[left, i, j] = region[i, j]
        if _restrict(children[left], link, grid, labels, run, apart, ways):
            left += 1
    return children[:left]


@compiled
def _restrict(
    region: NDArray[np.float64],
    link: Link,
    grid: Grid,
    labels: NDArray[np.int64],
    run: int,
    apart: bool,
    ways: Ways,
) -> bool:
    """Hold a region to the cells of a run, in place; return whether it is left."""
    dimension, size = grid.axes.shape[0], region.shape[1]
    first, last, middle = _extents(grid, labels, run)
    if ways.sampled or apart:
        for axis in range(dimension + 1):
            j, scale = link.length, 1.0
            if axis < dimension:
                j, scale = grid.axes[axis], link.scale
            region[LOW, j] = max(region[LOW, j], first[axis] * scale - SLACK)
            region[HIGH, j] = min(region[HIGH, j], last[axis] * scale + SLACK)
            if region[LOW, j] > region[HIGH, j]:
                return False
    turn, slopes = rotate(link.reference, middle[:TURNS].copy())
    theta = middle[TURNS] if dimension > TURNS else 0.0
    for k in range(2):
        normal, tilt = np.zeros(size), np.empty(TURNS + 1)
        normal[link.length], tilt[0], tilt[1], tilt[2], tilt[3] = image(turn, slopes, np.cos(theta), np.sin(theta), k)
        for axis in range(dimension):
            tilt[axis] *= middle[dimension]
            normal[grid.axes[axis]] = tilt[axis] / link.scale
        least, most = _extremes(grid, labels, run, tilt, normal[link.length])
        if not apply_strip(region, normal, least, most, ways):
            return False
    return settle(region, ways)


@compiled
def _extents(
    grid: Grid, labels: NDArray[np.int64], run: int
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return the least, the greatest and the mean angles and, last of each (d + 1,), lengths of the cells of a run."""
    dimension = grid.axes.shape[0]
    first, last, middle = np.empty(dimension + 1), np.empty(dimension + 1), np.zeros(dimension + 1)
    members = 0
    for n in range(labels.shape[0]):
        if labels[n] != run:
            continue
        place = n
        for axis in range(dimension, -1, -1):
            low, high = grid.shortest[n], grid.longest[n]
            if axis < dimension:
                low = grid.start[axis] + 2 * (place % grid.cells) * grid.half[axis]
                high = low + 2 * grid.half[axis]
                place //= grid.cells
            first[axis] = low if members == 0 else min(first[axis], low)
            last[axis] = high if members == 0 else max(last[axis], high)
            middle[axis] += 0.5 * (low + high)
        members += 1
    for axis in range(dimension + 1):
        middle[axis] /= members
    return first, last, middle


@compiled
def _extremes(
    grid: Grid, labels: NDArray[np.int64], run: int, tilt: NDArray[np.float64], slope: float
) -> tuple[float, float]:
    """Return the least and the greatest of a linear function over the cells of a run."""
    dimension = grid.axes.shape[0]
    room = 0.0
    for axis in range(dimension):
        room += abs(tilt[axis]) * grid.half[axis]
    least, most = np.inf, -np.inf
    for n in range(labels.shape[0]):
        if labels[n] != run:
            continue
        place, value = n, 0.0
        for axis in range(dimension - 1, -1, -1):
            value += tilt[axis] * (grid.start[axis] + (2 * (place % grid.cells) + 1) * grid.half[axis])
            place //= grid.cells
        one, other = slope * grid.shortest[n], slope * grid.longest[n]
        least, most = min(least, value + min(one, other) - room), max(most, value + max(one, other) + room)
    return least, most
