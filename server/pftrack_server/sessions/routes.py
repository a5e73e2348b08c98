"""Routes of sessions: start, steer, branch, end; and the stream of a session's state and drawings."""

import asyncio
import contextlib
from collections.abc import Awaitable, Callable
from http import HTTPStatus
from typing import Annotated, TypeAlias

from fastapi import APIRouter, Depends, Query, Request, WebSocket
from pydantic import Field
from starlette.responses import RedirectResponse, Response

from pftrack.analysis.explanation import Explanation
from pftrack.core.refusal import ConflictError, RefusedError
from pftrack.experiments import find as find_experiment
from pftrack.sources.truth import LARGEST_FILE_BYTES
from pftrack_server.core.base_path import address_of
from pftrack_server.core.bodies import RequestBody, Title
from pftrack_server.core.errors import not_found
from pftrack_server.core.requests import MULTIPART, AName, TakesFiles, service, unless_client_gone
from pftrack_server.jobs.child_tasks import TheTasks
from pftrack_server.sessions.create import SessionCreate, as_spec
from pftrack_server.sessions.duplex import converse
from pftrack_server.sessions.manager import Manager, Prepare
from pftrack_server.sessions.session import Answer, Session
from pftrack_server.sessions.spec import Bookmark, Phase, SessionSpec
from pftrack_server.sessions.state import Columns
from pftrack_server.sessions.stream import SessionPublic
from pftrack_server.sessions.worker.protocol import Command, Explain, MakeBranch, Picture
from pftrack_server.store.database import UploadRow
from pftrack_server.store.files import new_name
from pftrack_server.store.filters import TheFilters
from pftrack_server.store.store import AStore
from pftrack_server.uploads.multipart import receive
from pftrack_server.uploads.truth import TruthPublic, rows_of, store_truth


class SessionUpdate(RequestBody):
    """A session's new name."""

    name: Title = Field(description="New name; the name of its clip or preset if empty")


class BookmarkCreate(RequestBody):
    """A bookmark on the shown frame."""

    note: str = Field("", max_length=500)


router = APIRouter(prefix="/sessions", tags=["sessions"])

FAREWELL = "The session was ended."
AManager = Annotated[Manager, service(Manager)]


async def _session(session: AName, manager: AManager) -> Session:
    return manager.get(session)


ASession = Annotated[Session, Depends(_session)]


Begins: TypeAlias = Callable[[SessionSpec, Prepare | None], Awaitable[Session]]
"""Takes a spec and a preparation, as `Manager.create` does."""


def _begin(request: Request, manager: AManager) -> Begins:
    return lambda spec, prepare: unless_client_gone(request, manager.create(spec, prepare))


Begin = Annotated[Begins, Depends(_begin)]
"""Starts a session for a client; if the client hangs up meanwhile, the session is ended, since nobody knows its
name."""


@router.post("", status_code=HTTPStatus.CREATED)
async def start_session(body: SessionCreate, begin: Begin, store: AStore, filters: TheFilters) -> SessionPublic:
    """Start a session: an experiment on its own scene, or on an upload with the mark of its target."""
    body = body.model_copy(update={"recipe": filters.bring(body.recipe)})
    session = await begin(await asyncio.to_thread(as_spec, body, store), None)
    return session.view()


@router.get("")
async def list_sessions(manager: AManager) -> list[SessionPublic]:
    """List all sessions, newest first."""
    return [session.view() for session in manager.all if session.spec.description]


@router.get("/{session}")
async def show_session(session: ASession) -> SessionPublic:
    """Return the complete state of a session."""
    return session.view()


@router.patch("/{session}")
async def rename_session(session: ASession, body: SessionUpdate, manager: AManager) -> SessionPublic:
    """Rename a session."""
    session.keep(name=body.name)
    await manager.note()
    return session.view()


@router.delete("/{session}", status_code=HTTPStatus.NO_CONTENT)
async def end_session(session: AName, manager: AManager) -> None:
    """End a session permanently, even one with damaged stored data."""
    found = manager.find(session)
    if found is not None:
        await manager.end(found)
    elif not await manager.forget(session):
        manager.get(session)


@router.post("/{session}/commands")
async def command(session: ASession, body: Command, manager: AManager) -> Answer:
    """Carry out a command, named by `kind`: play, pause, seek, change, branch, inspect and others.

    The answer to `change` holds the current values, that to `inspect` the findings, any other the session.
    """
    answer = await session.command(body)
    if isinstance(body, MakeBranch):
        await manager.note()
    return answer


@router.post("/{session}/resume")
async def resume(session: ASession, manager: AManager) -> SessionPublic:
    """Start a worker for a suspended or crashed session again, at the same frame."""
    await manager.resume(session)
    return session.view()


