"""Regions: an ellipsoid and the box of its guides; what is possible is in both.

For compiled code a region is one array (n + 3, n): the ellipsoid's centre, the low and the high guides, and the
ellipsoid's shape matrix. So it is copied, passed on and kept in one piece. A region moves, strips cut it, and its two
parts bound each other; all of these work in place and return whether anything is left.
"""

from typing import NamedTuple

import numpy as np

from pftrack.core.arrays import Floats, Ints
from pftrack.core.numerics.compiled import compiled
from pftrack.core.numerics.matrices import orthogonalise, solve_system
from pftrack.experiments.linkage.sets.plane import SLACK, TRACE, cut, cut_along, label_components, link_cells

CENTRE, LOW, HIGH, SHAPE = 0, 1, 2, 3
"""Rows of a region; the shape has all from its first."""


class Ways(NamedTuple):
    """How regions are treated. Every choice but `way` keeps all points that are possible.

    Attributes:
        ellipsoids: Whether there are ellipsoids at all, or boxes alone.
        contraction: Whether every strip shrinks the guides by interval arithmetic.
        sampled: Whether guides shrink to the cells that fit the observation.
        sides: Whether the guides are strips for the ellipsoid.
        splitting: Whether cells that fall apart make regions of their own.
        way: Of prediction: `OUTER`, or one that may lose the truth.
    """

    ellipsoids: bool
    contraction: bool
    sampled: bool
    sides: bool
    splitting: bool
    way: int


def region_of(low: Floats, high: Floats, shape: Floats | None = None) -> Floats:
    """Return a region: a box (n,) to (n,) and an ellipsoid about its middle.

    Args:
        low: Of the guides.
        high: Of the guides.
        shape: (n, n) of the ellipsoid; by default that of the least trace around the box.
    """
    half = 0.5 * (high - low) + SLACK
    return np.vstack([0.5 * (low + high), low, high, np.diag(half * half.sum()) if shape is None else shape])


def contains(region: Floats, point: Floats, *, ellipsoids: bool = True) -> bool:
    """Return whether a point (n,) is in a region; of the ellipsoid as well as within the guides, unless told otherwise.

    A millionth of the unit, of the ellipsoid's size and of the quadratic is left to rounding; an ellipsoid that is
    flat, because something is known exactly, has an inverse by that as well.
    """
    slack = 1e-6
    if np.any(point < region[LOW] - slack) or np.any(point > region[HIGH] + slack):
        return False
    if not ellipsoids:
        return True
    off, shape = point - region[CENTRE], region[SHAPE:]
    rounding = slack * slack * max(float(np.trace(shape)), 1.0)
    return float((off * solve_system(shape + rounding * np.eye(len(off)), off)).sum()) <= 1.0 + slack


# The sum of an ellipsoid and a ball is not an ellipsoid. For every p > 0, (1 + 1/p) P + (1 + p) U contains it, where U
# is the ball's shape, and p = sqrt(tr P / tr U) has the least trace (Kurzhanski and Valyi 1997). Shimada prints P + du
# I, which is not even of one unit, and describes in words the ellipsoid whose semi-axes are each longer by du, which
# touches the sum on the axes and lies inside it elsewhere. They are here for what they lose.
#
# Source: Shimada 1997, section 5.3, eq. 5.31, corrected (docs/methods/linkages.md).

OUTER, LENGTHENED, PRINTED = 0, 1, 2
"""The bound that holds; every semi-axis longer by du, as the source's words say; P + du I, as it is printed."""

FLOOR, RELATIVE_FLOOR = 1e-12, 1e-12
"""Added to all squared semi-axes, absolutely and relative to their mean, which keeps them positive for ever."""


