"""Regions: an ellipsoid and the box of its guides; possible states lie in both.

For compiled code a region is one array (n + 3, n): the ellipsoid's centre, the low and the high guides, and the
ellipsoid's shape matrix. So it is copied, passed on and kept in one piece. A region moves, strips cut it, and its two
parts bound each other; all of these work in place and return whether anything remains. A frame moves a family of
regions, observes, constrains, and drops each region that lies in another. The caller defines the observation.

Source: Shimada 1997, sections 5.1 and 5.6.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple, TypeAlias

import numpy as np

from pftrack.core.arrays import Floats, Ints
from pftrack.core.numerics.compiled import compiled
from pftrack.core.numerics.matrices import solve_system
from pftrack.experiments.linkage.sets.ellipsoids import (
    SLACK,
    box_in_ellipsoid,
    cut,
    cut_along,
    ellipsoid_in_ellipsoid,
    predict,
)
from pftrack.experiments.linkage.state import Events

CENTRE, LOW, HIGH, SHAPE = 0, 1, 2, 3
"""Rows of a region; the shape has all from its first."""


class Ways(NamedTuple):
    """Treatment of regions. Every choice but `way` keeps all points that are possible.

    Attributes:
        ellipsoids: Whether there are ellipsoids at all, or boxes alone.
        guided: Whether guides shrink by interval arithmetic and to the cells that fit the observation, and are strips
            for the ellipsoid; if not, they shrink to the ellipsoid's extent alone.
        splitting: Whether separate cells become separate regions.
        way: Kind of prediction: `OUTER`, or one that may lose the truth.
    """

    ellipsoids: bool
    guided: bool
    splitting: bool
    way: int


def region_of(low: Floats, high: Floats, shape: Floats | None = None) -> Floats:
    """Return a region: a box (n,) to (n,) and an ellipsoid about its middle.

    Args:
        low: Low guides.
        high: High guides.
        shape: (n, n) of the ellipsoid; by default that of the least trace around the box.
    """
    half = 0.5 * (high - low) + SLACK
    return np.vstack([0.5 * (low + high), low, high, np.diag(half * half.sum()) if shape is None else shape])


def contains(region: Floats, point: Floats, *, ellipsoids: bool = True) -> bool:
    """Return whether a point (n,) is in a region: in the ellipsoid and, by default, within the guides.

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


# Guides: an ellipsoid that contains a cut ellipsoid contains more than that, so a bound that was known gets lost in it
# again. The box keeps its bounds: a proved bound of one coordinate holds until that coordinate moves. Every strip
# bounds each coordinate by where the others can be (interval contraction), and every side of the box is a strip for the
# ellipsoid. Each of these steps keeps all points of the true intersection, in any order and however often.
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
    half = 0.5 * (high - low) + SLACK
    centre[:] = 0.5 * (low + high)
    shape[:] = np.diag(half * half.sum())


@compiled
def apply_strip(region: Floats, normal: Floats, least: float, most: float, ways: Ways) -> bool:
    """Cut a region (n + 3, n) by the strip least <= m'x <= most."""
    if ways.guided and not contract(region[LOW], region[HIGH], normal, least, most):
        return False
    return not ways.ellipsoids or cut(
        region[CENTRE], region[SHAPE:], normal, 0.5 * (least + most), 0.5 * (most - least)
    )


@compiled
def settle(region: Floats, ways: Ways) -> bool:
    """Let guides and ellipsoid bound each other."""
    if not ways.ellipsoids:
        return True
    low, high, centre, shape = region[LOW], region[HIGH], region[CENTRE], region[SHAPE:]
    if not shrink_to_extent(low, high, centre, shape):
        return False
    if not ways.guided:
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
        if ways.guided and not settle(region, ways):
            # A moved region is not empty: the parts are disjoint only by rounding.
            circumscribe(low, high, region[CENTRE], region[SHAPE:])


