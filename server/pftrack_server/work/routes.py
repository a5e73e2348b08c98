"""Routes of My work: sessions, saved runs, comparisons, sweeps and uploads in one searchable list, and each alone.

Jobs are begun at the routes of their subject; here they are polled, cancelled and fetched.

A search finds the items in whose texts every word occurs.
"""

import asyncio
import re
from collections.abc import Iterable, Sequence
from datetime import datetime
from functools import partial
from http import HTTPStatus
from typing import Annotated, Any, Literal, TypeAlias
from zoneinfo import ZoneInfo

from fastapi import APIRouter, Depends, Path, Query, Request
from pydantic import BaseModel, Field
from starlette.responses import FileResponse, Response

from pftrack.core.model.parameters import NOT_BOOLEAN
from pftrack.core.model.series import Plot
from pftrack.core.refusal import ConflictError
from pftrack.experiments import EXPERIMENTS
from pftrack.experiments import find as find_experiment
from pftrack.output.exports.formats import FileKind, exports_of
from pftrack.runs.reproduction import SourceCode, comparison_code, run_code
from pftrack.sweep.work import sweep_code
from pftrack_server.core import requests
from pftrack_server.core.bodies import GivenTitle, RequestBody, Title
from pftrack_server.core.errors import ApiError, not_found
from pftrack_server.core.requests import MULTIPART, TICKET, AName, SettingsNow, TakesFiles, service
from pftrack_server.jobs.child_tasks import Queues, TheTasks
from pftrack_server.jobs.jobs import Job
from pftrack_server.sessions.routes import AManager, ASession, Begin
from pftrack_server.sessions.stream import SessionPublic
from pftrack_server.store.database import ComparisonRow, RunRow, UploadRow
from pftrack_server.store.files import is_name
from pftrack_server.store.store import AStore
from pftrack_server.sweeps.routes import ASweep, ASweeps
from pftrack_server.sweeps.sweep import SweepPublic
from pftrack_server.uploads.multipart import receive
from pftrack_server.uploads.routes import UploadPublic
from pftrack_server.work import comparisons, runs
from pftrack_server.work.comparisons import ComparisonJob, SavedComparisonDetail, SavedComparisonPublic
from pftrack_server.work.explorations import ExplorationCreate, ExplorationJob, Explorations
from pftrack_server.work.runs import ExportJob, FitJob, ImportJob, RunPublic
from pftrack_server.work.sources import ComparedRun, House, find_run, reopen

Kind = Literal["sessions", "runs", "comparisons", "sweeps", "uploads"]


class RunCreate(RequestBody):
    """The session whose active branch to save."""

    session: str = Field(max_length=64)
    title: Title | None = None


class NewTitle(RequestBody):
    """A new title for a saved run or comparison."""

    title: GivenTitle


class WorkPublic(BaseModel):
    """Results of a search, newest of each kind first."""

    sessions: list[SessionPublic]
    runs: list[RunPublic]
    comparisons: list[SavedComparisonPublic]
    sweeps: list[SweepPublic]
    uploads: list[UploadPublic]
    found: dict[Kind, int] = Field(description="Number of matches, including those beyond the limit")
    total: dict[Kind, int] = Field(description="Number of all items")


class QueuePublic(BaseModel):
    """The place of a request in the queue."""

    before: int = Field(description="Number of requests before it")


class ComparisonCreate(RequestBody):
    """Two to four runs to compare."""

    runs: list[ComparedRun] = Field(max_length=64)


class ComparisonExportCreate(ComparisonCreate):
    """Two to four runs whose comparison to write as a file."""

    title: Title = Field("", description="Title for the file's name")


AnyJob: TypeAlias = Annotated[
    ExportJob | ImportJob | FitJob | ComparisonJob | ExplorationJob, Field(discriminator="kind")
]


class ExportsPublic(BaseModel):
    """The exports of a saved run."""

    exports: list[FileKind]
    plots: list[Plot] = Field(description='Values of `plot` for an export of the group "plots"')