@compiled
def predict(shape: Floats, moved: int, radius: float, way: int) -> None:
    """Add a motion to an ellipsoid, in place.

    Args:
        shape: P, (n, n).
        moved: The motion is in the first so many coordinates.
        radius: Of the ball of all motions, in the unit of the coordinates.
        way: `OUTER`, `LENGTHENED` or `PRINTED`; the last two change all coordinates, as the source has it.
    """
    size = shape.shape[0]
    trace = 0.0
    for i in range(size):
        trace += shape[i, i]
    if way == PRINTED:
        for i in range(size):
            shape[i, i] += radius
    elif way == LENGTHENED:
        _lengthen(shape, radius)
    elif radius > 0.0:
        ratio = np.sqrt(max(trace, 0.0) / (moved * radius * radius))
        for i in range(size):
            for j in range(size):
                # No ratio: a point, which becomes the ball.
                shape[i, j] *= 1.0 + 1.0 / ratio if ratio > 0.0 else 1.0
        for i in range(moved):
            shape[i, i] += (1.0 + ratio) * radius * radius
    for i in range(size):
        shape[i, i] += FLOOR + RELATIVE_FLOOR * max(trace, 0.0) / size


@compiled
def _lengthen(shape: Floats, radius: float) -> None:
    """Make every semi-axis longer by the radius, in place."""
    size = shape.shape[0]
    scaled, axes = orthogonalise(shape)
    for i in range(size):
        for j in range(size):
            shape[i, j] = 0.0
    for k in range(size):
        square = 0.0
        for i in range(size):
            square += scaled[k, i] * axes[k, i]
        half = np.sqrt(max(square, 0.0)) + radius
        for i in range(size):
            for j in range(size):
                shape[i, j] += half * half * axes[k, i] * axes[k, j]


# Guides: an ellipsoid that contains a cut ellipsoid contains more than that, so a bound that was known gets lost in it
# again. A box beside it does not forget: a bound of one coordinate, once proved, holds until that coordinate moves.
# Every strip bounds each coordinate by where the others can be (interval contraction), and every side of the box is a
# strip for the ellipsoid. Each of these steps keeps all points of the true intersection, in any order and however
# often.
#
# Source: Shimada 1997, section 5.1; eqs. 5.17 and 5.18 are `shrink_to_extent`, the others are added.


@compiled
def contract(low: Floats, high: Floats, normal: Floats, least: float, most: float) -> bool:
    """Shrink a box, in place, to what a strip leaves of it: each coordinate by the extremes of the others.

    Args:
        low: (n,) of the box.
        high: (n,) of the box.
        normal: m, (n,), of the strip least <= m'x <= most.
        least: Its one side.
        most: Its other side.

    Returns:
        Whether anything is left.
    """
    size = low.shape[0]
    lowest, highest = 0.0, 0.0
    for j in range(size):
        factor = normal[j]
        if factor > 0.0:
            lowest += factor * low[j]
            highest += factor * high[j]
        elif factor < 0.0:
            lowest += factor * high[j]
            highest += factor * low[j]
    slack = SLACK * (1.0 + 1e-3 * max(abs(lowest), abs(highest)))
    if lowest > most + slack or highest < least - slack:
        return False
    for j in range(size):
        factor = normal[j]
        if factor == 0.0:
            continue
        own_low, own_high = (low[j], high[j]) if factor > 0.0 else (high[j], low[j])
        one = (least - (highest - factor * own_high)) / factor
        other = (most - (lowest - factor * own_low)) / factor
        room = slack / abs(factor)
        low[j] = max(low[j], min(one, other) - room)
        high[j] = min(high[j], max(one, other) + room)
        if low[j] > high[j]:
            return False
    return True


@compiled
def shrink_to_extent(low: Floats, high: Floats, centre: Floats, shape: Floats) -> bool:
    """Shrink a box, in place, to the ellipsoid's extent along each axis; return whether anything is left."""
    for j in range(low.shape[0]):
        half = np.sqrt(max(shape[j, j], 0.0)) + SLACK
        low[j] = max(low[j], centre[j] - half)
        high[j] = min(high[j], centre[j] + half)
        if low[j] > high[j]:
            return False
    return True


@compiled
def cut_by_guides(low: Floats, high: Floats, centre: Floats, shape: Floats) -> bool:
    """Cut the ellipsoid, in place, by each pair of the box's sides; return whether they have a point in common."""
    left = True
    for j in range(low.shape[0]):
        left = left and cut_along(centre, shape, j, low[j], high[j])
    return left


