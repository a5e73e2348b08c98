"""The scene feed: the viser scene of a session, fed with the newest drawing, and what people do on the panel in it.

The viewer is made when somebody first looks. It keeps the newest drawing and sends as many as its browsers can follow,
so handing it one costs nothing. The worker gets credit for its next drawing when the viewer could show it and somebody
looks on: in a crowd, drawings that no browser takes up would keep everybody waiting.

What people do on the panel are commands of the session. A slider that is dragged asks for twenty values a second. While
another command is under way one change waits for its turn and takes up the newest value of each parameter. Nobody waits
for the answer, so a refusal is told to all who look on.
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
    """The scene of one session and those who look at it; all methods belong to the event loop's thread.

    Args:
        credit: Lets the worker send one drawing.
        carry_out: Carries out a command of the panel, and calls `note_turn` before it is sent.
        on_refusal: Called with the inside of an error.

    Attributes:
        watchers: How many look at it.
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
        """Make the viewer unless there is one, and return where browsers are joined to it."""
        from pftrack_server.viewer import Viewer  # noqa: PLC0415 - viser is imported when somebody first looks

        if self._viewer is None:
            self._viewer = Viewer(description, in_force, on_command=self.ask, on_ready=self.want)
        return self._viewer.endpoint

    async def close(self) -> None:
        """Close the viewer, if there is one; it can be opened again."""
        viewer, self._viewer = self._viewer, None
        if viewer is not None:
            await viewer.close()

    @contextmanager
    def watch(self) -> Iterator[None]:
        """Count somebody as looking on for as long as the context lasts."""
        self.watchers += 1
        self._credit()
        try:
            yield
        finally:
            self.watchers -= 1

    def want(self) -> None:
        """Ask the worker for a drawing if somebody looks on; a browser that comes later asks again."""
        if self.watchers:
            self._credit()

    def offer(self, drawing: SceneDrawing, frame: int) -> None:
        """Show the drawing of a frame; the viewer leaves it out if a newer one comes before it can be sent."""
        if self._viewer is not None:
            self._viewer.show(drawing, frame)

    def tell(self, in_force: PanelValues) -> None:
        """Show in the panel what is in force."""
        self._try(lambda viewer: viewer.tell(in_force))

    def refuse(self, message: str) -> None:
        """Tell that a value was refused; its control springs back."""
        self._try(lambda viewer: viewer.refuse(message))

    def ask(self, body: dict[str, Any]) -> None:
        """Carry out a command; new values join the change that waits for its turn, where there is one."""
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
        """Take note that an order is about to be sent: no other value can join it."""
        if order is self._waiting:
            self._waiting = None

    async def _send(self, command: Command) -> None:
        """Carry out a command, and tell if it fails."""
        try:
            await self._carry_out(command)
        except RefusedError as error:
            self._on_refusal(detail_of(error))
        except Exception as error:
            log.exception("a command of the panel failed")
            self._on_refusal(shape(failure_message(error)))

    def _try(self, act: "Callable[[Viewer], None]") -> None:
        """Do something with the viewer; what cannot be shown must not end the session: its page has the plots."""
        try:
            if self._viewer is not None:
                act(self._viewer)
        except Exception:
            log.exception("viewer failed")
