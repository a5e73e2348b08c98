"""One control of the panel, made from the declaration of one parameter.

Whole numbers and numbers are sliders, which in viser carry a box to type into; a slider for a part of the range stands
below a box for the whole. viser passes on whatever a browser sends, so nothing is trusted: the session validates, and
the panel shows the answer.
"""

from collections.abc import Callable
from typing import Any

import viser

from pftrack.core.model.parameters import Declaration, Value

Handle = Any  # viser's handles are generic over their value and assign through `__setattr__`


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

        async def on_change(event: viser.GuiEvent[Any]) -> None:
            if event.client_id is not None:
                on_move(declaration.name, _from_handle(declaration, event.target.value))

        for handle in self._handles:
            handle.on_update(on_change)

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
    shown = _to_handle(declaration, value)
    match declaration.kind:
        case "integer" | "number":
            return _make_number(server.gui, declaration, shown)
        case "file":  # files come by the page, which checks who sends them
            return ()
        case _:
            return (_make_one(server.gui, declaration, shown),)


def _make_one(gui: viser.GuiApi, declaration: Declaration, shown: Handle) -> Handle:
    label, hint = declaration.label, declaration.hint
    match declaration.kind:
        case "boolean":
            return gui.add_checkbox(label, shown, hint=hint)
        case "choice":
            return gui.add_dropdown(label, declaration.choices, initial_value=shown, hint=hint)
        case _:
            return gui.add_rgb(label, shown, hint=hint)


def _make_number(gui: viser.GuiApi, declaration: Declaration, shown: Handle) -> tuple[Handle, ...]:
    number = int if declaration.kind == "integer" else float
    low, high = declaration.minimum, declaration.maximum
    if low is None or high is None or not low <= shown <= high or low == high:
        return (gui.add_number(declaration.label, shown, hint=declaration.hint),)
    step, label, hint = number(declaration.step or 1), declaration.label, declaration.hint
    bounds = number(low), number(high)
    slider = tuple(number(bound) for bound in slider_range(declaration, shown) or ())
    if slider == bounds:
        return (gui.add_slider(label, *bounds, step, shown, marks=(), hint=hint),)
    box = gui.add_number(label, shown, min=bounds[0], max=bounds[1], step=step, hint=hint)
    if not slider:
        return (box,)
    # Without a label: the style sheet gives such a slider the whole width and hides its box.
    return box, gui.add_slider("", slider[0], slider[1], step, shown, marks=(), hint=hint)


def slider_range(declaration: Declaration, value: float) -> tuple[float, float] | None:
    """Return from where to where the slider of a number goes: its useful range, widened to the value in force."""
    if declaration.useful is None:
        return None
    low, high = min(declaration.useful[0], value), max(declaration.useful[1], value)
    return (low, high) if low < high else None


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
