"""A sign: that a cause is at work at a moment of a run, since when, and the numbers that this is said from."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

from pftrack.diagnosis.moment import Moment
from pftrack.model.cause import CauseId

__all__ = ["Rule", "Sign"]


@dataclass(frozen=True)
class Sign:
    """That a cause is at work.

    Attributes:
        cause: Which.
        since: Frame since when.
        strength: How clearly, from 0 to 1.
        text: A sentence with a place `{name}`, with a format if need be, for each number, and `{unit}` for the run's.
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
        """The sentence with its numbers."""
        return self.text.format(**self.numbers, unit=f" {self.unit}".rstrip())


Rule: TypeAlias = Callable[[Moment], Sign | None]
