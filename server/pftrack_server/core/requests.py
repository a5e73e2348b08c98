"""Requests: what a handler may ask for, and how long its client waits for the answer."""

import asyncio
from collections.abc import Awaitable, Callable, Coroutine
from contextlib import suppress
from typing import Annotated, Any, TypeVar

from fastapi import Depends, Path, Query, Request
from starlette.requests import HTTPConnection
from starlette.responses import Response

from pftrack.core.refusal import RefusedError
from pftrack.experiments import find as find_experiment
from pftrack.experiments.experiment import Experiment
from pftrack_server.core.body_limit import lift_limit
from pftrack_server.core.errors import ClientGoneError, NotFoundError
from pftrack_server.core.settings import Settings

Result = TypeVar("Result")

DAY_S = 24 * 3600
MULTIPART = {
    "requestBody": {
        "required": True,
        "content": {
            "multipart/form-data": {
                "schema": {
                    "type": "object",
                    "required": ["file"],
                    "properties": {"file": {"type": "array", "items": {"type": "string", "format": "binary"}}},
                }
            }
        },
    }
}
"""What the description of the interface says of a route that takes files."""
TICKET = r"^[0-9A-Za-z-]{8,64}$"
Ticket = Annotated[
    str | None, Query(pattern=TICKET, description="A name chosen by the client, to ask for the place in the queue")
]


def service(kind: type) -> Any:  # noqa: ANN401 - as FastAPI's own `Depends`
    """Return a dependency: the app's service of a kind, which `web.services` has opened."""

    def find(connection: HTTPConnection) -> object:
        return connection.app.state.services[kind]

    return Depends(find)


SettingsNow = Annotated[Settings, service(Settings)]


def _takes_files(request: Request) -> None:
    lift_limit(request.scope)


TakesFiles = Depends(_takes_files)
"""For a route whose handler reads files from the wire, with limits of their own."""


def _experiment(experiment: Annotated[str, Path(max_length=64)]) -> Experiment:
    try:
        return find_experiment(experiment)
    except RefusedError as error:
        raise NotFoundError(str(error)) from None


AnExperiment = Annotated[Experiment, Depends(_experiment)]


async def wait_until_gone(request: Request) -> None:
    """Wait until the client of a request whose body has been read hangs up."""
    while (await request.receive())["type"] != "http.disconnect":
        pass


async def unless_client_gone(request: Request, work: Coroutine[Any, Any, Result]) -> Result:
    """Return what work comes to, and cancel it once its client hangs up."""
    return await unless_gone(work, lambda: wait_until_gone(request))


async def unless_gone(work: Coroutine[Any, Any, Result], gone: Callable[[], Awaitable[object]]) -> Result:
    """Do work for a client, and cancel it once the client is gone.

    Args:
        work: What to do.
        gone: Waits until the client has hung up.

    Raises:
        ClientGoneError: It has, before the work was done.
    """
    working = asyncio.ensure_future(work)
    leaving = asyncio.ensure_future(gone())
    try:
        await asyncio.wait((working, leaving), return_when=asyncio.FIRST_COMPLETED)
        if working.done():
            return working.result()
        leaving.result()  # a body may be refused that nobody has read
        raise ClientGoneError("The client hung up before this was done.")
    finally:
        for task in (working, leaving):
            task.cancel()
        with suppress(asyncio.CancelledError):
            await asyncio.gather(working, leaving, return_exceptions=True)


def kept_picture(data: bytes, media_type: str) -> Response:
    """Return the answer with a picture of somebody's own recording or run."""
    return Response(data, media_type=media_type, headers={"Cache-Control": f"private, max-age={DAY_S}"})
