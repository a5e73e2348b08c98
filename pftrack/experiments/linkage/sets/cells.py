"""Cells of a link's angles, in the plane and in space: which of them fit, the runs they make, and how far these reach.

What a link shows bends with its angles, so what fits an observation is covered by cells, each with the lengths that fit
in it. Where the cells fall apart into runs, the link may lean either way, and each run makes a region of its own.

Source: Shimada 1997, section 5.2, eqs. 5.22 to 5.25, and section 5.6, with cells in the place of points.
"""

from typing import NamedTuple

import numpy as np

from pftrack.core.arrays import Bools, Floats, Ints
from pftrack.core.numerics.compiled import compiled
from pftrack.experiments.linkage.sets.ellipsoids import SLACK
from pftrack.experiments.linkage.sets.regions import HIGH, LOW, Ways

MARGIN = 1e-12
"""What rounding may take from a sum of a few numbers, relative to them."""


class Grid(NamedTuple):
    """Cells of angles, as many along each axis, and what lengths fit in each.

    Attributes:
        axes: (d,) coordinates of a region that it is over.
        length: Coordinate of the length.
        low: (d, k) where the cells along each axis begin, rad.
        high: (d, k) where they end, rad.
        half: (d,) half widths of a cell, rad.
        shortest: (k^d,) px, the last axis together.
        longest: (k^d,) px; below the shortest where nothing fits.
    """

    axes: Ints
    length: int
    low: Floats
    high: Floats
    half: Floats
    shortest: Floats
    longest: Floats


@compiled
def below(shortest: float, longest: float, factor: float, limit: float) -> tuple[float, float]:
    """Return what r * factor <= limit leaves of an interval of r."""
    if factor > 0.0:
        return shortest, min(longest, limit / factor)
    if factor < 0.0:
        return max(shortest, limit / factor), longest
    return (shortest, longest) if limit >= 0.0 else (1.0, -1.0)


@compiled
def find_runs(grid: Grid, most: int, ways: Ways) -> tuple[Ints, int, bool]:
    """Return the run (k^d,) of each cell, -1 where nothing fits, how many runs there are, and if they are kept apart.

    Args:
        grid: The cells.
        most: Into how many runs they may fall apart; what would be more stays one.
        ways: How regions are treated.
    """
    labels, runs = label_components(grid.shortest <= grid.longest, np.full(grid.axes.shape[0], grid.low.shape[1]))
    apart = ways.splitting and 1 < runs <= most
    if runs > 1 and not apart:
        return np.minimum(labels, 0), 1, False
    return labels, runs, apart


@compiled
def find_extents(grid: Grid, labels: Ints, run: int) -> tuple[Floats, Floats, Floats]:
    """Return the least, the greatest and the mean angles and, last of each (d + 1,), lengths of the cells of a run."""
    dimension, cells = grid.low.shape
    first, last, middle = np.full(dimension + 1, np.inf), np.full(dimension + 1, -np.inf), np.zeros(dimension + 1)
    members = 0
    for n in range(labels.shape[0]):
        if labels[n] != run:
            continue
        place = n
        for axis in range(dimension, -1, -1):
            low, high = grid.shortest[n], grid.longest[n]
            if axis < dimension:
                low, high = grid.low[axis, place % cells], grid.high[axis, place % cells]
                place //= cells
            first[axis] = min(first[axis], low)
            last[axis] = max(last[axis], high)
            middle[axis] += 0.5 * (low + high)
        members += 1
    return first, last, middle / members


@compiled
def shrink_to_cells(region: Floats, grid: Grid, scale: float, first: Floats, last: Floats) -> bool:
    """Shrink the guides, in place, to the extents (d + 1,) of a run; return whether anything is left."""
    for axis in range(first.shape[0]):
        j, unit = grid.length, 1.0
        if axis < grid.axes.shape[0]:
            j, unit = grid.axes[axis], scale
        region[LOW, j] = max(region[LOW, j], first[axis] * unit - SLACK)
        region[HIGH, j] = min(region[HIGH, j], last[axis] * unit + SLACK)
        if region[LOW, j] > region[HIGH, j]:
            return False
    return True


# Two cells are neighbours if they touch, at a corner at least: 2 in one dimension, 80 in four. What is apart in the
# grid is apart in the world too, so each run of neighbours may become a region of its own.


@compiled
def label_components(feasible: Bools, sizes: Ints) -> tuple[Ints, int]:
    """Return the number (N,) of the run that each feasible cell is in, -1 for others, and how many runs there are.

    Args:
        feasible: (N,) cells, the last axis together.
        sizes: (d,) of the grid, N their product.
    """
    dimension, count = sizes.shape[0], feasible.shape[0]
    labels, stack = np.empty(count, np.int64), np.empty(count, np.int64)
    place, step = np.empty(dimension, np.int64), np.empty(dimension, np.int64)
    runs, left = 0, 0
    for cell in range(count):
        labels[cell] = -1
        left += feasible[cell]
    for begin in range(count):
        if not feasible[begin] or labels[begin] >= 0:
            continue
        labels[begin] = runs
        left -= 1
        stack[0] = begin
        waiting = 1
        # Once every cell has its number, nobody needs to be asked for neighbours any more.
        while waiting > 0 and left > 0:
            waiting -= 1
            rest = stack[waiting]
            for axis in range(dimension - 1, -1, -1):
                place[axis] = rest % sizes[axis]
                rest //= sizes[axis]
                step[axis] = -1
            more = True
            while more:
                other, inside = 0, True
                for axis in range(dimension):
                    moved = place[axis] + step[axis]
                    inside = inside and 0 <= moved < sizes[axis]
                    other = other * sizes[axis] + moved
                if inside and feasible[other] and labels[other] < 0:
                    labels[other] = runs
                    left -= 1
                    stack[waiting] = other
                    waiting += 1
                more = _increment(step)
        runs += 1
    return labels, runs


@compiled
def _increment(step: Ints) -> bool:
    """Count up digits of -1, 0 and 1, in place; return whether there was a next number."""
    axis = step.shape[0] - 1
    while axis >= 0 and step[axis] == 1:
        step[axis] = -1
        axis -= 1
    if axis >= 0:
        step[axis] += 1
    return bool(axis >= 0)
