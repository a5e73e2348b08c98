"""Serving: `pftrack serve` from the settings to the end of the server.

Silent connections do not block others. A client has some seconds to send the head of a request, whose length is
limited, and some to send the next request after an answer. When connections nearly use up the process's open files,
those silent for longest are closed. A page that does not answer a ping within 20 s loses its websocket. On Linux a
connection ends when its client stops reading an answer; one that reads a little now and then, or waits for a late
answer, stays. Bodies have a limit of their own (`pftrack_server.core.requests`); handling slow clients is left to a
proxy.
"""

import asyncio
import errno
import gc
import logging
import signal
import socket
import sys
import time
from collections.abc import Callable, Mapping
from http import HTTPStatus
from typing import Any, NoReturn

import structlog
import uvicorn
from fastapi import FastAPI
from pydantic import ValidationError
from starlette.types import ASGIApp
from uvicorn.protocols.http.httptools_impl import STATUS_LINE, HttpToolsProtocol
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol

from pftrack_server.core.errors import response, shape
from pftrack_server.core.resource_limits import most_connections, name_cpu_limit, notices, too_few_files
from pftrack_server.core.settings import Settings
from pftrack_server.store import Store

log = structlog.get_logger(__name__)

GRACE_S = 5
FAILED, WRONG_USE = 1, 2

HEAD_S = 20.0
"""Time for the head of a request, s."""
UNTAKEN_S = 120.0
"""Longest time in which a client reads nothing of an answer, s; uvicorn would wait for ever."""
LARGEST_HEAD = 64 * 1024
LARGEST_MESSAGE = 64 * 1024
CLOSING = {"connection": "close"}


class Connection(HttpToolsProtocol):
    """A uvicorn connection that ends if no request arrives."""

    silent_since: float | None = None
    """When it began to wait for a request; None while it serves one."""
    _deadline: asyncio.TimerHandle | None = None
    _head_bytes: int | None = None
    """Length of the head so far; None while no head is arriving."""

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]  # as uvicorn's own
        """Begin to wait; if there are too many connections, close the one that has waited longest."""
        super().connection_made(transport)
        self._wait()
        if len(self.connections) > most_connections():
            known = [each for each in self.connections if isinstance(each, Connection) and each is not self]
            silent = [(each.silent_since, each) for each in known if each.silent_since is not None]
            if silent:
                min(silent, key=lambda pair: pair[0])[1].transport.abort()

    def connection_lost(self, exc: Exception | None) -> None:
        """Stop waiting."""
        self._on_activity()
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        """Close the connection if the head is too long."""
        super().data_received(data)
        if self._head_bytes is not None:
            self._head_bytes += len(data)
            if self._head_bytes > LARGEST_HEAD:
                self.transport.abort()

    def send_400_response(self, msg: str) -> None:
        """Refuse invalid HTTP or an invalid address in the one shape of errors."""
        del msg  # plain text
        answer = response(HTTPStatus.BAD_REQUEST, shape("The request is not valid HTTP"), CLOSING)
        lines = [STATUS_LINE[answer.status_code], *(b"%b: %b\r\n" % header for header in answer.raw_headers), b"\r\n"]
        self.transport.write(b"".join(lines) + bytes(answer.body))
        self.transport.close()

    def on_message_begin(self) -> None:
        """Start the time limit for the rest of the head."""
        super().on_message_begin()
        self._head_bytes = 0
        self._wait()

    def on_headers_complete(self) -> None:
        """Stop waiting: a request has arrived."""
        super().on_headers_complete()
        self._head_bytes = None
        self._on_activity()

    def on_response_complete(self) -> None:
        """Wait for the next request: any byte, even of an unread body, would cancel uvicorn's own deadline."""
        has_next = bool(self.pipeline)
        super().on_response_complete()
        if not has_next:
            self._wait()

    def _wait(self) -> None:
        self._on_activity()
        self.silent_since = time.monotonic()
        self._deadline = self.loop.call_later(HEAD_S, self.transport.abort)

    def _on_activity(self) -> None:
        self.silent_since = None
        if self._deadline is not None:
            self._deadline.cancel()
            self._deadline = None


class WebSocketConnection(WebSocketsSansIOProtocol):
    """A uvicorn websocket that ends if a ping is not answered."""

    def keepalive_timeout(self) -> None:
        """End it at once: uvicorn waits until everything is read, for ever if the page reads nothing."""
        self.transport.abort()


