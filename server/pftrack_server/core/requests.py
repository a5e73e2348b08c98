"""Requests: dependencies of handlers, limits of bodies, and work that ends when its client hangs up.

A request without files must be small, and every body must arrive without long pauses; otherwise it is refused.
"""

import asyncio
from collections.abc import Awaitable, Callable, Coroutine
from contextlib import suppress
from http import HTTPStatus
from typing import Annotated, Any, TypeVar

from fastapi import Depends, Path, Query, Request
from starlette.datastructures import Headers
from starlette.exceptions import HTTPException
from starlette.requests import HTTPConnection
from starlette.responses import Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from pftrack.core.refusal import RefusedError
from pftrack.experiments import find as find_experiment
from pftrack.experiments.experiment import Experiment
from pftrack_server.core.errors import client_gone, not_found
from pftrack_server.core.settings import Settings

Result = TypeVar("Result")

DAY_S = 24 * 3600
LIMIT = "pftrack.body_limit"
CLOSING = {"Connection": "close"}
SILENCE_S = 30.0
"""Seconds without a byte of an unfinished body after which it is refused."""
FILES = {"type": "array", "items": {"type": "string", "format": "binary"}}
FORM = {"type": "object", "required": ["file"], "properties": {"file": FILES}}
MULTIPART = {"requestBody": {"required": True, "content": {"multipart/form-data": {"schema": FORM}}}}
"""OpenAPI description of a route that takes files."""
TICKET = r"^[0-9A-Za-z-]{8,64}$"
Ticket = Annotated[str | None, Query(pattern=TICKET, description="Chosen by the client for its place in the queue")]


class BodyLimit:
    """ASGI middleware that limits bodies; routes that take files replace the limit by their own.

    Args:
        app: The wrapped app; it must answer an `HTTPException`, which FastAPI lets through while it reads a body.
        most_bytes: Most bytes of a body.
        silence_s: Seconds without a byte after which an unfinished body is refused.
    """

    def __init__(self, app: ASGIApp, most_bytes: int, silence_s: float = SILENCE_S) -> None:
        self._app = app
        self._most_bytes = most_bytes
        self._silence_s = silence_s

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Count a request's bytes as they arrive."""
        if scope["type"] == "http":
            scope[LIMIT] = self._most_bytes
            receive = self._counting(scope, receive)
        await self._app(scope, receive, send)

    def _counting(self, scope: Scope, receive: Receive) -> Receive:
        announced = Headers(scope=scope).get("content-length", "")
        come, ended = 0, False

        def check(total: int) -> None:
            if scope[LIMIT] is not None and total > scope[LIMIT]:
                message = f"The body of a request may have at most {scope[LIMIT]} bytes"
                raise HTTPException(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, message, CLOSING)

        async def receive_counted() -> Message:
            nonlocal come, ended
            check(int(announced) if announced.isdecimal() else 0)
            try:
                message = await (receive() if ended else asyncio.wait_for(receive(), self._silence_s))
            except TimeoutError:
                told = f"The request body stalled for more than {self._silence_s:g} s"
                raise HTTPException(HTTPStatus.REQUEST_TIMEOUT, told, CLOSING) from None
            come += len(message.get("body", b""))
            ended = not message.get("more_body", False)
            check(come)
            return message

        return receive_counted


def service(kind: type) -> Any:  # noqa: ANN401 - as FastAPI's own `Depends`
    """Return a dependency on the app's service of a type, which `web.services` has opened."""

    def find(connection: HTTPConnection) -> object:
        return connection.app.state.services[kind]

    return Depends(find)


AName = Annotated[str, Path(max_length=64)]
"""The name of a resource in an address."""

SettingsNow = Annotated[Settings, service(Settings)]


def _takes_files(request: Request) -> None:
    request.scope[LIMIT] = None


TakesFiles = Depends(_takes_files)
"""Dependency of a route whose handler reads files from the wire, with its own limits."""


def _experiment(experiment: AName) -> Experiment:
    try:
        return find_experiment(experiment)
    except RefusedError as error:
        raise not_found(str(error)) from None


AnExperiment = Annotated[Experiment, Depends(_experiment)]


async def wait_until_gone(request: Request) -> None:
    """Wait until the client hangs up; the request's body must have been read."""
    while (await request.receive())["type"] != "http.disconnect":
        pass


async def unless_client_gone(request: Request, work: Coroutine[Any, Any, Result]) -> Result:
    """Return the result of work; cancel it if its client hangs up."""
    return await unless_gone(work, lambda: wait_until_gone(request))


async def unless_gone(work: Coroutine[Any, Any, Result], gone: Callable[[], Awaitable[object]]) -> Result:
    """Do work for a client; cancel it when the client is gone.

    Args:
        work: The work.
        gone: Waits until the client hangs up.

    Raises:
        ApiError: The client hung up before the work was done (499).
    """
    working = asyncio.ensure_future(work)
    leaving = asyncio.ensure_future(gone())
    try:
        await asyncio.wait((working, leaving), return_when=asyncio.FIRST_COMPLETED)
        if working.done():
            return working.result()
        leaving.result()  # an unread body may be refused
        raise client_gone("The client hung up before this was done.")
    finally:
        for task in (working, leaving):
            task.cancel()
        with suppress(asyncio.CancelledError):
            await asyncio.gather(working, leaving, return_exceptions=True)


def kept_picture(data: bytes, media_type: str) -> Response:
    """Return a response with a picture of a person's own recording or run."""
    return Response(data, media_type=media_type, headers={"Cache-Control": f"private, max-age={DAY_S}"})
