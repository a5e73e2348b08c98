"""What holds of every lesson that is a demonstration: its figure, its numbers and their purity."""

import numpy as np
import pytest

from pftrack.core.model.parameters import declarations
from pftrack.teaching.lessons import LESSONS
from pftrack.teaching.lessons.figure import Number
from pftrack.teaching.lessons.lesson import Lesson
from tests.teaching.lessons.demonstrations import DEMONSTRATIONS, asked_at, assert_sound, corners, demonstration, shown

SEEDS = 1, 2, 3, 4, 5
FAILING = {"sir"}
"""Lessons that show how a method fails where its parameters are extreme."""


@pytest.fixture(params=DEMONSTRATIONS)
def lesson(request: pytest.FixtureRequest) -> Lesson:
    return LESSONS[request.param]


def assert_believable(numbers: tuple[Number, ...], where: object) -> None:
    """Numbers are finite, and as near to the exact ones as they say, where they say it."""
    assert numbers
    for number in numbers:
        assert np.isfinite(number.value), (number, where)
        if number.exact is not None and number.tolerance is not None:
            assert abs(number.value - number.exact) <= number.tolerance, (number, where)


def test_there_are_two_to_six_parameters(lesson: Lesson) -> None:
    """A lesson has few things to turn; a switch or two may stand beside its sliders."""
    assert 2 <= len(declarations(type(demonstration(lesson).parameters))) <= 6


def test_the_figure_can_be_drawn(lesson: Lesson) -> None:
    """At the defaults it is sound, and every handle stands at its parameter's value."""
    body = demonstration(lesson)
    figure = shown(lesson).figure
    assert_sound(figure)
    for panel in figure.panels:
        for handle in panel.handles:
            assert handle.at == pytest.approx(getattr(body.parameters, handle.parameter))


def test_showing_is_pure(lesson: Lesson) -> None:
    """The same parameters and seed come to the same; another seed to something else, just where there are draws."""
    body = demonstration(lesson)
    first, again = body.show(body.parameters, 7), body.show(body.parameters, 7)
    assert first.figure.model_dump_json() == again.figure.model_dump_json()
    assert first.numbers == again.numbers
    other = body.show(body.parameters, 8)
    assert (first.figure.model_dump_json() != other.figure.model_dump_json()) == body.random


def test_numbers_are_as_near_as_they_say(lesson: Lesson) -> None:
    """At the defaults every number lies within its tolerance of the exact one, whatever the draw."""
    body = demonstration(lesson)
    for seed in SEEDS if body.random else SEEDS[:1]:
        numbers = body.show(body.parameters, seed).numbers
        assert_believable(numbers, seed)
        assert [number.title for number in numbers if number.exact is not None and number.tolerance is None] == []


def test_every_bound_can_be_shown(lesson: Lesson) -> None:
    """With each parameter at each end, and all at once, the figure is sound and the numbers are believable.

    Of lessons that show how a method fails there, the numbers may be as far off as they are.
    """
    for corner in corners(lesson):
        it = shown(lesson, **corner)
        assert_sound(it.figure)
        if lesson.id not in FAILING:
            assert_believable(it.numbers, corner)


def test_the_veil_hides_what_reveals(lesson: Lesson) -> None:
    """Veiled, the figure has all traces but those that reveal; what is left can be drawn."""
    body = demonstration(lesson)
    figure = body.show(asked_at(lesson), body.seed).figure
    veiled = figure.without_answer()
    assert_sound(veiled)
    for whole, rest in zip(figure.panels, veiled.panels, strict=True):
        assert [trace for trace in whole.traces if not trace.reveals] == list(rest.traces)


def test_no_number_gives_the_answer_away(lesson: Lesson) -> None:
    """Before the question is answered, no number on the screen is its answer."""
    if lesson.question.kind == "choice":
        pytest.skip("the answer is no number")
    body, at = demonstration(lesson), asked_at(lesson)
    exact = lesson.answer(at, body.seed).exact
    told = [number for number in body.show(at, body.seed).numbers if not number.reveals]
    near = [number.title for number in told if abs((number.exact or number.value) - exact) < 1e-9]
    assert near == []


def test_a_point_is_asked_for_within_its_panel(lesson: Lesson) -> None:
    """The panel in which a point is to be placed exists, and its axis holds every answer that is allowed."""
    question = lesson.question
    if question.kind != "point":
        pytest.skip("no point is asked for")
    body = demonstration(lesson)
    panels = {panel.id: panel for panel in body.show(asked_at(lesson), body.seed).figure.panels}
    axis = getattr(panels[question.panel], question.along)
    assert question.bounds[0] <= axis.low
    assert axis.high <= question.bounds[1]
    assert axis.low <= lesson.answer(asked_at(lesson), body.seed).exact <= axis.high
