"""The scene feed: sends a session's newest drawing to its viser scene, and carries out commands of the scene's panel.

The viewer is made when somebody first opens the scene. It keeps the newest drawing and sends as many as its browsers
can take, so offering one costs nothing. The worker gets credit for its next drawing once the viewer could show it and
somebody watches: with many sessions, drawings that no browser takes would slow all of them.

Actions on the panel are commands of the session. A dragged slider sends twenty values a second. While another command
is being carried out, one change waits and collects the newest value of each parameter. Nobody waits for its answer, so
all watchers are shown a refusal.
"""

import asyncio
from collections.abc import Awaitable, Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import structlog
from pydantic import ValidationError

from pftrack.core.refusal import RefusedError
from pftrack_server.core.errors import detail_of, shape
from pftrack_server.core.panel import PanelDescription, PanelValues
from pftrack_server.core.pictures import SceneDrawing
from pftrack_server.sessions.worker.protocol import COMMAND, ChangeValues, Command, Order
from pftrack_server.store.disk_budget import failure_message

if TYPE_CHECKING:
    from pftrack_server.viewer import Endpoint, Viewer


log = structlog.get_logger(__name__)


class SceneFeed:
    """The scene of one session and its watchers; call all methods in the event loop's thread.

    Args:
        credit: Lets the worker send one drawing.
        carry_out: Carries out a command of the panel; calls `note_turn` before sending it.
        on_refusal: Called with the inside of an error.

    Attributes:
        watchers: Number of watchers.
    """

    def __init__(
        self,
        *,
        credit: Callable[[], None],
        carry_out: Callable[[Command], Awaitable[object]],
        on_refusal: Callable[[dict[str, Any]], None],
    ) -> None:
        self._credit = credit
        self._carry_out = carry_out
        self._on_refusal = on_refusal
        self._viewer: Viewer | None = None
        self._waiting: ChangeValues | None = None
        self._commands: set[asyncio.Task[None]] = set()
        self.watchers = 0

    def open(self, description: PanelDescription, in_force: PanelValues) -> "Endpoint":
        """Make the viewer if there is none, and return the endpoint for its browsers."""
        from pftrack_server.viewer import Viewer  # noqa: PLC0415 - viser is imported when somebody first looks

        if self._viewer is None:
            self._viewer = Viewer(description, in_force, on_command=self.ask, on_ready=self.want)
        return self._viewer.endpoint

    async def close(self) -> None:
        """Close the viewer if there is one; it can be opened again."""
        viewer, self._viewer = self._viewer, None
        if viewer is not None:
            await viewer.close()

    @contextmanager
    def watch(self) -> Iterator[None]:
        """Count one more watcher while the context lasts."""
        self.watchers += 1
        self._credit()
        try:
            yield
        finally:
            self.watchers -= 1

    def want(self) -> None:
        """Ask the worker for a drawing if somebody watches; a browser that joins later asks again."""
        if self.watchers:
            self._credit()

    def offer(self, drawing: SceneDrawing, frame: int) -> None:
        """Show the drawing of a frame; the viewer skips it if a newer one arrives before it can be sent."""
        if self._viewer is not None:
            self._viewer.show(drawing, frame)

    def tell(self, in_force: PanelValues) -> None:
        """Show the current values in the panel."""
        self._try(lambda viewer: viewer.tell(in_force))

    def refuse(self, message: str) -> None:
        """Show that a value was refused; its control springs back."""
        self._try(lambda viewer: viewer.refuse(message))

    def ask(self, body: dict[str, Any]) -> None:
        """Carry out a command; new values join the waiting change, if there is one."""
        try:
            command = COMMAND.validate_python(body)
        except ValidationError as error:
            first = error.errors()[0]
            self._on_refusal(shape(f"{first['loc'][-1] if first['loc'] else 'kind'}: {first['msg']}"))
            return
        if isinstance(command, ChangeValues):
            if self._waiting is not None:
                self._waiting.values.update(command.values)
                return
            self._waiting = command
        task = asyncio.ensure_future(self._send(command))
        self._commands.add(task)
        task.add_done_callback(self._commands.discard)

    def note_turn(self, order: Order) -> None:
        """Note that an order is about to be sent: no other value can join it."""
        if order is self._waiting:
            self._waiting = None

    async def _send(self, command: Command) -> None:
        """Carry out a command; show and log its failure."""
        try:
            await self._carry_out(command)
        except RefusedError as error:
            self._on_refusal(detail_of(error))
        except Exception as error:
            log.exception("a command of the panel failed")
            self._on_refusal(shape(failure_message(error)))

    def _try(self, act: "Callable[[Viewer], None]") -> None:
        """Act on the viewer; a failure there must not end the session, whose page still has the plots."""
        try:
            if self._viewer is not None:
                act(self._viewer)
        except Exception:
            log.exception("viewer failed")