router = APIRouter(tags=["work"])
uploads = APIRouter(prefix="/uploads", tags=["uploads"])

TheHouse = Annotated[House, service(House)]


def _run(run: AName, store: AStore) -> RunRow:
    return store.find(RunRow, run)


def _comparison(saved: AName, store: AStore) -> ComparisonRow:
    return store.find(ComparisonRow, saved)


ARun = Annotated[RunRow, Depends(_run)]
AComparison = Annotated[ComparisonRow, Depends(_comparison)]

MOST = 500
UTC = ZoneInfo("UTC")
RECORD = "application/vnd.pftrack.run"


class Words:
    """The words of a search, in any order and either case; parts of words match, parts of numbers do not.

    So a seed does not match the minutes of a time, nor the month of a date in digits.
    """

    def __init__(self, text: str) -> None:
        self._words = [_pattern(word) for word in text.casefold().split()]

    def occur_in(self, *texts: object) -> bool:
        """Return whether all words occur in these texts together."""
        said = " ".join(str(text) for text in texts).casefold()
        return all(word.search(said) for word in self._words)


def _pattern(word: str) -> re.Pattern[str]:
    """Return a pattern that matches a word anywhere, and a number only if it is not part of a number, time or date."""
    return re.compile(rf"(?<![\d:-]){word}(?![\d:-])" if word.isdecimal() else re.escape(word))


def experiment_words(experiment: str, trackers: Iterable[str]) -> str:
    """Return names and titles of an experiment and its trackers; removed ones have only a name."""
    names = [experiment, *trackers]
    known = EXPERIMENTS.get(experiment)
    if known is not None:
        names += [
            known.title,
            known.video.clip_title,
            known.texts.target,
            *(known.trackers[name].title for name in names if name in known.trackers),
        ]
    return " ".join(names)


def date_words(created: str, now: datetime) -> str:
    """Return the searchable forms of a time: in digits, in words, and "today" on that day.

    Args:
        created: The time in ISO 8601.
        now: The time of the search, in the searcher's zone; the day may depend on the zone.
    """
    try:
        moment = datetime.fromisoformat(created).astimezone(now.tzinfo)
    except ValueError:
        return created
    today = "today" if moment.date() == now.date() else ""
    return f"{moment:%Y-%m-%d %H:%M} {moment.day} {moment:%B %Y} {today}"


@router.post("/runs", status_code=HTTPStatus.CREATED)
async def keep_run(body: RunCreate, manager: AManager, store: AStore, settings: SettingsNow) -> RunPublic:
    """Save the active branch of a session."""
    session = manager.get(body.session)
    await asyncio.to_thread(runs.check_room, store, settings)
    return RunPublic.model_validate(await runs.save_run(store, session, body.title))


@router.post("/runs/import", status_code=HTTPStatus.ACCEPTED, openapi_extra=MULTIPART, dependencies=[TakesFiles])
async def import_run(request: Request, store: AStore, settings: SettingsNow, house: TheHouse) -> ImportJob:
    """Import a run saved elsewhere, and begin to compute it."""
    await asyncio.to_thread(runs.check_room, store, settings)
    folder = store.files.new_incoming()
    received = await receive(request, folder, store.disk_budget, most_bytes=settings.max_record_bytes, most_files=1)
    return await requests.unless_client_gone(request, runs.bring_in(house, folder, received))


@router.get("/runs")
def list_runs(store: AStore) -> list[RunPublic]:
    """List all saved runs, newest first."""
    return [RunPublic.model_validate(row) for row in store.all(RunRow)]


@router.get("/runs/{run}")
def show_run(run: ARun) -> RunPublic:
    """Return a saved run."""
    return RunPublic.model_validate(run)


@router.patch("/runs/{run}")
async def rename_run(run: ARun, body: NewTitle, store: AStore) -> RunPublic:
    """Rename a saved run."""
    await asyncio.to_thread(store.rename, run, body.title)
    return RunPublic.model_validate(run)


