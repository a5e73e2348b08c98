"""What decides on the success of a simulated run: where the target is held in the end, whatever came between."""

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.measures import EvaluatedRun, Measure

__all__ = ["HELD_AT_END"]

LAST = 10


def _is_held_at_end(course: EvaluatedRun) -> NDArray[np.float64]:
    """Return 1 or 0 for each of the last labelled frames, NaN for the others."""
    values = np.full(len(course.errors), np.nan)
    last = np.flatnonzero(~np.isnan(course.errors))[-LAST:]
    if course.lost is not None:
        values[last] = ~course.lost[last]
    return values


HELD_AT_END = Measure(
    "held_at_end",
    f"On target in the last {LAST} frames",
    f"Share of the last {LAST} labelled frames that do not count as lost.",
    "share",
    _is_held_at_end,
)
