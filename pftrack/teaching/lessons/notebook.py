"""A lesson as a notebook: predict, then see, with the same numbers as on the page and the command line.

The notebook of a scenario computes the run of the question. A lecturer's file comes from elsewhere, so its HTML is
shown as text in a notebook, as on the page.
"""

import re

from pftrack.core.model.parameters import Declaration, Parameters, declarations, describe_allowed, flat
from pftrack.experiments import find
from pftrack.output.exports import files
from pftrack.output.exports.files import Cell, code, run_cells
from pftrack.teaching.lessons.lesson import Lesson, Question, Scenario, question_recipe

TAG = re.compile(r"<(?=[A-Za-z/!?])")
"""The start of HTML, which a space after the bracket prevents; in a formula a space has no effect."""


def markdown(text: str) -> Cell:
    """Return a cell of words in which HTML is text."""
    return files.markdown(TAG.sub("< ", text))


def lesson_notebook(lesson: Lesson, parameters: Parameters | None = None, seed: int | None = None) -> bytes:
    """Return a lesson as the content of a Jupyter notebook.

    Args:
        lesson: The lesson.
        parameters: With which the figure of a demonstration is shown; its own if not given.
        seed: Seed of the draws of a demonstration; by default its own.

    Raises:
        RefusedError: The experiment of a scenario is not there.
    """
    body = lesson.body
    asked: tuple[Cell, ...] = ()
    answered: tuple[Cell, ...] = ()
    if isinstance(body, Scenario):
        recipe = question_recipe(lesson)
        imports, right = "from pftrack.teaching.lessons.lesson import answer_of", "answer_of(lesson)"
        shown = run_cells(recipe, find(recipe.experiment), plots=body.plots)
        answered = (code("print(lesson.answer(run).exact)"),)
    else:
        imports, right = IMPORTS, "lesson.answer(asked_at, lesson.body.seed)"
        asked = (code(ASKED),)
        shown = code(_values(parameters or body.parameters, body.seed if seed is None else seed)), code(SHOWN)
    return files.notebook(
        (
            markdown(f"# {f'{lesson.number}. ' if lesson.number else ''}{lesson.title}\n\n{lesson.idea}"),
            lesson_cell(lesson, imports),
            *_question_cells(lesson.question, right, asked),
            markdown(f"## See\n\n{lesson.notice}\n\n## Try\n\n" + "\n".join(f"- {each}" for each in lesson.tries)),
            *shown,
            markdown(
                f"## Checked\n\nWhat this lesson claims, computed here beside what is exact. {lesson.question.words}"
            ),
            *answered,
            code(CHECKED),
        )
    )


def lesson_cell(lesson: Lesson, imports: str) -> Cell:
    """Return the cell in which the lesson is found, or read again, where a lecturer wrote it.

    Args:
        lesson: The lesson.
        imports: Further lines of imports.
    """
    if not lesson.source:
        return code(f"{imports}\nfrom pftrack.teaching.lessons import find, judge\n\nlesson = find({lesson.id!r})")
    again = f"lesson = read_lesson({_quote(lesson.source)})"
    read = "from pftrack.teaching.lessons import judge\nfrom pftrack.teaching.lessons.library import read_lesson"
    return code(f"{imports}\n{read}\n\n{again}")


def _question_cells(question: Question, right: str, asked: tuple[Cell, ...]) -> tuple[Cell, ...]:
    """Return the cells that ask, show what is asked about, and judge what a person writes.

    Args:
        question: The question.
        right: An expression that computes the right answer.
        asked: The cells in between.
    """
    choices = "\n".join(f"- `{name!r}`: {words}" for name, words in (question.choices or {}).items())
    low, high = question.bounds
    number = " ".join(f"a number from {low:g} to {high:g} {question.unit}".split())  # a line of a comment
    kind = "one of the names above" if question.choices else number
    return (
        markdown(f"## Predict\n\n{question.text}\n\n{choices}".strip()),
        *asked,
        code(PREDICTION.format(kind=kind, right=right)),
    )


def _quote(text: str) -> str:
    """Return a text as Python has it, line by line where that can be."""
    lines_up = "'''" not in text and not text.endswith(("'", "\\")) and text.replace("\n", "").isprintable()
    return f"r'''{text}'''" if lines_up else repr(text)


PREDICTION = """
prediction = None  # write {kind} in its place
if prediction is not None:
    right = {right}
    print(*judge(lesson.question, right, prediction).words, sep="\\n")
""".strip()

CHECKED = """
for check in lesson.checks:
    print(check.title, check.run(), sep="\\n    ")
""".strip()

IMPORTS = """
from IPython.display import Image

from pftrack.teaching.lessons.traces import encode
from pftrack.core.model.parameters import revise
""".strip()

ASKED = """
asked_at = revise(lesson.body.parameters, lesson.question.at)
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
