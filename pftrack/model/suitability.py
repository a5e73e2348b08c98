"""Suitability: can this target be followed by this likelihood? Asked before tracking, not after.

An experiment that takes recordings may declare how it looks at a target that was marked or found (`Experiment.suits`).
The answer is a number from 0 to 1, the words that go with it, and what would help. `docs/reference/measures.md` says
how well the number predicts what share of the frames a tracker is inside the true box.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from pftrack.model.marks import Mark

__all__ = ["NOT_AT_ALL", "WELL", "Grade", "Suitability", "grade"]

Grade: TypeAlias = Literal["well", "poorly", "not at all"]

WELL, NOT_AT_ALL = 0.6, 0.3
"""From the one on a target is followed well, below the other not at all. Of 11 targets in real clips and 24 simulated
ones, all from 0.6 on were inside the true box in 99 % of the frames, all below 0.3 in 26 % at the most; between them
are both."""


@dataclass(frozen=True, slots=True, eq=False)
class Suitability:
    """What came of looking at a target.

    Attributes:
        value: 0..1, the higher the better.
        remark: What was found, a sentence without its capital and full stop.
        advice: What would help, a clause each.
        better: A mark of the same target that suits better, where one was found.
        likelihood: (height, width) over the picture in which the target is marked, 0..1 relative to its peak, of a
            large picture every so-many-th pixel; None for a likelihood that is not one of places in the picture.
    """

    value: float
    remark: str
    advice: tuple[str, ...] = ()
    better: Mark | None = None
    likelihood: NDArray[np.float64] | None = None

    @property
    def sentences(self) -> tuple[str, ...]:
        """What was found, and what would help, a sentence each."""
        return tuple(f"{said[:1].upper()}{said[1:]}." for said in (self.remark, *self.advice))

    @property
    def grade(self) -> Grade:
        """The number in words."""
        return "well" if self.value >= WELL else "poorly" if self.value >= NOT_AT_ALL else "not at all"


def grade(value: float, unusable: float, usable: float) -> float:
    """Return how suitable a quantity is, 0..1, of which more is better.

    Args:
        value: What was measured.
        unusable: Below this it is suitable "not at all".
        usable: From here on it is "well"; twice as much is as good as it gets.
    """
    return float(np.interp(value, _scale(unusable, usable), (0.0, NOT_AT_ALL, WELL, 1.0)))


def _scale(unusable: float, usable: float) -> Sequence[float]:
    return 0.0, unusable, usable, 2.0 * usable
