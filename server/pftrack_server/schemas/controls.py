"""How a parameter is turned by hand, worked out from its declaration once for all panels.

A number has a slider and a box to type into. Where a slider over the whole range would jump by many steps at a pixel,
the box has the whole range and the slider the part that one works in.
"""

import math
from collections.abc import Iterable, Mapping

from pydantic import BaseModel

from pftrack.core.model.parameters import Declaration, Value

FINE_STEPS = 1000
"""Positions up to which one slider is enough."""
SLIDER_STEPS = 100_000
"""Positions beyond which there is no slider: numbers like these are names, not amounts."""


class ControlPublic(BaseModel):
    """The control of a parameter, in addition to its declaration.

    Attributes:
        name: Of the parameter.
        label: Its title with its unit.
        hint: What it does, between which bounds, and whether a change restarts the run.
        step: Between two values of a number; None where there is none.
        slider: From where to where a slider goes; None where a number has only a box, and where it is no number.
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
    step, slider = _slider(declaration, value)
    label = f"{declaration.title} ({declaration.unit})" if declaration.unit else declaration.title
    return ControlPublic(name=declaration.name, label=label, hint=_hint(declaration), step=step, slider=slider)


def _slider(declaration: Declaration, value: Value) -> tuple[float | None, tuple[float, float] | None]:
    low, high = declaration.minimum, declaration.maximum
    if declaration.kind not in {"integer", "number"} or low is None or high is None or low == high:
        return declaration.step, None
    step = declaration.step or (1.0 if declaration.kind == "integer" else (high - low) / 100.0)
    steps = (high - low) / step
    if steps <= FINE_STEPS:
        return step, (low, high)
    return step, working_range(declaration, float(value)) if steps <= SLIDER_STEPS else None


def working_range(declaration: Declaration, value: float) -> tuple[float, float]:
    """Return the part of a wide range that a slider shows: up to about five times what is in force.

    Args:
        declaration: With both bounds.
        value: In force.
    """
    low, high = declaration.minimum or 0.0, declaration.maximum or 0.0
    reach = 5.0 * abs(value) or 200.0 * (declaration.step or 1.0)
    power = 10.0 ** math.floor(math.log10(reach))
    reach = next(factor * power for factor in (1.0, 2.0, 5.0, 10.0) if reach <= factor * power * (1.0 + 1e-9))
    return max(low, -reach), min(high, reach)


def _hint(declaration: Declaration) -> str:
    unit = f" {declaration.unit}" if declaration.unit else ""
    sentences = [declaration.description]
    if declaration.kind != "action" and declaration.minimum is not None and declaration.maximum is not None:
        sentences.append(f"From {declaration.minimum:g} to {declaration.maximum:g}{unit}.")
    if not declaration.live:
        sentences.append("A change restarts the run.")
    return " ".join(sentences)
