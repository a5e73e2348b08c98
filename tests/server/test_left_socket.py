"""A page that is left before its websocket is open."""

from typing import Any

import pytest
from fastapi import FastAPI, WebSocket
from starlette.types import Message
from structlog.testing import capture_logs
from uvicorn.protocols.utils import ClientDisconnected

from pftrack_server.middleware.errors import install
from tests.apart import run


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

    scope: dict[str, Any] = {
        "type": "websocket",
        "path": "/stream",
        "headers": [],
        "query_string": b"",
        "subprotocols": [],
    }
    with capture_logs() as logged, pytest.raises(ClientDisconnected):
        run(app(scope, receive, send))
    assert logged == []
