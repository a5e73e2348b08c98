"""The gallery of failures: those of all experiments in one order, each with a number, and their runs.

It takes the experiments as an argument, a mapping by name, so that it knows none.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from pftrack.diagnosis import Diagnosis, diagnose
from pftrack.experiment import Experiment
from pftrack.model.diagnostics import Diagnostics
from pftrack.model.failure import ORDER, Failure, Finding
from pftrack.model.recipe import Recipe
from pftrack.runs.run import Run

__all__ = ["Entry", "FailureRun", "entry", "gallery", "run_failure"]


@dataclass(frozen=True)
class Entry:
    """A failure in the gallery.

    Attributes:
        number: Its place, from 1 on; it stands for the id in commands and addresses.
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
        recipe: What made it.
        rows: The diagnostics of all its frames.
        finding: What the symptom found in them.
        diagnosis: Why the target was lost, as a run that nobody has declared is told.
    """

    recipe: Recipe
    rows: tuple[Diagnostics, ...]
    finding: Finding
    diagnosis: Diagnosis


def gallery(experiments: Mapping[str, Experiment]) -> tuple[Entry, ...]:
    """Return all failures: those that a course names in its order, then the others by experiment.

    Of two with one id that of the experiment that comes first is kept.
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
        LookupError: There is none; the sentence lists those that there are.
    """
    entries = gallery(experiments)
    for each in entries:
        if name in {each.failure.id, str(each.number)}:
            return each
    known = ", ".join(f"{each.number} {each.failure.id}" for each in entries)
    raise LookupError(f"there is no failure {name!r} here; there are {known}")


def run_failure(shown: Entry, *, cured: bool = False, seed: int | None = None) -> FailureRun:
    """Return the finished run of a failure, on its own seed unless another is given."""
    recipe = shown.recipe(cured=cured, seed=seed)
    run = Run.from_recipe(recipe, shown.experiment, shown.experiment.simulate())
    run.finish()
    rows = tuple(run.diagnostics)
    return FailureRun(run.recipe, rows, shown.failure.symptom(rows), diagnose(run))
