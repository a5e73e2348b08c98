"""Jobs: begun beside what they are about; followed, cancelled and fetched here; and the source code of runs."""

import asyncio
from http import HTTPStatus
from typing import Annotated, Any, TypeAlias

from fastapi import APIRouter, Path, Query, Request
from pydantic import BaseModel, Field
from starlette.responses import FileResponse

from pftrack.core.model.parameters import NOT_BOOLEAN
from pftrack.core.model.series import Plot
from pftrack.core.refusal import ConflictError
from pftrack.experiments import find as find_experiment
from pftrack.output.exports.formats import FileKind, exports_of
from pftrack.runs.reproduction import SourceCode, comparison_code, run_code
from pftrack.sweep.work import sweep_code
from pftrack_server.core.bodies import RequestBody, Title
from pftrack_server.core.errors import NotFoundError
from pftrack_server.core.requests import TICKET, service, unless_client_gone
from pftrack_server.jobs.child_tasks import Queues
from pftrack_server.jobs.jobs import Job
from pftrack_server.sessions.routes import ASession
from pftrack_server.sweeps.routes import ASweep
from pftrack_server.work import exports, runs
from pftrack_server.work.comparisons import ComparisonJob, compare
from pftrack_server.work.explorations import ExplorationCreate, ExplorationJob, Explorations
from pftrack_server.work.exports import ExportJob
from pftrack_server.work.routes import ARun, TheHouse
from pftrack_server.work.runs import FitCreate, FitJob, ImportJob
from pftrack_server.work.sources import ComparedRun, find_run, reopen


class QueuePublic(BaseModel):
    """Where a request waits."""

    before: int = Field(description="How many come before it")


class ComparisonCreate(RequestBody):
    """Two to four runs to compare."""

    runs: list[ComparedRun] = Field(max_length=64)


class ComparisonExportCreate(ComparisonCreate):
    """Two to four runs whose comparison shall be written as a file."""

    title: Title = Field("", description="By which the file is called")


AnyJob: TypeAlias = Annotated[
    ExportJob | ImportJob | FitJob | ComparisonJob | ExplorationJob, Field(discriminator="kind")
]


class ExportsPublic(BaseModel):
    """What a saved run can be exported as."""

    exports: list[FileKind]
    plots: list[Plot] = Field(description='What `plot` may name for an export of the group "plots"')


router = APIRouter(tags=["jobs"])
TheExplorations = Annotated[Explorations, service(Explorations)]

Name = Annotated[str, Path(max_length=64)]

PlotId = Annotated[str | None, Query(max_length=64, description="The one plot that a picture shows; all if not given.")]


@router.get("/jobs", response_model=list[AnyJob])
async def list_jobs(house: TheHouse) -> list[Job[Any]]:
    """List the jobs under way, and what came of those of the last minutes, the newest first."""
    return house.jobs.all()


@router.get("/jobs/{job}", response_model=AnyJob)
async def show_job(job: Name, house: TheHouse) -> Job[Any]:
    """Tell how far a job is, and what it has found; one that nobody asks for is dropped after 150 s."""
    return house.jobs.get(job)


@router.delete("/jobs/{job}", status_code=HTTPStatus.NO_CONTENT)
async def cancel_job(job: Name, house: TheHouse) -> None:
    """Stop a job, or forget what came of it."""
    await house.jobs.cancel(job)


@router.get("/jobs/{job}/file", response_class=FileResponse)
async def fetch_file(job: Name, house: TheHouse) -> FileResponse:
    """Return the file that an export has written; it is kept for ten minutes."""
    found = house.jobs.get(job)
    if not isinstance(found, ExportJob):
        raise NotFoundError("This job writes no file.")
    if found.result is None:
        raise ConflictError(found.error or "The file is still being written; ask again when it is done.")
    return FileResponse(
        house.store.files.exported(job),
        media_type=found.result.media_type,
        filename=found.name,
        headers={"Cache-Control": "no-store"},
    )


