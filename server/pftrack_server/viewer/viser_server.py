"""A viser server that works in its starter's loop, and that only admitted browsers can reach.

viser listens on a TCP port and checks neither Origin nor identity of a client. A port on the loopback interface is open
to every page of every site in the user's own browser, and to every other user of the machine. So here viser never
listens: instead of a port it gets an `Endpoint`, through which it serves a browser's websocket after the web
application has checked the request. It has no thread either: with a loop for each session every frame would pass back
and forth between threads that wait for each other and for the interpreter.

Nothing queues on the way to a browser: viser's sender waits until a message has left, and meanwhile viser replaces
unsent messages by newer ones. But a browser or a connection that cannot keep up does not report it: the buffers of the
connection fill with seconds of stale pictures. So up to ten times a second a `Connection` sends a question after a
message, which the browser's drawing code answers. While the answer is overdue the browser is sent nothing, and then the
newest state. A connection with a long delay is not mistaken for a slow one, and a frozen tab is sent nothing until it
resumes.

To allow another version of viser (`pyproject.toml` allows only 1.1), check these tests in order. 1.2 is not published
yet; its likely differences are estimated from the changes between 1.0.21 and 1.1.1.

1. `test_viser_server`: viser must open its port by `websockets.asyncio.server.serve`, use four members of a
   connection, and make its event loop by `asyncio.new_event_loop`, in which it runs one coroutine. The first two were
   the same in 1.0.21. A version that opens its port otherwise is refused when a server is started. The endpoint could
   go if viser took a transport of the caller's.
2. `test_viser_contracts`: the only clock in `viser.infra._infra` times messages (the same in 1.0.21), so it may run
   fast; it could go with an option that turns smoothing off. New kinds of messages from browsers have to be judged. A
   client that is packed in another way is served in one piece until `client_page` learns the new way.
3. `test_browser`: `__viserMutable`, `drainMessageQueue` and `messageQueue` are not in 1.0.21 at all, so these
   are what a new version is most likely to change; `client/frames.js` and `client/state.js` are then to be adapted.
   `client/colours.js` rests on `onBeforeRender` of the scene and on the bytes that points keep as their colours; with a
   viser whose meshes take colours of vertices in place, it and `ColouredMesh` can go. What `style.css`, `numbers.js`
   and `folds.js` look for are names of the library that draws the panel (mantine), and of its icons.
"""

import asyncio
import inspect
import logging
import math
import time
from collections.abc import Callable, Coroutine
from contextlib import suppress
from functools import cache
from types import SimpleNamespace
from typing import Any, Self, cast

import rich
import viser
import websockets.asyncio.server
import websockets.datastructures
import websockets.exceptions
from fastapi import WebSocket
from starlette.websockets import WebSocketDisconnect
from viser.infra import _infra

from pftrack_server.viewer import viser_messages as messages

Handler = Callable[[Any], Coroutine[Any, Any, None]]
Ending = tuple[int, str]

OPENING = "websockets.asyncio.server.serve("
"""How viser opens its port; checked before the first start of a server."""

MAXIMUM_BYTES = 16 * 1024
"""Largest message that a browser may send; a camera takes 300 bytes."""
MOST_HZ = 150.0
"""Sustained messages per second from a browser; one that drags a slider and turns the camera sends 120."""
BURST = 300
"""Messages that a browser may send in one burst."""

LATE_S = 0.2
"""Delay beyond a browser's shortest at which its answer is overdue, s."""
LOADING_S = 4.0
"""Assumed shortest delay of a browser that has never answered, s: it may still be loading."""
ASK_EVERY_S = 0.1

CLOSE_GOING_AWAY = 1001
CLOSE_UNSUPPORTED = 1003
CLOSE_TOO_BIG = 1009
CLOSE_INTERNAL_ERROR = 1011
CLOSE_TRY_LATER = 1013

FAST = 1e6
"""Factor on viser's clock: messages a microsecond apart seem a second apart, and viser's client smooths only below 100
ms."""

