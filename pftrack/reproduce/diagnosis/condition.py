"""A condition: a run that holds, and one change to it by which it fails, the *flaw*.

What is lost with the flaw and held without it, on the same seed, was lost because of it: so the cause is known without
anybody's opinion. Parameters of the flaw, trackers and seeds are drawn, by a number each, so that there are as many
different runs of a condition as one wants.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TypeAlias

from pftrack.core.model.cause import CauseId
from pftrack.core.model.parameters import Value
from pftrack.core.model.recipe import Recipe
from pftrack.core.model.timeline import Change
from pftrack.core.numerics.random import Purpose, Stream

__all__ = ["Condition", "Drawn", "Range"]

Range: TypeAlias = tuple[float, float]
"""Bounds between which a number is drawn; a list is of values of which one is drawn."""

KEPT_FROM = 2000
"""Draws that are kept aside have numbers from here on: odd ones below had been counted before."""

Drawn: TypeAlias = Mapping[str, "Value | Range | list[Value]"]


@dataclass(frozen=True)
class Condition:
    """A run that holds, and what makes it fail.

    Attributes:
        name: Of the condition.
        cause: What the flaw is a case of.
        experiment: Id of the experiment.
        trackers: Of which one is drawn.
        base: Values of the run that holds: given, or drawn.
        flaw: Values that differ in the one that fails, given or drawn.
        at: Frame at which the flaw comes; 0 for a whole run with it.
        cured_by: Another tracker than the drawn one for the run that holds.
        frames: Length of both.
        draws: How many there are of it in the study, half of them kept aside (`numbers`).
    """

    name: str
    cause: CauseId
    experiment: str
    trackers: tuple[str, ...]
    base: Drawn = field(default_factory=dict)
    flaw: Drawn = field(default_factory=dict)
    at: int = 0
    cured_by: str = ""
    frames: int | None = 60
    draws: int = 24

    @property
    def numbers(self) -> tuple[int, ...]:
        """The draws of the study: even numbers are of those on which rules are made, odd ones of those kept aside."""
        return (*range(0, self.draws, 2), *range(KEPT_FROM + 1, KEPT_FROM + self.draws, 2))

    def draw(self, number: int) -> tuple[Recipe, Recipe]:
        """Return a run with the flaw and the same without it.

        Args:
            number: From which all that is drawn follows, the seed included.
        """
        chances = Stream(number, 0, Purpose.SCENE)
        tracker = self.trackers[int(chances.random() * len(self.trackers))]
        base, flaw = (
            {name: _draw(said, chances.random()) for name, said in it.items()} for it in (self.base, self.flaw)
        )
        begin = (Change(0, base),) if base else ()
        wrong = (Change(0, {**base, **flaw}),) if self.at == 0 else (*begin, Change(self.at, flaw))
        return (
            self._recipe(tracker, number, wrong),
            self._recipe(self.cured_by or tracker, number, begin),
        )

    def _recipe(self, tracker: str, seed: int, timeline: Sequence[Change]) -> Recipe:
        return Recipe(
            experiment=self.experiment, tracker=tracker, seed=seed, frames=self.frames, timeline=tuple(timeline)
        )


def _draw(said: "Value | Range | list[Value]", chance: float) -> Value:
    if isinstance(said, list):
        return said[int(chance * len(said))]
    if isinstance(said, tuple):
        low, high = said
        value = low + (high - low) * chance
        return round(value) if isinstance(low, int) and isinstance(high, int) else value
    return said
