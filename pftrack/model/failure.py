"""Failures: named ways in which a tracker goes wrong, with what shows each and what cures it.

A failure is the recipe of a run, the frame before it happens, and a *symptom*: a function of the finished run's rows
that measures the mechanism and says in numbers what it found. A loss alone is no symptom, since a target can be lost
for many reasons. Its *cure* is a change to the beginning of the same run, of the same seed, after which the symptom is
gone and the target is held at the end.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal, TypeAlias, get_args

from pftrack.model.cause import CAUSES
from pftrack.model.diagnostics import Diagnostics
from pftrack.model.parameters import Value
from pftrack.model.recipe import Recipe
from pftrack.model.timeline import Change

__all__ = ["KINDS", "ORDER", "Cure", "Failure", "Finding", "Kind", "Symptom"]

Kind: TypeAlias = Literal["weights", "dynamics", "collapse", "appearance"]

KINDS: Mapping[str, str] = dict(
    zip(
        get_args(Kind),
        ("Particles and weights", "Motion and what is in the way", "A belief that collapses", "Looks and detectors"),
        strict=True,
    )
)
"""What failures have in common, with the words for it, in the order in which they are shown."""

ORDER: tuple[str, ...] = tuple(CAUSES)[:-2]  # of the last two no run is an example
"""Ids of the failures that have a number of their own, whichever experiment shows them; all others come after."""


@dataclass(frozen=True)
class Finding:
    """What a symptom has found in a run.

    Attributes:
        shown: Whether the run fails in this way.
        text: A sentence with a place `{name}`, with a format if need be, for each number.
        numbers: What was measured, by name.
    """

    shown: bool
    text: str
    numbers: Mapping[str, float]

    @property
    def words(self) -> str:
        """The sentence with its numbers."""
        return self.text.format(**self.numbers)


Symptom: TypeAlias = Callable[[Sequence[Diagnostics]], Finding]
"""(rows of a finished run) -> whether it fails in that way, and by what numbers."""


@dataclass(frozen=True)
class Cure:
    """What keeps a run from failing.

    Attributes:
        text: What is done and why it helps, a sentence.
        values: What differs at frame 0: parameters by name, and `tracker` for another one.
    """

    text: str
    values: Mapping[str, Value]


@dataclass(frozen=True)
class Failure:
    """A named failure of an experiment's trackers on its simulated scene.

    Attributes:
        id: Name in commands and addresses. If it is that of a cause (`pftrack.model.cause`), the diagnosis of the run
            must come to that cause first; any other id names a way to fail of which the diagnosis knows nothing.
        title: The field's name for it.
        kind: What it has in common with others.
        diagnosis: What goes wrong and why, a sentence or two; frames in it are those of its own seed.
        tracker: Name of the tracker.
        frame: The one before it happens: the target is held there, and lost in the next one.
        symptom: What measures the mechanism.
        cure: What helps.
        parameters: Values that differ from the defaults.
        seed: Of the run.
        frames: Length of the run; None for the experiment's own.
        timeline: Changes after frame 0; they happen to the cured run as well.
    """

    id: str
    title: str
    kind: Kind
    diagnosis: str
    tracker: str
    frame: int
    symptom: Symptom
    cure: Cure
    parameters: Mapping[str, Value] = field(default_factory=dict)
    seed: int = 0
    frames: int | None = None
    timeline: tuple[Change, ...] = ()

    def recipe(self, experiment: str, *, cured: bool = False, seed: int | None = None) -> Recipe:
        """Return what makes the run that fails, or the one that does not.

        Args:
            experiment: Id of the experiment that declares it.
            cured: Whether the cure is taken.
            seed: Another seed than its own.
        """
        values = {**self.parameters, **(self.cure.values if cured else {})}
        tracker = str(values.pop("tracker", self.tracker))
        return Recipe(
            experiment=experiment,
            tracker=tracker,
            seed=self.seed if seed is None else seed,
            frames=self.frames,
            timeline=(*((Change(0, values),) if values else ()), *self.timeline),
        )
