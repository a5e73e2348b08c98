"""Source code: what computes runs, comparisons and sweeps again, as Python and as a command."""

import asyncio
from typing import Annotated

from fastapi import APIRouter
from pydantic import Field

from pftrack.core.model.parameters import NOT_BOOLEAN
from pftrack.experiments import find as find_experiment
from pftrack.runs.reproduction import SourceCode, comparison_code, run_code
from pftrack.sweep.work import sweep_code
from pftrack_server.core.bodies import RequestBody
from pftrack_server.sweeps.routes import ASweep
from pftrack_server.work.routes import TheHouse
from pftrack_server.work.sources import ComparedRun, find_run


class SourceCodeRequest(RequestBody):
    """Of which runs: of one, or of several that are compared."""

    runs: list[ComparedRun] = Field(min_length=1, max_length=4)
    frames: Annotated[int, Field(ge=1, le=10_000_000), NOT_BOOLEAN] | None = Field(
        None, description="How many frames of each; all if left out"
    )


router = APIRouter(tags=["source code"])


@router.post("/source-code")
async def write_source_code(body: SourceCodeRequest, house: TheHouse) -> SourceCode:
    """Write what computes runs again; of several, what compares them. The truth of a recording is no part of it."""
    named = await asyncio.gather(*(find_run(run, house) for run in body.runs))
    recipes = [each.spec.recipe.with_footage(truth=None) for each in named]
    runs = [(recipe, find_experiment(recipe.experiment)) for recipe in recipes]
    return run_code(*runs[0], body.frames) if len(runs) == 1 else comparison_code(runs, body.frames)


@router.get("/sweeps/{sweep}/source-code")
async def write_sweep_code(sweep: ASweep) -> SourceCode:
    """Write what computes a sweep again."""
    return sweep_code(sweep.plan)
