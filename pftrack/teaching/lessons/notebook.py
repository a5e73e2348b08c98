"""A lesson as a notebook: predict, then see, with the numbers that the page and the command line have."""

from pftrack.core.model.parameters import Declaration, Parameters, declarations, describe_allowed, flat
from pftrack.output.exports.notebook import Cell, code, notebook
from pftrack.teaching.lessons.cells import (
    CHECKED,
    check_cell,
    lesson_cell,
    notes_cell,
    prediction_cell,
    question_cell,
    title_cell,
)
from pftrack.teaching.lessons.lesson import Demonstration, Lesson
from pftrack.teaching.lessons.scenario_notebook import scenario_cells

__all__ = ["demonstration_cells", "demonstration_notebook", "lesson_notebook"]


def lesson_notebook(lesson: Lesson) -> bytes:
    """Return a lesson as the content of a Jupyter notebook; a demonstration with its own parameters and seed.

    Raises:
        LookupError: The experiment of a scenario is not there.
    """
    if isinstance(lesson.body, Demonstration):
        return demonstration_notebook(lesson, lesson.body.parameters, lesson.body.seed)
    return notebook(scenario_cells(lesson))


def demonstration_notebook(lesson: Lesson, parameters: Parameters, seed: int) -> bytes:
    """Return a demonstration as the content of a Jupyter notebook.

    Args:
        lesson: The lesson, whose body is a demonstration.
        parameters: With which its figure is shown.
        seed: Of the draws.

    Raises:
        TypeError: The lesson's body is a run.
    """
    return notebook(demonstration_cells(lesson, parameters, seed))


def demonstration_cells(lesson: Lesson, parameters: Parameters, seed: int) -> tuple[Cell, ...]:
    """Return the cells of that notebook; see there."""
    if not isinstance(lesson.body, Demonstration):
        raise TypeError(f"the lesson {lesson.id} is a run, and its notebook is that of a run")
    return (
        title_cell(lesson),
        lesson_cell(lesson, IMPORTS),
        question_cell(lesson.question),
        code(ASKED),
        prediction_cell(lesson.question, "lesson.question.answer(asked_at, lesson.body.seed)"),
        notes_cell(lesson),
        code(_values(parameters, seed)),
        code(SHOWN),
        check_cell(lesson),
        CHECKED,
    )


IMPORTS = """
from IPython.display import Image

from pftrack.teaching.lessons.plotting import encode
from pftrack.core.model.parameters import revise
""".strip()

ASKED = """
asked_at = revise(lesson.body.parameters, lesson.question.at or {})
Image(encode(lesson.body.show(asked_at, lesson.body.seed).figure.without_answer(), ".png"), width=900)
""".strip()

SHOWN = """
shown = lesson.body.show(parameters, seed)
print(*shown.numbers, sep="\\n")
Image(encode(shown.figure, ".png"), width=900)
""".strip()


def _values(parameters: Parameters, seed: int) -> str:
    declared = {declaration.name: declaration for declaration in declarations(type(parameters))}
    lines = "".join(
        f"    {name!r}: {value!r},  # {_comment(declared[name])}\n" for name, value in flat(parameters).items()
    )
    return f"parameters = revise(lesson.body.parameters, {{\n{lines}}})\nseed = {seed}  # another one is a new draw"


def _comment(declaration: Declaration) -> str:
    return f"{declaration.title}: {describe_allowed(declaration)}"
