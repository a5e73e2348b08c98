"""Cells of a link's angles, in the plane and in space: the fitting ones, their runs, and the extents of the runs.

A link's image is a nonlinear function of its angles, so the states that fit an observation are covered by cells, each
with its fitting lengths. Where the cells separate into runs, the link may lean either way, and each run makes a region
of its own.

Source: Shimada 1997, section 5.2, eqs. 5.22 to 5.25, and section 5.6, with cells in the place of points.
"""

from typing import NamedTuple

import numpy as np

from pftrack.core.arrays import Bools, Floats, Ints
from pftrack.core.numerics.compiled import compiled
from pftrack.experiments.linkage.sets.ellipsoids import SLACK
from pftrack.experiments.linkage.sets.regions import CENTRE, HIGH, LOW, SHAPE, Ways, apply_strip, settle

MARGIN = 1e-12
"""Largest relative rounding error of a sum of a few numbers."""


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
    """Return the run (k^d,) of each cell, -1 where nothing fits, the number of runs, and whether they are kept apart.

    Args:
        grid: The cells.
        most: Largest number of runs; more than these stay one.
        ways: Treatment of regions.
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


# Two cells are neighbours if they touch, at a corner at least: 2 in one dimension, 80 in four. Cells that are separate
# in the grid are separate in the world, so each run of neighbours may become a separate region.


@compiled
def label_components(feasible: Bools, sizes: Ints) -> tuple[Ints, int]:
    """Return the number (N,) of each feasible cell's run, -1 for others, and the number of runs.

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
        # Once every cell has its number, neighbours need no further checks.
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


# A link in the plane that shows a given length: a rigorous cover by cells of its direction, and how it cuts a region.
#
# A link of length r in the direction theta (0 is parallel to the image) shows r cos theta. The interval of directions
# is cut into cells, and in each the lengths are bounded by all that is known: the ellipse that the ellipsoid leaves of
# (theta, r), the guide of r, and the observation, with the exact range of cos over the cell. No pair (theta, r) that
# fits is outside the cells, which points sampled instead could not promise. It replaces the five points per axis with
# which Shimada samples (5.47).
#
# r cos theta bends, so it is not a strip; a strip across its gradient that holds the corners of all cells holds them.
#
# Source: Shimada 1997, sections 5.2 and 5.5, and appendix D, eq. D.4, corrected; see docs/methods/linkages.md.

DIRECTION_CELLS = 128
"""Number of cells in the range of a direction."""

MOST_STEPS, CLOSE_PX = 20, 1e-4
"""Steps of the search for the point of linearisation."""


@compiled
def cosine_range(first: float, last: float) -> tuple[float, float]:
    """Return the least and the greatest cosine of the angles from first to last, rad."""
    one, other = np.cos(first), np.cos(last)
    least, most = min(one, other), max(one, other)
    begin, end = first / np.pi, last / np.pi
    whole = np.ceil(begin)
    if whole <= end:
        if whole % 2.0 == 0.0:
            most = 1.0
        else:
            least = -1.0
        if whole + 1.0 <= end:
            least, most = -1.0, 1.0
    return least, most


@compiled
def section(first: float, last: float, wide: float, both: float, tall: float) -> tuple[float, float]:
    """Return the least and the greatest y of the ellipse about 0 where x is between two values; low > high if nowhere.

    The upper edge is b x / a + sqrt((c - b^2 / a) (1 - x^2 / a)): it rises to its apex, sqrt(c) at x = b / sqrt(c), and
    falls from there.

    Args:
        first: Least x.
        last: Greatest x.
        wide: a of the shape matrix (a, b; b, c).
        both: b.
        tall: c.
    """
    half, top = np.sqrt(max(wide, 0.0)), np.sqrt(max(tall, 0.0))
    if first > half + SLACK or last < -half - SLACK:
        return 1.0, -1.0
    if not half > SLACK:
        return -top, top
    first, last = max(first, -half), min(last, half)
    slope = both / wide
    rest = max(tall - both * slope, 0.0)
    one = np.sqrt(rest * max(1.0 - first * first / wide, 0.0))
    other = np.sqrt(rest * max(1.0 - last * last / wide, 0.0))
    low = min(slope * first - one, slope * last - other)
    high = max(slope * first + one, slope * last + other)
    apex = both / top if top > 0.0 else 0.0
    if first <= apex <= last:
        high = top
    if first <= -apex <= last:
        low = -top
    return low, high


