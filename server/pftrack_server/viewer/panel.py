"""The panel beside the scene: everything that can be turned, generated from the declarations.

A control never decides. It proposes a value, the session accepts or refuses it, and the panel shows what the session
says: `show` after a change, `refuse` after a refusal. While somebody still drags a slider the session's answers to
older positions are held back, since they would tear it out of the hand; once it rests, all controls are set to the
truth again.

viser calls a coroutine at once, in the loop that has just taken up the browser's value, and a plain function some time
later in a thread, when the value may have been overwritten by the session's. So all callbacks here are coroutines; none
of them waits: whoever is asked answers later.
"""

import threading
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import viser

from pftrack.core.model.drawing import Key, Layer, World
from pftrack.core.model.parameters import Declaration, Value
from pftrack_server.core.panel import SPEEDS, PanelDescription, PanelValues
from pftrack_server.viewer.camera import PRESETS
from pftrack_server.viewer.controls import Control, Handle
from pftrack_server.viewer.legend import caption_html, legend_html
from pftrack_server.viewer.seed import SEED, SeedBox
from pftrack_server.viewer.worlds import preset

REST_S = 0.5
"""How long a control must lie still before it is set to what the session says."""
PATIENCE_S = 5.0
"""How long the session may take to answer before the control springs back."""
FRAME = "frame"
"""What the panel calls its slider of frames among what is touched."""
TRACKER = "tracker"
"""What the session calls the choice of a tracker among the values of parameters."""


@dataclass(frozen=True, slots=True)
class Requests:
    """What the panel asks for. They are called in viser's loop, so none may wait for what it starts.

    Attributes:
        command: Takes a command, not yet validated, such as `{"kind": "speed", "speed": 2.0}`.
        set_layer: Takes a layer and whether it is to be shown.
        look: Takes a browser and the camera preset that it wants.
        wake: Says that `Panel.tend` has to be called earlier than it last said.
    """

    command: Callable[[dict[str, Any]], None]
    set_layer: Callable[[str, bool], None]
    look: Callable[[int, str], None]
    wake: Callable[[], None]


