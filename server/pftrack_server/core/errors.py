"""Errors: exceptions that become answers to a client, and the one shape of these answers.

`{"error": {"message": ..., "field"?: ..., "bound"?: ..., "value"?: ...}}`, whose message says what was wrong and what
is allowed, without a path or a stack trace.
"""

import json
import math
from functools import partial
from http import HTTPStatus
from typing import Any

from pydantic import BaseModel
from starlette.responses import Response
from starlette.websockets import WebSocket, WebSocketState

from pftrack.core.refusal import ConflictError, ParameterError, RefusedError

LONGEST_VALUE = 200


class ErrorDetail(BaseModel):
    """The error in a sentence, and the field that it concerns."""

    message: str
    field: str | None = None
    bound: str | None = None
    value: Any = None


class ErrorBody(BaseModel):
    """The one shape of every error."""

    error: ErrorDetail


class ApiError(RefusedError):
    """A refusal of the server, with its own HTTP status."""

    def __init__(self, message: str, status: int = HTTPStatus.BAD_REQUEST) -> None:
        super().__init__(message)
        self.status = status


unauthorized = partial(ApiError, status=HTTPStatus.UNAUTHORIZED)
"""The client is not authenticated."""
forbidden = partial(ApiError, status=HTTPStatus.FORBIDDEN)
"""The client has no right to do this."""
not_found = partial(ApiError, status=HTTPStatus.NOT_FOUND)
"""The resource does not exist (any more)."""
gone = partial(ApiError, status=HTTPStatus.GONE)
"""The resource existed and has ended, or its record cannot be read and can only be deleted."""
too_large = partial(ApiError, status=HTTPStatus.REQUEST_ENTITY_TOO_LARGE)
"""The body or file has more bytes than allowed."""
too_many = partial(ApiError, status=HTTPStatus.TOO_MANY_REQUESTS)
"""A limit on clients or connections is reached."""
client_gone = partial(ApiError, status=499)
"""The client hung up before the answer was ready; web servers log this status, which is in no standard."""
unavailable = partial(ApiError, status=HTTPStatus.SERVICE_UNAVAILABLE)
"""The server cannot do this now, but may later."""
disk_full = partial(ApiError, status=HTTPStatus.INSUFFICIENT_STORAGE)
"""The disk, or the server's share of it, is full."""

ENDED = 4404
CLOSE_CODES: dict[int, int] = {HTTPStatus.GONE: ENDED, HTTPStatus.UNAUTHORIZED: 4403}
"""Close codes of websockets by HTTP status; any other status has the code 4000 plus the status."""
MOST_REASON_BYTES = 123
"""Most bytes of a reason in a close frame (RFC 6455, section 5.5)."""


def status_of(error: RefusedError) -> int:
    """Return the HTTP status of the answer to a refusal."""
    usual = HTTPStatus.CONFLICT if isinstance(error, ConflictError) else HTTPStatus.UNPROCESSABLE_ENTITY
    return error.status if isinstance(error, ApiError) else usual


async def close(websocket: WebSocket, status: int, message: str) -> None:
    """Close a websocket with the status and message that a request would get."""
    # A browser sees code and reason only on an accepted socket.
    if websocket.application_state is WebSocketState.CONNECTING:
        await websocket.accept()
    reason = message.encode()[:MOST_REASON_BYTES].decode(errors="ignore")
    await websocket.close(CLOSE_CODES.get(status, 4000 + status), reason)


def detail_of(error: RefusedError) -> dict[str, Any]:
    """Return the inside of the error shape; the message is capitalised unless it begins with the name of a field."""
    message = str(error)
    # A parameter's name may be empty if a client sends an empty one; other refusals without a name have no field.
    if not (error.field or isinstance(error, ParameterError)):
        return shape(message[:1].upper() + message[1:])
    if not message.startswith(error.field):
        message = message[:1].upper() + message[1:]
    return shape(message, field=error.field, bound=error.bound, value=error.value)


def shape(message: str, **detail: object) -> dict[str, Any]:
    """Return the inside of an error: the message, with field, bound and value where they are known, safe for JSON."""
    return {"message": message, **{key: _plain(value) for key, value in detail.items() if value is not None}}


def response(status: int, detail: dict[str, Any], headers: dict[str, str] | None = None) -> Response:
    """Return the answer that carries an error."""
    # With ASCII escapes even half a surrogate pair of a client's text can be sent back.
    body = json.dumps({"error": detail}, ensure_ascii=True, allow_nan=False)
    return Response(body, status_code=status, media_type="application/json", headers=headers)


def _plain(value: object) -> object:
    """Return a client's value in a form that JSON can carry, shortened if it is long."""
    if (isinstance(value, int) and abs(value) < 2**53) or (isinstance(value, float) and math.isfinite(value)):
        return value
    text = value if isinstance(value, str) else repr(value)
    return text if len(text) <= LONGEST_VALUE else f"{text[: LONGEST_VALUE - 1]}…"
