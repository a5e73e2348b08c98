"""What holds of every lesson of the course: its words, its question, its checks, and where it is used."""

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
from tests.teaching.lessons.demonstrations import DEMONSTRATIONS, asked_at, assert_sound, corners, demonstration, shown

CHECKS = [(name, check.name) for name, lesson in LESSONS.items() for check in lesson.checks]
NAME = re.compile(r"[a-z0-9]+(-[a-z0-9]+)*")


@pytest.fixture(params=LESSONS)
def lesson(request: pytest.FixtureRequest) -> Lesson:
    return LESSONS[request.param]


def right_answer(lesson: Lesson) -> Answer:
    """The answer, computed; of a scenario, whose run would take long, one that stands for it."""
    if lesson.id in DEMONSTRATIONS:
        return answer_of(lesson)
    usual = {mistake.given for mistake in lesson.question.mistakes}
    if lesson.question.kind == "choice":
        return Answer(next(name for name in lesson.question.choices or () if name not in usual))
    return Answer(sum(lesson.question.bounds) / 2)


def test_every_sentence_is_there_and_ends(lesson: Lesson) -> None:
    """Title, what to notice, what to try, what is asked and why are all there, as sentences, and each check's claim.

    At most ninety words stand before the figure, a formula counted as one. Names of checks differ, and have the form of
    a lesson's name.
    """
    assert 20 <= len(re.sub(r"\$+[^$]+\$+", "formula", lesson.idea).split()) <= 90
    assert lesson.title
    assert not lesson.title.endswith(".")
    assert lesson.question.text.endswith(("?", "."))
    assert lesson.tries
    sentences = [lesson.notice, *lesson.tries, lesson.question.words, *(it.words for it in lesson.question.mistakes)]
    assert [sentence for sentence in sentences if not sentence.endswith((".", "?"))] == []
    names = [check.name for check in lesson.checks]
    assert len(set(names)) == len(names) > 0
    assert all(NAME.fullmatch(name) for name in (lesson.id, *names))
    assert all(check.title for check in lesson.checks)


@pytest.mark.parametrize(("name", "check"), CHECKS)
def test_every_check_passes(name: str, check: str) -> None:
    """What a lesson claims holds within the tolerance that the claim states."""
    outcome = next(each for each in LESSONS[name].checks if each.name == check).run()
    assert outcome.tolerance >= 0
    assert outcome.passed, outcome


def test_any_answer_gets_words(lesson: Lesson) -> None:
    """The right answer is judged right, any other gets the right one, with the reason; usual mistakes get their own."""
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


# Where lessons say that their ideas are used: sessions that can be opened as they stand.

SCENARIOS = [
    *((f"{name}, use {number}", use) for name, it in LESSONS.items() for number, use in enumerate(it.uses)),
    *((name, it.body) for name, it in LESSONS.items() if isinstance(it.body, Scenario)),
]


@pytest.mark.parametrize("scenario", [each for _, each in SCENARIOS], ids=[name for name, _ in SCENARIOS])
def test_it_can_be_opened(scenario: Scenario) -> None:
    """Its recipe makes a run that has the frame at which it opens, and its tracker reads what is unlocked."""
    run = make(scenario.recipe)
    experiment = find(scenario.recipe.experiment)
    assert 0 <= scenario.frame < (scenario.recipe.frames or experiment.frames)
    readers = {each.name: each.trackers for each in declarations(type(run.parameters_at(0)))}
    for name in set(scenario.unlocked) - {"tracker", "seed"}:
        assert not readers[name] or run.tracker_at(0) in readers[name] or "tracker" in scenario.unlocked, name
    assert set(scenario.plots) <= {plot.id for plot in experiment.display.plots}
    assert set(scenario.layers) <= {layer.name for layer in experiment.display.layers}


# A lesson's question as a poll: the right answer and the usual mistakes lie in intervals of their own.

NUMBER = re.compile(r"-?[\d,]+(?:\.\d+)?")