def configuration(app: ASGIApp, **more: Any) -> uvicorn.Config:  # noqa: ANN401 - uvicorn's own options
    """Return uvicorn's configuration.

    Args:
        app: The app to serve.
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


class AnnouncingServer(uvicorn.Server):
    """A server that prints its link once it can be reached."""

    def __init__(self, config: uvicorn.Config, settings: Settings) -> None:
        super().__init__(config)
        self._settings = settings

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Start, and print the link."""
        await super().startup(sockets)
        gc.freeze()
        gc.enable()
        if self.started and sockets:
            print(f"pftrack is at {self._settings.link(sockets[0].getsockname()[1])}", flush=True)  # noqa: T201

    def stop(self, reason: str) -> None:
        """Stop as after Ctrl-C, and print the reason."""
        if not self.should_exit:
            print(reason, file=sys.stderr, flush=True)  # noqa: T201
        self.should_exit = True

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Stop, without waiting for a request that decodes an upload."""
        if self.started:
            self.config.app.state.services.stopping.set()  # type: ignore[union-attr]  # what `create_app` has made
        await super().shutdown(sockets)


def run(create_app: Callable[[Settings], FastAPI], given: Mapping[str, object]) -> None:
    """Serve until the server is stopped.

    Args:
        create_app: Makes the app.
        given: Settings from the command line, which override those of the environment.
    """
    try:
        settings = Settings(**given)  # type: ignore[arg-type]  # validated within
    except ValidationError as error:
        first = error.errors()[0]
        name, said = "".join(map(str, first["loc"][:1])), first["msg"].removeprefix("Value error, ")
        source = f"--{name.replace('_', '-')}" if name in given else f"PFTRACK_{name.upper()}"
        if first["type"] != "value_error":  # a bound, in pydantic's words
            _fail(f"{source} {said.replace('Input should', 'must')}, got {first['input']!r}", WRONG_USE)
        _fail(f"{source}: {said}" if name else said, WRONG_USE)
    _log_to_stderr()
    # An orderly end also before the server has started.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
    if lacking := too_few_files():
        _fail(lacking)
    for notice in notices():
        log.warning(notice)
    _claim(settings)
    listening = _listen(settings)
    server = AnnouncingServer(configuration(create_app(settings), timeout_graceful_shutdown=GRACE_S), settings)
    name_cpu_limit(server.stop)
    try:
        server.run(sockets=[listening])
    except KeyboardInterrupt:
        sys.exit(0)
    if not server.started:
        sys.exit(1)


def _claim(settings: Settings) -> None:
    """Check data directory and database before anything starts, so that a fault gives one sentence on the terminal."""
    try:
        Store(settings).close()
    except RuntimeError as error:
        _fail(str(error))
    except OSError as error:
        _fail(f"The data directory {settings.data_dir} cannot be used ({error.strerror}); choose one with --data-dir.")


def _listen(settings: Settings) -> socket.socket:
    """Bind the port here, so that a port in use gives one sentence on the terminal."""
    listening = socket.socket(socket.AF_INET6 if ":" in settings.host else socket.AF_INET, socket.SOCK_STREAM)
    listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    if sys.platform == "linux":  # accepted connections inherit it
        listening.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, int(1000 * UNTAKEN_S))
    try:
        listening.bind((settings.host, settings.port))
        listening.listen(2048)
    except OSError as error:
        listening.close()
        if isinstance(error, socket.gaierror):
            _fail(f"{settings.host!r} is not an address; give --host one of this machine, such as 127.0.0.1.")
        reasons = {
            "EADDRINUSE": f"Port {settings.port} is in use; stop the program that uses it, or choose another --port.",
            "EACCES": f"This user may not listen on port {settings.port}; choose a --port above 1023.",
            "EADDRNOTAVAIL": f"{settings.host} is not an address of this machine; give --host one that is.",
        }
        name = errno.errorcode.get(error.errno or 0, "")
        _fail(reasons.get(name, f"The server cannot listen at {settings.host}:{settings.port} ({error.strerror})."))
    return listening


def _fail(message: str, status: int = FAILED) -> NoReturn:
    print(f"pftrack: {message}", file=sys.stderr)  # noqa: T201
    sys.exit(status)


def _log_to_stderr() -> None:
    structlog.configure(
        processors=[
            structlog.processors.add_log_level,
            structlog.processors.TimeStamper(fmt="iso", utc=True),
            structlog.processors.format_exc_info,
            structlog.processors.LogfmtRenderer(key_order=["timestamp", "level", "event"], bool_as_flag=False),
        ],
        wrapper_class=structlog.make_filtering_bound_logger(logging.INFO),
        logger_factory=structlog.PrintLoggerFactory(sys.stderr),
    )
    logging.basicConfig(level=logging.WARNING, stream=sys.stderr)
    # uvicorn logs every websocket that is refused before its handshake as an error of the app.
    logging.getLogger("uvicorn.error").addFilter(lambda record: "without completing handshake" not in record.msg)
