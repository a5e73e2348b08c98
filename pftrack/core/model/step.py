"""A step: one frame of a run as everything that shows it is given it, and what draws it."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from pftrack.core.model.diagnostics import Diagnostics
from pftrack.core.model.drawing import Drawing
from pftrack.core.model.frame import Frame

__all__ = ["Draw", "Step"]


@dataclass(frozen=True, slots=True)
class Step:
    """One frame of a run: what was seen, what is believed, and the numbers of both.

    Attributes:
        frame: What the source showed.
        state: The tracker's posterior, of the kind that the experiment's trackers have.
        diagnostics: The numbers.
        parameters: In force in this frame.
        tracker: Name of the tracker that took the step.
        tracker_title: Its title, as the experiment of the run has it.
    """

    frame: Frame
    state: Any
    diagnostics: Diagnostics
    parameters: Any
    tracker: str
    tracker_title: str


class Draw(Protocol):
    """Draw a frame."""

    def __call__(self, step: Step, past: Sequence[Diagnostics], other: Diagnostics | None = None) -> Drawing:
        """Return what is to be seen.

        Args:
            step: The frame.
            past: The run's diagnostics up to this frame, or further.
            other: The diagnostics of the same frame in a second run, if there is one to compare with.
        """
