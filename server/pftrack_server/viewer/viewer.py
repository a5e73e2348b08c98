"""A session's viewer: one viser server, kept at the newest drawing.

`show` leaves the newest drawing for one task in viser's loop, which changes the scene up to 30 times a second. What was
overtaken is never sent, each browser is sent what it can follow, and nothing is drawn while all are late.
"""

import asyncio
import concurrent.futures
import contextlib
import threading
import time
import traceback
from collections.abc import Callable
from typing import Any

import viser

from pftrack.core.model.drawing import LayerRole
from pftrack_server.core.log import RateLimitedLogger
from pftrack_server.core.panel import PanelDescription, PanelValues
from pftrack_server.core.pictures import SceneDrawing
from pftrack_server.viewer import viser_adapter, worlds
from pftrack_server.viewer.camera import PRESETS, Cameras
from pftrack_server.viewer.pacing import FASTEST_S, Pacer
from pftrack_server.viewer.panel import Panel, Requests
from pftrack_server.viewer.scene import Scene

PANEL_WIDTH_PX = 200
"""The picture is to have six tenths of a page that is 1,000 px wide, with the plots beside it."""
HELD_S = 0.1
"""How often to look whether a browser keeps up again; its answer ends the wait at once."""
FAILED_S = 0.1
"""How long to rest after a failure."""
UNWATCHED_S = 1.0
"""Time between two frames while nobody watches: just enough for whoever comes next."""
BRAND = (0, 76, 118)
"""viser takes this as the darkest of a ramp; its middle, which the controls wear, is then the blue of the estimate."""

warnings = RateLimitedLogger(__name__)


