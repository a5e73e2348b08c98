"""Connections to a viser server within this process: no port, no socket, nothing that anybody else could reach.

viser listens on a TCP port and checks neither Origin nor identity of whoever connects. A port on the loopback interface
is open to every page of every site in the user's own browser, and to every other user of the machine. So here it never
listens: where viser would open its port it is given an `Endpoint`, and the bridge connects through that, after the web
application has checked who is asking. A Unix socket would keep browsers out as well, but it leaves a file behind when
the process is killed, and it copies each frame twice through the kernel.

A `Connection` stands between the loop in which viser works and the caller's, which may be the same. It has no buffer
towards the browser: viser's sender waits until the caller has taken a message, and meanwhile viser replaces what it has
not sent yet by what is newer.
"""

import asyncio
import inspect
import logging
import math
import threading
import time
from collections.abc import Callable, Coroutine
from contextlib import suppress
from types import SimpleNamespace
from typing import Any, Self

import viser
import websockets
import websockets.asyncio.server
import websockets.datastructures
from viser.infra import _infra
from websockets.exceptions import ConnectionClosedError, ConnectionClosedOK

CLOSE_GOING_AWAY = 1001
CLOSE_INTERNAL_ERROR = 1011
OPENING = "websockets.asyncio.server.serve("
"""How viser opens its port; it is looked up at each start of a server."""

LEAVES_WITHIN = 3
"""Messages, one of which carries the question; it is asked together with a frame, and may leave before that.

So a browser that answers before the next frame leaves is never held, however long that takes on a busy machine.
"""

Work = Coroutine[Any, Any, None]
Handler = Callable[[Any], Work]

logger = logging.getLogger(__name__)


class Connection:
    """One connection to a viser server, made by `Endpoint.connect`.

    viser is given it in place of a `websockets.asyncio.server.ServerConnection`, of which it uses `subprotocol`,
    `send`, `recv` and `close`. These run in viser's loop; the other methods belong to the loop that has made the
    connection.

    Attributes:
        subprotocol: What the client and viser speak, or None if the client has offered nothing known.
        looks_only: Whether the client moves its own camera and changes nothing that others see.
    """

    def __init__(
        self,
        viser_loop: asyncio.AbstractEventLoop,
        subprotocol: str | None,
        take: Callable[[bytes], Work],
        *,
        looks_only: bool = False,
    ) -> None:
        self.subprotocol = subprotocol
        self.looks_only = looks_only
        self._take = take
        self._viser_loop = viser_loop
        self._loop = asyncio.get_running_loop()
        self._inbox: asyncio.Queue[bytes | None] = asyncio.Queue()
        self._is_closing = False
        self._closing = CLOSE_GOING_AWAY, "The scene has ended"
        self._ended = asyncio.Event()
        self._patience_s = math.inf
        self._leaving = 0
        self._left = time.monotonic()
        self._hold_from = math.inf
        self._released = asyncio.Event()

    # ------------------------------------------------------------ for whoever has connected

    def deliver(self, message: bytes) -> None:
        """Hand viser a message; one that comes after the end is dropped."""
        self._put(message)

    async def wait_closed(self) -> tuple[int, str]:
        """Wait until viser has dealt with the end of the connection; return its closing code and reason."""
        await self._ended.wait()
        return self._closing

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(self, *_: object) -> None:
        self._put(None)
        await self._ended.wait()

    def _put(self, message: bytes | None) -> None:
        with suppress(RuntimeError):  # viser's loop has been closed, after all connections had ended
            self._viser_loop.call_soon_threadsafe(self._inbox.put_nowait, message)

    # ------------------------------------------------------------ for the viewer, from any thread

    @property
    def held(self) -> bool:
        """Whether nothing is sent, because an answer is overdue."""
        return time.monotonic() >= self._hold_from

    def expect(self, patience_s: float) -> None:
        """Take note that a question follows: so long after it has left nothing more is sent until `release`.

        What delays the question itself, such as a busy server, is not counted.
        """
        with suppress(RuntimeError):
            self._viser_loop.call_soon_threadsafe(self._expect, patience_s)

    def release(self) -> float:
        """Send again, as the answer has come; return the time since the question had left, s."""
        lag_s = time.monotonic() - self._left
        with suppress(RuntimeError):
            self._viser_loop.call_soon_threadsafe(self._release)
        return lag_s

    def _expect(self, patience_s: float) -> None:
        self._patience_s, self._leaving, self._left = patience_s, LEAVES_WITHIN, time.monotonic()

    def _release(self) -> None:
        self._leaving, self._hold_from = 0, math.inf
        self._released.set()
        self._released.clear()

    def _note_taken(self) -> None:
        """Take note that a message was taken, which may have been the one with the question."""
        if self._leaving:
            self._leaving, self._left = self._leaving - 1, time.monotonic()
            if not self._leaving:
                self._hold_from = self._left + self._patience_s

    # ------------------------------------------------------------ for viser

    async def send(self, message: bytes) -> None:
        """Hand a message to whoever has connected, and wait until it has been taken; first of all while it is held.

        Raises:
            ConnectionClosed: The connection has ended.
        """
        while self.held and not self._is_closing:
            await self._released.wait()
        if self._is_closing:
            raise ConnectionClosedOK(None, None)
        taking = self._take(message)
        try:
            if self._loop is self._viser_loop:
                await taking
            else:
                await asyncio.wrap_future(asyncio.run_coroutine_threadsafe(taking, self._loop))
        except Exception:  # noqa: BLE001 - whatever it was, the message cannot be taken
            taking.close()
            raise ConnectionClosedError(None, None) from None
        self._note_taken()

    async def recv(self) -> bytes:
        """Return the next message.

        Raises:
            ConnectionClosed: The connection has ended.
        """
        message = None if self._is_closing else await self._inbox.get()
        if message is None:
            self._is_closing = True
            self._released.set()
            raise ConnectionClosedOK(None, None)
        return message

    async def close(self, code: int = CLOSE_GOING_AWAY, reason: str = "The scene has ended") -> None:
        """End the connection; the first to close it says why."""
        if not self._is_closing:
            self._is_closing, self._closing = True, (code, reason)
            self._released.set()
            self._inbox.put_nowait(None)

    def mark_closed(self) -> None:
        """Tell whoever has connected that viser has dealt with the end."""
        with suppress(RuntimeError):  # their loop has been closed, so nobody waits
            self._loop.call_soon_threadsafe(self._ended.set)