class Panel:
    """The controls of one session, shared by all its browsers.

    Args:
        server: The session's viser server.
        description: What it offers.
        in_force: What it shows at first.
        requests: Whom it asks.
    """

    def __init__(
        self, server: viser.ViserServer, description: PanelDescription, in_force: PanelValues, requests: Requests
    ) -> None:
        self._server = server
        self._requests = requests
        self._lock = threading.RLock()
        self._values: dict[str, Value] = dict(in_force.values)
        self._touched: dict[str, float] = {}
        self._answered = False
        self._titles = dict(description.trackers)
        self._tracker = in_force.tracker
        self._frame = self._add_frames(description.frames) if description.frames > 1 else None
        self._choice = self._add_tracker()
        self._seed = SeedBox(server, in_force.seed, self._reseed)
        self._add_cameras(description.worlds)
        self._said, self._branch_point = "", in_force.branch_point
        self._caption = server.gui.add_html(caption_html("", self._branch_point))
        self._controls: dict[str, Control] = {}
        self._layers: dict[str, Handle] = {}
        self._folders: dict[str, viser.GuiFolderHandle] = {}
        self._add_controls(description)
        with server.gui.add_folder("What to draw", expand_by_default=False):
            for layer in description.layers:
                self._add_layer(layer)
        self._legend = server.gui.add_html(legend_html(()))
        self._speed = self._add_speed(in_force.speed)
        self._choose_visible()

    def show(self, in_force: PanelValues) -> None:
        """Show what is in force, except on a control that is in somebody's hand."""
        with self._lock, self._server.atomic():
            self._values.update(in_force.values)
            self._answered = True
            for name in in_force.values.keys() & self._controls.keys():
                if name not in self._touched:
                    self._controls[name].show(self._values[name])
            if in_force.tracker != self._tracker:
                self._tracker = in_force.tracker
                self._choose_visible()
            if TRACKER not in self._touched:
                self._choice.value = self._titles.get(self._tracker, self._tracker)
            self._seed.seed = in_force.seed
            if SEED not in self._touched:
                self._seed.show()
            if in_force.speed in SPEEDS:
                self._speed.value = _speed_title(in_force.speed)
            if in_force.branch_point != self._branch_point:
                self._branch_point = in_force.branch_point
                self.caption(self._said)
        self._requests.wake()

    def refuse(self, message: str) -> None:
        """Say why a value was refused, and put every control back to what is in force."""
        with self._lock:
            self._restore()
        for client in self._server.get_clients().values():
            client.add_notification("Not accepted", message, color="orange", auto_close_seconds=6.0)

    def frame(self, frame: int) -> None:
        """Show which frame is shown, unless somebody is on the way to another."""
        with self._lock:
            if self._frame is not None and FRAME not in self._touched:
                self._frame.value = frame

    def caption(self, caption: str) -> None:
        """Show the line of text about the frame."""
        self._said = caption
        self._caption.content = caption_html(caption, self._branch_point)

    def legend(self, keys: Iterable[Key]) -> None:
        """Show what the colours of the drawing mean."""
        html = legend_html(keys)
        if self._legend.content != html:
            self._legend.content = html

    def tend(self) -> float | None:
        """Put controls that have come to rest back to what is in force.

        Returns:
            After how many seconds to call again; None if there is nothing to wait for.
        """
        with self._lock:
            if not self._touched:
                return None
            since = time.monotonic() - max(self._touched.values())
            due = (REST_S if self._answered else PATIENCE_S) - since
            if due > 0.0:
                return due
            self._restore()
            return None

    def _restore(self) -> None:
        with self._server.atomic():
            self._touched.clear()
            for name, control in self._controls.items():
                if name in self._values:
                    control.show(self._values[name], insist=True)
            title = self._titles.get(self._tracker, self._tracker)
            if self._choice.value == title:
                self._choice.value = ""
            self._choice.value = title
            self._seed.show(insist=True)

    def _on_change(self, name: str, value: Value) -> None:
        self._touch(name)
        self._requests.command({"kind": "change", "values": {name: value}})

    def _reseed(self, seed: Value) -> None:
        self._touch(SEED)
        self._requests.command({"kind": "restart", "seed": seed})

    def _touch(self, name: str) -> None:
        with self._lock:
            self._touched[name] = time.monotonic()
            self._answered = False
        self._requests.wake()

    def _add_tracker(self) -> Handle:
        choice = self._server.gui.add_dropdown(
            "Tracker",
            tuple(self._titles.values()),
            initial_value=self._titles[self._tracker],
            hint="The method that follows the target; a change counts from the next frame.",
        )
        identifiers = {title: identifier for identifier, title in self._titles.items()}

        @choice.on_update
        async def _(event: viser.GuiEvent[viser.GuiDropdownHandle[str]]) -> None:
            if event.client_id is not None and choice.value in identifiers:
                self._on_change(TRACKER, identifiers[choice.value])

        return choice

    def _add_frames(self, frames: int) -> Handle:
        slider = self._server.gui.add_slider("Frame", 0, frames - 1, 1, 0)
        play = self._server.gui.add_button("Play or pause")

        @slider.on_update
        async def _(event: viser.GuiEvent[viser.GuiSliderHandle[int]]) -> None:
            if event.client_id is not None:
                self._touch(FRAME)
                self._requests.command({"kind": "seek", "frame": int(slider.value)})

        @play.on_click
        async def _(_event: viser.GuiEvent[viser.GuiButtonHandle]) -> None:
            self._requests.command({"kind": "toggle"})

        return slider

    def _add_cameras(self, worlds: Sequence[World]) -> None:
        self._add_views("View", {view.title: name for name, view in PRESETS.items()})
        for world in worlds:
            self._add_views(world.title, {side.title: preset(world, side) for side in world.viewpoints})

    def _add_views(self, title: str, names: Mapping[str, str]) -> None:
        """Add buttons with titles for presets by name."""
        group = self._server.gui.add_button_group(title, tuple(names))

        @group.on_click
        async def _(event: viser.GuiEvent[viser.GuiButtonGroupHandle]) -> None:
            if event.client_id is not None and event.target.value in names:
                self._requests.look(event.client_id, names[event.target.value])

    def _add_controls(self, description: PanelDescription) -> None:
        """Add a control for each declaration with a value: those to turn first in sight, the others folded by group."""
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
        self._controls[declaration.name] = Control(self._server, declaration, value, self._on_change)

    def set_layer(self, layer: str, *, shown: bool) -> bool:
        """Switch a layer on or off; return whether that changes anything."""
        box = self._layers.get(layer)
        if box is None or box.value == shown:
            return False
        box.value = shown
        return True

    def _add_layer(self, layer: Layer) -> None:
        box: Handle = self._server.gui.add_checkbox(layer.title, layer.shown)

        async def on_switch(event: viser.GuiEvent[viser.GuiCheckboxHandle]) -> None:
            self._requests.set_layer(layer.name, event.target.value)

        box.on_update(on_switch)
        self._layers[layer.name] = box

    def _add_speed(self, speed: float) -> Handle:
        offered = {_speed_title(each): each for each in SPEEDS}
        shown = _speed_title(speed if speed in SPEEDS else 1.0)
        choice = self._server.gui.add_dropdown("Speed", tuple(offered), initial_value=shown)

        @choice.on_update
        async def _(event: viser.GuiEvent[viser.GuiDropdownHandle[str]]) -> None:
            if event.client_id is not None and choice.value in offered:
                self._requests.command({"kind": "speed", "speed": offered[choice.value]})

        return choice

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
