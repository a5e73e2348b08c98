"""Pages that are left before they are answered, by the page or by a server that stops."""

import asyncio
import socket
import threading
from collections.abc import AsyncIterator
from typing import Any

import pytest
import uvicorn
from fastapi import FastAPI, WebSocket
from starlette.types import Message, Send
from structlog.testing import capture_logs
from uvicorn.protocols.utils import ClientDisconnected

from pftrack_server.sessions.duplex import converse
from pftrack_server.web.errors import ErrorBoundary, install
from pftrack_server.web.serving import configuration
from tests.apart import run
from tests.waiting import wait_for


def test_a_page_that_is_left_is_no_error_of_the_system() -> None:
    """It is left to the server below, which ends the connection quietly, and the log says nothing of a disk."""
    app = FastAPI()
    install(app)

    @app.websocket("/stream")
    async def accept(socket: WebSocket) -> None:
        await socket.accept()

    async def receive() -> Message:
        return {"type": "websocket.connect"}

    async def send(_: Message) -> None:
        raise ClientDisconnected

    scope: dict[str, Any] = {"type": "websocket", "path": "/stream", "headers": [], "query_string": b""}
    with capture_logs() as logged, pytest.raises(ClientDisconnected):
        run(app(scope, receive, send))
    assert logged == []


async def test_a_request_that_the_end_of_the_server_cuts_off_is_answered() -> None:
    """Uvicorn cancels what takes too long when it stops; that is an answer, and no traceback."""
    sent: list[Message] = []

    async def wait_for_ever(*_: object) -> None:
        await asyncio.Event().wait()

    async def receive() -> Message:
        return {"type": "http.request"}

    async def send(message: Message) -> None:
        sent.append(message)

    async def begin(_scope: object, _receive: object, send: Send) -> None:
        await send({"type": "http.response.start", "status": 200, "headers": []})
        await wait_for_ever()

    for app in (wait_for_ever, begin):
        request = asyncio.ensure_future(ErrorBoundary(app)({"type": "http"}, receive, send))
        await asyncio.sleep(0)
        request.cancel()
        await asyncio.wait({request})
    assert [each.get("status") for each in sent] == [503, None, 200], "an answer that has begun is only cut off"
    assert b"being stopped" in sent[1]["body"]


OPENING = (
    b"GET /stream HTTP/1.1\r\nHost: here\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n"
    b"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n"
)


def test_a_page_that_takes_nothing_leaves_no_traceback() -> None:
    """It answers no ping, so its connection ends; what is still to be sent then ends the stream without an error."""
    app, ended = FastAPI(), threading.Event()

    @app.websocket("/stream")
    async def stream(websocket: WebSocket) -> None:
        await websocket.accept()
        await converse(websocket, messages(), "")
        ended.set()

    async def messages() -> AsyncIterator[bytes]:
        # More than the system takes, and less than makes uvicorn wait.
        yield bytes(55_000)
        while True:
            yield b"more"
            await asyncio.sleep(0.01)

    with socket.socket() as listening, socket.socket() as page, capture_logs() as logged:
        for each, size in ((listening, socket.SO_SNDBUF), (page, socket.SO_RCVBUF)):
            each.setsockopt(socket.SOL_SOCKET, size, 4096)
        listening.bind(("127.0.0.1", 0))
        server = uvicorn.Server(configuration(app, ws_ping_interval=0.1, ws_ping_timeout=0.1))
        serving = threading.Thread(target=server.run, kwargs={"sockets": [listening]})
        serving.start()
        try:
            wait_for(lambda: server.started)
            page.connect(listening.getsockname())
            page.sendall(OPENING)
            assert ended.wait(20)
            wait_for(lambda: not server.server_state.connections)
        finally:
            server.should_exit = True
            page.close()
            serving.join()
    assert logged == []
