"""Routes of sweeps: plan, begin, watch, query, open a run, and download the complete or partial result."""

import asyncio
import shutil
from collections.abc import Mapping
from dataclasses import replace
from http import HTTPStatus
from typing import Annotated

from fastapi import APIRouter, Depends, Path, Query, WebSocket
from starlette.background import BackgroundTask
from starlette.responses import FileResponse, Response, StreamingResponse

from pftrack.core.refusal import ConflictError
from pftrack.process import UNLIMITED
from pftrack.sweep.axis import MOST_RUNS
from pftrack.sweep.cells import Correction, UsedTest
from pftrack.sweep.journal import csv_pieces
from pftrack_server.core.bodies import Name, RequestBody
from pftrack_server.core.requests import AName, AnExperiment, SettingsNow, service
from pftrack_server.jobs.child_tasks import TheTasks
from pftrack_server.sessions.duplex import converse
from pftrack_server.sessions.routes import Begin
from pftrack_server.sessions.stream import SessionPublic
from pftrack_server.store.store import AStore
from pftrack_server.sweeps import functions
from pftrack_server.sweeps.functions import Form
from pftrack_server.sweeps.manager import EstimatePublic, Sweeps
from pftrack_server.sweeps.planning import EstimateRequest, SweepCreate, example
from pftrack_server.sweeps.results import CellsPublic, RowsPublic, session_spec
from pftrack_server.sweeps.sweep import Sweep, SweepPublic


class OpenRequest(RequestBody):
    """The method with which to open a run; by default its own."""

    tracker: Name | None = None


router = APIRouter(tags=["sweeps"])

ASweeps = Annotated[Sweeps, service(Sweeps)]


async def _sweep(sweep: AName, sweeps: ASweeps) -> Sweep:
    return sweeps.get(sweep)


ASweep = Annotated[Sweep, Depends(_sweep)]

MOST_ROWS = 500
Axis = Annotated[str | None, Query(max_length=64, description="Name of an axis; `none` pools all values.")]
Method = Annotated[str | None, Query(max_length=64, description="Name of a tracker of the sweep.")]
Compared = Annotated[
    str, Query(max_length=64, description="Quantity to compare two trackers by: `success`, `error` or a measure.")
]
Place = Annotated[int, Query(ge=0, le=2_000_000)]


@router.get("/experiments/{experiment}/sweep", response_model_exclude_none=True)
def show_example(experiment: AnExperiment) -> SweepCreate:
    """Return a filled-in example of a sweep of an experiment."""
    return example(experiment)


@router.post("/sweeps/estimate")
async def estimate(body: EstimateRequest, sweeps: ASweeps) -> EstimatePublic:
    """Return the numbers of runs and cells of a sweep, and the time that it would take, without starting it."""
    return await sweeps.estimate(body)


@router.post("/sweeps", status_code=HTTPStatus.CREATED)
async def begin_sweep(body: SweepCreate, sweeps: ASweeps) -> SweepPublic:
    """Begin a sweep."""
    return (await sweeps.create(body)).view()


@router.get("/sweeps")
async def list_sweeps(sweeps: ASweeps) -> list[SweepPublic]:
    """List all sweeps, newest first."""
    return [sweep.view() for sweep in sweeps.all]


@router.get("/sweeps/{sweep}")
async def show_sweep(sweep: ASweep) -> SweepPublic:
    """Return a sweep and its progress."""
    return sweep.view()


@router.delete("/sweeps/{sweep}", status_code=HTTPStatus.NO_CONTENT)
async def remove_sweep(sweep: AName, sweeps: ASweeps) -> None:
    """Delete a sweep with all its results; a running one is stopped first."""
    await sweeps.remove(sweep)


@router.post("/sweeps/{sweep}/cancel")
async def cancel_sweep(sweep: ASweep, sweeps: ASweeps) -> SweepPublic:
    """Stop computing a sweep; computed runs are kept."""
    await sweeps.cancel(sweep)
    return sweep.view()


@router.post("/sweeps/{sweep}/resume")
async def resume_sweep(sweep: ASweep, sweeps: ASweeps) -> SweepPublic:
    """Resume a stopped sweep."""
    await sweeps.resume(sweep)
    return sweep.view()


