"""Checks of the failures that an experiment declares: each is diagnosed as what it is, and its cure still cures."""

from collections.abc import Iterator
from dataclasses import replace
from functools import partial

from pftrack.analysis.diagnosis.course import course_of
from pftrack.analysis.diagnosis.diagnosis import diagnose_course
from pftrack.analysis.failures import Entry, FailureRun, run_failure
from pftrack.core.model.preset import CAUSES
from pftrack.experiments.experiment import Experiment
from pftrack.testing.check import Check, demand
from pftrack.testing.numbers import UNKNOWN

MARKED = 7
"""A mark in so many pictures."""
AT_END = 5
"""So many frames at the end decide whether the target is held."""


def checks(experiment: Experiment) -> Iterator[Check]:
    """Yield a check of each failure."""
    for number, failure in enumerate(experiment.failures, 1):
        shown = Entry(number, experiment, failure)
        yield Check(
            f"each failure fails in its way, and its cure cures ({failure.id})", partial(_fails_and_is_cured, shown)
        )


def _fails_and_is_cured(shown: Entry) -> None:
    failure, cured, name = run_failure(shown), run_failure(shown, cured=True), shown.failure.id
    frame = shown.failure.frame
    demand(frame + 1 < len(failure.rows), f"{name} must stand before its last frame, got {frame}")
    demand(not failure.rows[frame].is_lost, f"{name} must stand at a frame in which the target is held, got {frame}")
    demand(failure.rows[frame + 1].is_lost, f"{name} must stand at the frame before the loss, got {frame}")
    cause = CAUSES[shown.failure.cause]
    demand(failure.shown, f"{name} must be diagnosed as {cause}, got: {failure.diagnosis.sentence}")
    demand(_lost_at_end(failure) == AT_END, f"{name} must end with {AT_END} lost frames")
    demand(not cured.shown, f"the cure of {name} must cure, got: {cured.finding}")
    demand(_lost_at_end(cured) == 0, f"the cure of {name} must hold the target in the last {AT_END} frames")
    demand(cured.recipe.seed == failure.recipe.seed, f"the cure of {name} must be shown on the same seed")
    _is_told_by_marks(shown, failure)


def _is_told_by_marks(shown: Entry, failure: FailureRun) -> None:
    """Ask what is said where a person has marked the target in few pictures: no number that is not known."""
    series, unit = shown.experiment.all_series(), shown.experiment.unit
    rows = [row if row.frame % MARKED == 0 else replace(row, **UNKNOWN) for row in failure.rows]
    course = course_of(rows, series, unit=unit)
    for frame in range(0, len(rows), 10):
        for sign in diagnose_course(course, frame).signs:
            demand("nan" not in sign.words, f"{shown.failure.id} must be told by what is known, got: {sign.words}")


def _lost_at_end(done: FailureRun) -> int:
    return sum(row.is_lost for row in done.rows[-AT_END:])
