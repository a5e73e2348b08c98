"""Verdicts: whether a property holds of a file, with the numbers that say so."""

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Verdict:
    """What came of looking at a property.

    Attributes:
        holds: Whether it holds.
        words: What was found, a sentence.
        numbers: By name, those that decided.
        seed: Of the random numbers that show it; None where nothing is random.
    """

    holds: bool
    words: str
    numbers: Mapping[str, float] = field(default_factory=dict)
    seed: int | None = None
