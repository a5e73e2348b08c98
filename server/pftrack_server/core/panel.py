"""How a parameter is turned by hand, worked out from its declaration once for all panels.

A number has a slider over its useful range and a box that takes whatever is allowed.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from pydantic import BaseModel

from pftrack.core.model.drawing import Layer, World
from pftrack.core.model.parameters import Declaration, Value


class ControlPublic(BaseModel):
    """The control of a parameter, in addition to its declaration.

    Attributes:
        name: Of the parameter.
        label: Its title with its unit.
        hint: What it does, between which bounds, and whether a change restarts the run.
        step: Between two values of a number; None where there is none.
        slider: From where to where a slider goes; None without a range, and where it is not a number.
    """

    name: str
    label: str
    hint: str
    step: float | None = None
    slider: tuple[float, float] | None = None


def controls_of(declarations: Iterable[Declaration], values: Mapping[str, Value]) -> list[ControlPublic]:
    """Return a control for each declaration that has a value, in order."""
    return [control_of(each, values[each.name]) for each in declarations if each.name in values]


def control_of(declaration: Declaration, value: Value) -> ControlPublic:
    """Return how a parameter is turned.

    Args:
        declaration: Of the parameter.
        value: In force.
    """
    label = f"{declaration.title} ({declaration.unit})" if declaration.unit else declaration.title
    return ControlPublic(
        name=declaration.name,
        label=label,
        hint=_hint(declaration),
        step=declaration.step,
        slider=_slider(declaration, value),
    )


def _slider(declaration: Declaration, value: Value) -> tuple[float, float] | None:
    """Return the useful range, widened to the value in force."""
    if declaration.kind not in {"integer", "number"} or declaration.useful is None:
        return None
    low, high = min(declaration.useful[0], float(value)), max(declaration.useful[1], float(value))
    return (low, high) if low < high else None


def _hint(declaration: Declaration) -> str:
    unit = f" {declaration.unit}" if declaration.unit else ""
    sentences = [declaration.description]
    if declaration.minimum is not None and declaration.maximum is not None:
        sentences.append(f"From {declaration.minimum:g} to {declaration.maximum:g}{unit}.")
    if not declaration.live:
        sentences.append("A change restarts the run.")
    return " ".join(sentences)


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
