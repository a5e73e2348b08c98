"""The panel beside the scene: everything that can be turned, generated from the declarations.

A control never decides. It proposes a value, the session accepts or refuses it, and the panel shows what the session
says: `show` after a change, `refuse` after a refusal. While somebody still drags a slider the session's answers to
older positions are held back, since they would tear it out of the hand; once it rests, all controls are set to the
truth again.

viser calls a coroutine at once, in the loop that has just taken up the browser's value, and a plain function some time
later in a thread, when the value may have been overwritten by the session's. So all callbacks here are coroutines; none
of them waits, since what they propose is sent on by a thread of its own.
"""

import threading
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence

import viser

from pftrack.parameters import Declaration, Value
from server.viewer.camera import PRESETS
from server.viewer.changes import Coalescer
from server.viewer.controls import Control, Handle
from server.viewer.legend import caption_html, legend_html
from server.viewer.seed import SEED, SeedBox

__all__ = ["Panel"]

REST_S = 0.5
"""How long a control must lie still before it is set to what the session says."""
PATIENCE_S = 5.0
"""How long the session may take to answer before the control springs back."""
SOON_S = 0.1
OPEN_ROWS = 15
"""Controls that are unfolded at first; a group is unfolded whole or not at all."""
SPEED = "speed of the run"
"""What the panel calls it beside the parameters, whose names have no spaces."""
SPEEDS = {"0.1x": 0.1, "0.25x": 0.25, "0.5x": 0.5, "1x": 1.0, "2x": 2.0, "4x": 4.0, "As fast as possible": 0.0}


