"""Routes of the gallery of failures: the list, one failure, and the results of its runs."""

from typing import Annotated

from fastapi import APIRouter, Depends
from pydantic import BaseModel, Field

from pftrack.analysis.failures import Entry, entry, gallery
from pftrack.core.model.parameters import Value, declarations, flat, revise
from pftrack.core.model.preset import KINDS, CauseId
from pftrack.core.model.recipe import Recipe, parameter_values
from pftrack.core.refusal import RefusedError
from pftrack.experiments import EXPERIMENTS
from pftrack_server.core.bodies import fields_of
from pftrack_server.core.errors import not_found
from pftrack_server.core.requests import AName
from pftrack_server.jobs.functions import FailureResult, run_with_and_without_cure
from pftrack_server.jobs.results import TheResults


class DifferencePublic(BaseModel):
    """One setting that the cure changes."""

    title: str
    unit: str
    failing: Value
    cured: Value


class FailureNeighbour(BaseModel):
    """The failure before another in the gallery, or the one after it."""

    id: str
    title: str


class FailurePublic(BaseModel):
    """A named failure of an experiment's trackers, and its cure."""

    id: str
    number: int = Field(description="Number in the gallery; usable in addresses in place of the id")
    title: str
    kind: str
    kind_title: str
    cause: CauseId = Field(description="First cause in the diagnosis of its run")
    experiment: str
    experiment_title: str
    diagnosis: str = Field(description="Failure and its reason")
    cure: str = Field(description="Remedy and its reason")
    frame: int = Field(description="The frame before it happens")
    differences: list[DifferencePublic] = Field(description="Settings that the cure changes at frame 0")
    failing: Recipe
    cured: Recipe
    page: str
    previous: FailureNeighbour | None
    next: FailureNeighbour | None


def failure_named(failure: AName) -> Entry:
    """Return a failure by its id or its number.

    Raises:
        ApiError: The failure does not exist, or its experiment is not installed (404).
    """
    try:
        return entry(EXPERIMENTS, failure)
    except RefusedError:
        raise not_found(
            f"No installed experiment has a failure {failure[:64]!r}. "
            f"Name one of the {len(gallery(EXPERIMENTS))} failures by its number or name."
        ) from None


router = APIRouter(prefix="/failures", tags=["failures"])


AFailure = Annotated[Entry, Depends(failure_named)]


@router.get("")
def list_failures() -> list[FailurePublic]:
    """List the failures in order of their numbers."""
    return [_public(each) for each in gallery(EXPERIMENTS)]


@router.get("/{failure}")
def show_failure(failure: AFailure) -> FailurePublic:
    """Return the declaration of a failure, by its id or number."""
    return _public(failure)


@router.get("/{failure}/course")
async def course_of_failure(failure: AFailure, results: TheResults) -> FailureResult:
    """Return the results of a failure's run and of the cured one: errors, and the numbers that show the failure."""
    course = await results.get(failure.experiment.id, run_with_and_without_cure, failure.failure.id)
    return FailureResult.model_validate(course)


def _public(shown: Entry) -> FailurePublic:
    """Return the declaration of a failure."""
    failure, experiment = shown.failure, shown.experiment
    known = fields_of(FailurePublic, failure) | {
        "number": shown.number,
        "kind_title": KINDS[failure.kind],
        "experiment": experiment.id,
        "experiment_title": experiment.title,
        "cure": failure.cure.text,
        "differences": _differences(shown),
        "failing": shown.recipe(),
        "cured": shown.recipe(cured=True),
        "page": f"failures/{failure.id}",
        "previous": _neighbour(shown.number - 1),
        "next": _neighbour(shown.number + 1),
    }
    return FailurePublic(**known)


def _neighbour(number: int) -> FailureNeighbour | None:
    found = [each.failure for each in gallery(EXPERIMENTS) if each.number == number]
    return FailureNeighbour(id=found[0].id, title=found[0].title) if found else None


def _differences(shown: Entry) -> list[DifferencePublic]:
    """Return the settings that differ between the two runs, with the experiment's titles."""
    failure, experiment = shown.failure, shown.experiment
    parameters = experiment.simulate().parameters
    before, after = (
        flat(revise(parameters, parameter_values(values)))
        for values in (failure.parameters, {**failure.parameters, **failure.cure.values})
    )
    found = [
        DifferencePublic(title=it.title, unit=it.unit, failing=before[it.name], cured=after[it.name])
        for it in declarations(type(parameters))
        if before[it.name] != after[it.name]
    ]
    trackers: list[Value] = [
        experiment.trackers[str(name)].title for name in (failure.tracker, failure.cure.values.get("tracker")) if name
    ]
    if len(set(trackers)) > 1:
        found.insert(0, DifferencePublic(title="Tracker", unit="", failing=trackers[0], cured=trackers[1]))
    return found
