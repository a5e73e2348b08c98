"""The panel next to the scene: all controls, generated from the declarations.

A control only proposes a value. The session accepts or refuses it, and the panel shows the session's answer: `show`
after a change, `refuse` after a refusal. While a person drags a slider, answers to older positions are held back, since
they would move it under the pointer; once it rests, all controls are set to the session's values. viser passes on any
value that a browser sends, so the session validates them all.

viser calls a coroutine at once, in the loop that has just received the browser's value, and a plain function some time
later in a thread, when the session's value may have overwritten it. So all callbacks here are coroutines, and none of
them waits: the answer comes later.
"""

import asyncio
from collections.abc import Callable, Iterable, Mapping
from html import escape
from typing import Any

import viser

from pftrack.core.model.drawing import COLOURS, Key, Layer, sort_keys
from pftrack.core.model.parameters import Declaration, Value
from pftrack.core.numerics.random import LARGEST_SEED
from pftrack_server.core.panel import SPEEDS, PanelDescription, PanelValues
from pftrack_server.viewer.camera import PRESETS
from pftrack_server.viewer.scene import is_on
from pftrack_server.viewer.worlds import preset

Handle = Any  # viser's handles are generic over their value and assign through `__setattr__`

REST_S = 0.5
"""How long a control must rest before it is set to the session's value, s."""
PATIENCE_S = 5.0
"""How long the session may take to answer before the control springs back, s."""

FRAME, SEED, SPEED = "frame of the run", "seed of the run", "speed of the run"
"""Names of these controls; they differ from parameters, whose names have no spaces."""
TRACKER = "tracker"
"""Name of the tracker's choice among the session's values."""


def _declare(name: str, title: str, kind: str, description: str, **more: object) -> Declaration:
    """Return the declaration of a control that is not a parameter."""
    known = {"name": name, "title": title, "kind": kind, "description": description, "unit": "", "group": name}
    return Declaration.model_validate(known | more)


