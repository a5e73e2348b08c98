"""Every exception becomes an answer in the one shape of errors, also one that nobody expected."""

import asyncio
import json
import sys
from http import HTTPStatus
from typing import Any

import structlog
from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from sqlalchemy.exc import DBAPIError
from starlette.exceptions import HTTPException
from starlette.responses import Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from uvicorn.protocols.utils import ClientDisconnected

from pftrack.core.refusal import RefusedError, first_problem
from pftrack.sweep.axis import SweepError
from pftrack_server.core.base_path import route_path
from pftrack_server.core.errors import ApiError, detail_of, response, shape, status_of
from pftrack_server.store.system_errors import describe

log = structlog.get_logger(__name__)


class ErrorBoundary:
    """ASGI middleware that catches unexpected exceptions: logged whole, answered without path and stack."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on and answer it if it fails."""
        begun = False

        async def note_start(message: Message) -> None:
            nonlocal begun
            begun = begun or message["type"] == "http.response.start"
            await send(message)

        try:
            await self._app(scope, receive, note_start)
        except asyncio.CancelledError:
            # Nothing but the end of the server cancels a request; uvicorn would write a traceback of it.
            if scope["type"] != "http" or begun:
                raise
            message = "The server is being stopped. Try again when it is back."
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
    """Teach an app to answer every exception in the one shape."""

    @app.exception_handler(ApiError)
    @app.exception_handler(RefusedError)
    async def _refused(_: Request, error: ApiError | RefusedError) -> Response:
        return response(status_of(error), detail_of(error))

    @app.exception_handler(SweepError)
    async def _sweep(request: Request, error: SweepError) -> Response:
        # The library's message names paths.
        log.error("sweep", path=route_path(request.scope), exc_info=error)
        return response(HTTPStatus.GONE, shape("The files of this sweep are damaged or were removed."))

    @app.exception_handler(OSError)
    @app.exception_handler(DBAPIError)
    async def _system(request: Request, error: Exception) -> Response:
        # An operating system's message names paths.
        status, message = describe(error)
        unknown = status == HTTPStatus.INTERNAL_SERVER_ERROR
        log.error("system", path=route_path(request.scope), error=message, exc_info=error if unknown else None)
        return response(status, shape(message))

    @app.exception_handler(RequestValidationError)
    async def _request(_: Request, error: RequestValidationError) -> Response:
        return response(HTTPStatus.UNPROCESSABLE_ENTITY, _first(error))

    @app.exception_handler(HTTPException)
    async def _http(request: Request, error: HTTPException) -> Response:
        too_long = await _long_number(request) if isinstance(error.__cause__, ValueError) else None
        if too_long is not None:
            return response(HTTPStatus.UNPROCESSABLE_ENTITY, too_long)
        return response(error.status_code, shape(_sentence(error)), dict(error.headers or {}))

    app.add_exception_handler(ClientDisconnected, _leave)
    # The innermost of all, so that the answer passes through those that add headers and count.
    app.add_middleware(ErrorBoundary)


async def _leave(_: Request, error: Exception) -> Response:
    # It is an OSError, but none of this machine: the server below ends the connection, and nobody is there to answer.
    raise error


async def _long_number(request: Request) -> dict[str, Any] | None:
    """Tell of the number that kept a body from being read, if one did."""
    field = field_of_long_number(await request.body())
    if field is None:
        return None
    name = field.removeprefix("recipe.").removeprefix("values.")
    bound = f"a number of at most {sys.get_int_max_str_digits()} digits"
    return shape(f"{name or 'The body'} must be {bound}", field=name or None, bound=bound)


def _sentence(error: HTTPException) -> str:
    match error.status_code:
        case HTTPStatus.NOT_FOUND:
            return "There is no page or resource at this address."
        case HTTPStatus.METHOD_NOT_ALLOWED:
            allowed = (error.headers or {}).get("Allow", "another")
            return f"This address does not take this method; it takes {allowed}."
        case _:
            return str(error.detail)


def _first(error: RequestValidationError) -> dict[str, Any]:
    """Tell the first of what a request got wrong, with the name of its field."""
    try:
        first = first_problem(error.errors())
    except RefusedError as refused:
        return detail_of(refused)
    # The fields of a recipe have the names that the library's own refusals give them, and so have those of a command.
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


TOO_LONG = object()


def field_of_long_number(body: bytes) -> str | None:
    """Return the name of the first field whose whole number has too many digits; None if there is none."""
    most = sys.get_int_max_str_digits()

    def read(digits: str) -> object:
        return TOO_LONG if most and len(digits.lstrip("-")) > most else 0

    try:
        found = _find(json.loads(body, parse_int=read), ())
    except (ValueError, RecursionError):
        return None
    return None if found is None else ".".join(found)


def _find(value: Any, place: tuple[str, ...]) -> tuple[str, ...] | None:  # noqa: ANN401 - any JSON
    if value is TOO_LONG:
        return place
    members = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    below = (_find(member, (*place, str(name))) for name, member in members)
    return next((found for found in below if found is not None), None)