class Viewer:
    """The scene and the panel of one session, for any number of browsers.

    All methods may be called from any thread; the callbacks run in viser's loop, so they must not wait.

    Args:
        description: What the panel offers, and the scene's layers.
        in_force: What the panel shows at first.
        on_command: Takes a command, not yet validated, as `POST /sessions/{id}/commands` has it.
        on_ready: Called when another drawing could be shown, and again only after `show`.
        loop: Where viser works, which must not be that of the calling thread; None for a thread of its own.

    Attributes:
        endpoint: Where `bridge` connects to the viser server.
    """

    def __init__(
        self,
        description: PanelDescription,
        in_force: PanelValues,
        *,
        on_command: Callable[[dict[str, Any]], None],
        on_ready: Callable[[], None] = lambda: None,
        loop: asyncio.AbstractEventLoop | None = None,
    ) -> None:
        self._on_ready = on_ready
        server, self.endpoint = viser_adapter.start(description.title, loop)
        self._server = server
        self._layers = tuple(description.layers)
        self._loop = server.get_event_loop()
        self._news = asyncio.Event()
        self._lock = threading.Lock()
        self._closed = False
        self._newest: tuple[SceneDrawing, int] | None = None
        self._shown: tuple[SceneDrawing, int] | None = None
        self._redraw = self._asked = False
        self._due = 0.0
        with server.atomic():
            server.gui.configure_theme(
                show_logo=False, show_share_button=False, control_width="small", brand_color=BRAND
            )
            server.gui.main_panel.dock_right()
            server.gui.main_panel.set_width(PANEL_WIDTH_PX)
            self._pacer = Pacer(self._wake)
            self._scene = Scene(server, description.layers)
            # Nothing is seen of it; where it stands tells the page around which frame this is (`client/state.js`).
            self._frame = server.scene.add_frame("/frame", show_axes=False)
            self._cameras = Cameras(server, self._draw_again, worlds.sides(description.worlds))
            requests = Requests(on_command, self._set_layer, self._look, self._wake)
            self._panel = Panel(server, description, in_force, requests)
        server.on_client_connect(self._join)
        server.on_client_disconnect(self._leave)
        self._task = asyncio.run_coroutine_threadsafe(self._work(), self._loop)

    @property
    def clients(self) -> int:
        """Number of browsers that watch."""
        return len(self._server.get_clients())

    def show(self, drawing: SceneDrawing, frame: int) -> None:
        """Show the drawing of a frame, unless a newer one comes before it can be sent; it never waits."""
        with self._lock:
            self._newest = (drawing, frame)
        self._wake()

    def tell(self, in_force: PanelValues) -> None:
        """Show what is in force now; nothing is asked for it."""
        self._panel.show(in_force)

    def refuse(self, message: str) -> None:
        """Say why a value was refused; the controls spring back to what is in force."""
        self._panel.refuse(message)

    def close(self) -> None:
        """Disconnect all browsers and end the viser server; a second call does nothing.

        It waits for viser's loop, so it must not be called there.
        """
        with self._lock:
            if self._closed:
                return
            self._closed = True
        self._wake()
        concurrent.futures.wait([self._task], timeout=5.0)
        viser_adapter.stop(self._server)

    async def _join(self, client: viser.ClientHandle) -> None:
        line = viser_adapter.connection_of(client)
        self._cameras.join(client, looks_only=line is not None and line.looks_only)
        self._pacer.watch(client)
        self._due = 0.0
        self._news.set()

    async def _leave(self, client: viser.ClientHandle) -> None:
        self._pacer.forget(client.client_id)
        self._cameras.leave(client.client_id)

    def _set_layer(self, layer: str, shown: bool) -> None:
        self._scene.set_layer(layer, shown=shown)
        self._draw_again()

    def _look(self, client_id: int, preset: str) -> None:
        # Time as the third direction is worth seeing from aside only; whoever looks beside the picture sees none of it.
        aside = preset == "side"
        turned = preset in PRESETS and [
            self._panel.set_layer(layer, shown=aside) for layer in self._with_role("through time")
        ]
        if turned and any(turned):
            for layer in self._with_role("flat only"):
                self._panel.set_layer(layer, shown=not aside)
        self._cameras.look(client_id, preset)

    def _with_role(self, role: LayerRole) -> list[str]:
        return [layer.name for layer in self._layers if layer.role == role]

    def _draw_again(self) -> None:
        with self._lock:
            self._redraw = True
        self._wake()

    def _wake(self) -> None:
        with contextlib.suppress(RuntimeError):  # the loop has been closed
            self._loop.call_soon_threadsafe(self._news.set)

    async def _work(self) -> None:
        try:
            while not self._closed:
                await self._wait(self._attend_or_warn())
        finally:
            self._pacer.close()

    def _attend_or_warn(self) -> float | None:
        """Attend; what fails, such as one drawing that cannot be shown, must not end the picture for good."""
        try:
            return self._attend()
        except Exception:  # noqa: BLE001 - whatever it was
            warnings.warn("a scene could not be brought up to date", traceback=traceback.format_exc())
            return FAILED_S

    def _attend(self) -> float | None:
        """Do what is due; return after how many seconds to look again, or None if there is nothing to wait for."""
        self._news.clear()
        rest = self._panel.tend()
        if not self._ask():
            rest = HELD_S if rest is None else min(rest, HELD_S)
        if not (self._newest or self._redraw):
            return rest
        # The pause comes before taking the drawing, so that what is sent after it is the newest.
        pause = self._pause_s()
        if pause > 0.0:
            return pause
        self._draw_newest()
        return 0.0

    async def _wait(self, rest_s: float | None) -> None:
        """Wait for news, but no longer than this."""
        timer = None if rest_s is None else self._loop.call_later(rest_s, self._news.set)
        await self._news.wait()
        if timer is not None:
            timer.cancel()

    def _ask(self) -> bool:
        """Ask for a drawing unless nobody would be sent it; return whether one is on its way."""
        if not (self._asked or self._pacer.all_held):
            self._on_ready()
            self._asked = True
        return self._asked

    def _pause_s(self) -> float:
        """Return the time until the next frame may go out; not positive if it may now."""
        rest = self._due - time.monotonic()
        return max(rest, HELD_S) if self._pacer.all_held else rest

    def _draw_newest(self) -> None:
        self._due = time.monotonic() + (FASTEST_S if self.clients else UNWATCHED_S)
        with self._lock:
            self._redraw, self._asked = False, self._asked and self._newest is None
            self._shown, self._newest = self._newest or self._shown, None
        if self._shown is not None:
            self._draw(*self._shown)

    def _draw(self, shown: SceneDrawing, frame: int) -> None:
        drawing = shown.drawing
        self._cameras.set_box(self._scene.box(drawing))
        with self._server.atomic():
            self._scene.apply(shown, self._cameras.relief)
            self._frame.position = (float(frame), 0.0, 0.0)
            self._panel.legend(self._scene.legend(drawing))
            self._panel.caption(drawing.caption or f"Frame {frame}")
            self._panel.frame(frame)
        self._server.flush()
        self._pacer.note_frame()
