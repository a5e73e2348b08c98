"""Every exception becomes an answer in the one shape of errors, even an unexpected one."""

import asyncio
import contextlib
import re
import sys
from http import HTTPStatus
from typing import Any

import structlog
from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError, WebSocketRequestValidationError
from sqlalchemy.exc import DBAPIError
from starlette.exceptions import HTTPException
from starlette.requests import HTTPConnection
from starlette.responses import Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from starlette.websockets import WebSocket, WebSocketDisconnect
from uvicorn.protocols.utils import ClientDisconnected

from pftrack.core.refusal import RefusedError, first_problem
from pftrack.sweep.axis import SweepError
from pftrack_server.core.base_path import route_path
from pftrack_server.core.errors import close, detail_of, response, shape, status_of
from pftrack_server.store.disk_budget import describe

log = structlog.get_logger(__name__)


class ErrorBoundary:
    """ASGI middleware that catches unexpected exceptions: it logs them whole, and answers without path and stack."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on, and answer it if it fails."""
        begun = False

        async def note_start(message: Message) -> None:
            nonlocal begun
            begun = begun or message["type"] == "http.response.start"
            await send(message)

        try:
            await self._app(scope, receive, note_start)
        except asyncio.CancelledError:
            # Only the end of the server cancels a request; uvicorn would log a traceback.
            if scope["type"] != "http" or begun:
                raise
            message = "The server is shutting down. Try again after its restart."
            await response(HTTPStatus.SERVICE_UNAVAILABLE, shape(message))(scope, receive, send)
        except Exception:
            if scope["type"] != "http":
                raise
            log.exception("unexpected", path=route_path(scope))
            if begun:
                raise
            message = "The server failed unexpectedly; details are in its log. Try again, or reload the page."
            await response(HTTPStatus.INTERNAL_SERVER_ERROR, shape(message))(scope, receive, send)


def install(app: FastAPI) -> None:
    """Make an app answer every exception in the one shape."""

    @app.exception_handler(RefusedError)
    async def _refused(connection: HTTPConnection, error: RefusedError) -> Response | None:
        return await _answer(connection, status_of(error), detail_of(error))

    @app.exception_handler(SweepError)
    async def _sweep(connection: HTTPConnection, error: SweepError) -> Response | None:
        # The library's message names paths.
        log.error("sweep", path=route_path(connection.scope), exc_info=error)
        detail = shape("The files of this sweep are damaged or were removed.")
        return await _answer(connection, HTTPStatus.GONE, detail)

    @app.exception_handler(OSError)
    @app.exception_handler(DBAPIError)
    async def _system(connection: HTTPConnection, error: Exception) -> Response | None:
        # An operating system's message names paths.
        status, message = describe(error)
        unknown = status == HTTPStatus.INTERNAL_SERVER_ERROR
        log.error("system", path=route_path(connection.scope), error=message, exc_info=error if unknown else None)
        return await _answer(connection, status, shape(message))

    @app.exception_handler(RequestValidationError)
    async def _request(_: Request, error: RequestValidationError) -> Response:
        return response(HTTPStatus.UNPROCESSABLE_ENTITY, _first(error))

    @app.exception_handler(HTTPException)
    async def _http(request: Request, error: HTTPException) -> Response:
        if "integer string conversion" in str(error.__cause__):
            return response(HTTPStatus.UNPROCESSABLE_ENTITY, _long_number(await request.body()))
        return response(error.status_code, shape(_sentence(error)), dict(error.headers or {}))

    @app.exception_handler(WebSocketRequestValidationError)
    async def _socket(websocket: WebSocket, _: WebSocketRequestValidationError) -> None:
        await _answer(websocket, HTTPStatus.NOT_FOUND, shape("This address has no stream."))

    app.add_exception_handler(ClientDisconnected, _leave)
    # The innermost middleware, so that the answer passes through those that add headers and count.
    app.add_middleware(ErrorBoundary)


async def _answer(connection: HTTPConnection, status: int, detail: dict[str, Any]) -> Response | None:
    """Return the answer to a request, or close a websocket with a code and the message."""
    if not isinstance(connection, WebSocket):
        return response(status, detail)
    with contextlib.suppress(WebSocketDisconnect, RuntimeError):  # the page has left
        await close(connection, status, detail["message"])
    return None


async def _leave(_: Request, error: Exception) -> Response:
    # An OSError, but not of this machine: uvicorn ends the connection, and no client waits for an answer.
    raise error


def _long_number(body: bytes) -> dict[str, Any]:
    """Return the error for a whole number with too many digits; its field is the last name before it."""
    most = sys.get_int_max_str_digits()
    before = re.split(rb"(?<!\d)\d{%d}" % (most + 1), body, maxsplit=1)[0]
    names = re.findall(rb'"([^"]*)"\s*:', before)
    name = names[-1].decode(errors="replace") if names else None
    bound = f"a number of at most {most} digits"
    return shape(f"{name or 'The body'} must be {bound}", field=name, bound=bound)


def _sentence(error: HTTPException) -> str:
    if error.status_code == HTTPStatus.NOT_FOUND:
        return "This address has no page or resource."
    if error.status_code == HTTPStatus.METHOD_NOT_ALLOWED:
        allowed = (error.headers or {}).get("Allow", "another")
        return f"This address does not allow this method; allowed: {allowed}."
    return str(error.detail)


def _first(error: RequestValidationError) -> dict[str, Any]:
    """Return the first error of a request, with the name of its field."""
    try:
        first = first_problem(error.errors())
    except RefusedError as refused:
        return detail_of(refused)
    # Fields of a recipe or a command are named as in the library's own refusals.
    kind = error.body.get("kind") if isinstance(error.body, dict) else None
    where = [str(part) for part in first["loc"] if part not in {"body", "query", "path", "recipe"}]
    where = where[1:] if where[:1] == [kind] else where
    field = ".".join(where) or first.get("ctx", {}).get("discriminator", "").strip("'") or None
    said = str(first["msg"]).removeprefix("Value error, ")
    bound = said.removeprefix("Input should be ").removeprefix("String should ")
    if first["type"] in {"json_invalid", "model_attributes_type", "dict_type"} and not where:
        return shape("The body must be a JSON object")
    if first["type"] == "json_invalid":
        return shape(f"The body must be JSON ({first.get('ctx', {}).get('error', 'it does not parse')})")
    if first["type"] in {"missing", "union_tag_not_found"}:
        return shape(f"{field or 'The body'} is missing", field=field, bound="given")
    if first["type"] == "extra_forbidden":
        return shape(f"{field} is unknown", field=field, bound="one of the documented fields")
    return shape(
        f"{field or 'The body'}: {said[:1].lower()}{said[1:]}", field=field, bound=bound, value=first.get("input")
    )
