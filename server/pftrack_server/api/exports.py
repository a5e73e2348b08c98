"""Exports: have a run or a comparison written as a file, follow how far that is, and fetch the file."""

import asyncio
from http import HTTPStatus
from typing import Annotated

from fastapi import APIRouter, Path, Query, Request
from starlette.responses import FileResponse

from pftrack.output.exports.formats import exports_of
from pftrack.runs.record import Record
from pftrack_server.api.dependencies import (
    ARun,
    ASession,
    AStore,
    TheComparisons,
    TheExplorations,
    TheExports,
    TheTasks,
    wait_until_gone,
)
from pftrack_server.errors import ConflictError, NotFoundError
from pftrack_server.experiments import find_experiment
from pftrack_server.runs.exports import Exporting, Subject
from pftrack_server.schemas.comparisons import ComparisonExportCreate
from pftrack_server.schemas.description import ExportPublic
from pftrack_server.schemas.exports import ExportJobPublic, ExportsPublic, PlotChoice
from pftrack_server.system_errors import failure_message
from pftrack_server.tasks.functions import read_record
from pftrack_server.tasks.queue import unless_gone

router = APIRouter(tags=["exports"])

Name = Annotated[str, Path(max_length=64)]

PlotId = Annotated[str | None, Query(max_length=64, description="The one plot that a picture shows; all if not given.")]


@router.post("/sessions/{session}/exports/{export}", status_code=HTTPStatus.ACCEPTED)
async def export_session(
    session: ASession, export: Name, exports: TheExports, explorations: TheExplorations, plot: PlotId = None
) -> ExportJobPublic:
    """Begin to write the active branch of a session, as far as it was computed, as a file of another kind."""
    run, found = session.spec.run, explorations.found_of(session)
    return _view(
        exports.write(Subject(run.recipe, run.computed, run.position, session.state.snapshot.name, found), export, plot)
    )


@router.get("/runs/{run}/exports")
def list_exports(run: ARun) -> ExportsPublic:
    """List what a saved run can be exported as."""
    experiment = find_experiment(run.experiment)
    return ExportsPublic(
        exports=[ExportPublic.model_validate(one) for one in exports_of(experiment)],
        plots=[PlotChoice(id=plot.id, title=plot.title) for plot in experiment.plots],
    )


@router.post("/runs/{run}/exports/{export}", status_code=HTTPStatus.ACCEPTED)
async def export_run(
    run: ARun, export: Name, exports: TheExports, store: AStore, tasks: TheTasks, plot: PlotId = None
) -> ExportJobPublic:
    """Begin to write a saved run as a file of another kind."""
    path = store.files.record(run.id)
    if not path.exists():
        raise NotFoundError("The file of this run is missing.")
    saved = Record.model_validate(await tasks.run(read_record, str(path)))
    return _view(exports.write(Subject(saved.recipe, saved.computed - 1, run.position, run.title), export, plot))


@router.post("/comparisons/exports/{export}", status_code=HTTPStatus.ACCEPTED)
async def export_comparison(
    export: Name, body: ComparisonExportCreate, request: Request, comparisons: TheComparisons, exports: TheExports
) -> ExportJobPublic:
    """Begin to write what two to four runs come to beside each other as a file."""
    begun = comparisons.export(body.runs, body.title, export, exports)
    return _view(await unless_gone(begun, lambda: wait_until_gone(request)))


@router.get("/exports/{name}")
async def show_export(name: Name, exports: TheExports) -> ExportJobPublic:
    """Tell how far a file is; one that nobody asks for is dropped after 150 s, and ten minutes after it was done."""
    return _view(exports.get(name))


@router.get("/exports/{name}/file", response_class=FileResponse)
async def fetch_export(name: Name, exports: TheExports) -> FileResponse:
    """Return a file that was written."""
    job = exports.get(name)
    if not job.task.done():
        raise ConflictError("The file is still being written; ask again when it is done.")
    path = await job.task
    kind = job.about.kind
    return FileResponse(
        path, media_type=kind.media_type, filename=job.about.name, headers={"Cache-Control": "no-store"}
    )


@router.delete("/exports/{name}", status_code=HTTPStatus.NO_CONTENT)
async def cancel_export(name: Name, exports: TheExports) -> None:
    """Stop writing a file, or forget it."""
    await exports.cancel(name)


def _view(job: Exporting) -> ExportJobPublic:
    state, message = "writing", None
    if job.task.done():
        error = asyncio.CancelledError() if job.task.cancelled() else job.task.exception()
        state, message = ("done", None) if error is None else ("failed", failure_message(error))
    return ExportJobPublic(
        id=job.id,
        title=job.about.kind.title,
        name=job.about.name,
        state=state,
        done=job.total if state == "done" else job.done,  # the last steps are not told
        total=job.total,
        file=f"api/v1/exports/{job.id}/file",
        message=message,
    )
