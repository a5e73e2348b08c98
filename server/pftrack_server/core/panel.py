"""The controls that the panel of a session offers, and the values that it shows."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from pftrack.core.model.drawing import Layer, World
from pftrack.core.model.parameters import Declaration, Value

SPEEDS = (0.1, 0.25, 0.5, 1.0, 2.0, 5.0, 10.0, 0.0)
"""Speeds that are offered, as factors of real time; 0 is as fast as possible."""


@dataclass(frozen=True, slots=True)
class PanelDescription:
    """The controls that a panel offers; they do not change while a session lives.

    Attributes:
        title: Its heading.
        declarations: What can be turned, in order.
        trackers: Titles by identifier, in order.
        layers: What can be switched on and off in the scene, in order.
        worlds: What stands beside the picture, in order.
        about: Names of the parameters to turn first, in order.
        frames: Of the run, where the panel itself has to lead through them; 0 where a page around it does.
    """

    title: str
    declarations: Sequence[Declaration]
    trackers: Mapping[str, str]
    layers: Sequence[Layer]
    worlds: Sequence[World] = ()
    about: Sequence[str] = ()
    frames: int = 0


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
