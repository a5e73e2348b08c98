"""The gallery of failures: the list of them, each by itself, and what its runs come to."""

from typing import Annotated

from fastapi import APIRouter, Depends, Path

from pftrack.analysis.failures import Entry
from pftrack_server.jobs.functions import FailureResult, run_with_and_without_cure
from pftrack_server.jobs.results import TheResults
from pftrack_server.work.failures import FailurePublic, failure_named, failures, public

router = APIRouter(prefix="/failures", tags=["failures"])


def _failure(failure: Annotated[str, Path(max_length=64)]) -> Entry:
    return failure_named(failure)


AFailure = Annotated[Entry, Depends(_failure)]


@router.get("")
def list_failures() -> list[FailurePublic]:
    """List the failures, by their numbers."""
    return failures()


@router.get("/{failure}")
def show_failure(failure: AFailure) -> FailurePublic:
    """Tell what is declared of a failure, by its id or its number."""
    return public(failure)


@router.get("/{failure}/course")
async def course_of_failure(failure: AFailure, results: TheResults) -> FailureResult:
    """Tell how its run and the cured one went: their errors, and what shows the failure in their numbers."""
    course = await results.get(failure.experiment.id, run_with_and_without_cure, failure.failure.id)
    return FailureResult.model_validate(course)
