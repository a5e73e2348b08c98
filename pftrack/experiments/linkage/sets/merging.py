"""One frame of a family of regions, and whether one region contains another, which then need not be kept.

An ellipsoid lies in another if the greatest value of the other's quadratic over it is at most 1. That is a quadratic
over a ball: with its eigenvalues l_i and slopes g_i it is the least mu + sum g_i^2 / (mu - l_i) + value at the centre,
over all mu above the greatest l_i (the secular equation is where its derivative is zero). Every mu gives an upper
bound, so whichever the search ends with, a yes is a proof.

A frame predicts, observes, constrains and merges. What is observed is the caller's affair, so this knows no chain.

Source: Shimada 1997, section 5.6, for the rule; the test of inclusion is our own.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from pftrack.core.arrays import Floats, Ints
from pftrack.core.numerics.compiled import compiled
from pftrack.core.numerics.matrices import factorise, orthogonalise, substitute
from pftrack.experiments.linkage.sets.regions import CENTRE, HIGH, LOW, SHAPE, Ways, constrain, move

MOST_STEPS = 60
"""Halvings of the interval of mu."""

LIMIT = 1.0 + 1e-9
"""By so little the one may stick out, for the sake of rounding."""


@compiled
def lies_in(one: Floats, other: Floats, ellipsoids: bool) -> bool:
    """Return whether a region lies in another: its box in the other's, and it in the other's ellipsoid.

    Args:
        one: A region, see `pftrack.experiments.linkage.sets.regions`.
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


@compiled
def box_in_ellipsoid(low: Floats, high: Floats, centre: Floats, shape: Floats) -> bool:
    """Return whether all corners of a box (n,) to (n,) lie in an ellipsoid, and with them all of the box."""
    size = low.shape[0]
    root, positive = factorise(shape)
    if not positive:
        return False
    corners = np.empty((size, 1 << size))
    for number in range(1 << size):
        for j in range(size):
            corners[j, number] = (high[j] if number >> j & 1 else low[j]) - centre[j]
    off = substitute(root, corners)
    for number in range(1 << size):
        value = 0.0
        for j in range(size):
            value += off[j, number] * off[j, number]
        if not value <= 1.0:
            return False
    return True


@compiled
def ellipsoid_in_ellipsoid(
    centre: Floats,
    shape: Floats,
    other_centre: Floats,
    other_shape: Floats,
) -> bool:
    """Return whether an ellipsoid, centre (n,) and shape (n, n), lies in another."""
    size = centre.shape[0]
    own, regular = factorise(shape)
    root, positive = factorise(other_shape)
    if not (regular and positive):
        return False
    # In coordinates in which the other is the unit ball about 0, the one is d + A u, |u| <= 1.
    apart, across = np.empty((size, 1)), np.empty((size, size))
    for j in range(size):
        apart[j, 0] = centre[j] - other_centre[j]
    apart, image = substitute(root, apart), substitute(root, own)
    for j in range(size):
        for k in range(size):
            across[k, j] = image[j, k]
    turned, _ = orthogonalise(across)
    squares, slopes = np.zeros(size), np.zeros(size)
    distance = 0.0
    for k in range(size):
        for j in range(size):
            squares[k] += turned[k, j] * turned[k, j]
            slopes[k] += turned[k, j] * apart[j, 0]
        distance += apart[k, 0] * apart[k, 0]
    return _at_most_one(squares, slopes, distance)


@compiled
def _at_most_one(squares: Floats, slopes: Floats, distance: float) -> bool:
    """Return whether sum l_k v_k^2 + 2 g_k v_k + distance is at most 1 for all |v| <= 1."""
    most, steepest = 0.0, 0.0
    for k in range(squares.shape[0]):
        most = max(most, squares[k])
        steepest += slopes[k] * slopes[k]
    if not most + distance <= LIMIT:
        return False
    least, greatest = most, most + np.sqrt(steepest)
    for _ in range(MOST_STEPS):
        middle = 0.5 * (least + greatest)
        bound, slope = middle + distance, 1.0
        for k in range(squares.shape[0]):
            if slopes[k] != 0.0:
                share = slopes[k] / (middle - squares[k])
                bound += share * slopes[k]
                slope -= share * share
        if bound <= LIMIT:
            return True
        if slope > 0.0:
            greatest = middle
        else:
            least = middle
    return False


MOST_REGIONS = 16
"""A region that would become more than there is room for is not split, which loses nothing."""

Observe: TypeAlias = Callable[[Floats, int, int], Floats]
"""(region (n + 3, n), number of the observation, into how many it may split) -> what is left of it, (K, n + 3, n)."""


@dataclass(frozen=True, slots=True, eq=False)
class Known:
    """What is known beforehand, and how far a frame may move.

    Attributes:
        rows: A, (m, n), of least <= A x <= most in the coordinates of the regions.
        least: (m,), -inf for a row with one side only.
        most: (m,), inf for a row with one side only.
        moved: So many of the first coordinates move.
        radius: All together by at most that much in a frame, in their unit.
    """

    rows: Floats
    least: Floats
    most: Floats
    moved: int
    radius: float


@dataclass(frozen=True, slots=True, eq=False)
class Outcome:
    """What comes of a frame.

    Attributes:
        regions: Those that are left, (n + 3, n) each.
        parents: (K,) index of the region of the frame before that each comes from.
        splits: How many regions more than one come from the same parent.
        merges: How many parents went into another region.
        refuted: How many parents have turned out impossible.
        outlier: Whether none was possible, so that the observation was left out.
    """

    regions: tuple[Floats, ...]
    parents: Ints
    splits: int
    merges: int
    refuted: int
    outlier: bool


def frame_step(
    before: Sequence[Floats],
    observe: Observe,
    links: Sequence[int],
    known: Known,
    passes: int,
    ways: Ways,
) -> Outcome:
    """Take one frame.

    Args:
        before: The regions of the frame before.
        observe: Take one observation into account.
        links: What was observed, by number.
        known: What is known beforehand.
        passes: How often observations and constraints are gone through.
        ways: How regions are treated.
    """
    predicted = [(region.copy(), parent) for parent, region in enumerate(before)]
    for region, _ in predicted:
        move(region, known.moved, known.radius, ways)
    here = [(region.copy(), parent) for region, parent in predicted]
    merged: set[int] = set()
    for _ in range(passes):
        for link in links:
            after: list[tuple[Floats, int]] = []
            for number, (region, parent) in enumerate(here, start=1):
                # Those that are still to come need a place each.
                room = MOST_REGIONS - len(after) - (len(here) - number)
                after += [(child, parent) for child in observe(region, link, room)]
            here = after
        here = [pair for pair in here if constrain(pair[0], known.rows, known.least, known.most, ways)]
        here = _distinct(here, merged, ways)
    outlier = not here
    left = predicted if outlier else here
    parents = [parent for _, parent in left]
    ended = set(range(len(before))) - set(parents)
    return Outcome(
        tuple(region for region, _ in left),
        np.array(parents),
        len(parents) - len(set(parents)),
        len(ended & merged),
        len(ended - merged),
        outlier,
    )


def _distinct(pairs: list[tuple[Floats, int]], merged: set[int], ways: Ways) -> list[tuple[Floats, int]]:
    """Return regions without those that lie in another, and note the parents of these."""
    left = list(pairs)
    for pair in pairs:
        others = [other for other in left if other is not pair]
        if any(lies_in(pair[0], other[0], ways.ellipsoids) for other in others):
            left = others
            merged.add(pair[1])
    return left
