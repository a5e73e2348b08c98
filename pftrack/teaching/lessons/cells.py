"""Cells that the notebooks of all lessons have: the lesson itself, what is asked, a prediction judged, the checks.

A lecturer's file comes from elsewhere, so that its own HTML is text here, as it is on the page.
"""

import re

from pftrack.output.exports import notebook
from pftrack.output.exports.notebook import Cell, code
from pftrack.teaching.lessons.lesson import Lesson, Question

__all__ = ["CHECKED", "check_cell", "lesson_cell", "notes_cell", "prediction_cell", "question_cell", "title_cell"]


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
