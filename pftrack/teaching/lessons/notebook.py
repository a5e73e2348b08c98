"""A lesson as a notebook: predict, then see, with the numbers that the page and the command line have.

The notebook of a scenario computes the run that the question is about. A lecturer's file comes from elsewhere, so that
its own HTML is text in a notebook, as it is on the page.
"""

import re

from pftrack.core.model.parameters import Declaration, Parameters, declarations, describe_allowed, flat
from pftrack.experiments import find
from pftrack.output.exports import notebook
from pftrack.output.exports.notebook import Cell, code, run_cells
from pftrack.output.exports.notebook import notebook as notebook_of
from pftrack.teaching.lessons.lesson import Demonstration, Lesson, Question, Scenario
from pftrack.teaching.lessons.lesson import question_recipe as asked_run

TAG = re.compile(r"<(?=[A-Za-z/!?])")
"""What begins HTML, which a space after the bracket prevents; in a formula a space says nothing."""


def markdown(text: str) -> Cell:
    """Return a cell of words in which HTML is text."""
    return notebook.markdown(TAG.sub("< ", text))


def title_cell(lesson: Lesson) -> Cell:
    """Return the cell with title and idea."""
    return markdown(f"# {f'{lesson.number}. ' if lesson.number else ''}{lesson.title}\n\n{lesson.idea}")


def lesson_cell(lesson: Lesson, imports: str) -> Cell:
    """Return the cell in which the lesson is found, or read again, where a lecturer wrote it.

    Args:
        lesson: The lesson.
        imports: Further lines of imports.
    """
    if not lesson.source:
        return code(f"{imports}\nfrom pftrack.teaching.lessons import find, judge\n\nlesson = find({lesson.id!r})")
    again = f"lesson = read_lesson({_quote(lesson.source)})"
    read = "from pftrack.teaching.lessons import judge\nfrom pftrack.teaching.lessons.lecturers import read_lesson"
    return code(f"{imports}\n{read}\n\n{again}")


def question_cell(question: Question) -> Cell:
    """Return the cell that asks."""
    choices = "\n".join(f"- `{name!r}`: {words}" for name, words in (question.choices or {}).items())
    return markdown(f"## Predict\n\n{question.text}\n\n{choices}".strip())


def prediction_cell(question: Question, right: str) -> Cell:
    """Return the cell in which a person answers.

    Args:
        question: What is asked.
        right: What computes the right answer, an expression.
    """
    low, high = question.bounds
    number = " ".join(f"a number from {low:g} to {high:g} {question.unit}".split())  # a line of a comment
    kind = "one of the names above" if question.choices else number
    return code(
        f"""
prediction = None  # write {kind} in its place
if prediction is not None:
    right = {right}
    print(*judge(lesson.question, right, prediction).words, sep="\\n")
""".strip()
    )


def notes_cell(lesson: Lesson) -> Cell:
    """Return the cell that says what to notice and to try."""
    tries = "\n".join(f"- {sentence}" for sentence in lesson.tries)
    return markdown(f"## See\n\n{lesson.notice}\n\n## Try\n\n{tries}")


def check_cell(lesson: Lesson) -> Cell:
    """Return the cell that says what the checks are."""
    return markdown(
        f"## Checked\n\nWhat this lesson claims, computed here beside what is exact. {lesson.question.words}"
    )


CHECKED = code(
    """
for check in lesson.checks:
    print(check.title, check.run(), sep="\\n    ")
""".strip()
)


def _quote(text: str) -> str:
    """Return a text as Python has it, line by line where that can be."""
    lines_up = "'''" not in text and not text.endswith(("'", "\\")) and text.replace("\n", "").isprintable()
    return f"r'''{text}'''" if lines_up else repr(text)


ANSWER_IMPORTS = "from pftrack.teaching.lessons.lesson import answer_of"

ANSWERED = "print(lesson.question.answer(run).exact)"


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
        lesson_cell(lesson, ANSWER_IMPORTS),
        question_cell(lesson.question),
        prediction_cell(lesson.question, "answer_of(lesson)"),
        notes_cell(lesson),
        *run_cells(recipe, find(recipe.experiment), plots=lesson.body.plots),
        check_cell(lesson),
        code(ANSWERED),
        CHECKED,
    )


def lesson_notebook(lesson: Lesson) -> bytes:
    """Return a lesson as the content of a Jupyter notebook; a demonstration with its own parameters and seed.

    Raises:
        LookupError: The experiment of a scenario is not there.
    """
    if isinstance(lesson.body, Demonstration):
        return demonstration_notebook(lesson, lesson.body.parameters, lesson.body.seed)
    return notebook_of(scenario_cells(lesson))


def demonstration_notebook(lesson: Lesson, parameters: Parameters, seed: int) -> bytes:
    """Return a demonstration as the content of a Jupyter notebook.

    Args:
        lesson: The lesson, whose body is a demonstration.
        parameters: With which its figure is shown.
        seed: Of the draws.

    Raises:
        TypeError: The lesson's body is a run.
    """
    return notebook_of(demonstration_cells(lesson, parameters, seed))


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

from pftrack.teaching.lessons.traces import encode
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
