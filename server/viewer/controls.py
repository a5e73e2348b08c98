"""One control of the panel, made from the declaration of one parameter.

Whole numbers and numbers are sliders, which in viser carry a box to type into. Where a slider over the whole range
would jump by many steps at a pixel, the box has the whole range, and a slider below it the part that one works in.
viser passes on whatever a browser sends, so nothing is trusted: the session validates, and the panel shows the answer.
"""

import math
from collections.abc import Callable
from typing import Any

import viser

from pftrack.parameters import Declaration, Value

__all__ = ["Control", "Handle", "label_of", "working_range"]

FINE_STEPS = 1000
"""Positions up to which one slider is enough."""
SLIDER_STEPS = 100_000
"""Positions beyond which there is no slider: numbers like these are names, not amounts."""

Handle = Any  # viser's handles are generic over their value and assign through `__setattr__`


def label_of(declaration: Declaration) -> str:
    """Return a parameter's title with its unit."""
    return f"{declaration.title} ({declaration.unit})" if declaration.unit else declaration.title


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


class Control:
    """A control and the value that it shows.

    Args:
        server: Where it is shown.
        declaration: What it turns.
        value: What it shows at first.
        on_move: Called with the new value when a person has changed it, never when it was assigned.
    """

    def __init__(
        self, server: viser.ViserServer, declaration: Declaration, value: Value, on_move: Callable[[str, Value], None]
    ) -> None:
        self.declaration = declaration
        self._handles: tuple[Handle, ...] = _make(server, declaration, value)
        self._shown = True

        async def moved(event: viser.GuiEvent[Any]) -> None:
            if event.client_id is not None:
                on_move(declaration.name, _from_handle(declaration, event.target.value))

        for handle in self._handles:
            handle.on_update(moved)

    def show(self, value: Value, *, insist: bool = False) -> None:
        """Show a value.

        Args:
            value: What the session says.
            insist: Send it even if the server believes that it is shown already. A browser may have lost it: all of
                viser's controls share one throttle, which can drop the middle one of three quick changes.
        """
        for handle in self._handles:
            wanted = _to_handle(self.declaration, value)
            if isinstance(handle, viser.GuiSliderHandle):
                wanted = min(max(wanted, handle.min), handle.max)
            if insist and handle.value == wanted:
                handle.value = _other(wanted)
            handle.value = wanted

    def set_visible(self, *, visible: bool) -> None:
        """Show or hide the control."""
        if visible != self._shown:
            self._shown = visible
            for handle in self._handles:
                handle.visible = visible


def _make(server: viser.ViserServer, declaration: Declaration, value: Value) -> tuple[Handle, ...]:
    label, hint = label_of(declaration), _hint(declaration)
    shown = _to_handle(declaration, value)
    match declaration.kind:
        case "boolean":
            return (server.gui.add_checkbox(label, shown, hint=hint),)
        case "choice":
            return (server.gui.add_dropdown(label, declaration.choices, initial_value=shown, hint=hint),)
        case "colour":
            return (server.gui.add_rgb(label, shown, hint=hint),)
        case _:
            return _make_number(server.gui, declaration, shown)


def _make_number(gui: viser.GuiApi, declaration: Declaration, shown: Handle) -> tuple[Handle, ...]:
    number = int if declaration.kind == "integer" else float
    label, hint = label_of(declaration), _hint(declaration)
    low, high = declaration.minimum, declaration.maximum
    if low is None or high is None or not low <= shown <= high or low == high:
        return (gui.add_number(label, shown, hint=hint),)
    step = number(declaration.step or (1 if number is int else (high - low) / 100.0))
    steps = (high - low) / step
    if steps <= FINE_STEPS:
        return (gui.add_slider(label, number(low), number(high), step, shown, marks=(), hint=hint),)
    box = gui.add_number(label, shown, min=number(low), max=number(high), step=step, hint=hint)
    if steps > SLIDER_STEPS:
        return (box,)
    # Without a label: the style sheet gives such a slider the whole width and hides its box.
    start, end = (number(bound) for bound in working_range(declaration, float(shown)))
    return box, gui.add_slider("", start, end, step, shown, marks=(), hint=hint)


def _hint(declaration: Declaration) -> str:
    unit = f" {declaration.unit}" if declaration.unit else ""
    sentences = [declaration.description]
    if declaration.minimum is not None and declaration.maximum is not None:
        sentences.append(f"From {declaration.minimum:g} to {declaration.maximum:g}{unit}.")
    if not declaration.live:
        sentences.append("A change restarts the run.")
    return " ".join(sentences)


def _to_handle(declaration: Declaration, value: Value) -> Handle:
    match declaration.kind:
        case "boolean":
            return bool(value)
        case "integer":
            return int(value)
        case "number":
            return float(value)
        case "colour":
            digits = str(value).removeprefix("#")
            return tuple(int(digits[i : i + 2], 16) for i in (0, 2, 4))
        case _:
            return str(value)


def _from_handle(declaration: Declaration, shown: Handle) -> Value:
    if declaration.kind == "colour":
        return "#{:02x}{:02x}{:02x}".format(*shown)
    return shown  # type: ignore[no-any-return]


def _other(value: Handle) -> Handle:
    match value:
        case bool():
            return not value
        case int() | float():
            return value + 1
        case tuple():
            return (value[0] ^ 1, *value[1:])
        case _:
            return f"{value}\u200b"
