"""Properties of every lesson of the course: its words, question and checks, and where its idea is used."""

import re
from itertools import pairwise

import numpy as np
import pytest

from pftrack.core.model.parameters import declarations
from pftrack.experiments import find
from pftrack.runs.reproduction import make
from pftrack.teaching.lessons import LESSONS
from pftrack.teaching.lessons.figure import Number
from pftrack.teaching.lessons.lesson import Answer, Lesson, Question, Scenario, answer_of, judge, poll_answers
from tests.teaching.lessons.demonstrations import DEMONSTRATIONS, asked_at, assert_sound, corners, shown

SLOW = {"wide-random-walk"}
"""Checks that repeat long runs; the same lesson has quick ones of the same kind."""

CHECKS = [
    pytest.param(name, check.name, marks=pytest.mark.slow if check.name in SLOW else ())
    for name, lesson in LESSONS.items()
    for check in lesson.checks
]


@pytest.fixture(params=LESSONS)
def lesson(request: pytest.FixtureRequest) -> Lesson:
    return LESSONS[request.param]


def right_answer(lesson: Lesson) -> Answer:
    """Return the computed answer, or a possible one for a scenario, whose run would take long."""
    if lesson.id in DEMONSTRATIONS:
        return answer_of(lesson)
    usual = {mistake.given for mistake in lesson.question.mistakes}
    if lesson.question.kind == "choice":
        return Answer(next(name for name in lesson.question.choices or () if name not in usual))
    return Answer(sum(lesson.question.bounds) / 2)


def test_every_sentence_is_there_and_ends(lesson: Lesson) -> None:
    """All texts are there, as sentences, with at most ninety words before the figure; names of checks are unique."""
    assert 20 <= len(re.sub(r"\$+[^$]+\$+", "formula", lesson.idea).split()) <= 90
    assert lesson.title
    assert not lesson.title.endswith(".")
    assert lesson.question.text.endswith(("?", "."))
    assert lesson.tries
    sentences = [lesson.notice, *lesson.tries, lesson.question.words, *(it.words for it in lesson.question.mistakes)]
    assert [sentence for sentence in sentences if not sentence.endswith((".", "?"))] == []
    names = [check.name for check in lesson.checks]
    assert len(set(names)) == len(names) > 0
    assert all(re.fullmatch(r"[a-z0-9]+(-[a-z0-9]+)*", name) for name in (lesson.id, *names))
    assert all(check.title for check in lesson.checks)


@pytest.mark.parametrize(("name", "check"), CHECKS)
def test_every_check_passes(name: str, check: str) -> None:
    """A lesson's claim holds within its stated tolerance."""
    outcome = next(each for each in LESSONS[name].checks if each.name == check).run()
    assert outcome.tolerance >= 0
    assert outcome.passed, outcome


def test_any_answer_gets_words(lesson: Lesson) -> None:
    """The verdict on a wrong answer has the right one with its reason, and an explanation of a usual mistake."""
    question, answer = lesson.question, right_answer(lesson)
    verdict = judge(question, answer, answer.exact)
    assert verdict.right
    assert verdict.exact == verdict.given
    assert question.words in verdict.words
    assert len(verdict.words[0]) > len("Right")
    for given in set(question.choices or question.bounds) - {answer.exact}:
        verdict = judge(question, answer, given)
        assert not verdict.right
        assert question.words in verdict.words
        assert not verdict.words[0].startswith("Right")
        assert question.kind == "choice" or isinstance(verdict.exact, float)
    assert question.mistakes
    for mistake in question.mistakes:
        given = mistake.given
        examples = (given[0], sum(given) / 2, given[1]) if isinstance(given, tuple) else (given,)
        verdicts = [judge(question, answer, example) for example in examples]
        assert any(not verdict.right and mistake.words in verdict.words for verdict in verdicts), mistake


# Sessions in which the idea of a lesson is used.

SCENARIOS = [
    *((f"{name}, use {number}", use) for name, it in LESSONS.items() for number, use in enumerate(it.uses)),
    *((name, it.body) for name, it in LESSONS.items() if isinstance(it.body, Scenario)),
]


@pytest.mark.parametrize("scenario", [each for _, each in SCENARIOS], ids=[name for name, _ in SCENARIOS])
def test_it_can_be_opened(scenario: Scenario) -> None:
    """Its recipe makes a run with the frame at which it opens, and its tracker reads the unlocked parameters."""
    run = make(scenario.recipe)
    experiment = find(scenario.recipe.experiment)
    assert 0 <= scenario.frame < (scenario.recipe.frames or experiment.frames)
    readers = {each.name: each.trackers for each in declarations(type(run.parameters_at(0)))}
    for name in set(scenario.unlocked) - {"tracker", "seed"}:
        assert not readers[name] or run.tracker_at(0) in readers[name] or "tracker" in scenario.unlocked, name
    assert set(scenario.plots) <= {plot.id for plot in experiment.display.plots}
    assert set(scenario.layers) <= {layer.name for layer in experiment.display.layers}


