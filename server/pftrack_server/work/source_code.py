"""Source code: what computes runs, comparisons and sweeps again, as Python and as a command."""

import asyncio

from fastapi import APIRouter

from pftrack.runs.reproduction import comparison_code, run_code
from pftrack.sweep.work import sweep_code
from pftrack_server.core.experiments import find_experiment
from pftrack_server.schemas.source_code import SourceCodePublic, SourceCodeRequest
from pftrack_server.sweeps.routes import ASweep
from pftrack_server.work.routes import TheHouse
from pftrack_server.work.sources import find_run

router = APIRouter(tags=["source code"])


@router.post("/source-code")
async def write_source_code(body: SourceCodeRequest, house: TheHouse) -> SourceCodePublic:
    """Write what computes runs again; of several, what compares them. The truth of a recording is no part of it."""
    named = await asyncio.gather(*(find_run(run, house) for run in body.runs))
    recipes = [each.spec.recipe.with_footage(truth=None) for each in named]
    runs = [(recipe, find_experiment(recipe.experiment)) for recipe in recipes]
    made = run_code(*runs[0], body.frames) if len(runs) == 1 else comparison_code(runs, body.frames)
    return SourceCodePublic.model_validate(made)


@router.get("/sweeps/{sweep}/source-code")
async def write_sweep_code(sweep: ASweep) -> SourceCodePublic:
    """Write what computes a sweep again."""
    return SourceCodePublic.model_validate(sweep_code(sweep.plan))