@pytest.mark.parametrize("name", DEMONSTRATIONS)
def test_every_question_of_the_course(name: str) -> None:
    """The intervals ascend, and the right answer with its tolerance stands in one of them."""
    question = LESSONS[name].question
    if question.choices:
        assert poll_answers(question) == tuple(question.choices.values())
        return
    exact = answer_of(LESSONS[name]).exact
    assert isinstance(exact, float)
    answers = poll_answers(question, exact)
    assert 3 <= len(answers) <= 8
    found = [float(NUMBER.findall(answer)[0].replace(",", "")) for answer in answers[1:]]
    assert all(low < high for low, high in pairwise(found))
    assert all(abs(cut - exact) > 0.5 * question.tolerance for cut in found)
    assert all(question.unit in answer for answer in answers)


def test_without_mistakes() -> None:
    """The bounds stand for them, or half and twice the right answer; zero has neither."""
    bounded = Question(text="How much?", words="So much.", bounds=(0.0, 1.0))
    assert poll_answers(bounded, 0.3) == ("Below 0.15", "0.15 to 0.65", "Above 0.65")
    free = Question(text="How many?", words="So many.", unit="frames")
    assert poll_answers(free, 40.0) == ("Below 30 frames", "30 to 60 frames", "Above 60 frames")
    assert poll_answers(free, 0.0) == ("Below -0.5 frames", "-0.5 to 0.5 frames", "Above 0.5 frames")
    with pytest.raises(ValueError, match="not a number"):
        poll_answers(free, float("nan"))


# Demonstrations: their figures, their numbers and their purity.

of_demonstrations = pytest.mark.parametrize("lesson", DEMONSTRATIONS, indirect=True)
SEEDS = 1, 2, 3, 4, 5
FAILING = {"sir"}
"""Lessons that show how a method fails where its parameters are extreme."""


def assert_believable(numbers: tuple[Number, ...], where: object) -> None:
    """Numbers are finite, and as near to the exact ones as they say, where they say it."""
    assert numbers
    for number in numbers:
        assert np.isfinite(number.value), (number, where)
        if number.exact is not None and number.tolerance is not None:
            assert abs(number.value - number.exact) <= number.tolerance, (number, where)


@of_demonstrations
def test_the_figure_can_be_drawn(lesson: Lesson) -> None:
    """It has two to six parameters; at the defaults it is sound, and every handle stands at its parameter's value.

    The same parameters and seed come to the same; another seed to something else, just where there are draws.
    """
    body = demonstration(lesson)
    assert 2 <= len(declarations(type(body.parameters))) <= 6
    figure = shown(lesson).figure
    assert_sound(figure)
    for handle in (handle for panel in figure.panels for handle in panel.handles):
        assert handle.at == pytest.approx(getattr(body.parameters, handle.parameter))
    first, again, other = (body.show(body.parameters, seed) for seed in (7, 7, 8))
    assert first.figure.model_dump_json() == again.figure.model_dump_json()
    assert first.numbers == again.numbers
    assert (first.figure.model_dump_json() != other.figure.model_dump_json()) == body.random


@of_demonstrations
def test_numbers_are_as_near_as_they_say(lesson: Lesson) -> None:
    """At the defaults every number lies within its tolerance of the exact one, whatever the draw."""
    body = demonstration(lesson)
    for seed in SEEDS if body.random else SEEDS[:1]:
        numbers = body.show(body.parameters, seed).numbers
        assert_believable(numbers, seed)
        assert [number.title for number in numbers if number.exact is not None and number.tolerance is None] == []


@of_demonstrations
def test_every_bound_can_be_shown(lesson: Lesson) -> None:
    """With each parameter at each end, and all at once, the figure is sound and the numbers are believable.

    Of lessons that show how a method fails there, the numbers may be as far off as they are.
    """
    for corner in corners(lesson):
        it = shown(lesson, **corner)
        assert_sound(it.figure)
        if lesson.id not in FAILING:
            assert_believable(it.numbers, corner)


@of_demonstrations
def test_the_veil_hides_what_reveals(lesson: Lesson) -> None:
    """Veiled, the figure has all traces but those that reveal, and can be drawn; no number tells the answer.

    The panel in which a point is to be placed exists, and its axis holds every answer that is allowed.
    """
    body, at, question = demonstration(lesson), asked_at(lesson), lesson.question
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
