"""Streams between server and pages, the same for sessions, sweeps and classes.

A listener is one page's end of a stream: an asynchronous iterator of encoded messages, read at the page's own pace. A
session's listener queues messages, a sweep's looks for changes. `converse` sends the messages over a socket and
receives the page's replies.
"""

import asyncio
import contextlib
from abc import ABC, abstractmethod
from collections.abc import AsyncIterable, AsyncIterator, Callable, Iterator
from contextlib import contextmanager
from typing import Annotated, Generic, Literal, TypeVar

import structlog
from fastapi import WebSocket, WebSocketDisconnect
from pydantic import BaseModel, ConfigDict, Field, TypeAdapter

from pftrack_server.core.base_path import route_path
from pftrack_server.core.errors import ENDED

VERSION: Literal[1] = 1


class Message(BaseModel):
    """Base of all messages, with the version of the protocol and the type."""

    model_config = ConfigDict(frozen=True)

    version: Literal[1] = VERSION


class Pong(Message):
    """The answer to a ping; it returns the ping's time."""

    type: Literal["pong"] = "pong"
    sent: float


class Ping(Message):
    """A page's message on any stream, to measure the delay."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    type: Literal["ping"]
    sent: Annotated[float, Field(allow_inf_nan=False)]


class Painted(BaseModel):
    """A page's count of the drawings that it has painted or skipped since it connected."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    type: Literal["painted"]
    count: Annotated[int, Field(ge=0)]


PAGE_WORDS: TypeAdapter[Ping | Painted] = TypeAdapter(Annotated[Ping | Painted, Field(discriminator="type")])


def encode(message: Message) -> str:
    """Return a message as JSON text; a number that is not finite becomes null."""
    return message.model_dump_json()


log = structlog.get_logger(__name__)

FAILED = 1011
UNKNOWN_WORD = 1003
SLOWEST_LISTENER_S = 30.0
MOST_HZ = 150.0
"""Sustained messages per second that a page may send; one that paints every drawing of a fast run sends 60."""
BURST = 300
"""Messages that a page may send in one burst."""

One = TypeVar("One", bound="Listener")


class Listener(ABC):
    """One page's end of a stream.

    Attributes:
        news: Set when there may be a message to send.
        closed: Whether the stream ends after the remaining messages.
    """

    def __init__(self) -> None:
        self.news = asyncio.Event()
        self.news.set()
        self.closed = False

    def close(self) -> None:
        """End the stream after the remaining messages."""
        self.closed = True
        self.news.set()

    @abstractmethod
    def __aiter__(self) -> AsyncIterator[str | bytes]:
        """Yield messages as they arrive, the greeting first."""


class Listeners(Generic[One]):
    """All listeners of one stream."""

    def __init__(self) -> None:
        self._all: set[One] = set()

    def __len__(self) -> int:
        return len(self._all)

    def __iter__(self) -> Iterator[One]:
        return iter(self._all)

    @contextmanager
    def add(self, listener: One) -> Iterator[One]:
        """Add a listener while the context lasts."""
        self._all.add(listener)
        try:
            yield listener
        finally:
            self._all.discard(listener)

    def close(self) -> None:
        """End all streams."""
        for listener in self._all:
            listener.close()


async def converse(
    websocket: WebSocket,
    messages: AsyncIterable[str | bytes],
    farewell: str,
    painted: Callable[[int], None] | None = None,
) -> None:
    """Send a page all messages and answer its pings, until one of the two leaves.

    Args:
        websocket: The accepted socket of the page.
        messages: Messages to send; the stream ends with them.
        farewell: Reason to give when the stream ends.
        painted: Called with the number of drawings that the page has painted, if it receives drawings; raises a
            ValueError for an impossible number.
    """
    directions = [
        asyncio.ensure_future(each) for each in (_tell(websocket, messages, farewell), _listen(websocket, painted))
    ]
    try:
        await asyncio.wait(directions, return_when=asyncio.FIRST_COMPLETED)
    finally:
        for each in directions:
            each.cancel()
        await asyncio.gather(*directions, return_exceptions=True)


async def _tell(websocket: WebSocket, messages: AsyncIterable[str | bytes], farewell: str) -> None:
    try:
        async for message in messages:
            if not await _send(websocket, message):
                return
    except Exception:
        # Without a close the page would wait for ever; so it reconnects and learns what is wrong.
        log.exception("a stream failed", path=route_path(websocket.scope))
        await websocket.close(FAILED, "The server failed unexpectedly; details are in its log.")
        return
    await websocket.close(ENDED, farewell)


async def _send(websocket: WebSocket, message: str | bytes) -> bool:
    """Send a message; return whether the page took it."""
    try:
        # A peer that takes nothing for this long is gone, even if its TCP connection is open.
        async with asyncio.timeout(SLOWEST_LISTENER_S):
            await (websocket.send_text(message) if isinstance(message, str) else websocket.send_bytes(message))
    except (TimeoutError, WebSocketDisconnect, RuntimeError):  # uvicorn raises the last where no ping was answered
        return False
    return True


async def _listen(websocket: WebSocket, painted: Callable[[int], None] | None) -> None:
    """Receive the page's messages at the allowed rate, until it leaves or sends one that is not allowed."""
    loop = asyncio.get_running_loop()
    # When the messages so far would be used up at the allowed rate.
    taken_up = loop.time()
    with contextlib.suppress(WebSocketDisconnect):
        while True:
            message = await websocket.receive()
            taken_up = max(taken_up, loop.time()) + 1.0 / MOST_HZ
            if taken_up - BURST / MOST_HZ > loop.time():
                await asyncio.sleep(taken_up - BURST / MOST_HZ - loop.time())
            if message["type"] == "websocket.disconnect":
                return
            try:
                words = PAGE_WORDS.validate_json(message.get("text") or "")
                if isinstance(words, Ping):
                    await _send(websocket, encode(Pong(sent=words.sent)))
                elif painted is None:
                    raise ValueError("no drawings were sent")  # noqa: TRY301 - refused like all that is not for it
                else:
                    painted(words.count)
            except ValueError:
                await websocket.close(UNKNOWN_WORD, "The stream takes no commands; use the REST interface.")
                return
