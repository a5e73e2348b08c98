"""Errors: the exceptions that become answers to a client, and the one shape of these answers.

`{"error": {"message": ..., "field"?: ..., "bound"?: ..., "value"?: ...}}`, with a message that says what was wrong and
what is allowed, and never a path or a stack.
"""

import json
import math
from http import HTTPStatus
from typing import Any

from pydantic import BaseModel
from starlette.responses import Response

from pftrack.core.refusal import ConflictError, ParameterError, RefusedError

LONGEST_VALUE = 200


class ErrorDetail(BaseModel):
    """The error in a sentence, and its place."""

    message: str
    field: str | None = None
    bound: str | None = None
    value: Any = None


class ErrorBody(BaseModel):
    """The one shape of every error."""

    error: ErrorDetail


class ApiError(RefusedError):
    """A refusal of the server, with its own HTTP status."""

    status: int = HTTPStatus.BAD_REQUEST


class GoneError(ApiError):
    """The resource existed and has ended, or its record cannot be read and can only be deleted."""

    status = HTTPStatus.GONE


class ForbiddenError(ApiError):
    """The client has no right to do this."""

    status = HTTPStatus.FORBIDDEN


class CrowdedError(ApiError):
    """A limit on clients or connections is reached."""

    status = HTTPStatus.TOO_MANY_REQUESTS


class NotFoundError(ApiError):
    """The resource does not exist, or no longer."""

    status = HTTPStatus.NOT_FOUND


class TooLargeError(ApiError):
    """The body or file has more bytes than allowed."""

    status = HTTPStatus.REQUEST_ENTITY_TOO_LARGE


class DiskFullError(ApiError):
    """The disk, or the server's share of it, is full."""

    status = HTTPStatus.INSUFFICIENT_STORAGE


class ClientGoneError(ApiError):
    """The client hung up before the answer was ready."""

    status = 499  # as web servers write it down, in no standard


class UnavailableError(ApiError):
    """The server cannot do this now, but may later."""

    status = HTTPStatus.SERVICE_UNAVAILABLE


def status_of(error: RefusedError) -> int:
    """Return the HTTP status of the answer to a refusal."""
    usual = HTTPStatus.CONFLICT if isinstance(error, ConflictError) else HTTPStatus.UNPROCESSABLE_ENTITY
    return error.status if isinstance(error, ApiError) else usual


def detail_of(error: RefusedError) -> dict[str, Any]:
    """Return the inside of the error shape; a sentence that begins with no name of a field begins large."""
    message = str(error)
    # A parameter's name may be empty, where somebody sends one; other refusals have no field then.
    if not (error.field or isinstance(error, ParameterError)):
        return shape(message[:1].upper() + message[1:])
    if not message.startswith(error.field):
        message = message[:1].upper() + message[1:]
    return shape(message, field=error.field, bound=error.bound, value=error.value)


def shape(message: str, **detail: object) -> dict[str, Any]:
    """Return the inside of an error: the message and what is known of field, bound and value, safe for JSON."""
    return {"message": message, **{key: _plain(value) for key, value in detail.items() if value is not None}}


def response(status: int, detail: dict[str, Any], headers: dict[str, str] | None = None) -> Response:
    """Return the answer that carries an error."""
    # ASCII escapes let even half a surrogate pair of a client's own text travel back to it.
    body = json.dumps({"error": detail}, ensure_ascii=True, allow_nan=False)
    return Response(body, status_code=status, media_type="application/json", headers=headers)


def _plain(value: object) -> object:
    """Return what JSON can carry of a value that somebody sent."""
    if value is None or isinstance(value, bool):
        return value
    if isinstance(value, int):
        return value if abs(value) < 2**53 else _short(str(value))
    if isinstance(value, float):
        return value if math.isfinite(value) else str(value)
    return _short(value if isinstance(value, str) else repr(value))


def _short(text: str) -> str:
    return text if len(text) <= LONGEST_VALUE else f"{text[: LONGEST_VALUE - 1]}…"