class Endpoint:
    """Where one viser server is reached, in place of a host and a port.

    Give it to `viser.ViserServer` as its host, after `install`.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._handler: Handler | None = None
        self._loop: asyncio.AbstractEventLoop | None = None
        self._handling: dict[asyncio.Task[None], Connection] = {}

    @property
    def is_open(self) -> bool:
        """Whether the server runs."""
        return self._loop is not None

    def connect(
        self, subprotocol: str | None, take: Callable[[bytes], Work], *, looks_only: bool = False
    ) -> Connection:
        """Connect to the server; leaving the connection's context ends it.

        Args:
            subprotocol: The one of those offered by the client that viser is to see.
            take: Takes a message from viser; it runs in the caller's loop, and viser's next message waits for it.
            looks_only: Whether the client moves its own camera and changes nothing that others see.

        Raises:
            ConnectionRefusedError: The server does not run.
        """
        with self._lock:
            if self._loop is None:
                raise ConnectionRefusedError("the viser server of this scene does not run")
            connection = Connection(self._loop, subprotocol, take, looks_only=looks_only)
            self._loop.call_soon_threadsafe(self._begin, connection)
            return connection

    def serving(self, handler: Handler) -> Self:
        """Return a context, entered and left in viser's loop, in which a handler is called for each connection."""
        self._handler = handler
        return self

    async def __aenter__(self) -> SimpleNamespace:
        with self._lock:
            self._loop = asyncio.get_running_loop()
        # viser asks a server for its sockets, to learn its port; there are none.
        return SimpleNamespace(server=SimpleNamespace(sockets=()))

    async def __aexit__(self, *_: object) -> None:
        with self._lock:
            self._loop = None
        await asyncio.sleep(0.0)  # so that connections made just before have begun
        for connection in self._handling.values():
            await connection.close()
        await asyncio.gather(*self._handling, return_exceptions=True)

    def _begin(self, connection: Connection) -> None:
        task = asyncio.ensure_future(self._handle(connection))
        self._handling[task] = connection
        task.add_done_callback(self._end)

    def _end(self, task: asyncio.Task[None]) -> None:
        self._handling.pop(task).mark_closed()

    async def _handle(self, connection: Connection) -> None:
        assert self._handler is not None  # noqa: S101 - for mypy: it is given before the loop is known
        try:
            await self._handler(connection)
        except Exception:
            logger.exception("a connection to the scene failed")
            await connection.close(CLOSE_INTERNAL_ERROR, "The scene has failed")


def install() -> None:
    """Make viser serve an `Endpoint` where it is given one in place of a host.

    Raises:
        RuntimeError: This version of viser opens its port in another way. It must not be started then.
    """
    if OPENING not in inspect.getsource(_infra.WebsockServer._background_worker):  # noqa: SLF001 - all this is private
        raise RuntimeError(
            f"viser {viser.__version__} does not open its port by {OPENING}...), so it cannot be kept from "
            "listening; install a version that this server knows"
        )
    _infra.websockets = SimpleNamespace(  # type: ignore[attr-defined,assignment]  # a module of viser's own
        asyncio=SimpleNamespace(server=SimpleNamespace(serve=_serve)),
        datastructures=websockets.datastructures,
        exceptions=websockets.exceptions,
    )


def _serve(handler: Handler, host: object, port: int, **options: Any) -> Any:  # noqa: ANN401 - as websockets' own
    """Stand in for `websockets.asyncio.server.serve`."""
    if isinstance(host, Endpoint):
        return host.serving(handler)
    return websockets.asyncio.server.serve(handler, host, port, **options)  # type: ignore[arg-type]
