"""Presets and example sweeps: where to begin with an experiment, so that there is something to be seen at once."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from pftrack.core.model.parameters import Value
from pftrack.core.model.tour import Tour

__all__ = ["ExampleSweep", "Preset"]


@dataclass(frozen=True)
class Preset:
    """A named starting point that shows something.

    Attributes:
        name: Name in addresses.
        title: What it shows, a few words.
        tracker: Name of the tracker.
        parameters: Values that differ from the defaults.
        seed: Of the run.
        about: Names of further parameters that it is about, worth turning while it is watched.
        scene: Names of those that it sets and is not about: what a scene is made of, and what is known beforehand.
        watch: What to look at when it is opened, a sentence or two; frames in it are those of its own seed.
        tour: What a guided tour says of it, where it is known to lose its target.
    """

    name: str
    title: str
    tracker: str
    parameters: Mapping[str, Value] = field(default_factory=dict)
    seed: int = 0
    about: tuple[str, ...] = ()
    watch: str = ""
    scene: tuple[str, ...] = ()
    tour: Tour | None = None

    @property
    def subjects(self) -> tuple[str, ...]:
        """Names of all parameters that it is about: those that it sets beyond the scene's, then the further ones."""
        set_here = (name for name in self.parameters if name not in self.scene)
        return tuple(dict.fromkeys((*set_here, *self.about)))


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
