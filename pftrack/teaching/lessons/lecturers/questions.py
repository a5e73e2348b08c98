"""What a lecturer's lesson asks, and how the answer is computed: by an expression over numbers."""

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from pftrack.core.model.parameters import Parameters
from pftrack.teaching.lessons.answers import figure_numbers
from pftrack.teaching.lessons.lecturers.expression import Expression, ExpressionError, NoValueError, unknown
from pftrack.teaching.lessons.lecturers.findings import Findings
from pftrack.teaching.lessons.lecturers.head import Head, near
from pftrack.teaching.lessons.lesson import Answer, Demonstration, Mistake, Question, Scenario

__all__ = ["check_expression", "check_question", "question_of"]


def check_expression(expression: Expression, columns: Mapping[str, Any], head: Head, found: Findings) -> None:
    """Try the expression on numbers of the right shapes: what they are does not matter here."""
    missing = sorted(expression.names - columns.keys())
    for name in missing:
        found.add(("answer",), f"`answer`: {unknown(name, columns)}")
    if missing:
        return
    try:
        value = expression.value(columns)
    except NoValueError:
        return  # It hangs on the run, which is not computed to list a lesson.
    except ExpressionError as error:
        found.add(("answer",), f"`answer`: {error}")
        return
    if head.question.kind != "choice" and isinstance(value, str):
        found.add(("answer",), "`answer` comes to a text, where the question asks for a number")


def question_of(head: Head, body: Scenario | Demonstration, expression: Expression) -> Question:
    """Return the question of a head in which nothing is wrong."""
    asked = head.question
    return Question(
        text=asked.text,
        kind=asked.kind,
        answer=_answer(expression, body),
        words=asked.words,
        tolerance=asked.tolerance or 0.0,
        unit=asked.unit,
        bounds=asked.bounds,
        choices=asked.choices,
        panel=asked.panel or "",
        along=asked.along,
        at=asked.at or None,
        mistakes=tuple(Mistake(mistake.given, mistake.words) for mistake in asked.mistakes),
    )


def _answer(expression: Expression, body: Scenario | Demonstration) -> Callable[..., Answer]:
    def of_figure(parameters: Parameters, seed: int, *, shown: Demonstration) -> Answer:
        return Answer(expression.value(figure_numbers(shown, parameters, seed)))

    if isinstance(body, Demonstration):
        return partial(of_figure, shown=body)
    return lambda columns: Answer(expression.value(columns))


def check_question(head: Head, body: Scenario | Demonstration | None, found: Findings) -> None:
    """Note what is wrong with a question."""
    asked = head.question
    if not asked.bounds[0] < asked.bounds[1]:
        found.add(("question", "bounds"), "`question.bounds` must be [lowest, highest]")
    if asked.kind != "choice" and asked.tolerance is None:
        found.add(("question",), "`question.tolerance` is missing: say by how much an answer may be off and be right")
    _check_choices(head, found)
    if (asked.kind == "point") != (asked.panel is not None) or (asked.kind == "point" and isinstance(body, Scenario)):
        found.add(("question", "kind"), "a point is placed in a `panel` of a `figure`; a run is asked for a number")
    if asked.panel is not None and isinstance(body, Demonstration):
        panels = [panel.id for panel in body.show(body.parameters, body.seed).figure.panels]
        if asked.panel not in panels:
            found.add(("question", "panel"), f"the figure has no panel {asked.panel}; {near(asked.panel, panels)}")


def _check_choices(head: Head, found: Findings) -> None:
    asked = head.question
    choices = asked.choices or {}
    if (asked.kind == "choice") != bool(choices):
        found.add(("question", "choices"), "a question of the kind choice has `choices`, and no other has")
    allowed = f"one of {', '.join(choices)}" if choices else "a number"
    for number, mistake in enumerate(asked.mistakes):
        if mistake.given not in choices if choices else isinstance(mistake.given, str):
            found.add(("question", "mistakes", number, "given"), f"`given` must be {allowed}, got {mistake.given}")
    if asked.expected is not None and (asked.expected not in choices if choices else isinstance(asked.expected, str)):
        found.add(("question", "expected"), f"`question.expected` must be {allowed}, got {asked.expected}")