class Panel:
    """The controls of one session, shared by all its browsers.

    Args:
        server: The session's viser server.
        description: The controls to offer.
        in_force: The first values to show.
        on_command: Takes a command, not yet validated, such as `{"kind": "speed", "speed": 2.0}`.
        on_layer: Takes a layer and whether to show it.
        on_look: Takes a browser and its chosen camera preset.
        frames: Length of the run, for a slider of frames; 0 if the outer page has one.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        description: PanelDescription,
        in_force: PanelValues,
        on_command: Callable[[dict[str, Any]], None],
        on_layer: Callable[[str, bool], None],
        on_look: Callable[[int, str], None],
        *,
        frames: int,
    ) -> None:
        self._server = server
        self._on_command, self._on_layer, self._on_look = on_command, on_layer, on_look
        self._touched: set[str] = set()
        self._rested_s = 0.0
        self._timer: asyncio.TimerHandle | None = None
        self._titles = {each.id: each.title for each in description.trackers}
        self._options: dict[str, dict[str, Value]] = {
            TRACKER: {title: identifier for identifier, title in self._titles.items()},
            SPEED: {_speed_title(speed): speed for speed in SPEEDS},
        }
        self._values: dict[str, Value] = {SPEED: _speed_title(1.0), **self._values_of(in_force)}
        self._tracker = in_force.tracker
        self._controls: dict[str, Control] = {}
        self._folders: dict[str, viser.GuiFolderHandle] = {}
        self._frame = self._add_frames(frames) if frames > 1 else None
        hint = "The method that follows the target; a change takes effect from the next frame."
        self._add_control(self._declare_choice(TRACKER, "Tracker", hint))
        hint = "The same seed gives the same scene and the same run, to the bit."
        bounds = {"minimum": 0, "maximum": LARGEST_SEED, "step": 1, "live": False}
        self._add_control(_declare(SEED, "Seed", "integer", hint, default=0, **bounds))
        has_time = any(layer.role == "flat only" for layer in description.layers)  # which is the past, drawn flat
        views = {view.title: name for name, view in PRESETS.items() if has_time or name != "time"}
        self._add_views("View", views)
        for world in description.worlds:
            self._add_views(world.title, {side.title: preset(world, side) for side in world.viewpoints})
        self._said, self._branch_point = "", in_force.branch_point
        self._caption = server.gui.add_html(caption_html("", self._branch_point))
        self._add_controls(description)
        with server.gui.add_folder("What to draw", expand_by_default=False):
            for layer in description.layers:
                self._add_layer(layer)
        self._legend = server.gui.add_html(legend_html(()))
        self._add_control(self._declare_choice(SPEED, "Speed", "As a factor of real time."))
        self._choose_visible()

    def show(self, in_force: PanelValues) -> None:
        """Show the current values, except on a control that a person is moving."""
        with self._server.atomic():
            self._values |= self._values_of(in_force)
            for name in self._controls.keys() - self._touched:
                self._controls[name].show(self._values[name])
            if in_force.tracker != self._tracker:
                self._tracker = in_force.tracker
                self._choose_visible()
            if in_force.branch_point != self._branch_point:
                self._branch_point = in_force.branch_point
                self.caption(self._said)
        if self._touched:
            self._restore_in(self._rested_s - asyncio.get_running_loop().time())

    def refuse(self, message: str) -> None:
        """Show why a value was refused, and set every control back to the current values."""
        self._restore()
        for client in self._server.get_clients().values():
            client.add_notification("Not accepted", message, color="orange", auto_close_seconds=6.0)

    def frame(self, frame: int) -> None:
        """Set the frame slider to the shown frame, unless a person is moving it."""
        if self._frame is not None and FRAME not in self._touched:
            self._frame.value = frame

    def caption(self, caption: str) -> None:
        """Show the line of text about the frame."""
        self._said = caption
        self._caption.content = caption_html(caption, self._branch_point)

    def legend(self, keys: Iterable[Key]) -> None:
        """Show the legend of the drawing's colours."""
        html = legend_html(keys)
        if self._legend.content != html:
            self._legend.content = html

    def close(self) -> None:
        """Stop setting controls."""
        if self._timer is not None:
            self._timer.cancel()

    def _values_of(self, in_force: PanelValues) -> dict[str, Value]:
        """Return the controls' values by name."""
        title = self._titles.get(in_force.tracker, in_force.tracker)
        speed = {SPEED: _speed_title(in_force.speed)} if in_force.speed in SPEEDS else {}
        return {**in_force.values, TRACKER: title, SEED: in_force.seed, **speed}

    def _restore_in(self, wait_s: float) -> None:
        self.close()
        self._timer = asyncio.get_running_loop().call_later(wait_s, self._restore)

    def _restore(self) -> None:
        self._touched.clear()
        with self._server.atomic():
            for name, control in self._controls.items():
                control.show(self._values[name], insist=True)

    def _propose(self, name: str, value: Value) -> None:
        """Propose the value of a control that a person has moved."""
        options = self._options.get(name)
        wanted = value if options is None else options.get(str(value))
        if wanted is None:
            return
        self._touch(name)
        if name == SEED:
            self._on_command({"kind": "restart", "seed": wanted})
        elif name == SPEED:
            self._on_command({"kind": "speed", "speed": wanted})
        else:
            self._on_command({"kind": "change", "values": {name: wanted}})

    def _touch(self, name: str) -> None:
        self._touched.add(name)
        self._rested_s = asyncio.get_running_loop().time() + REST_S
        self._restore_in(PATIENCE_S)

    def _declare_choice(self, name: str, title: str, description: str) -> Declaration:
        options = tuple(self._options[name])
        return _declare(name, title, "choice", description, default=options[0], choices=options)

    def _add_frames(self, frames: int) -> Handle:
        slider = self._server.gui.add_slider("Frame", 0, frames - 1, 1, 0)
        play = self._server.gui.add_button("Play or pause")

        @slider.on_update
        async def _(event: viser.GuiEvent[viser.GuiSliderHandle[int]]) -> None:
            if event.client_id is not None:
                self._touch(FRAME)
                self._on_command({"kind": "seek", "frame": int(slider.value)})

        @play.on_click
        async def _(_event: viser.GuiEvent[viser.GuiButtonHandle]) -> None:
            self._on_command({"kind": "toggle"})

        return slider

    def _add_views(self, title: str, names: Mapping[str, str]) -> None:
        """Add buttons with titles for presets by name."""
        group = self._server.gui.add_button_group(title, tuple(names))

        @group.on_click
        async def _(event: viser.GuiEvent[viser.GuiButtonGroupHandle]) -> None:
            if event.client_id is not None and event.target.value in names:
                self._on_look(event.client_id, names[event.target.value])

    def _add_controls(self, description: PanelDescription) -> None:
        """Add a control for each declaration with a value: the first ones visible, the others folded by group."""
        known = {each.name: each for each in description.declarations if each.name in self._values}
        first = [known.pop(name) for name in description.about if name in known]
        for declaration in first:
            self._add_control(declaration)
        if not first:
            self._add_groups(known.values(), unfolded=True)
        elif known:
            with self._server.gui.add_folder("More parameters", expand_by_default=False):
                self._add_groups(known.values(), unfolded=False)

    def _add_groups(self, declarations: Iterable[Declaration], *, unfolded: bool) -> None:
        for declaration in declarations:
            title = declaration.group or "Parameters"
            if title not in self._folders:
                self._folders[title] = self._server.gui.add_folder(title, expand_by_default=unfolded)
            with self._folders[title]:
                self._add_control(declaration)

    def _add_control(self, declaration: Declaration) -> None:
        value = self._values[declaration.name]
        self._controls[declaration.name] = Control(self._server, declaration, value, self._propose)

    def _add_layer(self, layer: Layer) -> None:
        box: Handle = self._server.gui.add_checkbox(layer.title, is_on(layer))

        async def on_switch(event: viser.GuiEvent[viser.GuiCheckboxHandle]) -> None:
            self._on_layer(layer.name, event.target.value)

        box.on_update(on_switch)

    def _choose_visible(self) -> None:
        used: set[str] = set()
        for control in self._controls.values():
            readers = control.declaration.trackers
            visible = not readers or self._tracker in readers
            control.set_visible(visible=visible)
            if visible:
                used.add(control.declaration.group or "Parameters")
        for title, folder in self._folders.items():
            folder.visible = title in used


