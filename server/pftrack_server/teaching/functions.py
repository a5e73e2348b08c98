"""Computations of lessons, in processes other than the web process.

A lesson worker draws and judges; a child task, which may take long, computes checks and whole runs.
"""

import json
import math
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from pydantic import TypeAdapter

from pftrack.core.model.parameters import flat, nearest, revise
from pftrack.doctor.compiling import watch
from pftrack.process import give_way, report
from pftrack.runs.reproduction import make
from pftrack.teaching.lessons import find
from pftrack.teaching.lessons import lesson as course
from pftrack.teaching.lessons.figure import Number
from pftrack.teaching.lessons.library import read_lesson
from pftrack_server.jobs.functions import Steps

NUMBERS = TypeAdapter(list[Number])
NICENESS = 10
"""Niceness of work that may take a minute: figures and sessions, for which people wait, go first."""


gives_signs_of_life = watch(report, lambda function, _: report(function))
"""Decorator that reports each compiled function: compiling all code of a figure may take minutes, once."""


@gives_signs_of_life
def draw(wanted: str, source: str, values: Mapping[str, object], seed: int | None, revealed: bool, near: bool) -> bytes:
    """Return a demonstration's figure and numbers as JSON in the form of `FigurePublic`.

    Args:
        wanted: Id of the lesson.
        source: Text of its file, if it comes from a file.
        values: Parameter values; missing ones are the defaults, or with `revealed` those of the question.
        seed: Random seed; None for the lesson's own.
        revealed: Whether the figure shows what answers the question.
        near: Whether a number out of bounds becomes the nearest allowed one.

    Raises:
        ParameterError: A value is refused.
    """
    lesson = _lesson(wanted, source)
    body = _demonstration(lesson)
    start = body.parameters if revealed else _question_parameters(lesson)
    parameters = revise(start, nearest(type(start), values) if near else dict(values))
    seed = body.seed if seed is None else seed
    shown = body.show(parameters, seed)
    figure = shown.figure if revealed else shown.figure.without_answer()
    told = {
        "figure": figure.model_dump(mode="json"),
        "numbers": NUMBERS.dump_python([it for it in shown.numbers if revealed or not it.reveals], mode="json"),
        "parameters": flat(parameters),
        "seed": seed,
    }
    return json.dumps(told, allow_nan=False).encode()


@gives_signs_of_life
def judge_demonstration(wanted: str, source: str, given: course.Given) -> course.Verdict:
    """Judge the answer to a demonstration's question.

    Raises:
        ParameterError: The answer does not fit the question.
    """
    lesson = _lesson(wanted, source)
    course.read_answer(lesson.question, given)
    right = lesson.answer(_question_parameters(lesson), _demonstration(lesson).seed)
    return course.judge(lesson.question, right, given)


def answer(wanted: str, source: str) -> Steps:
    """Compute the run behind a scenario's question, and return the right answer; a step is a frame.

    Raises:
        RefusedError: The experiment is unknown, a value is refused, or the run lacks the requested number.
    """
    give_way(NICENESS)
    lesson = _lesson(wanted, source)
    run = make(course.question_recipe(lesson))
    for step in run.seeking(run.frames - 1):
        yield step.diagnostics.frame + 1, run.frames
    return asdict(lesson.answer(run))


def check(wanted: str, source: str) -> Steps:
    """Compute the checks of a lesson; a step is a check.

    A check that cannot be computed has a problem in place of numbers; the others are computed anyway.
    """
    give_way(NICENESS)
    checks = _lesson(wanted, source).checks
    results: list[dict[str, Any]] = []
    for done, each in enumerate(checks):
        yield done, len(checks)
        results.append(_check(each))
    return {"results": results}


def _lesson(wanted: str, source: str) -> course.Lesson:
    return read_lesson(source) if source else find(wanted)


def _demonstration(lesson: course.Lesson) -> course.Demonstration:
    if not isinstance(lesson.body, course.Demonstration):
        raise TypeError(f"the lesson {lesson.id} is a scenario, which has no figure")
    return lesson.body


def _question_parameters(lesson: course.Lesson) -> Any:  # noqa: ANN401 - the lesson's own model of parameters
    """Return the parameters at which a demonstration's question is asked."""
    return revise(_demonstration(lesson).parameters, dict(lesson.question.at))


def _check(each: course.Check) -> dict[str, Any]:
    told: dict[str, Any] = {"check": each.name, "title": each.title}
    try:
        outcome = each.run()
    except Exception as error:  # noqa: BLE001 - told in its place
        return {**told, "problem": f"This could not be computed: {error}."}
    if outcome.words:
        return {**told, "problem": f"This could not be computed: {outcome.words}."}
    found = {"ours": outcome.ours, "exact": outcome.exact, "tolerance": outcome.tolerance}
    numbers = {name: float(value) if math.isfinite(value) else None for name, value in found.items()}
    return {**told, **numbers, "passed": outcome.passed}
