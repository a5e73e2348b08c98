"""Lesson 11: posteriors, influence curves and the track."""

import numpy as np
import pytest

from pftrack.teaching.lessons import LESSONS
from pftrack.teaching.lessons.course.outliers import (
    CELL,
    GRID,
    OutliersParameters,
    cauchy_mean,
    gaussian_mean,
    posterior,
    show,
)
from pftrack.teaching.lessons.lesson import judge

SCALES = 0.2, 1.0, 5.0
PLACES = -5.0, 0.0, 2.5, 20.0


@pytest.mark.parametrize("scale", SCALES)
@pytest.mark.parametrize("z", PLACES)
def test_means_on_the_grid_are_the_closed_forms(scale: float, z: float) -> None:
    """Under either noise, at all ends of both sliders."""
    for heavy, exact in ((False, gaussian_mean(z, scale)), (True, float(cauchy_mean(z, scale)))):
        density = posterior(z, scale, heavy=heavy)
        assert density.sum() * CELL == pytest.approx(1.0)
        assert density @ GRID * CELL == pytest.approx(exact, abs=1e-9)


def test_the_cauchy_mean_turns_round() -> None:
    """It grows with small surprises, and for large ones falls like 2/z towards nothing."""
    near, far = cauchy_mean(np.linspace(0.0, 2.0, 50), 1.0), cauchy_mean(np.linspace(3.0, 20.0, 50), 1.0)
    assert (np.diff(near) > 0).all()
    assert (np.diff(far) < 0).all()
    assert cauchy_mean(200.0, 1.0) == pytest.approx(2.0 / 200.0, rel=0.01)


def test_the_track_is_followed_by_both() -> None:
    """At frame 45 the Gaussian filter goes with the outlier and the Cauchy filter does not, at any seed."""
    for seed in (1, 2, 3):
        track = show(OutliersParameters(), seed).figure.panels[2]
        gaussian, cauchy = (
            next(each for each in track.traces if each.title.startswith(law)) for law in ("Gaussian", "Cauchy")
        )
        assert abs(gaussian.y[45] - 100.0) > 20.0
        assert abs(cauchy.y[45] - 100.0) < 5.0


@pytest.mark.parametrize(("given", "words"), [(10.0, "half way"), (4.0, "does not settle"), (-2.0, "never pushes")])
def test_a_point_in_the_wrong_place_is_explained(given: float, words: str) -> None:
    """Half way, between and beyond are different mistakes."""
    lesson = LESSONS["outliers"]
    answer = lesson.answer(OutliersParameters(**lesson.question.at), 1)
    verdict = judge(lesson.question, answer, given)
    assert not verdict.right
    assert any(words in sentence for sentence in verdict.words)
