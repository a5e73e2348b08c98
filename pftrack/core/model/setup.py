"""Setups: a source wired for an experiment, be it a simulated scene or a recording."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

from pftrack.core.model.frame import Frame
from pftrack.core.model.marks import Mark
from pftrack.core.model.measures import HIT_RATE
from pftrack.core.model.parameters import Parameters
from pftrack.core.model.recipe import Footage
from pftrack.core.model.sequence import FrameSequence
from pftrack.core.model.source import Source
from pftrack.core.model.suitability import Suitability
from pftrack.core.model.truth import Truth

__all__ = ["OnVideo", "Setup", "Suits"]


@dataclass(frozen=True)
class Setup:
    """A source wired for one experiment, with the defaults that suit it.

    Attributes:
        open_source: (seed, parameters of frame 0) -> source.
        parameters: Defaults in force for this source; one flat model of scene and tracker.
        footage: What a recipe says of the recording, with the target where it was marked or found; None for a
            simulated scene.
        success: Name of the measure that decides on success, a share: its frames that miss are counted against the
            parameter with the role "loss_share".
        units: Parameters of frame 0 -> units that this source has for itself, by the name of a plot, and by "estimate"
            that of the estimate and its error; None where the experiment's own hold.
        beside: (frame, state, parameters) -> the value of `BESIDE`, where a target's likelihood is one of places.
    """

    open_source: Callable[[int, Any], Source[Any]]
    parameters: Parameters
    footage: Footage | None = None
    success: str = HIT_RATE.name
    units: Callable[[Any], Mapping[str, str]] | None = None
    beside: Callable[[Frame, Any, Any], float] | None = None


class OnVideo(Protocol):
    """Wire a recording for an experiment."""

    def __call__(
        self, sequence: FrameSequence, mark: Mark | None, *, start: int = 0, truth: Truth | None = None
    ) -> Setup:
        """Return the setup of a recording.

        Args:
            sequence: The pictures.
            mark: The target in the picture `start`, of a kind that the experiment takes; None to have it found, where
                that can be done, or where nothing is to be marked.
            start: Number of the picture to start at, or to look for the target from.
            truth: By number of the picture, where it is known.

        Raises:
            ParameterError: The mark or the start is not within the recording.
            ValueError: There is no target in it.
        """


class Suits(Protocol):
    """Look whether a target in a recording can be followed, before it is tracked."""

    def __call__(self, sequence: FrameSequence, footage: Footage, parameters: Any) -> Suitability:  # noqa: ANN401 - the experiment's own model
        """Return how suitable it is.

        Args:
            sequence: The pictures.
            footage: What a setup says of the recording: where it starts, and the target's mark there.
            parameters: Of frame 0.
        """