def _speed_title(speed: float) -> str:
    return f"{speed:g}x" if speed else "As fast as possible"


class Control:
    """A control and the value that it shows.

    Args:
        server: Where it is shown.
        declaration: Declaration of its parameter.
        value: The first value to show.
        on_move: Called with the new value when a person has changed it, never when code assigns it.
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
            value: The session's value.
            insist: Send it even if it seems to be shown already. A browser may have lost it: all of viser's controls
                share one throttle, which can drop the middle one of three quick changes.
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
    gui, label, hint = server.gui, declaration.label, declaration.hint
    match declaration.kind:
        case "integer" | "number":
            return _make_number(gui, declaration, shown)
        case "file":  # files are uploaded through the page, which checks the sender
            return ()
        case "boolean":
            return (gui.add_checkbox(label, shown, hint=hint),)
        case "choice":
            return (gui.add_dropdown(label, declaration.choices, initial_value=shown, hint=hint),)
        case _:
            return (gui.add_rgb(label, shown, hint=hint),)


def _make_number(gui: viser.GuiApi, declaration: Declaration, shown: Handle) -> tuple[Handle, ...]:
    """Return a slider, which in viser includes a box to type into; two handles if the box has a wider range."""
    number = int if declaration.kind == "integer" else float
    low, high = declaration.minimum, declaration.maximum
    if low is None or high is None or not low <= shown <= high or low == high:
        return (gui.add_number(declaration.label, shown, hint=declaration.hint),)
    step, label, hint = number(declaration.step or 1), declaration.label, declaration.hint
    bounds = number(low), number(high)
    slider = tuple(number(bound) for bound in slider_range(declaration, shown) or ())
    if slider == bounds:
        return (gui.add_slider(label, *bounds, step, shown, marks=(), hint=hint),)
    if not slider:
        return (gui.add_number(label, shown, min=bounds[0], max=bounds[1], step=step, hint=hint),)
    # The box has no label: the style sheet puts it in place of the slider's own box.
    part = gui.add_slider(label, slider[0], slider[1], step, shown, marks=(), hint=hint)
    return part, gui.add_number("", shown, min=bounds[0], max=bounds[1], step=step)


def slider_range(declaration: Declaration, value: float) -> tuple[float, float] | None:
    """Return the range of a number's slider: its useful range, widened to the current value."""
    if declaration.useful is None:
        return None
    low, high = min(declaration.useful[0], value), max(declaration.useful[1], value)
    return (low, high) if low < high else None


def _to_handle(declaration: Declaration, value: Value) -> Handle:
    if declaration.kind == "colour":
        digits = str(value).removeprefix("#")
        return tuple(int(digits[i : i + 2], 16) for i in (0, 2, 4))
    return float(value) if declaration.kind == "number" else value


def _from_handle(declaration: Declaration, shown: Handle) -> Value:
    if declaration.kind == "colour":
        return "#{:02x}{:02x}{:02x}".format(*shown)
    return shown  # type: ignore[no-any-return]  # viser casts it to the type that the control has


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


def legend_html(keys: Iterable[Key]) -> str:
    """Return the legend as one paragraph of coloured dots, each meaning once, in the palette's order."""
    entries = "".join(
        f'<span class="pf-key"><i style="background:rgb{COLOURS[key.colour]}"></i>{escape(key.meaning)}</span>'
        for key in sort_keys(keys)
    )
    return f'<div class="pf-legend" role="note" aria-label="Legend">{entries}</div>'


def caption_html(caption: str, branch_point: int | None = None) -> str:
    """Return the caption of the shown frame, and the frame from which a change would make a branch, if it would."""
    what = "" if branch_point is None else f"<br>A change makes a branch from frame {branch_point}."
    return f'<div class="pf-caption">{escape(caption) or "&nbsp;"}{what}</div>'
