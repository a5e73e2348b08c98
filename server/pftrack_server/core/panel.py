"""The controls that the panel of a session offers, and the values that it shows."""

from collections.abc import Mapping
from dataclasses import dataclass

from pydantic import BaseModel, Field

from pftrack.core.model.drawing import Layer, World
from pftrack.core.model.parameters import Declaration, Value

SPEEDS = (0.1, 0.25, 0.5, 1.0, 2.0, 5.0, 10.0, 0.0)
"""Speeds that are offered, as factors of real time; 0 is as fast as possible."""


class TrackerPublic(BaseModel):
    """A tracker that can be chosen."""

    id: str
    title: str
    replays: bool = Field(False, description="It says again what was recorded; no seed or setting changes that")


class PanelDescription(BaseModel):
    """The controls that a panel offers, each list in order; they do not change while a session lives."""

    title: str
    declarations: list[Declaration] = []
    trackers: list[TrackerPublic]
    layers: list[Layer] = []
    worlds: list[World] = []
    about: list[str] = Field([], description="Parameters to turn first: those that its preset is about")

    def tracker_title(self, tracker: str) -> str:
        """Return what people call a tracker."""
        return next((known.title for known in self.trackers if known.id == tracker), tracker)


@dataclass(frozen=True, slots=True)
class PanelValues:
    """The values in force in the session, which the controls of the panel show.

    Attributes:
        values: Of the parameters; a declaration without a value gets no control.
        tracker: Identifier of the tracker.
        seed: Of the run.
        speed: As a factor of real time; 0 is as fast as possible.
        branch_point: Frame at which a change leaves the branch; None where it counts from the next frame on.
    """

    values: Mapping[str, Value]
    tracker: str
    seed: int
    speed: float = 1.0
    branch_point: int | None = None
