"""What a refusal becomes: an answer of a status in the one shape, or a closed websocket of a code."""

from typing import Annotated, Any
from unittest.mock import AsyncMock

import httpx
import pytest
from fastapi import FastAPI, Path, WebSocket

from pftrack.core.refusal import ConflictError, ParameterError
from pftrack.sweep.axis import SweepError
from pftrack_server.core import errors
from pftrack_server.web.errors import install
from tests.apart import run


@pytest.mark.parametrize(
    ("error", "status", "code", "message"),
    [
        (ParameterError("frame", 12, "0 to 9"), 422, 4422, "frame must be 0 to 9, got 12"),
        (ConflictError("the run ends at frame 9"), 409, 4409, "The run ends at frame 9"),
        (errors.ApiError("Broken."), 400, 4400, "Broken."),
        (errors.unauthorized("Come in first."), 401, 4403, "Come in first."),
        (errors.forbidden("No right."), 403, 4403, "No right."),
        (errors.not_found("Not here."), 404, 4404, "Not here."),
        (errors.gone("Over."), 410, 4404, "Over."),
        (errors.too_large("Too large."), 413, 4413, "Too large."),
        (errors.too_many("Full."), 429, 4429, "Full."),
        (errors.client_gone("Left."), 499, 4499, "Left."),
        (errors.unavailable("Later."), 503, 4503, "Later."),
        (errors.disk_full("No room."), 507, 4507, "No room."),
        (SweepError("/data/one is damaged"), 410, 4404, "The files of this sweep are damaged or were removed."),
        (OSError(28, "No space left", "/data/one"), 507, 4507, "The server's disk is full; delete uploads, saved"),
    ],
)
async def test_what_a_refusal_becomes(error: Exception, status: int, code: int, message: str) -> None:
    """A request gets the status, a websocket the code, whether it was accepted before or not."""
    app = FastAPI()
    install(app)

    @app.get("/")
    def ask() -> None:
        raise error

    @app.websocket("/new")
    async def refuse(websocket: WebSocket) -> None:
        raise error

    @app.websocket("/accepted")
    async def end(websocket: WebSocket) -> None:
        await websocket.accept()
        raise error

    async with httpx.AsyncClient(transport=httpx.ASGITransport(app), base_url="http://127.0.0.1") as client:
        answer = await client.get("/")
    assert answer.status_code == status
    assert answer.json()["error"]["message"].startswith(message)
    for path in ("/new", "/accepted"):
        accepted, closed = await said(app, path)
        assert (accepted["type"], closed["type"], closed["code"]) == ("websocket.accept", "websocket.close", code)
        assert closed["reason"].startswith(message)


async def said(app: FastAPI, path: str) -> list[Any]:
    """Return the messages that an app sends to a new websocket."""
    send = AsyncMock()
    scope = {"type": "websocket", "path": path, "query_string": b"", "headers": []}
    await app(scope, AsyncMock(return_value={"type": "websocket.connect"}), send)
    return [call.args[0] for call in send.await_args_list]


def test_a_websocket_with_a_wrong_name_hears_why() -> None:
    """A name that its pattern refuses is closed with a code and a sentence, like an unknown name."""
    app = FastAPI()
    install(app)

    @app.websocket("/{name}")
    async def _stream(websocket: WebSocket, name: Annotated[str, Path(max_length=4)]) -> None:
        await websocket.accept()

    _, closed = run(said(app, "/" + "x" * 5))
    assert (closed["code"], closed["reason"]) == (4404, "This address has no stream.")