class Panel:
    """The controls of one session, shared by all its browsers.

    Args:
        server: The session's viser server.
        declarations: What can be turned, in order.
        values: What is in force.
        trackers: Titles by identifier, in order.
        tracker: The one in force.
        seed: The seed of the run.
        layers: Layers by name, and whether they are shown at first.
        on_change: Takes new values of parameters.
        on_tracker: Takes the identifier of a tracker.
        on_speed: Takes a speed; 0 is as fast as possible.
        on_seed: Takes a seed with which the run shall begin anew.
        on_layer: Takes a layer and whether it is to be shown.
        on_look: Takes a browser and the camera preset that it wants.
        wake: Called when `tend` has to be called earlier than it last said.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        *,
        declarations: Sequence[Declaration],
        values: Mapping[str, Value],
        trackers: Mapping[str, str],
        tracker: str,
        seed: int,
        layers: Mapping[str, bool],
        on_change: Callable[[dict[str, Value]], None],
        on_tracker: Callable[[str], None],
        on_speed: Callable[[float], None],
        on_seed: Callable[[object], None],
        on_layer: Callable[[str, bool], None],
        on_look: Callable[[int, str], None],
        wake: Callable[[], None],
    ) -> None:
        self._server = server
        self._lock = threading.RLock()
        self._values: dict[str, Value] = dict(values)
        self._touched: dict[str, float] = {}
        self._answered = False
        self._wake = wake
        self._on_change, self._on_tracker, self._on_seed, self._on_speed = on_change, on_tracker, on_seed, on_speed
        self._changes = Coalescer(self._send)
        self._titles = dict(trackers)
        self._tracker = tracker
        gui = server.gui
        self._choice = self._add_tracker()
        self._seed = SeedBox(server, seed, lambda wanted: self._moved(SEED, wanted))
        self._add_cameras(on_look)
        self._caption = gui.add_html(caption_html(""))
        gui.add_html(legend_html(layers))
        self._controls: dict[str, Control] = {}
        self._layers: dict[str, Handle] = {}
        self._folders: dict[str, viser.GuiFolderHandle] = {}
        self._add_groups(declarations)
        self._add_layers(layers, on_layer)
        self._speed = self._add_speed()
        self._choose_visible()

    def show(self, values: Mapping[str, Value], tracker: str) -> None:
        """Show what is in force, except on a control that is in somebody's hand."""
        with self._lock, self._server.atomic():
            self._values.update(values)
            self._answered = True
            for name in values.keys() & self._controls.keys():
                if name not in self._touched:
                    self._controls[name].show(self._values[name])
            if tracker != self._tracker:
                self._tracker = tracker
                self._choose_visible()
            if "tracker" not in self._touched:
                self._choice.value = self._titles.get(tracker, tracker)
        self._wake()

    def refuse(self, message: str) -> None:
        """Say why a value was refused, and put every control back to what is in force."""
        with self._lock:
            self._restore()
        for client in self._server.get_clients().values():
            client.add_notification("Not accepted", message, color="orange", auto_close_seconds=6.0)

    def caption(self, caption: str) -> None:
        """Show the line of text about the frame."""
        self._caption.content = caption_html(caption)

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
            if self._changes.busy:
                return SOON_S
            self._restore()
            return None

    def close(self) -> None:
        """Send nothing more."""
        self._changes.close()

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

    def _moved(self, name: str, value: Value) -> None:
        with self._lock:
            self._touched[name] = time.monotonic()
            self._answered = False
        self._wake()
        self._changes.offer(name, value)

    def _send(self, batch: dict[str, Value]) -> None:
        tracker, seed, speed = (batch.pop(name, None) for name in ("tracker", SEED, SPEED))
        if batch:
            self._on_change(batch)
        if tracker is not None:
            self._on_tracker(str(tracker))
        if seed is not None:
            self._on_seed(seed)
        if speed is not None:
            self._on_speed(float(speed))

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
                self._moved("tracker", identifiers[choice.value])

        return choice

    def _add_cameras(self, on_look: Callable[[int, str], None]) -> None:
        names = {preset.title: name for name, preset in PRESETS.items()}
        group = self._server.gui.add_button_group("PublicModel", tuple(names))

        @group.on_click
        async def _(event: viser.GuiEvent[viser.GuiButtonGroupHandle]) -> None:
            if event.client_id is not None and event.target.value in names:
                on_look(event.client_id, names[event.target.value])

    def _add_groups(self, declarations: Sequence[Declaration]) -> None:
        known = [declaration for declaration in declarations if declaration.name in self._values]
        sizes = Counter(declaration.group for declaration in known)
        room = OPEN_ROWS
        for declaration in known:
            title = declaration.group or "Parameters"
            if title not in self._folders:
                unfolded = sizes[declaration.group] <= room
                room -= sizes[declaration.group] if unfolded else 0
                self._folders[title] = self._server.gui.add_folder(title, expand_by_default=unfolded)
            with self._folders[title]:
                self._controls[declaration.name] = Control(
                    self._server, declaration, self._values[declaration.name], self._moved
                )

    def set_layer(self, layer: str, *, shown: bool) -> bool:
        """Switch a layer on or off; return whether that changes anything."""
        box = self._layers.get(layer)
        if box is None or box.value == shown:
            return False
        box.value = shown
        return True

    def _add_layers(self, layers: Mapping[str, bool], on_layer: Callable[[str, bool], None]) -> None:
        with self._server.gui.add_folder("What to draw", expand_by_default=False):
            for layer, shown in layers.items():
                self._add_layer(layer, on_layer, shown=shown)

    def _add_layer(self, layer: str, on_layer: Callable[[str, bool], None], *, shown: bool) -> None:
        title = layer.replace("_", " ").replace("-", " ")
        box: Handle = self._server.gui.add_checkbox(title[:1].upper() + title[1:], shown)

        async def switched(event: viser.GuiEvent[viser.GuiCheckboxHandle]) -> None:
            on_layer(layer, event.target.value)

        box.on_update(switched)
        self._layers[layer] = box

    def _add_speed(self) -> Handle:
        choice = self._server.gui.add_dropdown("Speed", tuple(SPEEDS), initial_value="1x")

        @choice.on_update
        async def _(event: viser.GuiEvent[viser.GuiDropdownHandle[str]]) -> None:
            if event.client_id is not None and choice.value in SPEEDS:
                self._changes.offer(SPEED, SPEEDS[choice.value])

        return choice

    def show_speed(self, speed: float) -> None:
        """Show the speed in force, if it is one of those offered."""
        for title, offered in SPEEDS.items():
            if offered == speed:
                self._speed.value = title

    def show_seed(self, seed: int) -> None:
        """Show the seed of the run, unless another is just being typed."""
        with self._lock:
            self._seed.seed = seed
            self._answered = True
            if SEED not in self._touched:
                self._seed.show()

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
