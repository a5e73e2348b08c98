"""How a parameter is turned by hand, worked out from its declaration once for all panels.

A number has a slider over its useful range and a box that takes whatever is allowed.
"""

from collections.abc import Iterable, Mapping

from pydantic import BaseModel

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