@compiled
def link_cells(
    angles: tuple[float, float],
    lengths: tuple[float, float],
    seen: float,
    bound: float,
    place: tuple[float, float],
    ellipse: tuple[float, float, float],
    count: int,
) -> tuple[Floats, Floats, Floats]:
    """Return the edges (N + 1,) of cells of directions, rad, and the least and greatest length (N,) in each, px.

    Where the least length is above the greatest, nothing in that cell fits.

    Args:
        angles: Interval of the direction, rad.
        lengths: Interval of the length, px, not negative.
        seen: Observed length in the picture, with its sign, px.
        bound: Bound of its error, px.
        place: Centre (theta, r) of the ellipse.
        ellipse: (a, b, c) of its shape matrix, rad^2, rad px and px^2; a < 0 for no ellipse.
        count: N.
    """
    wide, both, tall = ellipse
    start, end = angles
    if wide >= 0.0:
        half = np.sqrt(wide) + SLACK
        start, end = max(start, place[0] - half), min(end, place[0] + half)
    edges, low, high = np.empty(count + 1), np.empty(count), np.empty(count)
    for n in range(count):
        edges[n], low[n], high[n] = start + (end - start) * (n / count), 1.0, -1.0
    edges[count] = end
    if start > end:
        return edges, low, high
    slack = SLACK + MARGIN * (abs(seen) + bound + lengths[1])
    least_seen, most_seen = seen - bound - slack, seen + bound + slack
    for n in range(count):
        shortest, longest = lengths
        if wide >= 0.0:
            bottom, top = section(edges[n] - place[0], edges[n + 1] - place[0], wide, both, tall)
            if bottom > top:
                continue
            shortest, longest = max(shortest, place[1] + bottom - slack), min(longest, place[1] + top + slack)
        least, most = cosine_range(edges[n], edges[n + 1])
        # Some cosine of the cell has r cos between the two: r least <= most_seen and r most >= least_seen.
        shortest, longest = below(shortest, longest, least, most_seen)
        low[n], high[n] = below(shortest, longest, -most, -least_seen)
    return edges, low, high


@compiled
def observe_in_plane(
    region: Floats,
    axes: tuple[int, int],
    scale: float,
    seen: float,
    bound: float,
    cells: int,
    most: int,
    ways: Ways,
) -> Floats:
    """Return what an observation leaves of a region: none, one or several (K, n + 3, n).

    Args:
        region: (n + 3, n).
        axes: Coordinates of the direction (S theta) and of the length (r).
        scale: S, px/rad.
        seen: r cos theta as observed, px.
        bound: Bound of its error, px.
        cells: Number of cells in the interval of directions.
        most: Largest number of parts; more than these stay one.
        ways: Treatment of regions.
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
    half = np.array([0.5 * (edges[cells] - edges[0]) / cells])
    starts, ends = edges[:cells].copy().reshape(1, cells), edges[1:].copy().reshape(1, cells)
    grid = Grid(np.array([angle]), length, starts, ends, half, shortest, longest)
    labels, runs, apart = find_runs(grid, most, ways)
    point = _linearisation_point(place, ellipse, seen) if ways.ellipsoids else place
    children = np.empty((runs, region.shape[0], region.shape[1]))
    left = 0
    for run in range(runs):
        child = children[left]
        child[:] = region
        first, last, middle = find_extents(grid, labels, run)
        if (ways.guided or apart) and not shrink_to_cells(child, grid, scale, first, last):
            continue
        if apart:
            point = (middle[0], middle[1])
        normal = np.zeros(region.shape[1])
        normal[angle], normal[length] = -point[1] * np.sin(point[0]) / scale, np.cos(point[0])
        nearest, farthest = _find_extremes(grid, labels, run, normal, scale)
        if apply_strip(child, normal, nearest, farthest, ways) and settle(child, ways):
            left += 1
    return children[:left]


@compiled
def _find_extremes(grid: Grid, labels: Ints, run: int, normal: Floats, scale: float) -> tuple[float, float]:
    """Return the least and the greatest of a linear function over the corners of a run's cells."""
    least, most = np.inf, -np.inf
    for n in range(labels.shape[0]):
        if labels[n] == run:
            for side in (grid.low[0, n], grid.high[0, n]):
                for r in (grid.shortest[n], grid.longest[n]):
                    value = normal[grid.axes[0]] * side * scale + normal[grid.length] * r
                    least, most = min(least, value), max(most, value)
    return least, most


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
