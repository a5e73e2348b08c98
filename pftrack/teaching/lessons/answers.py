"""Running a scenario: the answer of its question, computed from the numbers of the run that it asks for.

A demonstration's answer is a function of parameters and a seed; a scenario's is a function of columns. So the run that
the question speaks of is computed to its end, and its numbers are handed over by name.
"""

from collections.abc import Mapping
from typing import Any, TypeAlias

import numpy as np

from pftrack.core.model.diagnostics import Diagnostics
from pftrack.core.model.parameters import Parameters, revise
from pftrack.core.model.recipe import Recipe
from pftrack.experiments.experiment import Experiment
from pftrack.runs.columns import PREFIX, columns_of
from pftrack.runs.record import make
from pftrack.runs.run import Change, Run
from pftrack.teaching.lessons.lesson import Answer, Demonstration, Lesson, Scenario

__all__ = ["Columns", "all_columns", "answer_of", "figure_numbers", "numbers_of", "numbers_of_run", "question_recipe"]

WIDE = 8
"""Numbers of a vector whose length hangs on the run, as far as it is known without one."""

Columns: TypeAlias = Mapping[str, np.ndarray[Any, Any]]
"""The numbers of a run by name, one row a frame."""


def question_recipe(lesson: Lesson) -> Recipe:
    """Return the run that a scenario's question is about: the scenario's own, with the values at which it is asked.

    Raises:
        TypeError: The lesson is no scenario.
    """
    if not isinstance(lesson.body, Scenario):
        raise TypeError(f"the lesson {lesson.id} is a demonstration, which has no run")
    recipe, values = lesson.body.recipe, dict(lesson.question.at or {})
    seed = values.pop("seed", recipe.seed)
    timeline = (*recipe.timeline, Change(0, values)) if values else recipe.timeline
    return Recipe(**{**dict(recipe), "seed": seed, "timeline": timeline})


def numbers_of(recipe: Recipe) -> Columns:
    """Compute a run to its end and return its numbers.

    Raises:
        RecordError: There is no such experiment, or a value is refused.
    """
    run = make(recipe)
    run.finish()
    return numbers_of_run(run)


def numbers_of_run(run: Run) -> Columns:
    """Return the columns of the frames that a run has computed.

    A series has the name that it was declared with, and `series_NAME` as well, as in files; where a frame has a column
    of that name already, only the latter.
    """
    columns = columns_of(run)
    return {name.removeprefix(PREFIX): column for name, column in columns.items()} | columns


def figure_numbers(body: Demonstration, parameters: Parameters, seed: int) -> Columns:
    """Return the numbers of a figure in their order: `value`, and `exact`, NaN where that is not known."""
    numbers = body.show(parameters, seed).numbers
    return {
        "value": np.array([number.value for number in numbers]),
        "exact": np.array([np.nan if number.exact is None else number.exact for number in numbers]),
    }


def all_columns(experiment: Experiment, frames: int) -> Columns:
    """Return all columns that a run may have, with ones in place of its numbers: their names and shapes."""
    ones = Diagnostics(
        0, 1.0, (1.0,) * WIDE, (1.0,) * WIDE, 1.0, (1.0,) * WIDE, (1.0, 1.0), (1.0,) * WIDE, 1.0, True, True, True, 1.0
    )
    known: dict[str, Any] = {name: value for name, value in ones.as_dict().items() if name != "series"}
    columns = {name: np.ones((frames, *np.shape(value))) for name, value in known.items()}
    for series in experiment.all_series():
        width = (len(series.components) or WIDE,)
        match series.shape:
            case "number":
                shapes: dict[str, tuple[int, ...]] = {"": ()}
            case "vector":
                shapes = {"": width}
            case "interval":
                shapes = {"": (2,)}
            case "hypotheses":
                shapes = {"": (WIDE, *width), "_weights": (WIDE,), "_parents": (WIDE,)}
        for ending, shape in shapes.items():
            name = f"{series.name}{ending}"
            columns[f"{PREFIX}{name}"] = np.ones((frames, *shape))
            columns.setdefault(name, columns[f"{PREFIX}{name}"])
    return columns


def answer_of(lesson: Lesson) -> Answer:
    """Compute the answer of a lesson's question, by the run or the figure that it asks about."""
    body, question = lesson.body, lesson.question
    if isinstance(body, Scenario):
        return question.answer(numbers_of(question_recipe(lesson)))
    return question.answer(revise(body.parameters, question.at or {}), body.seed)
