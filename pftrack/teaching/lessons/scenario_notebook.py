"""A scenario lesson as a notebook: predict, then compute the run that the question is about, and see."""

from pftrack.experiments import find
from pftrack.output.exports.notebook import Cell, code
from pftrack.output.exports.run_notebook import run_cells
from pftrack.teaching.lessons.answers import question_recipe as asked_run
from pftrack.teaching.lessons.cells import (
    CHECKED,
    check_cell,
    lesson_cell,
    notes_cell,
    prediction_cell,
    question_cell,
    title_cell,
)
from pftrack.teaching.lessons.lesson import Lesson, Scenario

__all__ = ["scenario_cells"]

IMPORTS = "from pftrack.teaching.lessons.answers import answer_of, numbers_of_run"

ANSWERED = "print(lesson.question.answer(numbers_of_run(run)).exact)"


def scenario_cells(lesson: Lesson) -> tuple[Cell, ...]:
    """Return the cells of the notebook of a lesson that shows a run.

    Raises:
        TypeError: The lesson shows a figure.
        LookupError: Its experiment is not there.
    """
    if not isinstance(lesson.body, Scenario):
        raise TypeError(f"the lesson {lesson.id} shows a figure, and its notebook is that of a demonstration")
    recipe = asked_run(lesson)
    return (
        title_cell(lesson),
        lesson_cell(lesson, IMPORTS),
        question_cell(lesson.question),
        prediction_cell(lesson.question, "answer_of(lesson)"),
        notes_cell(lesson),
        *run_cells(recipe, find(recipe.experiment), plots=lesson.body.plots),
        check_cell(lesson),
        code(ANSWERED),
        CHECKED,
    )
