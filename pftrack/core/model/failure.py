"""Failures: named ways in which a tracker goes wrong, with what shows each and what cures it.

A failure is the recipe of a run, the frame before it happens, and its *cause*. A loss alone shows nothing, since a
target can be lost for many reasons: the diagnosis (`pftrack.analysis.diagnosis`), which knows nothing of failures, must
come to that cause by the run's own numbers. Its *cure* is a change to the beginning of the same run, of the same seed,
after which the target is held at the end.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal, TypeAlias, get_args

from pftrack.core.model.cause import CAUSES, CauseId
from pftrack.core.model.parameters import Value
from pftrack.core.model.recipe import Recipe
from pftrack.core.model.timeline import Change

__all__ = ["KINDS", "ORDER", "Cure", "Failure", "Kind"]

Kind: TypeAlias = Literal["weights", "dynamics", "collapse", "appearance"]

KINDS: Mapping[str, str] = dict(
    zip(
        get_args(Kind),
        ("Particles and weights", "Motion and what is in the way", "A belief that collapses", "Looks and detectors"),
        strict=True,
    )
)
"""What failures have in common, with the words for it, in the order in which they are shown."""

ORDER: tuple[CauseId, ...] = tuple(CAUSES)[:-2]  # of the last two no run is an example
"""Ids of the failures that have a number of their own, whichever experiment shows them; all others come after."""


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
        id: Name in commands and addresses; that of its cause where no other failure has it.
        title: The field's name for it.
        kind: What it has in common with others.
        diagnosis: What goes wrong and why, a sentence or two; frames in it are those of its own seed.
        tracker: Name of the tracker.
        frame: The one before it happens: the target is held there, and lost in the next one.
        cause: What the diagnosis of the run comes to first.
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
    cause: CauseId
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
