"""Lesson 7: clouds and the error of their mean."""

import numpy as np
import pytest

from pftrack.teaching.lessons import LESSONS
from pftrack.teaching.lessons.course.monte_carlo import MEAN, SD, sample, sizes_up_to
from pftrack.teaching.lessons.lesson import judge
from tests.teaching.lessons.demonstrations import asked_at

LESSON = LESSONS["monte-carlo"]


@pytest.mark.parametrize(("small", "large"), [(10, 20), (70, 3000), (990, 1000)])
def test_a_smaller_cloud_is_the_beginning_of_a_larger_one(small: int, large: int) -> None:
    """A slider that is turned adds samples or takes them away, and draws none anew; further axes change none either."""
    one, few = sample(5, small, 1, 3)
    other, many = sample(5, large, 4, 3)
    assert (other[:small] == one).all()
    common = [size for size in sizes_up_to(small) if size in sizes_up_to(large)]
    assert many[: len(common), :, :1] == pytest.approx(few[: len(common)])


def test_means_are_those_of_the_samples() -> None:
    """Of the first ten, thirty, hundred, and of all."""
    samples, means = sample(2, 250, 2, 4)
    assert means.shape == (4, 4, 2)
    assert list(sizes_up_to(250)) == [10, 30, 100, 250]
    assert means[:, 0, 0] == pytest.approx([samples[:size].mean() for size in (10, 30, 100, 250)])


def test_samples_have_the_density_that_is_drawn() -> None:
    """Mean and standard deviation of ten thousand are within four of their own standard deviations."""
    samples, _ = sample(1, 10_000, 1, 1)
    assert samples.mean() == pytest.approx(MEAN, abs=4 * SD / 100)
    assert samples.std() == pytest.approx(SD, abs=4 * SD / np.sqrt(20_000))


@pytest.mark.parametrize(("said", "words"), [(1000.0, "root of ten"), (400.0, "a tenth takes far more")])
def test_usual_mistakes_are_told_apart(said: float, words: str) -> None:
    """Ten times and four times the samples have explanations of their own."""
    answer = LESSON.answer(asked_at(LESSON), 1)
    assert answer.exact == 10_000
    verdict = judge(LESSON.question, answer, said)
    assert not verdict.right
    assert any(words in sentence for sentence in verdict.words)
