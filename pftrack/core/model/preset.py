"""First examples of an experiment: presets, sweeps, tours, failures.

The presets of an experiment are in `presets.yaml` in its folder, each under its name, so texts can be edited without
Python. `read_presets` reads them, and `Experiment` checks their names.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Literal, TypeAlias, get_args

from pydantic import Field, computed_field, with_config

from pftrack.core.model.parameters import Value
from pftrack.core.model.recipe import Change, Recipe
from pftrack.core.texts import CLOSED, Origin, read_as


@dataclass(frozen=True, slots=True)
class Tour:
    """A preset that loses its target, explained to a first visitor.

    Attributes:
        begin: What the page shows before it runs, a sentence or two.
        reason: Why the target is lost, a few sentences that need no knowledge of filters.
        plot: Id of the experiment's plot that shows it.
        frame: Number of the frame in which it is to be seen.
    """

    begin: str
    reason: str
    plot: str
    frame: int


@with_config(CLOSED)
@dataclass(frozen=True)
class Preset:
    """A named starting point that shows something.

    Attributes:
        name: Name in addresses.
        title: Its title, a few words.
        tracker: Name of the tracker.
        parameters: Values that differ from the defaults.
        seed: Seed of the run.
        about: Names of further parameters that it is about, worth turning while it is watched.
        scene: Names of those that it sets and is not about: what a scene is made of, and what is known beforehand.
        watch: What to watch when it is opened, a sentence or two; frames in it are those of its own seed.
        tour: Text of a guided tour, if it is known to lose its target.
        origin: The file and line where it is declared.
    """

    name: str
    title: str
    tracker: str
    parameters: Mapping[str, Value] = field(default_factory=dict)
    seed: int = 0
    about: Annotated[tuple[str, ...], Field(exclude=True)] = ()
    watch: str = ""
    scene: Annotated[tuple[str, ...], Field(exclude=True)] = ()
    tour: Tour | None = None
    origin: Origin = field(default="", compare=False, repr=False)

    @computed_field(alias="about")  # type: ignore[prop-decorator]
    @property
    def subjects(self) -> tuple[str, ...]:
        """Names of all parameters that it is about: those that it sets beyond the scene's, then the further ones."""
        set_here = (name for name in self.parameters if name not in self.scene)
        return tuple(dict.fromkeys((*set_here, *self.about)))


def read_presets(path: Path) -> tuple[Preset, ...]:
    """Return the presets of a YAML file, which maps their names to their fields.

    Raises:
        ValueError: The file is not YAML, or a preset lacks a field or has an unknown one; it names the file and line.
    """
    return read_as(Preset, path, "name")


@dataclass(frozen=True)
class ExampleSweep:
    """A sweep that is worth starting as it stands.

    Attributes:
        axes: Values of the parameters that are varied, by name.
        trackers: Names of the trackers that are compared.
        trials: Runs of each tracker in each condition.
        frames: Length of a run.
    """

    axes: Mapping[str, tuple[Value, ...]]
    trackers: tuple[str, ...]
    trials: int
    frames: int


CauseId: TypeAlias = Literal[
    "sample-impoverishment",
    "overconfident-weights",
    "look-alike-capture",
    "wrong-dynamics",
    "occlusion-longer-than-memory",
    "degenerate-resampling",
    "mirror-pose",
    "shrinking-covariance",
    "template-drift",
    "detector-seized-by-background",
    "target-not-in-the-picture",
    "uninformative-likelihood",
    "changed-look",
    "noisy-picture",
    "nothing-to-measure",
    "unclear",
]

CAUSES: dict[CauseId, str] = {cause: cause.replace("-", " ") for cause in get_args(CauseId)} | {
    "look-alike-capture": "look-alike capture",
    "template-drift": "drift of the model",
    "detector-seized-by-background": "seized by the background",
    "changed-look": "changed look of the target",
}
"""Their name in a sentence."""

# A failure is the recipe of a run, the frame before it happens, and its *cause*. A loss alone proves nothing, since a
# target can be lost for many reasons: the diagnosis (`pftrack.analysis.diagnosis`), which does not use the failures,
# must find that cause from the run's own numbers. Its *cure* is a change to the beginning of the same run, of the same
# seed, after which the target is held at the end.

Kind: TypeAlias = Literal["weights", "dynamics", "collapse", "appearance"]

KINDS: Mapping[Kind, str] = {
    "weights": "Particles and weights",
    "dynamics": "Motion and what is in the way",
    "collapse": "A belief that collapses",
    "appearance": "Looks and detectors",
}
"""Kinds of failures, with their titles, in display order."""

ORDER: tuple[CauseId, ...] = tuple(CAUSES)[:10]  # the others have no example run
"""Ids of the failures with fixed numbers, in any experiment; all others come after."""


@dataclass(frozen=True)
class Cure:
    """The cure of a failing run.

    Attributes:
        text: The change and why it helps, a sentence.
        values: Changes at frame 0: parameters by name, and `tracker` for another one.
    """

    text: str
    values: Mapping[str, Value]


@with_config(CLOSED)
@dataclass(frozen=True)
class Failure:
    """A named failure of an experiment's trackers on its simulated scene.

    Attributes:
        id: Name in commands and addresses; that of its cause where no other failure has it.
        title: The field's name for it.
        kind: Its kind.
        diagnosis: What goes wrong and why, a sentence or two; frames in it are those of its own seed.
        tracker: Name of the tracker.
        frame: The one before it happens: the target is held there, and lost in the next one.
        cause: First cause in the diagnosis of the run.
        cure: The cure.
        parameters: Values that differ from the defaults.
        seed: Seed of the run.
        frames: Length of the run; None for the experiment's own.
        timeline: Changes after frame 0; they happen to the cured run as well.
        origin: The file and line where it is declared.
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
    origin: Origin = field(default="", compare=False, repr=False)

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


def read_failures(path: Path) -> tuple[Failure, ...]:
    """Return the failures of a YAML file, which maps their ids to their fields.

    Raises:
        ValueError: The file is not YAML, or a failure lacks a field or has an unknown one; it names the file and line.
    """
    return read_as(Failure, path, "id")
