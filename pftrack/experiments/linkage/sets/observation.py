"""The observation of a link in the plane: from the cells that fit to strips, guides, and regions that split.

The shown length r cos theta bends, so it is no strip. The cells of `cells` cover what fits; a strip across the gradient
of r cos theta that holds all their corners holds them. Where the cells fall apart into runs, the link may lean either
towards the camera or away from it, and each run makes a region.

Source: Shimada 1997, section 5.2, eqs. 5.22 to 5.25, section 5.6 and appendix D, eq. D.4, corrected
(docs/methods/linkages.md).
"""

import numpy as np
from numpy.typing import NDArray

from pftrack.core.numerics.compiled import compiled
from pftrack.experiments.linkage.sets.cells import link_cells
from pftrack.experiments.linkage.sets.connected import label_components
from pftrack.experiments.linkage.sets.regions import CENTRE, HIGH, LOW, SHAPE, Ways
from pftrack.experiments.linkage.sets.steps import apply_strip, settle
from pftrack.experiments.linkage.sets.strips import SLACK

__all__ = ["observe_in_plane"]

MOST_STEPS, CLOSE_PX = 20, 1e-4
"""Of the search for the point to linearise at."""


@compiled
def observe_in_plane(
    region: NDArray[np.float64],
    axes: tuple[int, int],
    scale: float,
    seen: float,
    bound: float,
    cells: int,
    most: int,
    ways: Ways,
) -> NDArray[np.float64]:
    """Return what an observation leaves of a region: none, one or several (K, n + 3, n).

    Args:
        region: (n + 3, n).
        axes: Coordinates of the direction (S theta) and of the length (r).
        scale: S, px/rad.
        seen: r cos theta as observed, px.
        bound: Of its error, px.
        cells: Into how many the interval of directions is cut.
        most: Into how many it may split; what would be more stays one.
        ways: How.
    """
    angle, length = axes
    low, high, shape = region[LOW], region[HIGH], region[SHAPE:]
    ellipse = (-1.0, 0.0, 0.0)
    if ways.ellipsoids:
        ellipse = (shape[angle, angle] / (scale * scale), shape[angle, length] / scale, shape[length, length])
    place = (region[CENTRE, angle] / scale, region[CENTRE, length])
    edges, shortest, longest = link_cells(
        (low[angle] / scale, high[angle] / scale), (low[length], high[length]), seen, bound, place, ellipse, cells
    )
    feasible, sizes = np.empty(cells, np.bool_), np.empty(1, np.int64)
    sizes[0] = cells
    for n in range(cells):
        feasible[n] = shortest[n] <= longest[n]
    labels, runs = label_components(feasible, sizes)
    apart = ways.splitting and 1 < runs <= most
    point = _linearisation_point(place, ellipse, seen) if ways.ellipsoids else place
    if runs > 1 and not apart:
        runs = 1
        for n in range(cells):
            labels[n] = min(labels[n], 0)
    children = np.empty((runs, region.shape[0], region.shape[1]))
    left = 0
    for run in range(runs):
        child = children[left]
        for i in range(region.shape[0]):
            for j in range(region.shape[1]):
                child[i, j] = region[i, j]
        if apart:
            point = _middle(edges, shortest, longest, labels, run)
        slopes = (-point[1] * np.sin(point[0]) / scale, np.cos(point[0]))
        if _restrict(child, axes, scale, (edges, shortest, longest), labels, run, slopes, apart, ways):
            left += 1
    return children[:left]


@compiled
def _linearisation_point(
    place: tuple[float, float], ellipse: tuple[float, float, float], seen: float
) -> tuple[float, float]:
    """Return the (theta, r) nearest to the centre, as the ellipse measures, that shows what was seen (App. D)."""
    wide, both, tall = ellipse
    theta, r = place
    for _ in range(MOST_STEPS):
        by_angle, by_length = -r * np.sin(theta), np.cos(theta)
        rest = seen - r * by_length
        along_angle = wide * by_angle + both * by_length
        along_length = both * by_angle + tall * by_length
        spread = by_angle * along_angle + by_length * along_length
        gap = rest - by_angle * (place[0] - theta) - by_length * (place[1] - r)
        if not spread > 0.0:
            break
        theta, r = place[0] + along_angle * gap / spread, place[1] + along_length * gap / spread
        if not abs(seen - r * np.cos(theta)) > CLOSE_PX:
            break
    # Any point will do: a poor one only makes a wider strip.
    return (theta, r) if abs(theta - place[0]) < np.pi and abs(r) < 1e6 else place


@compiled
def _middle(
    edges: NDArray[np.float64],
    shortest: NDArray[np.float64],
    longest: NDArray[np.float64],
    labels: NDArray[np.int64],
    run: int,
) -> tuple[float, float]:
    """Return the mean (theta, r) of the middles of a run's cells."""
    theta, r, cells = 0.0, 0.0, 0
    for n in range(labels.shape[0]):
        if labels[n] == run:
            theta += 0.5 * (edges[n] + edges[n + 1])
            r += 0.5 * (shortest[n] + longest[n])
            cells += 1
    return theta / cells, r / cells


@compiled
def _restrict(
    region: NDArray[np.float64],
    axes: tuple[int, int],
    scale: float,
    cells: tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]],
    labels: NDArray[np.int64],
    run: int,
    slopes: tuple[float, float],
    apart: bool,
    ways: Ways,
) -> bool:
    """Hold a region to the cells (edges, least and greatest lengths) of a run, in place; return whether it is left."""
    angle, length = axes
    edges, shortest, longest = cells
    least, most = np.inf, -np.inf
    first, last, bottom, top = np.inf, -np.inf, np.inf, -np.inf
    for n in range(labels.shape[0]):
        if labels[n] != run:
            continue
        first, last = min(first, edges[n] * scale), max(last, edges[n + 1] * scale)
        bottom, top = min(bottom, shortest[n]), max(top, longest[n])
        for side in (edges[n], edges[n + 1]):
            for r in (shortest[n], longest[n]):
                value = slopes[0] * side * scale + slopes[1] * r
                least, most = min(least, value), max(most, value)
    low, high = region[LOW], region[HIGH]
    if ways.sampled or apart:
        low[angle], high[angle] = max(low[angle], first - SLACK), min(high[angle], last + SLACK)
        low[length], high[length] = max(low[length], bottom - SLACK), min(high[length], top + SLACK)
        if low[angle] > high[angle] or low[length] > high[length]:
            return False
    normal = np.zeros(region.shape[1])
    normal[angle], normal[length] = slopes
    return apply_strip(region, normal, least, most, ways) and settle(region, ways)
