"""Lesson 4: what a guess costs."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pftrack.teaching.lessons import LESSONS
from pftrack.teaching.lessons.course.estimate import exact_losses, expected_losses, median, posterior
from pftrack.teaching.lessons.lesson import judge
from tests.teaching.lessons.demonstrations import asked_at, shown

LESSON = LESSONS["estimate"]


@given(st.floats(-3, 9), st.floats(0, 1), st.floats(0, 6))
def test_losses_on_the_grid_are_those_of_the_formulas(guess: float, weight: float, second: float) -> None:
    """All three, for any guess and any density of the lesson."""
    density = posterior(weight, second)
    assert expected_losses(density, np.array([guess]))[:, 0] == pytest.approx(exact_losses(density, guess), abs=1e-4)


@given(st.floats(0, 1), st.floats(0, 6))
def test_half_of_the_probability_is_below_the_median(weight: float, second: float) -> None:
    """Wherever the second bump is and whatever it holds."""
    density = posterior(weight, second)
    assert float(density.cumulative(median(density))) == pytest.approx(0.5, abs=1e-12)


@given(st.floats(-3, 9), st.floats(0, 1), st.floats(0, 6))
def test_no_guess_beats_mean_and_median(guess: float, weight: float, second: float) -> None:
    """The mean has the smallest squared error, the median the smallest absolute one."""
    density = posterior(weight, second)
    assert exact_losses(density, density.mean)[0] <= exact_losses(density, guess)[0]
    assert exact_losses(density, median(density))[1] <= exact_losses(density, guess)[1] + 1e-12


def test_the_mode_jumps_where_the_lesson_says() -> None:
    """With 0.6 of the probability the second bump is still lower than the first, with 0.65 it is higher."""
    for weight, low, high in ((0.6, -0.1, 0.1), (0.65, 3.9, 4.1)):
        curve = shown(LESSON, weight=weight).figure.panels[0].traces[0]
        assert curve.kind == "curve"
        assert low <= curve.x[np.argmax(curve.y)] <= high


@pytest.mark.parametrize(("said", "words"), [(0.0, "mode"), (0.4, "median"), (2.0, "halfway"), (4.0, "three tenths")])
def test_usual_mistakes_are_told_apart(said: float, words: str) -> None:
    """Each place where one might put the guess has its own explanation."""
    verdict = judge(LESSON.question, LESSON.answer(asked_at(LESSON), 1), said)
    assert not verdict.right
    assert any(words in sentence for sentence in verdict.words)
