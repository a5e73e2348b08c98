"""Sessions: start, steer, branch, end."""

import asyncio
from http import HTTPStatus
from typing import Annotated

from fastapi import APIRouter, Path, Query, Request
from starlette.responses import RedirectResponse, Response

from pftrack.sources.truth import LARGEST_FILE_BYTES
from pftrack_server.api.dependencies import AManager, ASession, AStore, Begin, TakesFiles, TheFilters, TheTasks
from pftrack_server.api.uploads import MULTIPART
from pftrack_server.base_path import address_of
from pftrack_server.errors import ConflictError, NotFoundError
from pftrack_server.experiments import find_experiment
from pftrack_server.schemas.inspection import ExplanationPublic
from pftrack_server.schemas.messages import SessionPublic
from pftrack_server.schemas.sessions import (
    BookmarkCreate,
    Columns,
    SessionCreate,
    SessionUpdate,
)
from pftrack_server.schemas.snapshot import Bookmark
from pftrack_server.schemas.uploads import TruthPublic
from pftrack_server.sessions.create import as_spec
from pftrack_server.sessions.session import Answer
from pftrack_server.store.files import new_name
from pftrack_server.store.tables import UploadRow
from pftrack_server.uploads.multipart import receive
from pftrack_server.uploads.truth import rows_of, store_truth
from pftrack_server.worker.commands import Command, Explain, MakeBranch, Picture

router = APIRouter(prefix="/sessions", tags=["sessions"])

Name = Annotated[str, Path(max_length=64)]


@router.post("", status_code=HTTPStatus.CREATED)
async def start_session(body: SessionCreate, begin: Begin, store: AStore, filters: TheFilters) -> SessionPublic:
    """Start a session: an experiment on its own scene, or on an upload with the box of its target."""
    body = body.model_copy(update={"recipe": filters.bring(body.recipe)})
    session = await begin(await asyncio.to_thread(as_spec, body, store))
    return session.view()


@router.get("")
async def list_sessions(manager: AManager) -> list[SessionPublic]:
    """List all sessions, the newest first."""
    return [session.view() for session in manager.all if session.spec.description]


@router.get("/{session}")
async def show_session(session: ASession) -> SessionPublic:
    """Tell everything about a session."""
    return session.view()


@router.patch("/{session}")
async def rename_session(session: ASession, body: SessionUpdate, manager: AManager) -> SessionPublic:
    """Give a session a name."""
    session.state.rename(body.name)
    await manager.note()
    return session.view()


@router.delete("/{session}", status_code=HTTPStatus.NO_CONTENT)
async def end_session(session: Name, manager: AManager) -> None:
    """End a session for good, also one of which what is stored is damaged."""
    found = manager.find(session)
    if found is not None:
        await manager.end(found)
    elif not await manager.forget(session):
        manager.get(session)


@router.post("/{session}/commands")
async def command(session: ASession, body: Command, manager: AManager) -> Answer:
    """Carry out a command: play, pause, seek, change, branch, inspect and others; `kind` names it.

    `change` is answered with the values in force, `inspect` with what is found, any other with the session.
    """
    answer = await session.command(body)
    if isinstance(body, MakeBranch):
        await manager.note()
    return answer


@router.post("/{session}/resume")
async def resume(session: ASession, manager: AManager) -> SessionPublic:
    """Give a suspended or crashed session a worker again, where it was."""
    await manager.resume(session)
    return session.view()


@router.get("/{session}/diagnostics", response_class=Response, responses={200: {"model": Columns}})
async def diagnostics(session: ASession, branch: str | None = None) -> Response:
    """Return the diagnostics of all frames of a branch; of the active one if none is named."""
    name = branch or session.spec.branch
    if name not in session.spec.branches:
        raise NotFoundError("The session has no such branch.")
    return Response(session.state.columns_text(name), media_type="application/json")


@router.put("/{session}/truth", openapi_extra=MULTIPART, dependencies=[TakesFiles])
async def give_truth(
    request: Request, session: ASession, manager: AManager, store: AStore, tasks: TheTasks
) -> TruthPublic:
    """Take in a table of what is truly so in the session's upload, and measure the run by it from now on."""
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
async def explain(session: ASession, frame: Annotated[int | None, Query(ge=0)] = None) -> ExplanationPublic:
    """Tell why the target was lost in the active branch, in its first lasting loss or at a frame."""
    return ExplanationPublic.model_validate(await session.order(Explain(frame)))


@router.get("/{session}/frame.png", response_class=Response, responses={200: {"content": {"image/png": {}}}})
async def picture(session: ASession) -> Response:
    """Return the frame that is shown as a picture."""
    return Response(await session.order(Picture()), media_type="image/png", headers={"Cache-Control": "no-store"})


@router.get(
    "/{session}/thumbnail.png",
    response_class=Response,
    responses={200: {"content": {"image/png": {}}}, 307: {"description": "It has none; this is its experiment's"}},
)
async def thumbnail(request: Request, session: ASession) -> Response:
    """Return a picture of about where a session is, or lead to that of its experiment."""
    png = await session.thumbnail()
    if png is None:
        experiment = session.spec.recipe.experiment
        return RedirectResponse(address_of(request.scope, f"api/v1/experiments/{experiment}/thumbnail.png"))
    return Response(png, media_type="image/png", headers={"Cache-Control": "no-store"})


@router.post("/{session}/bookmarks", status_code=HTTPStatus.CREATED)
async def bookmark(session: ASession, manager: AManager, body: BookmarkCreate | None = None) -> Bookmark:
    """Remember the frame that is shown."""
    made = session.bookmark(new_name(), body.note if body else "")
    try:
        await manager.keep(positions=False)
    except Exception:
        session.state.unbookmark(made.id)
        raise
    return made


@router.delete("/{session}/bookmarks/{bookmark}", status_code=HTTPStatus.NO_CONTENT)
async def forget_bookmark(session: ASession, bookmark: Name, manager: AManager) -> None:
    """Forget a bookmark."""
    if not session.state.unbookmark(bookmark):
        raise NotFoundError("The session has no such bookmark.")
    await manager.note()
