"""Suitability: can this target be followed by this likelihood? Asked before tracking, not after.

An experiment that takes recordings may declare how it looks at a target that was marked or found (`Experiment.suits`).
The answer is a number from 0 to 1, the words that go with it, and what would help. `docs/reference/measures.md` says
how well the number predicts what share of the frames a tracker is inside the true box.

The look of a target changes, and so does what is around it. On a recording a run therefore measures in every frame how
likely what is around the estimate is beside the estimate itself (`BESIDE`, by `Setup.beside`).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import isnan
from statistics import median
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.marks import Mark
from pftrack.core.model.series import Series

__all__ = ["BESIDE", "NOT_AT_ALL", "WELL", "Grade", "Suitability", "describe_course", "grade"]

Grade: TypeAlias = Literal["well", "poorly", "not at all"]

WELL, NOT_AT_ALL = 0.6, 0.3
"""From the one on a target is followed well, below the other not at all. Of 11 targets in real clips and 24 simulated
ones, all from 0.6 on were inside the true box in 99 % of the frames, all below 0.3 in 26 % at the most; between them
are both."""

BESIDE = Series("beside", "likelihood around the estimate, over that on it")
"""Below 1 - `WELL` the target separates well, above 1 - `NOT_AT_ALL` not at all."""

SETTLED = 5
"""So many frames, this one the last, say together how a target separates: the middle one of their values."""


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
        return _in_words(self.value)


def describe_course(beside: Sequence[float]) -> str:
    """Say how a target separates from its surroundings in the last of some frames, and since when.

    Args:
        beside: Values of `BESIDE` in the frames from 0 on, NaN where they are not known.

    Returns:
        A sentence without its full stop; empty where nothing is known of the last frame.
    """
    found = _settled(beside, len(beside) - 1)
    if found is None:
        return ""
    said = _in_words(1.0 - found)
    since = len(beside) - 1
    while since > 0 and (before := _settled(beside, since - 1)) is not None and _in_words(1.0 - before) == said:
        since -= 1
    when = f" since frame {since}" if since > 0 else " from the start"
    if found > 1.0:
        return f"Separates {said}{when}: the estimate is {100 / found:.0f} % as likely as what is beside it"
    return f"Separates {said}{when}: what is beside the estimate is {100 * found:.0f} % as likely as it"


def _settled(beside: Sequence[float], frame: int) -> float | None:
    if frame < 0 or isnan(beside[frame]):
        return None
    return median(value for value in beside[max(frame - SETTLED + 1, 0) : frame + 1] if not isnan(value))


def _in_words(value: float) -> Grade:
    return "well" if value >= WELL else "poorly" if value >= NOT_AT_ALL else "not at all"


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
