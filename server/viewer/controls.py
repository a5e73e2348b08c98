"""One control of the panel, made from the declaration of one parameter.

Whole numbers and numbers are sliders, which in viser carry a box to type into; only where a slider would jump by
far more than a step at each pixel is there the box alone. viser passes on whatever a browser sends, so nothing here is
trusted: the session validates, and the panel shows what the session says.
"""

from collections.abc import Callable
from typing import Any

import viser

from pftrack.parameters import Declaration, Value

__all__ = ["Control", "Handle", "label_of"]

SLIDER_STEPS = 100_000
"""Positions up to which a slider is offered."""

Handle = Any  # viser's handles are generic over their value and assign through `__setattr__`


def label_of(declaration: Declaration) -> str:
    """Return a parameter's title with its unit."""
    return f"{declaration.title} ({declaration.unit})" if declaration.unit else declaration.title


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
        self._handle: Handle = _make(server, declaration, value)
        self._shown = True

        def moved(event: viser.GuiEvent[Any]) -> None:
            if event.client_id is not None:
                on_move(declaration.name, self.value)

        self._handle.on_update(moved)

    @property
    def value(self) -> Value:
        """What the control shows."""
        shown = self._handle.value
        if self.declaration.kind == "colour":
            return "#{:02x}{:02x}{:02x}".format(*shown)
        return shown  # type: ignore[no-any-return]

    def show(self, value: Value, *, insist: bool = False) -> None:
        """Show a value.

        Args:
            value: What the session says.
            insist: Send it even if the server believes that it is shown already. A browser may have lost it: all of
                viser's controls share one throttle, which can drop the middle one of three quick changes.
        """
        wanted = _to_handle(self.declaration, value)
        if insist and self._handle.value == wanted:
            self._handle.value = _other(wanted)
        self._handle.value = wanted

    def set_visible(self, *, visible: bool) -> None:
        """Show or hide the control."""
        if visible != self._shown:
            self._handle.visible = self._shown = visible


def _make(server: viser.ViserServer, declaration: Declaration, value: Value) -> Handle:
    label, hint = label_of(declaration), _hint(declaration)
    shown = _to_handle(declaration, value)
    match declaration.kind:
        case "boolean":
            return server.gui.add_checkbox(label, shown, hint=hint)
        case "choice":
            return server.gui.add_dropdown(label, declaration.choices, initial_value=shown, hint=hint)
        case "colour":
            return server.gui.add_rgb(label, shown, hint=hint)
        case _:
            return _make_number(server, declaration, shown)


def _make_number(server: viser.ViserServer, declaration: Declaration, shown: Handle) -> Handle:
    number = int if declaration.kind == "integer" else float
    label, hint = label_of(declaration), _hint(declaration)
    low, high = declaration.minimum, declaration.maximum
    step = number(declaration.step) if declaration.step else None
    if low is None or high is None or not low <= shown <= high:
        return server.gui.add_number(label, shown, step=step, hint=hint)
    step = step or (1 if number is int else (high - low) / 100.0)
    if high <= low or (high - low) / step > SLIDER_STEPS:
        return server.gui.add_number(label, shown, min=number(low), max=number(high), step=step, hint=hint)
    return server.gui.add_slider(label, number(low), number(high), step, shown, marks=(), hint=hint)


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
