"""Sweeps: plan, begin, watch, ask, and open a run."""

import asyncio
from http import HTTPStatus
from typing import Annotated

from fastapi import APIRouter, Path, Query

from pftrack.sweep.axis import MOST_RUNS
from pftrack_server.api.dependencies import AnExperiment, AStore, ASweep, ASweeps, Begin
from pftrack_server.schemas.messages import SessionPublic
from pftrack_server.schemas.sweep_views import CellsPublic, Correction, EstimatePublic, RowsPublic, SweepPublic, Test
from pftrack_server.schemas.sweeps import EstimateRequest, OpenRequest, SweepCreate
from pftrack_server.sweeps.examples import example
from pftrack_server.sweeps.opening import session_spec

router = APIRouter(tags=["sweeps"])

MOST_ROWS = 500
Axis = Annotated[str | None, Query(max_length=64, description="Name of an axis; `none` pools all values.")]
Method = Annotated[str | None, Query(max_length=64, description="Name of a tracker of the sweep.")]
Compared = Annotated[
    str, Query(max_length=64, description="What two trackers are compared by: `success`, `error`, or a measure's name.")
]
Place = Annotated[int, Query(ge=0, le=2_000_000)]


@router.get("/experiments/{experiment}/sweep", response_model_exclude_none=True)
def show_example(experiment: AnExperiment) -> SweepCreate:
    """Return a filled-in example of a sweep of an experiment."""
    return example(experiment)


@router.post("/sweeps/estimate")
async def estimate(body: EstimateRequest, sweeps: ASweeps) -> EstimatePublic:
    """Tell how many runs and cells a sweep would have, and how long it would take, without starting it."""
    return await sweeps.estimate(body)


@router.post("/sweeps", status_code=HTTPStatus.CREATED)
async def begin_sweep(body: SweepCreate, sweeps: ASweeps) -> SweepPublic:
    """Begin a sweep."""
    return (await sweeps.create(body)).view()


@router.get("/sweeps")
async def list_sweeps(sweeps: ASweeps) -> list[SweepPublic]:
    """List all sweeps, the newest first."""
    return [sweep.view() for sweep in sweeps.all]


@router.get("/sweeps/{sweep}")
async def show_sweep(sweep: ASweep) -> SweepPublic:
    """Tell about a sweep and how far it is."""
    return sweep.view()


@router.delete("/sweeps/{sweep}", status_code=HTTPStatus.NO_CONTENT)
async def remove_sweep(sweep: Annotated[str, Path(max_length=64)], sweeps: ASweeps) -> None:
    """Delete a sweep with everything that was computed of it; a running one is stopped first."""
    await sweeps.remove(sweep)


@router.post("/sweeps/{sweep}/cancel")
async def cancel_sweep(sweep: ASweep, sweeps: ASweeps) -> SweepPublic:
    """Stop computing a sweep; what was computed is kept."""
    await sweeps.cancel(sweep)
    return sweep.view()


@router.post("/sweeps/{sweep}/resume")
async def resume_sweep(sweep: ASweep, sweeps: ASweeps) -> SweepPublic:
    """Go on with a sweep that was stopped, by whatever."""
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
    test: Test = "chi-square",
    level: Annotated[float, Query(gt=0, lt=1)] = 0.01,
    correction: Correction = "none",
) -> CellsPublic:
    """Return the map of every method over two axes, the others pooled, and on request one method against another."""
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
    """Return runs of the cell with the i-th value of x and the j-th of y, from 0, failures first."""
    return await asyncio.to_thread(sweep.results.rows, x, y, (i, j), tracker, offset, limit)


@router.post("/sweeps/{sweep}/rows/{run}/open", status_code=HTTPStatus.CREATED)
async def open_row(
    sweep: ASweep,
    run: Annotated[int, Path(ge=0, le=MOST_RUNS)],
    store: AStore,
    begin: Begin,
    body: OpenRequest | None = None,
) -> SessionPublic:
    """Start a session with exactly this run, or the same with another method, ten frames before the first loss."""
    tracker = body.tracker if body else None
    spec = await asyncio.to_thread(session_spec, store, sweep.id, sweep.plan, sweep.results, run, tracker)
    return (await begin(spec)).view()