logger = logging.getLogger(__name__)


class Connection:
    """A browser's websocket, in the form that viser's connection handler expects.

    It replaces a `websockets.asyncio.server.ServerConnection`, of whose members viser uses `subprotocol`, `send`,
    `recv` and `close`. Messages pass unchanged: all from viser; from the browser only small ones of a kind that the
    scene and the panel need. The connection to the browser is not compressed: positions of particles hardly shrink, and
    deflating 50,000 of them takes ten times as long as sending them.

    Args:
        websocket: The accepted websocket.
        subprotocol: Subprotocol of client and viser, or None if the client offered no known one.
        looks_only: Whether the client may only move its own camera.
        on_free: Called when the browser has answered.

    Attributes:
        ending: Code and reason for closing the websocket, once viser's handler has ended.
    """

    def __init__(
        self,
        websocket: WebSocket,
        subprotocol: str | None,
        *,
        looks_only: bool = False,
        on_free: Callable[[], None] = lambda: None,
    ) -> None:
        self.subprotocol = subprotocol
        self.looks_only = looks_only
        self.ending: Ending = CLOSE_GOING_AWAY, "The scene has ended"
        self._websocket = websocket
        self._on_free = on_free
        self._taken_up = 0.0
        self._asked, self._best_s, self._overdue = -math.inf, LOADING_S, math.inf
        self._answered = asyncio.Event()

    @property
    def is_held(self) -> bool:
        """Whether sending is paused because an answer is overdue."""
        return time.monotonic() >= self._overdue

    async def send(self, message: bytes) -> None:
        """Send a message as soon as the browser can process it, and wait until it has left.

        Raises:
            ConnectionClosed: The browser has left.
        """
        while self.is_held:
            self._answered.clear()
            await self._answered.wait()
        try:
            await self._websocket.send_bytes(message)
            if self._overdue == math.inf and time.monotonic() >= self._asked + ASK_EVERY_S:
                await self._ask()
        except Exception:  # noqa: BLE001 - whatever it was, the message cannot be taken
            raise websockets.exceptions.ConnectionClosedError(None, None) from None

    async def recv(self) -> bytes:
        """Return the browser's next message for viser.

        Raises:
            ConnectionClosed: The browser has left, or has sent a forbidden message.
        """
        while True:
            message = await self._websocket.receive()
            await self._slow_down()
            data = message.get("bytes")
            if message["type"] == "websocket.disconnect":
                await self.close(CLOSE_GOING_AWAY, "The browser has left")
            elif data is None:
                await self.close(CLOSE_UNSUPPORTED, "Binary messages only")
            elif len(data) > MAXIMUM_BYTES:
                await self.close(CLOSE_TOO_BIG, f"A message must not exceed {MAXIMUM_BYTES} bytes")
            else:
                kind = messages.kind_of(data, looks_only=self.looks_only)
                if kind == messages.ANSWER:
                    self._note_answer()
                elif kind is not None:
                    return cast("bytes", data)
                continue
            raise websockets.exceptions.ConnectionClosedOK(None, None)

    async def close(self, code: int = CLOSE_GOING_AWAY, reason: str = "The scene has ended") -> None:
        """Note why the connection ends."""
        self.ending = code, reason

    async def _slow_down(self) -> None:
        """Wait, if messages arrive faster than allowed, until this one may be processed."""
        now = time.monotonic()
        self._taken_up = max(self._taken_up, now) + 1.0 / MOST_HZ
        await asyncio.sleep(self._taken_up - BURST / MOST_HZ - now)

    async def _ask(self) -> None:
        self._note_question()  # before it waits, so that at most one question is open
        await self._websocket.send_bytes(messages.question(FAST * time.perf_counter()))
        if self._overdue < math.inf:
            # Delays of the question itself, such as by a busy server, do not count.
            self._note_question()

    def _note_question(self) -> None:
        self._asked = time.monotonic()
        self._overdue = self._asked + self._best_s + LATE_S

    def _note_answer(self) -> None:
        if self._overdue < math.inf:
            self._best_s = min(time.monotonic() - self._asked, self._best_s)
            self._overdue = math.inf
            self._answered.set()
            self._on_free()


