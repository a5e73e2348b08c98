"""A sign: that a cause is at work at a moment of a run, since when, and the numbers that this is said from."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from string import Formatter
from typing import TypeAlias

from pftrack.analysis.diagnosis.moment import Moment
from pftrack.core.model.cause import CauseId

__all__ = ["Rule", "Sign"]


@dataclass(frozen=True)
class Sign:
    """That a cause is at work.

    Attributes:
        cause: Which.
        since: Frame since when.
        strength: How clearly, from 0 to 1.
        text: A sentence with a place `{name}`, with a format if need be, for each number, and `{unit}` for the run's.
            Bars part it: what names a number that is not known, as where a person has marked few frames, is left out.
        numbers: What was measured, by name.
        evidence: Names of the columns of the course that show it.
        unit: Of the run's estimates.
    """

    cause: CauseId
    since: int
    strength: float
    text: str
    numbers: dict[str, float]
    evidence: tuple[str, ...]
    unit: str = ""

    @property
    def words(self) -> str:
        """The sentence with its numbers, as far as they are known."""
        known = [
            part for part in self.text.split("|") if all(math.isfinite(self.numbers[name]) for name in _named(part))
        ]
        return "".join(known).format(**self.numbers, unit=f" {self.unit}".rstrip())


def _named(text: str) -> set[str]:
    """Return the names of the numbers in a text."""
    return {name for _, name, _, _ in Formatter().parse(text) if name and name != "unit"}


Rule: TypeAlias = Callable[[Moment], Sign | None]