# A lesson's question as a poll: the right answer and the usual mistakes lie in intervals of their own.


@pytest.mark.parametrize("name", DEMONSTRATIONS)
def test_a_question_makes_a_poll(name: str) -> None:
    """The intervals ascend, and the right answer with its tolerance is within one of them."""
    question = LESSONS[name].question
    if question.choices:
        assert poll_answers(question) == tuple(question.choices.values())
        return
    exact = answer_of(LESSONS[name]).exact
    answers = poll_answers(question, exact)
    assert 3 <= len(answers) <= 8
    found = [float(re.findall(r"-?[\d,]+(?:\.\d+)?", answer)[0].replace(",", "")) for answer in answers[1:]]
    assert all(low < high for low, high in pairwise(found))
    assert all(abs(cut - exact) > 0.5 * question.tolerance for cut in found)
    assert all(question.unit in answer for answer in answers)


def test_a_poll_without_usual_mistakes() -> None:
    """It uses the bounds, or half and twice the right answer; zero has neither."""
    bounded = Question(text="How much?", words="So much.", bounds=(0.0, 1.0))
    assert poll_answers(bounded, 0.3) == ("Below 0.15", "0.15 to 0.65", "Above 0.65")
    free = Question(text="How many?", words="So many.", unit="frames")
    assert poll_answers(free, 40.0) == ("Below 30 frames", "30 to 60 frames", "Above 60 frames")
    assert poll_answers(free, 0.0) == ("Below -0.5 frames", "-0.5 to 0.5 frames", "Above 0.5 frames")
    with pytest.raises(ValueError, match="not a number"):
        poll_answers(free, float("nan"))


# Demonstrations: their figures, their numbers and their purity.

of_demonstrations = pytest.mark.parametrize("lesson", DEMONSTRATIONS, indirect=True)


def assert_believable(numbers: tuple[Number, ...], where: object) -> None:
    """Assert that numbers are finite, and within their tolerance of the exact ones."""
    assert numbers
    for number in numbers:
        assert np.isfinite(number.value), (number, where)
        if number.exact is not None and number.tolerance is not None:
            assert abs(number.value - number.exact) <= number.tolerance, (number, where)


@of_demonstrations
def test_the_figure_can_be_drawn(lesson: Lesson) -> None:
    """At the defaults it is sound, handles are at their parameters' values, and numbers are near the exact ones.

    The same seed gives the same figure; another seed changes it only if the lesson draws samples.
    """
    body = lesson.body
    assert 2 <= len(declarations(type(body.parameters))) <= 6
    first = shown(lesson)
    figure = first.figure
    assert_sound(figure)
    for handle in (handle for panel in figure.panels for handle in panel.handles):
        assert handle.at == pytest.approx(getattr(body.parameters, handle.parameter))
    again, other = (body.show(body.parameters, body.seed + more) for more in (0, 1))
    assert first.figure.model_dump_json() == again.figure.model_dump_json()
    assert first.numbers == again.numbers
    assert (first.figure.model_dump_json() != other.figure.model_dump_json()) == body.random
    for numbers in (first.numbers, other.numbers):
        assert_believable(numbers, lesson.id)
        assert [number.title for number in numbers if number.exact is not None and number.tolerance is None] == []


@of_demonstrations
def test_every_bound_can_be_shown(lesson: Lesson) -> None:
    """With each parameter at each end, and all at once, the figure is sound and the numbers are near the exact ones."""
    for corner in corners(lesson):
        it = shown(lesson, **corner)
        assert_sound(it.figure)
        if lesson.id != "sir":  # whose method fails at extreme parameters
            assert_believable(it.numbers, corner)


@of_demonstrations
def test_the_veil_hides_the_traces_that_reveal_the_answer(lesson: Lesson) -> None:
    """The veiled figure has all other traces and can be drawn; no number reveals the answer.

    The panel in which a person places a point exists, and its axis contains every allowed answer.
    """
    body, at, question = lesson.body, asked_at(lesson), lesson.question
    it = body.show(at, body.seed)
    veiled = it.figure.without_answer()
    assert_sound(veiled)
    for whole, rest in zip(it.figure.panels, veiled.panels, strict=True):
        assert [trace for trace in whole.traces if not trace.reveals] == list(rest.traces)
    exact = lesson.answer(at, body.seed).exact
    if question.kind != "choice":
        told = [number for number in it.numbers if not number.reveals]
        assert [number.title for number in told if abs((number.exact or number.value) - exact) < 1e-9] == []
    if question.kind == "point":
        (panel,) = (panel for panel in it.figure.panels if panel.id == question.panel)
        axis = getattr(panel, question.along)
        assert question.bounds[0] <= axis.low <= exact <= axis.high <= question.bounds[1]
