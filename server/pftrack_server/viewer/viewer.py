"""A session's viewer: one viser server that shows the newest drawing.

`show` stores the newest drawing for one task, which updates the scene up to 30 times a second while some browser keeps
up. Replaced drawings are never sent, and each browser gets as many as it can take.
"""

import asyncio
import time
import traceback
from collections.abc import Callable
from contextlib import suppress
from typing import Any

import viser

from pftrack_server.core.log import RateLimitedLogger
from pftrack_server.core.panel import PanelDescription, PanelValues
from pftrack_server.core.pictures import SceneDrawing
from pftrack_server.viewer import viser_server, worlds
from pftrack_server.viewer.camera import Cameras
from pftrack_server.viewer.dragging import Grips
from pftrack_server.viewer.panel import Panel
from pftrack_server.viewer.scene import Scene

PANEL_WIDTH_PX = 200
"""Width of the panel, with which the picture has six tenths of a page of 1,000 px, next to the plots."""
FASTEST_S = 0.8 / 30.0
"""Shortest time between two drawings, s: less than a frame of a run, so that no frame waits for the next one's turn."""
STILL_S = 0.3
"""Time for which a drawing is shown before its objects can be grabbed, s."""
BRAND = (0, 76, 118)
"""Darkest colour of viser's ramp; the ramp's middle, used for controls, is then the blue of the estimate."""

warnings = RateLimitedLogger(__name__)


class Viewer:
    """The scene and the panel of one session, for any number of browsers.

    Make and use it in a running loop; the callbacks must not block.

    Args:
        description: The panel's controls and the scene's layers.
        in_force: The panel's first values.
        on_command: Takes a command, not yet validated, in the form of `POST /sessions/{id}/commands`.
        on_ready: Called when another drawing can be shown.
        frames: Length of the run, for a slider of frames; 0 if the outer page has one.

    Attributes:
        endpoint: Connects browsers to the viser server.
    """

    def __init__(
        self,
        description: PanelDescription,
        in_force: PanelValues,
        *,
        on_command: Callable[[dict[str, Any]], None],
        on_ready: Callable[[], None] = lambda: None,
        frames: int = 0,
    ) -> None:
        self._on_ready = on_ready
        server, self.endpoint = viser_server.start(description.title)
        self._server = server
        self._newest: tuple[SceneDrawing, int] | None = None
        self._news = asyncio.Event()
        with server.atomic():
            server.gui.configure_theme(
                show_logo=False, show_share_button=False, control_width="small", brand_color=BRAND
            )
            server.gui.main_panel.dock_right()
            server.gui.main_panel.set_width(PANEL_WIDTH_PX)
            self._scene = Scene(server, description.layers)
            self._grips = Grips(server, on_command)
            # Invisible; its position tells the outer page the number of the frame (`client/state.js`).
            self._frame = server.scene.add_frame("/frame", show_axes=False)
            self._cameras = Cameras(server, self._news.set, worlds.sides(description.worlds))
            asked = on_command, self._set_layer, self._cameras.look
            self._panel = Panel(server, description, in_force, *asked, frames=frames)
        server.on_client_connect(self._join)
        server.on_client_disconnect(self._leave)
        self._work = asyncio.create_task(self._keep_up())

    @property
    def clients(self) -> int:
        """Number of browsers that watch."""
        return len(self._server.get_clients())

    def show(self, drawing: SceneDrawing, frame: int) -> None:
        """Show the drawing of a frame, unless a newer one arrives before it can be sent."""
        self._newest = drawing, frame
        self._news.set()

    def tell(self, in_force: PanelValues) -> None:
        """Show the current values; this triggers no command."""
        self._panel.show(in_force)

    def refuse(self, message: str) -> None:
        """Show why a value was refused; the controls spring back to the current values."""
        self._panel.refuse(message)

    async def close(self) -> None:
        """Disconnect all browsers and end the viser server; a second call does nothing."""
        self._work.cancel()
        self._server.stop()
        await self.endpoint.wait_closed()
        self._panel.close()  # last, since a control moved before this sets its timer again

    async def _join(self, client: viser.ClientHandle) -> None:
        line = viser_server.connection_of(client)
        self._cameras.join(client, looks_only=line is not None and line.looks_only)

    async def _leave(self, client: viser.ClientHandle) -> None:
        self._cameras.leave(client.client_id)

    def _set_layer(self, layer: str, shown: bool) -> None:
        self._scene.set_layer(layer, shown=shown)
        self._news.set()

    async def _keep_up(self) -> None:
        patience_s: float | None = None
        while True:
            with suppress(TimeoutError):
                await asyncio.wait_for(self._news.wait(), patience_s)
            # Wait before taking the drawing, so that the newest is sent.
            await self.endpoint.wait_for_browser()
            begun, is_new = time.monotonic(), self._news.is_set()
            act, patience_s = (self._draw, STILL_S) if is_new else (self._let_grab, None)
            self._news.clear()
            try:
                act()
            except Exception:  # noqa: BLE001 - one drawing that cannot be shown must not end the picture for good
                warnings.warn("a scene could not be updated", traceback=traceback.format_exc())
            if is_new:
                self._on_ready()
            await asyncio.sleep(begun + FASTEST_S - time.monotonic())

    def _let_grab(self) -> None:
        if self._newest is not None:
            shown, frame = self._newest
            self._grips.place(self._scene, shown.drawing, frame, self._cameras.relief)
            self._server.flush()

    def _draw(self) -> None:
        if self._newest is None:
            return
        shown, frame = self._newest
        drawing = shown.drawing
        self._cameras.set_box(self._scene.box(drawing))
        relief = self._cameras.relief
        with self._server.atomic():
            self._grips.remove()
            self._scene.apply(shown, relief)
            self._frame.position = (float(frame), 0.0, 0.0)
            self._panel.legend(self._scene.legend(drawing, relief))
            self._panel.caption(drawing.caption or f"Frame {frame}")
            self._panel.frame(frame)
        self._server.flush()
