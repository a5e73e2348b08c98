"""A demonstration lesson as a notebook: predict, then see, with the numbers that the page and the command line have."""

from pathlib import Path

from pftrack.lessons.lesson import Demonstration, Lesson, Question
from pftrack.lessons.registry import LESSONS
from pftrack.notebook import Cell, code, markdown, notebook
from pftrack.parameters import Declaration, Parameters, allowed, declarations, flat

__all__ = ["demonstration_cells", "demonstration_notebook"]


def demonstration_notebook(lesson: Lesson, parameters: Parameters, seed: int, folder: Path | None = None) -> bytes:
    """Return a demonstration as the content of a Jupyter notebook.

    Args:
        lesson: The lesson, whose body is a demonstration.
        parameters: With which its figure is shown.
        seed: Of the draws.
        folder: Where the file of the lesson is, if a lecturer put it into one.

    Raises:
        TypeError: The lesson's body is a run.
    """
    return notebook(demonstration_cells(lesson, parameters, seed, folder))


def demonstration_cells(
    lesson: Lesson, parameters: Parameters, seed: int, folder: Path | None = None
) -> tuple[Cell, ...]:
    """Return the cells of that notebook; see there."""
    if not isinstance(lesson.body, Demonstration):
        raise TypeError(f"the lesson {lesson.id} is a run, and its notebook is that of a run")
    tries = "\n".join(f"- {sentence}" for sentence in lesson.tries)
    return (
        markdown(f"# {f'{lesson.number}. ' if lesson.number else ''}{lesson.title}\n\n{lesson.idea}"),
        code(_import(lesson, folder)),
        markdown(f"## Predict\n\n{_asked(lesson.question)}"),
        code(ASKED),
        code(_answer(lesson.question)),
        markdown(f"## See\n\n{lesson.notice}\n\n## Try\n\n{tries}"),
        code(_values(parameters, seed)),
        code(SHOWN),
        markdown(f"## Checked\n\nWhat this lesson claims, computed here beside what is exact. {lesson.question.words}"),
        code(CHECKED),
    )


ASKED = """
asked_at = revise(lesson.body.parameters, lesson.question.at or {})
Image(encoded(lesson.body.show(asked_at, lesson.body.seed).figure.veiled(), ".png"), width=900)
""".strip()

SHOWN = """
shown = lesson.body.show(parameters, seed)
print(*shown.numbers, sep="\\n")
Image(encoded(shown.figure, ".png"), width=900)
""".strip()

CHECKED = """
for check in lesson.checks:
    print(check.title, check.run(), sep="\\n    ")
""".strip()


def _import(lesson: Lesson, folder: Path | None) -> str:
    if lesson.id in LESSONS:
        imported, found = "from pftrack.lessons import find, judge", f"find({lesson.id!r})"
    else:
        place = "" if folder is None else f"Path({str(folder)!r})"
        imported = "from pftrack.lessons import judge\nfrom pftrack.lessons.lecturers import read_lessons"
        found = f"read_lessons({place}).lessons[{lesson.id!r}]"
    return f"""
from pathlib import Path

from IPython.display import Image

{imported}
from pftrack.lessons.plotting import encoded
from pftrack.parameters import revise

lesson = {found}
""".strip()


def _asked(question: Question) -> str:
    choices = "\n".join(f"- `{name!r}`: {words}" for name, words in (question.choices or {}).items())
    return f"{question.text}\n\n{choices}".strip()


def _answer(question: Question) -> str:
    low, high = question.bounds
    unit = f" {question.unit}" if question.unit else ""
    kind = "one of the names above" if question.choices else f"a number from {low:g} to {high:g}{unit}"
    return f"""
prediction = None  # write {kind} in its place
if prediction is not None:
    right = lesson.question.answer(asked_at, lesson.body.seed)
    print(*judge(lesson.question, right, prediction).words, sep="\\n")
""".strip()


def _values(parameters: Parameters, seed: int) -> str:
    declared = {declaration.name: declaration for declaration in declarations(type(parameters))}
    lines = "".join(
        f"    {name!r}: {value!r},  # {_comment(declared[name])}\n" for name, value in flat(parameters).items()
    )
    return f"parameters = revise(lesson.body.parameters, {{\n{lines}}})\nseed = {seed}  # another one is a new draw"


def _comment(declaration: Declaration) -> str:
    return f"{declaration.title}: {allowed(declaration)}"
