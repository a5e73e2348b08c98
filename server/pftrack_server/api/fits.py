"""Fits: have numbers of a session's tracker fitted to what it has seen, and follow how far that is."""

from http import HTTPStatus
from typing import Annotated

from fastapi import APIRouter, Path

from pftrack_server.api.dependencies import ASession, TheFits
from pftrack_server.runs.fits import Fitting
from pftrack_server.schemas.fits import FitCreate, FitJobPublic, FitPublic
from pftrack_server.tasks.jobs import failure_of

router = APIRouter(tags=["fits"])

Name = Annotated[str, Path(max_length=64)]


@router.post("/sessions/{session}/fits", status_code=HTTPStatus.ACCEPTED)
async def fit_session(session: ASession, body: FitCreate, fits: TheFits) -> FitJobPublic:
    """Begin to fit numbers to the active branch of a session, as far as it was computed; the session goes on."""
    run = session.spec.run
    return _view(fits.fit(run.recipe, run.computed, run.position, tuple(body.numbers)))


@router.get("/fits/{name}")
async def show_fit(name: Name, fits: TheFits) -> FitJobPublic:
    """Tell how far a fit is, and what came of it; one that nobody asks for is dropped after 150 s."""
    return _view(fits.get(name))


@router.delete("/fits/{name}", status_code=HTTPStatus.NO_CONTENT)
async def cancel_fit(name: Name, fits: TheFits) -> None:
    """Stop a fit, or forget it."""
    await fits.cancel(name)


def _view(job: Fitting) -> FitJobPublic:
    known = {"id": job.id, "done": job.done, "total": job.total, "message": None, "found": None}
    if not job.task.done():
        return FitJobPublic(**known, state="fitting")
    message = failure_of(job)
    if message is not None:
        return FitJobPublic(**{**known, "message": message}, state="failed")
    return FitJobPublic(**{**known, "found": FitPublic.model_validate(job.task.result())}, state="done")
