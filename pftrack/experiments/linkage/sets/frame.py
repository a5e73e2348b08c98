"""One frame of a family of regions: predict, observe, constrain, merge (Shimada 1997, section 5.6).

What is observed is the caller's affair, so this knows no chain.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from pftrack.experiments.linkage.sets.merging import lies_in
from pftrack.experiments.linkage.sets.regions import Ways
from pftrack.experiments.linkage.sets.steps import constrain, move

__all__ = ["MOST_REGIONS", "Known", "Observe", "Outcome", "frame_step"]

MOST_REGIONS = 16
"""A region that would become more than there is room for is not split, which loses nothing."""

Observe: TypeAlias = Callable[[NDArray[np.float64], int, int], NDArray[np.float64]]
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

    rows: NDArray[np.float64]
    least: NDArray[np.float64]
    most: NDArray[np.float64]
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

    regions: tuple[NDArray[np.float64], ...]
    parents: NDArray[np.int64]
    splits: int
    merges: int
    refuted: int
    outlier: bool


def frame_step(
    before: Sequence[NDArray[np.float64]],
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
            after: list[tuple[NDArray[np.float64], int]] = []
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


def _distinct(
    pairs: list[tuple[NDArray[np.float64], int]], merged: set[int], ways: Ways
) -> list[tuple[NDArray[np.float64], int]]:
    """Return regions without those that lie in another, and note the parents of these."""
    left = list(pairs)
    for pair in pairs:
        others = [other for other in left if other is not pair]
        if any(lies_in(pair[0], other[0], ways.ellipsoids) for other in others):
            left = others
            merged.add(pair[1])
    return left