@router.post("/sessions/{session}/exports/{export}", status_code=HTTPStatus.ACCEPTED)
async def export_session(
    session: ASession,
    export: Name,
    house: TheHouse,
    explorations: TheExplorations,
    plot: PlotId = None,
) -> ExportJob:
    """Begin to write the active branch of a session, as far as it was computed, as a file of another kind."""
    name, found = session.snapshot.name, explorations.found_of(session)
    return await exports.export_run(house, session.spec, name, export, plot, found)


@router.post("/sessions/{session}/fits", status_code=HTTPStatus.ACCEPTED)
async def fit_session(session: ASession, body: FitCreate, house: TheHouse) -> FitJob:
    """Begin to fit numbers to the active branch of a session, as far as it was computed; the session goes on."""
    return await runs.fit(house, session, tuple(body.numbers))


@router.post("/sessions/{session}/explorations", status_code=HTTPStatus.ACCEPTED)
async def explore(session: ASession, body: ExplorationCreate, explorations: TheExplorations) -> ExplorationJob:
    """Begin to try what would have saved the active branch, or what its settings do with other seeds."""
    return await explorations.explore(session, body)


@router.get("/runs/{run}/exports")
def list_exports(run: ARun) -> ExportsPublic:
    """List what a saved run can be exported as."""
    experiment = find_experiment(run.experiment)
    return ExportsPublic(
        exports=list(exports_of(experiment)),
        plots=list(experiment.plots),
    )


@router.post("/runs/{run}/exports/{export}", status_code=HTTPStatus.ACCEPTED)
async def export_run(run: ARun, export: Name, house: TheHouse, plot: PlotId = None) -> ExportJob:
    """Begin to write a saved run as a file of another kind."""
    return await exports.export_run(house, await reopen(house.store, house.tasks, run), run.title, export, plot)


@router.post("/comparisons", status_code=HTTPStatus.ACCEPTED)
async def compare_runs(body: ComparisonCreate, request: Request, house: TheHouse) -> ComparisonJob:
    """Compare two to four runs: what differs is told at once, what came of them when they have been computed."""
    return await unless_client_gone(request, compare(house, body.runs))


@router.post("/comparisons/exports/{export}", status_code=HTTPStatus.ACCEPTED)
async def export_comparison(export: Name, body: ComparisonExportCreate, request: Request, house: TheHouse) -> ExportJob:
    """Begin to write what two to four runs come to beside each other as a file."""
    return await unless_client_gone(request, exports.export_comparison(house, body.runs, body.title, export))


@router.get("/queue/{ticket}")
async def show_place(
    ticket: Annotated[str, Path(pattern=TICKET)], queues: Annotated[Queues, service(Queues)]
) -> QueuePublic:
    """Tell how many are before the request that was sent with a ticket; none once it is worked on."""
    return QueuePublic(before=queues.before(ticket))


class SourceCodeRequest(RequestBody):
    """Of which runs: of one, or of several that are compared."""

    runs: list[ComparedRun] = Field(min_length=1, max_length=4)
    frames: Annotated[int, Field(ge=1, le=10_000_000), NOT_BOOLEAN] | None = Field(
        None, description="How many frames of each; all if left out"
    )


source_code = APIRouter(tags=["source code"])


@source_code.post("/source-code")
async def write_source_code(body: SourceCodeRequest, house: TheHouse) -> SourceCode:
    """Write what computes runs again; of several, what compares them. The truth of a recording is no part of it."""
    named = await asyncio.gather(*(find_run(run, house) for run in body.runs))
    recipes = [each.spec.recipe.with_footage(truth=None) for each in named]
    runs = [(recipe, find_experiment(recipe.experiment)) for recipe in recipes]
    return run_code(*runs[0], body.frames) if len(runs) == 1 else comparison_code(runs, body.frames)


@source_code.get("/sweeps/{sweep}/source-code")
async def write_sweep_code(sweep: ASweep) -> SourceCode:
    """Write what computes a sweep again."""
    return sweep_code(sweep.plan)
