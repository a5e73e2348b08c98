"""Which finger is which protrusion: the best of all ways, with fingers that are hidden and protrusions of no finger.

Shimada 1997, section 2.6.2, assigns greedily and repairs. With five fingers and some protrusions all ways together are
few enough: a table over sets of protrusions that are taken already, finger by finger, holds the best of each.
"""

import numpy as np
from numpy.typing import NDArray

from pftrack.core.numerics.compiled import compiled

__all__ = ["HIDDEN", "MOST_PROTRUSIONS", "assign"]

HIDDEN = -1
"""In place of a protrusion's number."""

MOST_PROTRUSIONS = 8
"""That are assigned; a hand has five."""


@compiled
def assign(scores: NDArray[np.float64], costs: NDArray[np.float64]) -> tuple[float, NDArray[np.int64]]:
    """Return the greatest sum of scores that an assignment has, and its protrusion (F,) for each finger, or HIDDEN.

    Args:
        scores: (F, P + 1) of each finger with each protrusion, and hidden in the last column.
        costs: (P,) of protrusions that no finger explains.
    """
    fingers, protrusions = scores.shape[0], costs.shape[0]
    sets = 1 << protrusions
    best = np.full((fingers + 1, sets), -np.inf)
    taken = np.full((fingers, sets), HIDDEN)
    best[0, 0] = 0.0
    for finger in range(fingers):
        for before in range(sets):
            for p in range(protrusions + 1):
                after = before | (1 << p) if p < protrusions else before
                score = best[finger, before] + scores[finger, p]
                free = after != before or p == protrusions
                if free and score > best[finger + 1, after]:
                    best[finger + 1, after] = score
                    taken[finger, after] = p if p < protrusions else HIDDEN
    greatest, last = -np.inf, 0
    for after in range(sets):
        score = best[fingers, after]
        for p in range(protrusions):
            score -= 0.0 if after & (1 << p) else costs[p]
        if score > greatest:
            greatest, last = score, after
    return greatest, _trace_back(taken, last)


@compiled
def _trace_back(taken: NDArray[np.int64], last: int) -> NDArray[np.int64]:
    """Return the protrusion (F,) of each finger that led to a set of taken ones."""
    chosen = np.empty(taken.shape[0], np.int64)
    for finger in range(taken.shape[0] - 1, -1, -1):
        chosen[finger] = taken[finger, last]
        if chosen[finger] != HIDDEN:
            last ^= 1 << chosen[finger]
    return chosen