@compiled
def constrain(region: Floats, rows: Floats, least: Floats, most: Floats, ways: Ways) -> bool:
    """Cut a region by all of least <= A x <= most.

    Args:
        region: (n + 3, n).
        rows: A, (m, n).
        least: (m,), -inf for a row with one side only.
        most: (m,), inf for a row with one side only.
        ways: Treatment of regions.
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


@compiled
def lies_in(one: Floats, other: Floats, ellipsoids: bool) -> bool:
    """Return whether a region lies in another: its box in the other's, and it in the other's ellipsoid.

    Args:
        one: A region.
        other: The other.
        ellipsoids: Whether they have ellipsoids, or boxes alone.
    """
    for j in range(one.shape[1]):
        if one[LOW, j] < other[LOW, j] or one[HIGH, j] > other[HIGH, j]:
            return False
    if not ellipsoids:
        return True
    centre, shape = other[CENTRE], other[SHAPE:]
    return ellipsoid_in_ellipsoid(one[CENTRE], one[SHAPE:], centre, shape) or box_in_ellipsoid(
        one[LOW], one[HIGH], centre, shape
    )


PASSES = 2
"""Passes of a frame through observations and bounds."""

MOST_REGIONS = 16
"""A region that would become more than there is room for is not split, which loses nothing."""

Observe: TypeAlias = Callable[[Floats, int, int], Floats]
"""(region (n + 3, n), number of the observation, largest number of parts) -> the remaining parts, (K, n + 3, n)."""


@dataclass(frozen=True, slots=True, eq=False)
class Known:
    """Prior bounds, and the largest motion per frame.

    Attributes:
        rows: A, (m, n), of least <= A x <= most in the coordinates of the regions.
        least: (m,), -inf for a row with one side only.
        most: (m,), inf for a row with one side only.
        moved: Number of the first coordinates that move.
        radius: All together by at most that much in a frame, in their unit.
    """

    rows: Floats
    least: Floats
    most: Floats
    moved: int
    radius: float


def frame_step(
    before: Sequence[Floats],
    observe: Observe,
    links: Sequence[int],
    known: Known,
    ways: Ways,
) -> tuple[list[Floats], Ints, Events]:
    """Take one frame: predict, observe, constrain and merge.

    Args:
        before: The regions of the frame before.
        observe: Take one observation into account.
        links: Observed links, by number.
        known: Prior bounds.
        ways: Treatment of regions.

    Returns:
        The regions that are left, (n + 3, n) each, the number (K,) of the region of the frame before that each comes
        from, and what happened. If none is possible, the observation is left out.
    """
    predicted = [(region.copy(), parent) for parent, region in enumerate(before)]
    for region, _ in predicted:
        move(region, known.moved, known.radius, ways)
    here = [(region.copy(), parent) for region, parent in predicted]
    merged: set[int] = set()
    for _ in range(PASSES):
        for link in links:
            after: list[tuple[Floats, int]] = []
            for number, (region, parent) in enumerate(here, start=1):
                # Those that are still to come need a place each.
                room = MOST_REGIONS - len(after) - (len(here) - number)
                after += [(child, parent) for child in observe(region, link, room)]
            here = after
        here = [pair for pair in here if constrain(pair[0], known.rows, known.least, known.most, ways)]
        here = _distinct(here, merged, ways)
    left = here or predicted
    parents = [parent for _, parent in left]
    ended = set(range(len(before))) - set(parents)
    splits = len(parents) - len(set(parents))
    events = Events(splits, len(ended & merged), len(ended - merged), outlier=not here)
    return [region for region, _ in left], np.array(parents), events


def _distinct(pairs: list[tuple[Floats, int]], merged: set[int], ways: Ways) -> list[tuple[Floats, int]]:
    """Return regions without those that lie in another, and note the parents of these."""
    left = list(pairs)
    for pair in pairs:
        others = [other for other in left if other is not pair]
        if any(lies_in(pair[0], other[0], ways.ellipsoids) for other in others):
            left = others
            merged.add(pair[1])
    return left
