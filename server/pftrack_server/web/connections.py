"""Connections: one that says nothing, or takes nothing, does not keep others out.

Whoever connects has some seconds to send the head of a request, which has a longest length, and whoever was answered
has some to send the next. When the process has nearly as many connections as it may have files, those that have been
silent for longest make room, and then those whose bodies come most slowly. A browser that takes nothing of what it
asked for is given up. Bodies have a limit of their own in `pftrack_server.core.body_limit`.
"""

import asyncio
import time
from http import HTTPStatus
from typing import Any

import uvicorn
from starlette.types import ASGIApp
from uvicorn.protocols.http.httptools_impl import STATUS_LINE, HttpToolsProtocol
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol

from pftrack_server.core.errors import response, shape
from pftrack_server.core.resource_limits import most_connections

HEAD_S = 20.0
"""Time for the head of a request."""
LARGEST_HEAD = 64 * 1024
TAKING_S = 120.0
"""Time in which something of what was sent must be taken; the system takes it from this process in large pieces."""
SLOW_S = 1.0
"""Time after which a body that has not ended is slow."""
LARGEST_MESSAGE = 64 * 1024
CLOSING = {"connection": "close"}


class _SilenceWatch(asyncio.Protocol):
    """A connection that ends when its other side takes nothing of what was sent."""

    transport: asyncio.Transport
    loop: asyncio.AbstractEventLoop
    _untaken_bytes = 0
    _next_look: asyncio.TimerHandle | None = None

    def pause_writing(self) -> None:
        """Look from now on whether anything is taken."""
        super().pause_writing()
        self._look_later()

    def resume_writing(self) -> None:
        """Look no longer."""
        self._look_no_longer()
        super().resume_writing()

    def connection_lost(self, exc: Exception | None) -> None:
        """Look no longer."""
        self._look_no_longer()
        super().connection_lost(exc)

    def _look(self) -> None:
        if self.transport.get_write_buffer_size() < self._untaken_bytes:
            self._look_later()
        else:
            self.transport.abort()

    def _look_later(self) -> None:
        self._untaken_bytes = self.transport.get_write_buffer_size()
        self._next_look = self.loop.call_later(TAKING_S, self._look)

    def _look_no_longer(self) -> None:
        if self._next_look is not None:
            self._next_look.cancel()
            self._next_look = None


class WebSocketConnection(_SilenceWatch, WebSocketsSansIOProtocol):
    """A websocket of uvicorn's that ends when nothing is taken."""


class Connection(_SilenceWatch, HttpToolsProtocol):
    """A connection of uvicorn's that ends when no request comes, or nothing of the answer is taken."""

    silent_since: float | None = None
    """When it began to wait for a request; None while there is one."""
    _deadline: asyncio.TimerHandle | None = None
    _head_bytes: int | None = None
    """Length of the head so far; None while none is coming."""
    _body_since: float | None = None
    """When a body began to come; None while none does."""
    _body_bytes = 0

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]  # as uvicorn's own
        """Begin to wait, in the place of one that has waited longer if there are too many."""
        super().connection_made(transport)
        self._wait()
        if len(self.connections) > most_connections() and (wanted_least := self._wanted_least()):
            wanted_least.transport.abort()

    def connection_lost(self, exc: Exception | None) -> None:
        """Wait no longer."""
        self._on_activity()
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        """Give up a head that is too long."""
        super().data_received(data)
        if self._head_bytes is not None:
            self._head_bytes += len(data)
            if self._head_bytes > LARGEST_HEAD:
                self.transport.abort()

    def send_400_response(self, msg: str) -> None:
        """Refuse what is not HTTP, or no address, in the shape of every error."""
        del msg  # plain text
        answer = response(HTTPStatus.BAD_REQUEST, shape("What was sent is no valid HTTP request"), CLOSING)
        lines = [STATUS_LINE[answer.status_code], *(b"%b: %b\r\n" % header for header in answer.raw_headers), b"\r\n"]
        self.transport.write(b"".join(lines) + bytes(answer.body))
        self.transport.close()

    def on_message_begin(self) -> None:
        """Give the rest of the head its time."""
        super().on_message_begin()
        self._head_bytes = 0
        self._wait()

    def on_headers_complete(self) -> None:
        """Wait no longer: there is a request."""
        super().on_headers_complete()
        self._head_bytes = None
        self._on_activity()

        self._body_since, self._body_bytes = time.monotonic(), 0

    def on_body(self, body: bytes) -> None:
        """Take note of how fast a body comes."""
        super().on_body(body)
        self._body_bytes += len(body)

    def on_message_complete(self) -> None:
        """Take note that the body is there."""
        super().on_message_complete()
        self._body_since = None

    def on_response_complete(self) -> None:
        """Wait for the next request: uvicorn's own deadline ends with any byte, as of a body that nobody reads."""
        has_next = bool(self.pipeline)
        super().on_response_complete()
        if not has_next:
            self._wait()

    def _wanted_least(self) -> "Connection | None":
        """Return the one that has waited longest for a request, else the one whose body comes most slowly; or none."""
        known = [each for each in self.connections if isinstance(each, Connection)]
        silent = [(each.silent_since, each) for each in known if each.silent_since is not None and each is not self]
        now = time.monotonic()
        slow = [
            (each._body_bytes / (now - each._body_since), each)  # noqa: SLF001 - of another one of its kind
            for each in known
            if each._body_since is not None and now - each._body_since > SLOW_S  # noqa: SLF001 - see above
        ]
        return min(silent or slow, key=lambda pair: pair[0], default=(0.0, None))[1]

    def _wait(self) -> None:
        self._on_activity()
        self.silent_since = time.monotonic()
        self._deadline = self.loop.call_later(HEAD_S, self._give_up)

    def _on_activity(self) -> None:
        self.silent_since = None
        if self._deadline is not None:
            self._deadline.cancel()
            self._deadline = None

    def _give_up(self) -> None:
        self.transport.abort()


def configuration(app: ASGIApp, **more: Any) -> uvicorn.Config:  # noqa: ANN401 - uvicorn's own options
    """Return how uvicorn serves the app.

    Args:
        app: What is served.
        **more: Further options of `uvicorn.Config`.
    """
    return uvicorn.Config(
        app,
        http=Connection,
        ws=WebSocketConnection,
        log_config=None,
        access_log=False,
        server_header=False,
        proxy_headers=False,
        ws_max_size=LARGEST_MESSAGE,
        # Particles hardly shrink, and deflating them takes ten times as long as sending them.
        ws_per_message_deflate=False,
        **more,
    )
