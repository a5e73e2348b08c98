"""What holds of every lesson of the course: its words, its question, its checks, and where it is used."""

import re
from itertools import pairwise

import pytest

from pftrack.core.model.parameters import declarations
from pftrack.experiments import find
from pftrack.runs.reproduction import make
from pftrack.teaching.lessons import LESSONS
from pftrack.teaching.lessons.lesson import (
    MOST_ANSWERS,
    Answer,
    Demonstration,
    Lesson,
    Mistake,
    Question,
    Scenario,
    answer_of,
    judge,
    poll_answers,
)

CHECKS = [(name, check.name) for name, lesson in LESSONS.items() for check in lesson.checks]
NAME = re.compile(r"[a-z0-9]+(-[a-z0-9]+)*")


@pytest.fixture(params=LESSONS)
def lesson(request: pytest.FixtureRequest) -> Lesson:
    return LESSONS[request.param]


def right_answer(lesson: Lesson) -> Answer:
    """The answer, computed; of a scenario, whose run would take long, one that stands for it."""
    if isinstance(lesson.body, Demonstration):
        at = type(lesson.body.parameters)(**{**lesson.body.parameters.model_dump(), **lesson.question.at})
        answer = lesson.answer(at, lesson.body.seed)
        assert isinstance(answer, Answer)
        return answer
    usual = {mistake.given for mistake in lesson.question.mistakes}
    if lesson.question.kind == "choice":
        return Answer(next(name for name in lesson.question.choices or () if name not in usual))
    return Answer(sum(lesson.question.bounds) / 2)


def test_the_idea_is_short(lesson: Lesson) -> None:
    """At most ninety words stand before the figure, a formula counted as one."""
    assert 20 <= len(re.sub(r"\$+[^$]+\$+", "formula", lesson.idea).split()) <= 90


def test_every_sentence_is_there_and_ends(lesson: Lesson) -> None:
    """Title, what to notice, what to try, what is asked and why are all there, as sentences."""
    assert NAME.fullmatch(lesson.id)
    assert lesson.title
    assert not lesson.title.endswith(".")
    assert lesson.question.text.endswith(("?", "."))
    assert lesson.tries
    sentences = [lesson.notice, *lesson.tries, lesson.question.words, *(it.words for it in lesson.question.mistakes)]
    assert [sentence for sentence in sentences if not sentence.endswith((".", "?"))] == []


def test_checks_have_names_and_claims(lesson: Lesson) -> None:
    """Names differ, are of lower-case words with hyphens, and each check says what it claims."""
    names = [check.name for check in lesson.checks]
    assert names
    assert len(set(names)) == len(names)
    assert all(NAME.fullmatch(name) for name in names)
    assert all(check.title for check in lesson.checks)


@pytest.mark.parametrize(("name", "check"), CHECKS)
def test_every_check_passes(name: str, check: str) -> None:
    """What a lesson claims holds within the tolerance that the claim states."""
    outcome = next(each for each in LESSONS[name].checks if each.name == check).run()
    assert outcome.tolerance >= 0
    assert outcome.passed, outcome


def test_the_right_answer_is_judged_right(lesson: Lesson) -> None:
    """The exact answer is an answer, and is right; the verdict says why."""
    answer = right_answer(lesson)
    verdict = judge(lesson.question, answer, answer.exact)
    assert verdict.right
    assert verdict.exact == verdict.given
    assert lesson.question.words in verdict.words
    assert len(verdict.words[0]) > len("Right")


def test_every_usual_mistake_is_explained(lesson: Lesson) -> None:
    """Each of them is wrong, and its own words are reached."""
    answer = right_answer(lesson)
    assert lesson.question.mistakes
    for mistake in lesson.question.mistakes:
        verdicts = [judge(lesson.question, answer, given) for given in _examples(mistake)]
        assert any(not verdict.right and mistake.words in verdict.words for verdict in verdicts), mistake


def test_any_wrong_answer_gets_words(lesson: Lesson) -> None:
    """A wrong answer gets the right one, with the reason."""
    question, answer = lesson.question, right_answer(lesson)
    wrong = set(question.choices or question.bounds) - {answer.exact}
    for given in wrong:
        verdict = judge(question, answer, given)
        assert not verdict.right
        assert question.words in verdict.words
        assert not verdict.words[0].startswith("Right")
        if question.kind != "choice":
            assert isinstance(verdict.exact, float)


def _examples(mistake: Mistake) -> tuple[float | str, ...]:
    if isinstance(mistake.given, tuple):
        low, high = mistake.given
        return low, (low + high) / 2, high
    return (mistake.given,)


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
ASKED = [name for name, lesson in LESSONS.items() if isinstance(lesson.body, Demonstration)]


def cuts(answers: tuple[str, ...]) -> list[float]:
    """Where the intervals meet."""
    return [float(NUMBER.findall(answer)[0].replace(",", "")) for answer in answers[1:]]


@pytest.mark.parametrize("name", ASKED)
def test_every_question_of_the_course(name: str) -> None:
    """The intervals ascend, and the right answer with its tolerance stands in one of them."""
    question = LESSONS[name].question
    if question.choices:
        assert poll_answers(question) == tuple(question.choices.values())
        return
    exact = answer_of(LESSONS[name]).exact
    assert isinstance(exact, float)
    answers = poll_answers(question, exact)
    assert 3 <= len(answers) <= MOST_ANSWERS
    found = cuts(answers)
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