class Endpoint:
    """The entry to one viser server, in place of a host and a port.

    Pass it to `viser.ViserServer` as its host, after `install`. Use it only in the loop of the server.
    """

    def __init__(self) -> None:
        self.is_open = True
        self._handler: Handler | None = None
        self._opened, self._closed = asyncio.Event(), asyncio.Event()
        self._free = asyncio.Event()
        self._connections: dict[asyncio.Task[None], Connection] = {}

    async def serve(self, websocket: WebSocket, subprotocol: str | None, *, looks_only: bool = False) -> Ending:
        """Have viser serve a browser until one of them leaves; return why to close its websocket.

        Args:
            websocket: The accepted websocket.
            subprotocol: The client's subprotocol for viser.
            looks_only: Whether the client may only move its own camera.
        """
        connection = Connection(websocket, subprotocol, looks_only=looks_only, on_free=self._free.set)
        await self._opened.wait()
        if not self.is_open or self._handler is None:
            return connection.ending
        task = asyncio.ensure_future(self._handler(connection))
        self._connections[task] = connection
        self._free.set()
        try:
            await asyncio.wait([task])
        finally:
            task.cancel()
            (failure,) = await asyncio.gather(task, return_exceptions=True)
            del self._connections[task]
        if isinstance(failure, Exception):
            logger.error("a connection to the scene failed", exc_info=failure)
            return CLOSE_INTERNAL_ERROR, "The scene has failed"
        return connection.ending

    async def wait_for_browser(self) -> None:
        """Wait until there is a browser that keeps up with its messages."""
        while all(connection.is_held for connection in self._connections.values()):
            self._free.clear()
            await self._free.wait()

    async def wait_closed(self) -> None:
        """Wait until the server has ended and all browsers have left."""
        await self._closed.wait()

    def serving(self, handler: Handler) -> Self:
        """Return a context, entered and left in the server's loop, in which a handler serves connections."""
        self._handler = handler
        return self

    async def __aenter__(self) -> SimpleNamespace:
        self._opened.set()
        # viser asks a server for its sockets, to learn its port; there are none.
        return SimpleNamespace(server=SimpleNamespace(sockets=()))

    async def __aexit__(self, *_: object) -> None:
        self.is_open = False
        for task in self._connections:
            task.cancel()
        await asyncio.gather(*self._connections, return_exceptions=True)
        self._closed.set()


async def bridge(websocket: WebSocket, endpoint: Endpoint, *, looks_only: bool = False) -> None:
    """Connect a browser to the viser server of its session until one of them leaves.

    The caller must have checked Origin, session and rights.

    Args:
        websocket: The websocket, not yet accepted.
        endpoint: The viewer's endpoint.
        looks_only: Whether the browser may move its camera and nothing else.
    """
    if not endpoint.is_open:
        await websocket.close(CLOSE_TRY_LATER, "The scene is not ready")
        return
    offered = (name for name in websocket.scope.get("subprotocols", []) if name.startswith("viser-v"))
    subprotocol = next(offered, None)
    try:
        await websocket.accept(subprotocol=subprotocol)
    except OSError:
        # The browser left while the scene was made; before it is accepted, Starlette raises another error for that.
        return
    ending = await endpoint.serve(websocket, subprotocol, looks_only=looks_only)
    with suppress(RuntimeError, WebSocketDisconnect):  # the browser has already left
        await websocket.close(*ending)


def start(title: str) -> tuple[viser.ViserServer, Endpoint]:
    """Start a server in the running loop, without tunnel, uploads and smoothing; return it and its endpoint.

    Args:
        title: Heading of its panel.

    Raises:
        RuntimeError: No loop runs here, or the installed viser cannot be kept from opening a port.
    """
    install()
    asyncio.get_running_loop()
    endpoint = Endpoint()
    with rich.get_console().capture():  # viser prints a banner, and standard output belongs to the command
        server = viser.ViserServer(cast("str", endpoint), 0, label=title, verbose=False)
    messages.remove_handlers(server)
    messages.drop_bad_values(server)
    return server, endpoint


