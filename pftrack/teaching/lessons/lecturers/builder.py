"""Making a lesson of a document: does what it says fit an experiment, or a figure of the course?"""

import math
import re
from dataclasses import replace
from typing import Final

from pftrack.core.model.parameters import ParameterError
from pftrack.runs.record import RecordError
from pftrack.teaching.lessons.answers import answer_of
from pftrack.teaching.lessons.lecturers.bodies import body_of
from pftrack.teaching.lessons.lecturers.document import Document, DocumentError
from pftrack.teaching.lessons.lecturers.expression import ExpressionError, parse
from pftrack.teaching.lessons.lecturers.findings import Findings
from pftrack.teaching.lessons.lecturers.head import Head, ask
from pftrack.teaching.lessons.lecturers.questions import check_expression, check_question, question_of
from pftrack.teaching.lessons.lesson import Answer, Check, Lesson, Outcome
from pftrack.teaching.lessons.verdict import judge

__all__ = ["lesson_of"]

MOST_WORDS: Final = 90


def lesson_of(document: Document, origin: str) -> Lesson | list[DocumentError]:
    """Return the lesson of a document, or all that is wrong with it.

    Args:
        document: The file.
        origin: What people call it.
    """
    head = ask(document, Head, "a lesson", "docs/how-to/lessons.md")
    if isinstance(head, list):
        return head
    found = Findings(document)
    _check_text(document, found)
    body, columns = body_of(head, found)
    expression = found.attempt(("answer",), lambda: parse(str(head.answer)))
    check_question(head, body, found)
    if body is not None and expression is not None:
        check_expression(expression, columns, head, found)
    if found.problems or body is None or expression is None:
        return found.problems
    lesson = Lesson(
        id=head.id,
        title=head.title,
        idea=document.text,
        body=body,
        notice=head.notice,
        tries=head.tries,
        question=question_of(head, body, expression),
        origin=origin,
        source=document.source,
        declared_minutes=head.minutes,
    )
    return replace(lesson, checks=(_check(lesson, head),))


def _check_text(document: Document, found: Findings) -> None:
    words = len(re.sub(r"\$[^$]+\$", "formula", document.text).split())
    if not words:
        found.problems.append(DocumentError(document.text_line, "there is no text; write the idea below the head"))
    if words > MOST_WORDS:
        message = f"the text has {words} words, and {MOST_WORDS} fit beside the figure; say it in fewer"
        found.problems.append(DocumentError(document.text_line, message))


def _check(lesson: Lesson, head: Head) -> Check:
    """Return the check that the answer can be computed, is what its author saw, and is judged right."""
    expected = head.question.expected
    seen = ", and is what its author saw" if expected is not None else ""

    def run() -> Outcome:
        try:
            exact = answer_of(lesson).exact
            right = judge(lesson.question, Answer(exact), exact).right
        except (ExpressionError, ParameterError, RecordError) as error:
            return Outcome(math.nan, 1.0, 0.0, str(error))
        if isinstance(exact, float) and isinstance(expected, float) and right:
            return Outcome(exact, expected, lesson.question.tolerance)
        return Outcome(float(right and expected in {None, exact}), 1.0, 0.0)

    return Check("answer", f"The answer can be computed and is judged right{seen}.", run)