@router.delete("/runs/{run}", status_code=HTTPStatus.NO_CONTENT)
async def remove_run(run: AName, store: AStore) -> None:
    """Delete a saved run, even one with a damaged entry in the database."""
    await asyncio.to_thread(store.discard, RunRow, run)


@router.get("/runs/{run}/download", response_class=FileResponse, responses={200: {"content": {RECORD: {}}}})
def download(run: ARun, store: AStore) -> FileResponse:
    """Return the record of a saved run as a file."""
    path = store.files.record(run.id)
    if not path.exists():
        raise not_found("The file of this run is missing.")
    return FileResponse(
        path, media_type=RECORD, filename=f"{runs.run_file_name(run.experiment, run.title)}-{run.seed}.pft"
    )


@router.get("/runs/{run}/thumbnail.png", response_class=Response, responses={200: {"content": {"image/png": {}}}})
def thumbnail(run: ARun, store: AStore) -> Response:
    """Return a picture of the frame at which a run was saved."""
    path = store.files.thumbnail(run.id)
    if not path.exists():
        raise not_found("The picture of this run is missing.")
    return requests.kept_picture(path.read_bytes(), "image/png")


@router.post("/runs/{run}/open", status_code=HTTPStatus.CREATED)
async def open_run(run: ARun, store: AStore, begin: Begin, tasks: TheTasks) -> SessionPublic:
    """Continue a saved run in a new session."""
    session = await begin(await reopen(store, tasks, run), partial(runs.compare, store, tasks, run))
    return session.view()


@router.post("/comparisons/saved", status_code=HTTPStatus.CREATED)
def save_comparison(
    body: comparisons.SavedComparisonCreate, store: AStore, settings: SettingsNow
) -> SavedComparisonPublic:
    """Save a comparison under a name."""
    return comparisons.saved_view(comparisons.save(store, settings, body))


@router.get("/comparisons/saved")
def list_saved_comparisons(store: AStore) -> list[SavedComparisonPublic]:
    """List all saved comparisons, newest first."""
    return [comparisons.saved_view(row) for row in store.all(ComparisonRow)]


@router.get("/comparisons/saved/{saved}")
def show_saved_comparison(saved: AComparison) -> SavedComparisonDetail:
    """Return a saved comparison with its recipes."""
    return comparisons.detail_view(saved)


@router.patch("/comparisons/saved/{saved}")
def rename_comparison(saved: AComparison, body: NewTitle, store: AStore) -> SavedComparisonPublic:
    """Rename a saved comparison."""
    store.rename(saved, body.title)
    return comparisons.saved_view(saved)


@router.delete("/comparisons/saved/{saved}", status_code=HTTPStatus.NO_CONTENT)
def remove_comparison(saved: AName, store: AStore) -> None:
    """Delete a saved comparison, even one with a damaged entry in the database."""
    store.discard(ComparisonRow, saved)


@uploads.delete("/{upload}", status_code=HTTPStatus.NO_CONTENT)
async def remove_upload(upload: AName, store: AStore, manager: AManager, sweeps: ASweeps) -> None:
    """Delete an upload that no session or running sweep needs, even one with a damaged entry in the database."""
    if manager.uses(upload):
        raise ConflictError("A session runs on this upload; end the session first.")
    try:
        found = await asyncio.to_thread(store.get, UploadRow, upload) if is_name(upload) else None
    except ApiError:
        found = None  # No sweep runs on an unreadable upload.
    if found is not None and sweeps.uses(found):
        raise ConflictError("A sweep on this upload is being computed; wait, or cancel it first.")
    await asyncio.to_thread(store.discard, UploadRow, upload)


