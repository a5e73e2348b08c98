"""The scene feed: the viser scene of a session, fed with the newest drawing and never with a queue of them.

The viewer is made when somebody first looks. It keeps the newest drawing and sends as many as its browsers can follow,
so handing it one costs nothing; changes of its panel run in threads, one at a time, and while one runs only the newest
waits. The worker gets credit for its next drawing when the viewer could show it and somebody looks on: in a crowd,
drawings that no browser takes up would keep everybody waiting.
"""

import asyncio
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import structlog

from pftrack_server.core.panel import PanelDescription, PanelValues
from pftrack_server.core.pictures import SceneDrawing
from pftrack_server.sessions.spec import SessionDescription

if TYPE_CHECKING:
    from pftrack_server.viewer import Endpoint, Viewer


log = structlog.get_logger(__name__)


class SceneFeed:
    """The scene of one session and those who look at it."""

    def __init__(
        self,
        *,
        credit: Callable[[], None],
        on_command: Callable[[dict[str, Any]], None],
    ) -> None:
        self._credit = credit
        self._on_command = on_command
        self._viewer: Viewer | None = None
        self._opening = asyncio.Lock()
        self._loop = asyncio.get_running_loop()
        self._pump: asyncio.Task[None] | None = None
        self._in_force: PanelValues | None = None
        self._refusals: list[str] = []
        self.watchers = 0

    async def open(self, description: SessionDescription, in_force: PanelValues) -> "Endpoint":
        """Make the viewer unless there is one, and return where the bridge connects to it."""
        async with self._opening:
            if self._viewer is None:
                self._viewer = await asyncio.to_thread(self._make_viewer, description, in_force)
                # What was told while it was made is not in it.
                self._start()
            return self._viewer.endpoint

    @contextmanager
    def watch(self) -> Iterator[None]:
        """Count somebody as looking on for as long as the context lasts."""
        self.watchers += 1
        self._credit()
        try:
            yield
        finally:
            self.watchers -= 1

    def offer(self, drawing: SceneDrawing, frame: int) -> None:
        """Show the drawing of a frame; the viewer leaves it out if a newer one comes before it can be sent."""
        if self._viewer is not None:
            self._viewer.show(drawing, frame)

    def tell(self, in_force: PanelValues) -> None:
        """Show in the panel what is in force."""
        self._in_force = in_force
        self._start()

    def refuse(self, message: str) -> None:
        """Tell that a value was refused; its control springs back."""
        self._refusals.append(message)
        self._start()

    def on_worker_started(self) -> None:
        """Ask a new worker for its first drawing."""
        self._want()

    async def close(self) -> None:
        """Close the viewer, if there is one; it can be opened again."""
        if self._pump is not None:
            await asyncio.gather(self._pump, return_exceptions=True)
        async with self._opening:
            viewer, self._viewer = self._viewer, None
            if viewer is not None:
                await asyncio.to_thread(viewer.close)

    def _make_viewer(self, description: SessionDescription, in_force: PanelValues) -> "Viewer":
        from pftrack_server.viewer import Viewer  # noqa: PLC0415 - viser is imported when somebody first looks

        return Viewer(
            PanelDescription(
                description.title,
                description.declarations,
                {tracker.id: tracker.title for tracker in description.trackers},
                description.layers,
                description.worlds,
                description.about,
            ),
            in_force,
            on_command=lambda command: self._from_thread(self._on_command, command),
            on_ready=lambda: self._from_thread(self._want),
            loop=self._loop,
        )

    def _from_thread(self, callback: Callable[..., None], *arguments: object) -> None:
        if not self._loop.is_closed():
            self._loop.call_soon_threadsafe(callback, *arguments)

    def _want(self) -> None:
        """Ask for a drawing if somebody looks on; whoever comes later asks again."""
        if self.watchers:
            self._credit()

    def _start(self) -> None:
        if self._viewer is not None and (self._pump is None or self._pump.done()):
            self._pump = asyncio.ensure_future(self._run())

    async def _run(self) -> None:
        """Bring what waits into the panel until nothing waits."""
        while (viewer := self._viewer) is not None and (self._in_force or self._refusals):
            in_force, self._in_force = self._in_force, None
            refusals, self._refusals = self._refusals, []
            try:
                await asyncio.to_thread(_apply, viewer, in_force, refusals)
            except Exception:
                # A panel that cannot be drawn must not end the session: its page still has the plots.
                log.exception("viewer failed")


def _apply(viewer: "Viewer", in_force: PanelValues | None, refusals: list[str]) -> None:
    if in_force is not None:
        viewer.tell(in_force)
    for message in refusals:
        viewer.refuse(message)