def connection_of(client: viser.ClientHandle) -> Connection | None:
    """Return a browser's connection, or None if it has left."""
    live = client._viser_server._websock_server._live_connections  # noqa: SLF001 - there is no public way
    return cast("Connection | None", live.get(client.client_id))


@cache
def install() -> None:
    """Make viser serve an `Endpoint` in the running loop if it gets one in place of a host.

    Raises:
        RuntimeError: This version of viser opens its port in another way; it must not be started.
    """
    if OPENING not in inspect.getsource(_infra.WebsockServer._background_worker):  # noqa: SLF001 - all this is private
        raise RuntimeError(
            f"viser {viser.__version__} does not open its port by {OPENING}...), so it cannot be kept from "
            "listening; install a version that this server knows"
        )
    _infra.websockets = SimpleNamespace(  # type: ignore[attr-defined,assignment]  # a module of viser's own, as those below
        asyncio=SimpleNamespace(server=SimpleNamespace(serve=_serve)),
        datastructures=websockets.datastructures,
        exceptions=websockets.exceptions,
    )
    loops = {"new_event_loop": _new_event_loop, "set_event_loop": _set_event_loop}
    _infra.asyncio = SimpleNamespace(**{**vars(asyncio), **loops})  # type: ignore[attr-defined,assignment]
    # viser's client spaces out messages by the server's times of sending. One late message delays all that follow, by
    # up to a tenth of a second, for seconds. No public option turns that off.
    _infra.time = SimpleNamespace(perf_counter=lambda: FAST * time.perf_counter())  # type: ignore[attr-defined,assignment]
    _infra.WebsockServer.start = _start  # type: ignore[method-assign,assignment]


def _serve(handler: Handler, host: object, port: int, **options: Any) -> Any:  # noqa: ANN401 - as websockets' own
    """Stand in for `websockets.asyncio.server.serve`."""
    if isinstance(host, Endpoint):
        return host.serving(handler)
    return websockets.asyncio.server.serve(handler, host, port, **options)  # type: ignore[arg-type]


_start_thread = _infra.WebsockServer.start
_NO_THREAD: Any = SimpleNamespace(release=lambda: None, join=lambda timeout: timeout)
"""Stand-in for viser's thread, and for the semaphore by which the thread reports that it is ready."""


def _start(server: _infra.WebsockServer) -> None:
    """Stand in for `WebsockServer.start`, which works in a thread with a loop of its own."""
    if not isinstance(server._host, Endpoint):  # noqa: SLF001
        _start_thread(server)
        return
    server._server_thread = _NO_THREAD  # noqa: SLF001
    with suppress(_RunsElsewhere):
        server._background_worker(_NO_THREAD)  # noqa: SLF001


class _RunsElsewhere(Exception):  # noqa: N818 - not an error
    """Raised to leave viser's thread where its work would begin."""


class _RunningLoop:
    """The running loop, in the role of viser's own loop."""

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        self._loop = loop

    def __getattr__(self, name: str) -> Any:  # noqa: ANN401 - whatever viser asks of a loop
        return getattr(self._loop, name)

    def run_until_complete(self, work: Coroutine[Any, Any, None]) -> None:
        """Begin the work as a task."""
        self._work = self._loop.create_task(work)
        raise _RunsElsewhere


def _new_event_loop() -> asyncio.AbstractEventLoop | _RunningLoop:
    running = asyncio._get_running_loop()  # noqa: SLF001 - None in viser's own threads
    return asyncio.new_event_loop() if running is None else _RunningLoop(running)


def _set_event_loop(loop: asyncio.AbstractEventLoop | _RunningLoop) -> None:
    if not isinstance(loop, _RunningLoop):
        asyncio.set_event_loop(loop)