@router.get("/work")
async def find_work(
    manager: AManager,
    sweeps: ASweeps,
    store: AStore,
    q: Annotated[str, Query(max_length=200, description="Words that must all occur: title, tracker, date ...")] = "",
    show: Annotated[Kind | None, Query(description="List only items of this kind; others are counted.")] = None,
    limit: Annotated[int, Query(ge=1, le=MOST, description="Most items of each kind to list.")] = 20,
    zone: Annotated[ZoneInfo, Query(description="Time zone for dates in the search.")] = UTC,
) -> WorkPublic:
    """Find sessions, saved runs, comparisons, sweeps and uploads by words, newest first."""
    words = Words(q)
    now = datetime.now(zone)
    saved, uploads = await asyncio.gather(asyncio.to_thread(store.all, RunRow), asyncio.to_thread(store.all, UploadRow))
    there: dict[Kind, Sequence[Any]] = {
        "sessions": [session.view() for session in manager.all if session.spec.description],
        "runs": saved,
        "comparisons": [comparisons.saved_view(row) for row in await asyncio.to_thread(store.all, ComparisonRow)],
        "sweeps": [sweep.view() for sweep in sweeps.all],
        "uploads": uploads,
    }
    found = {
        kind: [it for it in things if words.occur_in(*_texts_of(it), date_words(it.created, now))]
        for kind, things in there.items()
    }
    listed = {kind: things[:limit] if show in {None, kind} else [] for kind, things in found.items()}
    counts = [{kind: len(things) for kind, things in each.items()} for each in (found, there)]
    return WorkPublic.model_validate({**listed, "found": counts[0], "total": counts[1]}, from_attributes=True)


def _texts_of(thing: Any) -> tuple[object, ...]:  # noqa: ANN401 - of any kind of work
    """Return the searchable texts of an item."""
    match thing:
        case SessionPublic(recipe=recipe, tracker=tracker):
            words = experiment_words(recipe.experiment, [tracker])
            return thing.name, thing.title, words, f"seed {recipe.seed}", thing.state
        case RunRow(tracker=tracker):
            return thing.title, experiment_words(thing.experiment, [tracker]), thing.outcome, f"seed {thing.seed}"
        case SavedComparisonPublic(trackers=trackers):
            return thing.title, *(experiment_words(experiment, trackers) for experiment in thing.experiments)
        case SweepPublic(trackers=trackers):
            words = experiment_words(thing.experiment, [tracker.id for tracker in trackers])
            return thing.title, words, thing.outcome, thing.state
        case _:
            return thing.name, thing.kind


jobs = APIRouter(tags=["jobs"])
TheExplorations = Annotated[Explorations, service(Explorations)]

PlotId = Annotated[str | None, Query(max_length=64, description="Id of the one plot to show; all by default.")]


@jobs.get("/jobs", response_model=list[AnyJob])
async def list_jobs(house: TheHouse) -> list[Job[Any]]:
    """List running jobs, and those that ended in the last ten minutes, newest first."""
    return house.jobs.all()


@jobs.get("/jobs/{job}", response_model=AnyJob)
async def show_job(job: AName, house: TheHouse) -> Job[Any]:
    """Return a job's progress and result; a job that no client polls is dropped after 150 s."""
    return house.jobs.get(job)


@jobs.delete("/jobs/{job}", status_code=HTTPStatus.NO_CONTENT)
async def cancel_job(job: AName, house: TheHouse) -> None:
    """Stop a job, or delete its result."""
    await house.jobs.cancel(job)


@jobs.get("/jobs/{job}/file", response_class=FileResponse)
async def fetch_file(job: AName, house: TheHouse) -> FileResponse:
    """Return the file of an export; it is kept for ten minutes."""
    found = house.jobs.get(job)
    if not isinstance(found, ExportJob):
        raise not_found("This job writes no file.")
    if found.result is None:
        raise ConflictError(found.error or "The file is still being written; ask again when it is done.")
    return FileResponse(
        house.store.files.exported(job),
        media_type=found.result.media_type,
        filename=found.name,
        headers={"Cache-Control": "no-store"},
    )


