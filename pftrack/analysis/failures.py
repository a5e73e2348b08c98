"""The gallery of failures: those of all experiments in one order, each with a number, and their runs.

It takes the experiments as an argument, a mapping by name, so it does not import any.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from pftrack.analysis.diagnosis import Diagnosis, course_of_run, diagnose_course
from pftrack.analysis.diagnosis.course import COLUMNS, Course, Sign, middle
from pftrack.core.model.preset import ORDER, Failure
from pftrack.core.model.recipe import Recipe
from pftrack.core.model.series import Known
from pftrack.core.model.tracker import Diagnostics
from pftrack.core.refusal import ParameterError
from pftrack.experiments.experiment import Experiment
from pftrack.runs.loss import loss_words
from pftrack.runs.run import Run


@dataclass(frozen=True)
class Entry:
    """A failure in the gallery.

    Attributes:
        number: Its place, from 1 on, which replaces the id in commands and addresses.
        experiment: The one that shows it.
        failure: The failure.
    """

    number: int
    experiment: Experiment
    failure: Failure

    def recipe(self, *, cured: bool = False, seed: int | None = None) -> Recipe:
        """Return what makes its run, or the cured one."""
        return self.failure.recipe(self.experiment.id, cured=cured, seed=seed)


@dataclass(frozen=True)
class FailureRun:
    """A run of a failure, cured or not.

    Attributes:
        recipe: Its recipe.
        rows: The diagnostics of all its frames.
        course: Their values over time.
        diagnosis: The diagnosis of the loss, as for any other run.
        sign: Sign of the failure's cause, if the diagnosis ranks it first and the target stays lost; else None.
    """

    recipe: Recipe
    rows: tuple[Diagnostics, ...]
    course: Course
    diagnosis: Diagnosis
    sign: Sign | None

    @property
    def shown(self) -> bool:
        """Whether it fails in this way."""
        return self.sign is not None

    @property
    def finding(self) -> str:
        """The evidence in its numbers, a sentence."""
        if self.sign is not None:
            return self.sign.words
        loss = self.course.loss
        words = loss_words(len(loss.lost), loss.lost_frames or 0, loss.first_lost_frame)
        end = "" if loss.first_lost_frame is None else f", and {'held' if loss.held_at_end else 'not held'} at the end"
        return f"{words}{end}."


@dataclass(frozen=True)
class Measured:
    """Evidence of a failure, in its run and in the cured one, in the frames from its loss to the end.

    Attributes:
        title: Its title, a few words.
        unit: Empty for the median of pure numbers; % for the share of the frames in which it holds.
        failing: In the run that fails; NaN where it has no such number.
        cured: In the cured one, in the same frames.
    """

    title: str
    unit: str
    failing: Known
    cured: Known


def gallery(experiments: Mapping[str, Experiment]) -> tuple[Entry, ...]:
    """Return all failures: those that a course names in its order, then the others by experiment.

    If two share an id, that of the first experiment is kept.
    """
    found: dict[str, tuple[Experiment, Failure]] = {}
    for experiment in experiments.values():
        for failure in experiment.failures:
            found.setdefault(failure.id, (experiment, failure))
    ranked = sorted(found, key=lambda name: ORDER.index(name) if name in ORDER else len(ORDER))
    return tuple(Entry(number, *found[name]) for number, name in enumerate(ranked, 1))


def entry(experiments: Mapping[str, Experiment], name: str) -> Entry:
    """Return a failure by its id or its number.

    Raises:
        ParameterError: The failure is unknown; the sentence lists all of them.
    """
    entries = gallery(experiments)
    for each in entries:
        if name in {each.failure.id, str(each.number)}:
            return each
    known = ", ".join(f"{each.number} {each.failure.id}" for each in entries)
    raise ParameterError("failure", name, f"one of {known}")


def run_failure(shown: Entry, *, cured: bool = False, seed: int | None = None) -> FailureRun:
    """Return the finished run of a failure, on its own seed unless another is given."""
    recipe = shown.recipe(cured=cured, seed=seed)
    run = Run.from_recipe(recipe, shown.experiment, shown.experiment.simulate())
    run.finish()
    rows, course = tuple(run.diagnostics), course_of_run(run)
    found = diagnose_course(course)
    fails = rows[-1].is_lost and found.lost and found.cause == shown.failure.cause
    return FailureRun(run.recipe, rows, course, found, found.signs[0] if fails else None)


def measure(failing: FailureRun, cured: FailureRun) -> tuple[Measured, ...]:
    """Return what shows the failure, in both runs; nothing if the one does not fail in its way."""
    if failing.sign is None or failing.diagnosis.frame is None:
        return ()
    frame = failing.diagnosis.frame
    found = [_measure(name, failing.course, cured.course, frame) for name in failing.sign.kind.evidence]
    return tuple(each for each in found if np.isfinite([each.failing, each.cured]).any())


def _measure(name: str, failing: Course, cured: Course, frame: int) -> Measured:
    column = COLUMNS[name]
    one, other = (getattr(course, name)[frame:] for course in (failing, cured))
    if column.is_flag:
        return Measured(column.title, "%", *(100.0 * float(np.mean(values)) for values in (one, other)))
    return Measured(column.title, failing.unit_of(name), middle(one), middle(other))