@compiled
def circumscribe(low: Floats, high: Floats, centre: Floats, shape: Floats) -> None:
    """Put in place the ellipsoid of the least trace around a box: its squared semi-axes are h_j sum(h)."""
    size = low.shape[0]
    total = 0.0
    for j in range(size):
        total += 0.5 * (high[j] - low[j]) + SLACK
    for j in range(size):
        for k in range(size):
            shape[j, k] = 0.0
        centre[j] = 0.5 * (low[j] + high[j])
        shape[j, j] = (0.5 * (high[j] - low[j]) + SLACK) * total


@compiled
def apply_strip(region: Floats, normal: Floats, least: float, most: float, ways: Ways) -> bool:
    """Cut a region (n + 3, n) by the strip least <= m'x <= most."""
    if ways.contraction and not contract(region[LOW], region[HIGH], normal, least, most):
        return False
    return not ways.ellipsoids or cut(
        region[CENTRE],
        region[SHAPE:],
        normal,
        0.5 * (least + most),
        0.5 * (most - least),
        TRACE,
        True,
    )


@compiled
def settle(region: Floats, ways: Ways) -> bool:
    """Let guides and ellipsoid bound each other."""
    if not ways.ellipsoids:
        return True
    low, high, centre, shape = region[LOW], region[HIGH], region[CENTRE], region[SHAPE:]
    if not shrink_to_extent(low, high, centre, shape):
        return False
    if not ways.sides:
        return True
    return cut_by_guides(low, high, centre, shape) and shrink_to_extent(low, high, centre, shape)


@compiled
def move(region: Floats, moved: int, radius: float, ways: Ways) -> None:
    """Let the first so many coordinates move, all together by at most a radius; the guides each by as much."""
    low, high = region[LOW], region[HIGH]
    for j in range(moved):
        low[j] -= radius
        high[j] += radius
    if ways.ellipsoids:
        predict(region[SHAPE:], moved, radius, ways.way)
        if ways.sides and not settle(region, ways):
            # What has moved is not empty: they are apart by rounding alone.
            circumscribe(low, high, region[CENTRE], region[SHAPE:])


@compiled
def constrain(
    region: Floats,
    rows: Floats,
    least: Floats,
    most: Floats,
    ways: Ways,
) -> bool:
    """Cut a region by all of least <= A x <= most.

    Args:
        region: (n + 3, n).
        rows: A, (m, n).
        least: (m,), -inf for a row with one side only.
        most: (m,), inf for a row with one side only.
        ways: How.
    """
    for row in range(rows.shape[0]):
        low, high = least[row], most[row]
        if low == -np.inf or high == np.inf:
            # The side that is missing is where the guides end.
            lowest, highest = 0.0, 0.0
            for j in range(region.shape[1]):
                one, other = rows[row, j] * region[LOW, j], rows[row, j] * region[HIGH, j]
                lowest += min(one, other)
                highest += max(one, other)
            low, high = max(low, min(lowest, high)), min(high, max(highest, low))
        if not apply_strip(region, rows[row], low, high, ways):
            return False
    return settle(region, ways)


# The shown length r cos theta of a link in the plane bends, so it is not a strip. The cells of `plane` cover what fits;
# a strip across the gradient of r cos theta that holds all their corners holds them. Where the cells fall apart into
# runs, the link may lean either towards the camera or away from it, and each run makes a region.
#
# Source: Shimada 1997, section 5.2, eqs. 5.22 to 5.25, section 5.6 and appendix D, eq. D.4, corrected
# (docs/methods/linkages.md).

MOST_STEPS, CLOSE_PX = 20, 1e-4
"""Of the search for the point to linearise at."""


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
    edges: Floats,
    shortest: Floats,
    longest: Floats,
    labels: Ints,
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
    region: Floats,
    axes: tuple[int, int],
    scale: float,
    cells: tuple[Floats, Floats, Floats],
    labels: Ints,
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
