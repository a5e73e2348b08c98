"""The controls of a session's panel, and the values that they show."""

from collections.abc import Mapping
from dataclasses import dataclass

from pydantic import BaseModel, Field

from pftrack.core.model.drawing import Layer, World
from pftrack.core.model.parameters import Declaration, Value

SPEEDS = (0.1, 0.25, 0.5, 1.0, 2.0, 5.0, 10.0, 0.0)
"""Speeds to choose from, as factors of real time; 0 is as fast as possible."""


class TrackerPublic(BaseModel):
    """A tracker to choose."""

    id: str
    title: str
    replays: bool = Field(False, description="It replays a recorded result; no seed or setting changes that")


class PanelDescription(BaseModel):
    """The controls of a panel, each list in order; they stay the same while a session exists."""

    title: str
    declarations: list[Declaration] = []
    trackers: list[TrackerPublic]
    layers: list[Layer] = []
    worlds: list[World] = []
    about: list[str] = Field([], description="Parameters that the preset is about, to change first")

    def tracker_title(self, tracker: str) -> str:
        """Return the title of a tracker."""
        return next((known.title for known in self.trackers if known.id == tracker), tracker)


@dataclass(frozen=True, slots=True)
class PanelValues:
    """The session's current values, which the controls of the panel show.

    Attributes:
        values: Values of the parameters; a parameter without a value gets no control.
        tracker: Identifier of the tracker.
        seed: Random seed of the run.
        speed: Factor of real time; 0 is as fast as possible.
        branch_point: Frame at which a change starts a new branch; None if it takes effect from the next frame.
    """

    values: Mapping[str, Value]
    tracker: str
    seed: int
    speed: float = 1.0
    branch_point: int | None = None
