"""Runs: save, list, download, bring in, open again."""

import asyncio
from functools import partial
from http import HTTPStatus
from typing import Annotated

from fastapi import APIRouter, Path, Request
from starlette.responses import FileResponse, Response

from pftrack_server.api.dependencies import (
    AManager,
    ARun,
    AStore,
    Begin,
    SettingsNow,
    TakesFiles,
    TheImports,
    TheTasks,
    wait_until_gone,
)
from pftrack_server.api.kept_pictures import kept_picture
from pftrack_server.api.uploads import MULTIPART
from pftrack_server.errors import ClientGoneError, NotFoundError
from pftrack_server.runs.exports import run_file_name
from pftrack_server.runs.imports import Import
from pftrack_server.runs.service import check_room, compare, reopen, save
from pftrack_server.schemas.messages import SessionPublic
from pftrack_server.schemas.runs import ImportPublic, RunCreate, RunPublic, RunUpdate
from pftrack_server.store.files import is_name
from pftrack_server.store.tables import RunRow
from pftrack_server.tasks.jobs import failure_of
from pftrack_server.tasks.queue import unless_gone
from pftrack_server.uploads.multipart import receive

router = APIRouter(prefix="/runs", tags=["runs"])

Name = Annotated[str, Path(max_length=64)]

# So long whoever sends a run waits for it; then the answer says how far it is.
IMPORT_S = 2.0

RECORD = "application/vnd.pftrack.run"


@router.post("", status_code=HTTPStatus.CREATED)
async def save_run(body: RunCreate, manager: AManager, store: AStore, settings: SettingsNow) -> RunPublic:
    """Save the active branch of a session."""
    session = manager.get(body.session)
    await asyncio.to_thread(check_room, store, settings)
    return run_view(await save(store, session, body.title))


@router.post(
    "/import",
    status_code=HTTPStatus.CREATED,
    openapi_extra=MULTIPART,
    dependencies=[TakesFiles],
    responses={202: {"model": ImportPublic, "description": "It is still being computed; ask for its progress"}},
)
async def import_run(
    request: Request, answer: Response, store: AStore, settings: SettingsNow, imports: TheImports
) -> RunPublic | ImportPublic:
    """Take in a run that was saved elsewhere, and compute it; one that takes longer can be followed and cancelled."""
    await asyncio.to_thread(check_room, store, settings)
    folder = store.files.new_incoming()
    received = await receive(request, folder, store.disk_budget, most_bytes=settings.max_record_bytes, most_files=1)
    begun = imports.bring_in(folder, received)
    try:
        await unless_gone(asyncio.wait({begun.task}, timeout=IMPORT_S), lambda: wait_until_gone(request))
    except ClientGoneError:
        await imports.cancel(begun.id)
        raise
    if begun.task.done():
        return run_view(await begun.task)
    answer.status_code = HTTPStatus.ACCEPTED
    return _job(begun)


@router.get("/imports")
async def list_imports(imports: TheImports) -> list[ImportPublic]:
    """List the runs that are being taken in, and what came of those of the last minutes, the newest first."""
    return [_job(each) for each in imports.all]


@router.get("/imports/{name}")
async def show_import(name: Name, imports: TheImports) -> ImportPublic:
    """Tell how far a run is that is being taken in; one that nobody asks for is dropped after 150 s."""
    return _job(imports.get(name))


@router.delete("/imports/{name}", status_code=HTTPStatus.NO_CONTENT)
async def cancel_import(name: Name, imports: TheImports) -> None:
    """Stop taking a run in, or forget what came of it."""
    await imports.cancel(name)


@router.get("")
def list_runs(store: AStore) -> list[RunPublic]:
    """List all saved runs, the newest first."""
    return [run_view(row) for row in store.runs()]


@router.get("/{run}")
def show_run(run: ARun) -> RunPublic:
    """Tell about a saved run."""
    return run_view(run)


@router.patch("/{run}")
async def rename_run(run: ARun, body: RunUpdate, store: AStore) -> RunPublic:
    """Give a saved run another name."""
    await asyncio.to_thread(store.rename_run, run.id, body.title)
    run.title = body.title
    return run_view(run)


@router.delete("/{run}", status_code=HTTPStatus.NO_CONTENT)
async def remove_run(run: Name, store: AStore) -> None:
    """Delete a saved run, also one whose entry in the database is damaged."""
    if not is_name(run) or not await asyncio.to_thread(store.remove_run, run):
        raise NotFoundError("There is no such run; it may have been deleted.")


@router.get("/{run}/download", response_class=FileResponse, responses={200: {"content": {RECORD: {}}}})
def download(run: ARun, store: AStore) -> FileResponse:
    """Return the record of a saved run as a file."""
    path = store.files.record(run.id)
    if not path.exists():
        raise NotFoundError("The file of this run is missing.")
    return FileResponse(path, media_type=RECORD, filename=f"{run_file_name(run.experiment, run.title)}-{run.seed}.pft")


@router.get("/{run}/thumbnail.png", response_class=Response, responses={200: {"content": {"image/png": {}}}})
def thumbnail(run: ARun, store: AStore) -> Response:
    """Return a picture of the frame at which a run was saved."""
    path = store.files.thumbnail(run.id)
    if not path.exists():
        raise NotFoundError("The picture of this run is missing.")
    return kept_picture(path.read_bytes(), "image/png")


@router.post("/{run}/open", status_code=HTTPStatus.CREATED)
async def open_run(run: ARun, store: AStore, begin: Begin, tasks: TheTasks) -> SessionPublic:
    """Go on with a saved run in a new session."""
    session = await begin(await reopen(store, tasks, run), partial(compare, store, tasks, run))
    return session.view()


def _job(job: Import) -> ImportPublic:
    known = {"id": job.id, "name": job.about, "done": job.done, "total": job.total}
    if not job.task.done():
        return ImportPublic(**known, state="computing", run=None, message=None)
    message = failure_of(job)
    if message is None:
        return ImportPublic(**known, state="done", run=job.task.result().id, message=None)
    return ImportPublic(**known, state="failed", run=None, message=message)


def run_view(row: RunRow) -> RunPublic:
    """Return a saved run as everybody outside sees it."""
    return RunPublic(
        id=row.id,
        title=row.title,
        experiment=row.experiment,
        tracker=row.tracker,
        seed=row.seed,
        frames=row.frames,
        created=row.created,
        outcome=row.outcome,
        summary=row.summary,
        thumbnail=f"api/v1/runs/{row.id}/thumbnail.png",
        page=f"work?show=runs#run-{row.id}",
    )
