"""What holds of every lesson of the course: its words, its question and its checks."""

import re

import pytest

from pftrack.teaching.lessons import LESSONS
from pftrack.teaching.lessons.lesson import Answer, Demonstration, Lesson, Mistake, judge

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
