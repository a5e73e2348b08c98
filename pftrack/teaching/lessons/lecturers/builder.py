"""Making a lesson of a document: does what it says fit an experiment, or a figure of the course?

A lecturer's lesson shows a run of an experiment, or a figure of the course with other parameters. Its question is
answered by an expression over numbers.
"""

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import Any, Final

from pftrack.core.model.parameters import ParameterError, Parameters, declarations, revise
from pftrack.core.model.recipe import Change, Recipe, Timeline
from pftrack.core.numerics.random import LARGEST_SEED
from pftrack.experiments import find as find_experiment
from pftrack.experiments.experiment import Experiment
from pftrack.runs.record import RecordError
from pftrack.teaching.lessons.lecturers.document import Document, DocumentError, Findings, Head, Place, ask, near
from pftrack.teaching.lessons.lecturers.expression import Expression, ExpressionError, NoValueError, parse, unknown
from pftrack.teaching.lessons.lesson import (
    Answer,
    Check,
    Demonstration,
    Lesson,
    Mistake,
    Outcome,
    Question,
    Scenario,
    all_columns,
    answer_of,
    figure_numbers,
    judge,
)
from pftrack.teaching.lessons.registry import find as find_lesson

BESIDE: Final = ("tracker", "seed")
"""What can be unlocked beside parameters."""


def body_of(head: Head, found: Findings) -> tuple[Scenario | Demonstration | None, Mapping[str, Any]]:
    """Return what a lesson shows, and numbers of the shape that its own will have; None where something is wrong.

    Args:
        head: What was written.
        found: Where it is noted what is wrong.
    """
    if (head.experiment is None) == (head.figure is None):
        found.add(("experiment",) if head.experiment else (), "a lesson names either an `experiment` or a `figure`")
        return None, {}
    return _demonstration(head, found) if head.figure is not None else _scenario(head, found)


def _scenario(head: Head, found: Findings) -> tuple[Scenario | None, Mapping[str, Any]]:
    experiment = found.attempt(("experiment",), lambda: find_experiment(str(head.experiment)))
    if experiment is None:
        return None, {}
    setup = experiment.simulate()
    tracker = head.tracker or experiment.default_tracker
    if tracker not in experiment.trackers:
        found.add(("tracker",), f"{experiment.id} has no tracker {tracker}; {near(tracker, experiment.trackers)}")
        tracker = experiment.default_tracker
    seed = head.seed or 0
    if seed > LARGEST_SEED:
        found.add(("seed",), f"`seed` must be a whole number between 0 and {LARGEST_SEED}")
    if head.parameters:
        found.add(("parameters",), "`parameters` are those of a figure; write those of an experiment in `timeline`")
    _check_names(head, experiment, type(setup.parameters), found)
    timeline = Timeline.begin(setup.parameters, tracker, tuple(experiment.trackers))
    for number, change in enumerate(head.timeline):
        timeline = _apply_change(timeline, Change(change.frame, change.values), ("timeline", number, "values"), found)
    at = {name: value for name, value in head.question.at.items() if name != "seed"}
    _apply_change(timeline, Change(0, at), ("question", "at"), found)
    if found.problems:
        return None, {}
    available = setup.open_source(seed, timeline.parameters_at(0)).frame_count
    frames = head.frames or available or experiment.frames
    _check_frames(head, min(frames, available or frames), found)
    recipe = Recipe(experiment=experiment.id, tracker=tracker, seed=seed, frames=frames, timeline=timeline.changes)
    return Scenario(recipe, head.unlocked, head.frame, head.plots, head.layers), all_columns(experiment, frames)


def _check_frames(head: Head, frames: int, found: Findings) -> None:
    if head.frames is not None and head.frames > frames:
        found.add(("frames",), f"`frames` is {head.frames}, and this scene has {frames}; say fewer, or leave it out")
    if head.frame >= frames:
        found.add(("frame",), f"`frame` is {head.frame}, and the last of {frames} frames is {frames - 1}")
    for number, change in enumerate(head.timeline):
        if change.frame >= frames:
            message = f"this change comes in frame {change.frame}, and the last is {frames - 1}"
            found.add(("timeline", number), message)


def _apply_change(timeline: Timeline, change: Change, place: Place, found: Findings) -> Timeline:
    model: type[Parameters] = type(timeline.parameters_at(0))
    known = {it.name for it in declarations(model)} | {"tracker"}
    values = {}
    for name, value in change.values.items():
        if name in known:
            values[name] = value
        else:
            found.add((*place, name), f"there is no parameter {name}; {near(name, known)}")
    changed = found.attempt(place, lambda: timeline.insert(Change(change.frame, values)))
    return changed or timeline


def _check_names(head: Head, experiment: Experiment, model: type[Parameters], found: Findings) -> None:
    known = [*(it.name for it in declarations(model)), *BESIDE]
    for number, name in enumerate(head.unlocked):
        if name not in known:
            message = f"`unlocked` names {name}, which {experiment.id} does not have; {near(name, known)}"
            found.add(("unlocked", number), message)
    shown = {"plots": [plot.id for plot in experiment.plots], "layers": [layer.name for layer in experiment.layers]}
    for field, names in shown.items():
        for number, name in enumerate(getattr(head, field)):
            if name not in names:
                message = f"`{field}` names {name}, which {experiment.id} does not have; {near(name, names)}"
                found.add((field, number), message)


def _demonstration(head: Head, found: Findings) -> tuple[Demonstration | None, Mapping[str, Any]]:
    lesson: Lesson | None = found.attempt(("figure",), lambda: find_lesson(str(head.figure)))
    for name in ("tracker", "frames", "timeline", "unlocked", "plots", "layers", "frame"):
        if name in head.model_fields_set:
            found.add((name,), f"`{name}` is of an experiment; a figure has `parameters` and `seed`, all unlocked")
    if lesson is None:
        return None, {}
    if not isinstance(lesson.body, Demonstration):
        experiment = lesson.body.recipe.experiment
        found.add(("figure",), f"the lesson {lesson.id} shows no figure; name its `experiment`, {experiment}")
        return None, {}
    body = lesson.body
    parameters = found.attempt(("parameters",), lambda: revise(body.parameters, head.parameters))
    at = found.attempt(("question", "at"), lambda: revise(parameters or body.parameters, head.question.at))
    if parameters is None or at is None:
        return None, {}
    seed = body.seed if head.seed is None else head.seed
    return replace(body, parameters=parameters, seed=seed), figure_numbers(body, at, seed)


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
