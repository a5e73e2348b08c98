"""Lesson 5: predictions and measurements on a grid and by a Kalman filter."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pftrack.core.model.parameters import Value
from pftrack.teaching.lessons import LESSONS
from pftrack.teaching.lessons.course.recursion import GRID, Moment, RecursionParameters, moments, spread
from tests.teaching.lessons.demonstrations import asked_at, shown

LESSON = LESSONS["recursion"]


def last(**changes: Value) -> Moment:
    *_, newest = moments(GRID, RecursionParameters.model_validate(changes))
    return newest


COUNTS = st.integers(0, 30)


@given(COUNTS, COUNTS, COUNTS, st.floats(0, 3), st.floats(0.5, 9))
def test_grid_and_filter_agree_on_any_sequence(
    rounds: int, predictions: int, measurements: int, motion: float, noise: float
) -> None:
    """However often is predicted and measured, mean and variance are the same."""
    moment = last(rounds=rounds, predictions=predictions, measurements=measurements, motion=motion, noise=noise)
    mean, variance = spread(GRID, moment.density)
    assert mean == pytest.approx(float(moment.exact.mean[0]), abs=1e-4)
    assert variance == pytest.approx(moment.variance, abs=1e-4)


def test_hidden_is_never_measured() -> None:
    """While the target is hidden the variance only grows, by q with each prediction."""
    assert last(rounds=2, measurements=1, motion=1, hidden=True).variance == pytest.approx(11.0)


def test_ten_predictions_and_one_measurement_are_as_the_question_says() -> None:
    """The variance has settled at 1, grows to 11 and is below r afterwards."""
    variances = [moment.variance for moment in moments(GRID, asked_at(LESSON))]
    assert variances[8] == pytest.approx(1.0, abs=0.02)
    assert variances[18] == pytest.approx(11.0, abs=0.02)
    assert LESSON.answer(asked_at(LESSON), 1).exact == pytest.approx(1.692, abs=1e-3)


def test_what_comes_of_the_last_step_is_behind_the_veil() -> None:
    """The variance chart tells all steps but the last, and no curve of the density afterwards is shown."""
    figure = shown(LESSON, **LESSON.question.at).figure.without_answer()
    density, variance = figure.panels
    assert [trace.title for trace in density.traces] == ["before: predicted", "likelihood of the measurement 3.9 m"]
    assert max(float(np.max(trace.x)) for trace in variance.traces if trace.kind == "strip chart") == 18.0


def test_it_settles_where_the_lesson_says() -> None:
    """The number on the screen is the variance after many rounds."""
    for motion, noise in ((1.0, 2.0), (0.3, 7.0), (0.0, 2.0)):
        settled = shown(LESSON, motion=motion, noise=noise).numbers[2].value
        rounds = last(rounds=30, motion=motion, noise=noise).variance
        assert settled == pytest.approx(rounds, abs=1e-3 if motion else 0.08)