@jobs.post("/sessions/{session}/exports/{export}", status_code=HTTPStatus.ACCEPTED)
async def export_session(
    session: ASession, export: AName, house: TheHouse, explorations: TheExplorations, plot: PlotId = None
) -> ExportJob:
    """Begin to export the computed frames of a session's active branch."""
    name, found = session.snapshot.name, explorations.found_of(session)
    return await runs.export_run(house, session.spec, name, export, plot, found)


@jobs.post("/sessions/{session}/fits", status_code=HTTPStatus.ACCEPTED)
async def fit_session(session: ASession, body: runs.FitCreate, house: TheHouse) -> FitJob:
    """Begin to fit parameters to the computed frames of a session's active branch; the session continues."""
    return await runs.fit(house, session, tuple(body.numbers))


@jobs.post("/sessions/{session}/explorations", status_code=HTTPStatus.ACCEPTED)
async def explore(session: ASession, body: ExplorationCreate, explorations: TheExplorations) -> ExplorationJob:
    """Begin to search for changes that would have saved the active branch, or to run its settings with other seeds."""
    return await explorations.explore(session, body)


@jobs.get("/runs/{run}/exports")
def list_exports(run: ARun) -> ExportsPublic:
    """List the exports of a saved run."""
    experiment = find_experiment(run.experiment)
    return ExportsPublic(exports=list(exports_of(experiment)), plots=list(experiment.display.plots))


@jobs.post("/runs/{run}/exports/{export}", status_code=HTTPStatus.ACCEPTED)
async def export_run(run: ARun, export: AName, house: TheHouse, plot: PlotId = None) -> ExportJob:
    """Begin to export a saved run."""
    return await runs.export_run(house, await reopen(house.store, house.tasks, run), run.title, export, plot)


@jobs.post("/comparisons", status_code=HTTPStatus.ACCEPTED)
async def compare_runs(body: ComparisonCreate, request: Request, house: TheHouse) -> ComparisonJob:
    """Compare two to four runs: the answer lists the differences at once, results follow once the runs are computed."""
    return await requests.unless_client_gone(request, comparisons.compare(house, body.runs))


@jobs.post("/comparisons/exports/{export}", status_code=HTTPStatus.ACCEPTED)
async def export_comparison(
    export: AName, body: ComparisonExportCreate, request: Request, house: TheHouse
) -> ExportJob:
    """Begin to write a comparison of two to four runs as a file."""
    return await requests.unless_client_gone(request, runs.export_comparison(house, body.runs, body.title, export))


@jobs.get("/queue/{ticket}")
async def show_place(
    ticket: Annotated[str, Path(pattern=TICKET)], queues: Annotated[Queues, service(Queues)]
) -> QueuePublic:
    """Return the number of requests before that of a ticket; 0 once it is processed."""
    return QueuePublic(before=queues.before(ticket))


class SourceCodeRequest(RequestBody):
    """The runs to write as source code: one, or several to compare."""

    runs: list[ComparedRun] = Field(min_length=1, max_length=4)
    frames: Annotated[int, Field(ge=1, le=10_000_000), NOT_BOOLEAN] | None = Field(None, description="Frames per run")


source_code = APIRouter(tags=["source code"])


@source_code.post("/source-code")
async def write_source_code(body: SourceCodeRequest, house: TheHouse) -> SourceCode:
    """Return source code that computes a run again, or compares several. It omits the truth of a recording."""
    named = await asyncio.gather(*(find_run(run, house) for run in body.runs))
    recipes = [each.spec.recipe.with_footage(truth=None) for each in named]
    runs = [(recipe, find_experiment(recipe.experiment)) for recipe in recipes]
    return run_code(*runs[0], body.frames) if len(runs) == 1 else comparison_code(runs, body.frames)


@source_code.get("/sweeps/{sweep}/source-code")
async def write_sweep_code(sweep: ASweep) -> SourceCode:
    """Return source code that computes a sweep again."""
    return sweep_code(sweep.plan)
