"""A lesson's question as a poll: the right answer and the usual mistakes lie in intervals of their own."""

import re
from itertools import pairwise

import pytest

from pftrack.teaching.lessons import LESSONS
from pftrack.teaching.lessons.lesson import MOST_ANSWERS, Demonstration, Question, answer_of, poll_answers

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
    with pytest.raises(ValueError, match="no number"):
        poll_answers(free, float("nan"))
