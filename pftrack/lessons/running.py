"""Running a scenario: the answer of its question, computed from the numbers of the run that it asks for.

A demonstration's answer is a function of parameters and a seed; a scenario's is a function of columns. So the run that
the question speaks of is computed to its end, and its numbers are handed over by name.
"""

from collections.abc import Mapping
from typing import Any, TypeAlias

import numpy as np

from pftrack.lessons.lesson import Answer, Lesson, Scenario
from pftrack.runs.columns import PREFIX, columns_of
from pftrack.runs.recipe import Recipe
from pftrack.runs.record import make
from pftrack.runs.run import Change, Run

__all__ = ["Columns", "answer_of", "asked", "numbers_of", "numbers_of_run"]

Columns: TypeAlias = Mapping[str, np.ndarray[Any, Any]]
"""The numbers of a run by name, one row a frame."""


def asked(lesson: Lesson) -> Recipe:
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


def answer_of(lesson: Lesson) -> Answer:
    """Compute the answer of a scenario's question."""
    return lesson.question.answer(numbers_of(asked(lesson)))