@router.get("/sweeps/{sweep}/cells")
async def show_cells(
    sweep: ASweep,
    x: Axis = None,
    y: Axis = None,
    first: Method = None,
    second: Method = None,
    measure: Compared = "success",
    test: UsedTest = "mcnemar",
    level: Annotated[float, Query(gt=0, lt=1)] = 0.01,
    correction: Correction = "none",
) -> CellsPublic:
    """Return every method's map over two axes, the others pooled, and on request a comparison of two methods."""
    await sweep.look()
    found = await sweep.cells(x, y)
    if first is None or second is None:
        return found
    compare = sweep.results.compare
    against = await asyncio.to_thread(compare, x, y, first, second, measure, test, level, correction)
    return found.model_copy(update={"comparison": against})


@router.get("/sweeps/{sweep}/rows")
async def list_rows(
    sweep: ASweep,
    i: Place = 0,
    j: Place = 0,
    x: Axis = None,
    y: Axis = None,
    tracker: Method = None,
    offset: Annotated[int, Query(ge=0, le=2_000_000)] = 0,
    limit: Annotated[int, Query(ge=1, le=MOST_ROWS)] = 50,
) -> RowsPublic:
    """Return runs of the cell at value i of x and j of y, from 0, failures first."""
    return await asyncio.to_thread(sweep.results.rows, x, y, (i, j), tracker, offset, limit)


@router.post("/sweeps/{sweep}/rows/{run}/open", status_code=HTTPStatus.CREATED)
async def open_row(
    sweep: ASweep,
    run: Annotated[int, Path(ge=0, le=MOST_RUNS)],
    store: AStore,
    begin: Begin,
    body: OpenRequest | None = None,
) -> SessionPublic:
    """Start a session with exactly this run, or the same with another method, shortly before the first loss."""
    tracker = body.tracker if body else None
    spec = await asyncio.to_thread(session_spec, store, sweep.row.id, sweep.plan, sweep.results, run, tracker)
    return (await begin(spec, None)).view()


WRITING_S = 120.0

FORMS: Mapping[Form, tuple[str, str]] = {
    "parquet": ("parquet", "application/vnd.apache.parquet"),
    "csv": ("csv", "text/csv"),
    "html": ("html", "text/html"),
    "png": ("zip", "application/zip"),
    "svg": ("zip", "application/zip"),
}
"""Suffix and media type of each file format."""


@router.get(
    "/sweeps/{sweep}/download",
    response_class=Response,
    responses={200: {"content": {media_type: {} for _, media_type in FORMS.values()}}},
)
async def download(
    sweep: ASweep,
    store: AStore,
    settings: SettingsNow,
    tasks: TheTasks,
    form: Annotated[Form, Query(alias="format", description="png and svg are archives of all maps.")] = "parquet",
) -> Response:
    """Return the results so far as a file: all runs as Parquet or CSV, or a report as one page or as pictures."""
    await sweep.look()
    if sweep.row.done == 0:
        raise ConflictError("No run of this sweep has been computed yet.")
    name = f"{sweep.plan.experiment}-sweep-{sweep.row.id[:6]}"
    suffix, media_type = FORMS[form]
    if form == "csv":
        headers = {"Content-Disposition": f'attachment; filename="{name}.csv"'}
        result = await asyncio.to_thread(sweep.results.result)
        return StreamingResponse(csv_pieces(result), media_type=media_type, headers=headers)
    whole = store.files.sweep(sweep.row.id)
    if form == "parquet" and whole.exists():
        return FileResponse(whole, media_type=media_type, filename=f"{name}.{suffix}")
    store.disk_budget.check()
    folder = store.files.new_outgoing()
    folder.mkdir(mode=0o700)
    after = BackgroundTask(shutil.rmtree, folder, ignore_errors=True)
    try:
        path = folder / f"sweep.{suffix}"
        filters = await asyncio.to_thread(store.files.filters_of, sweep.plan.single(0).recipe)
        budget = replace(UNLIMITED, silence_s=WRITING_S, file_bytes=settings.max_sweeps_bytes)
        await tasks.run_beside(functions.write, whole, path, form, filters, budget=budget)
        return FileResponse(path, media_type=media_type, filename=f"{name}.{suffix}", background=after)
    except BaseException:
        shutil.rmtree(folder, ignore_errors=True)
        raise


@router.websocket("/sweeps/{sweep}/stream")
async def stream(websocket: WebSocket, sweep: ASweep, x: str | None = None, y: str | None = None) -> None:
    """Send a page the complete state, then every change until one of the two leaves."""
    await websocket.accept()
    await sweep.look()
    await sweep.cells(x, y)
    with sweep.join(x, y) as listener:
        await converse(websocket, listener, "The sweep was deleted, or the server was stopped.")