@router.get("/{session}/diagnostics", response_class=Response, responses={200: {"model": Columns}})
async def diagnostics(session: ASession, branch: str | None = None) -> Response:
    """Return the diagnostics of all frames of a branch, by default the active one."""
    name = branch or session.spec.branch
    if name not in session.spec.branches:
        raise not_found("The session has no branch of this name.")
    return Response(session.columns_text(name), media_type="application/json")


@router.put("/{session}/truth", openapi_extra=MULTIPART, dependencies=[TakesFiles])
async def give_truth(
    request: Request, session: ASession, manager: AManager, store: AStore, tasks: TheTasks
) -> TruthPublic:
    """Read a truth table for the session's upload, and measure the run by it from now on."""
    spec = session.spec
    upload = await asyncio.to_thread(store.get, UploadRow, spec.upload) if spec.upload else None
    if upload is None:
        raise ConflictError("Truth can be given for an upload; this session has none, or it was deleted.")
    experiment = find_experiment(spec.recipe.experiment)
    folder = store.files.new_incoming()
    received = await receive(request, folder, store.disk_budget, most_bytes=LARGEST_FILE_BYTES, most_files=1)
    told = await store_truth(store, tasks, upload, experiment, folder, received)
    await manager.measure_by(session, await asyncio.to_thread(rows_of, store, upload.id, experiment))
    return told


@router.get("/{session}/explanation")
async def explain(
    session: ASession, frame: Annotated[int | None, Query(ge=0)] = None, branch: str | None = None
) -> Explanation | None:
    """Explain a loss of the target in the active branch: the first lasting one, or the one at a frame.

    The answer is null if `branch` is not active any more: a command may have made another on the way.
    """
    explanation: Explanation | None = await session.order(Explain(frame, branch))
    return explanation


@router.get("/{session}/frame.png", response_class=Response, responses={200: {"content": {"image/png": {}}}})
async def picture(session: ASession) -> Response:
    """Return the shown frame as a picture."""
    return Response(await session.order(Picture()), media_type="image/png", headers={"Cache-Control": "no-store"})


@router.get(
    "/{session}/thumbnail.png",
    response_class=Response,
    responses={200: {"content": {"image/png": {}}}, 307: {"description": "No picture; leads to its experiment's"}},
)
async def thumbnail(request: Request, session: ASession) -> Response:
    """Return a recent picture of a session, or redirect to that of its experiment."""
    png = await session.thumbnail()
    if png is None:
        experiment = session.spec.recipe.experiment
        return RedirectResponse(address_of(request.scope, f"api/v1/experiments/{experiment}/thumbnail.webp"))
    return Response(png, media_type="image/png", headers={"Cache-Control": "no-store"})


@router.post("/{session}/bookmarks", status_code=HTTPStatus.CREATED)
async def bookmark(session: ASession, manager: AManager, body: BookmarkCreate | None = None) -> Bookmark:
    """Bookmark the shown frame."""
    made = session.bookmark(new_name(), body.note if body else "")
    try:
        await manager.keep(positions=False)
    except Exception:
        session.unbookmark(made.id)
        raise
    return made


@router.delete("/{session}/bookmarks/{bookmark}", status_code=HTTPStatus.NO_CONTENT)
async def forget_bookmark(session: ASession, bookmark: AName, manager: AManager) -> None:
    """Forget a bookmark."""
    if not session.unbookmark(bookmark):
        raise not_found("The session has no bookmark of this id.")
    await manager.note()


@router.websocket("/{session}/stream")
async def stream(
    websocket: WebSocket, session: ASession, manager: AManager, *, paints: bool = False, has_picture: bool = False
) -> None:
    """Send a page the complete state, then all changes until one of the two leaves.

    Args:
        websocket: The page's socket.
        session: The session that it shows.
        manager: Resumes the session if it is suspended.
        paints: Whether to send the page drawings, each with the messages up to its frame, as fast as it paints them.
        has_picture: Whether it still shows a drawing of an earlier connection; the greeting then comes with the next
            drawing.
    """
    await websocket.accept()
    # A suspended session resumes, since somebody watches again.
    waking = asyncio.ensure_future(_wake(session, manager))
    try:
        with session.stream.join(paints=paints, has_picture=has_picture) as page:
            await converse(websocket, page, FAREWELL, page.note_painted)
    finally:
        waking.cancel()
        await asyncio.gather(waking, return_exceptions=True)


async def _wake(session: Session, manager: Manager) -> None:
    if session.phase is Phase.SUSPENDED:
        with contextlib.suppress(RefusedError):
            await asyncio.shield(manager.resume(session))
