"""The corridor: what can be known of the robot, and the particles beside it."""

import numpy as np
import pytest

from pftrack.filters.particles import ParticleSet
from pftrack.teaching.lessons import LESSONS
from pftrack.teaching.lessons.course.sir import (
    BINS_M,
    CELL_M,
    CELLS_M,
    LENGTH_M,
    STEPS,
    Corridor,
    SirParameters,
    assign_bins,
    cached_walk,
    total_variation,
)


def test_the_likelihood_is_that_of_the_lesson() -> None:
    """p(door | x) is 0.05 + 0.9 exp(-((x - d) / 1.5)^2 / 2) of the nearest door, and nothing is outside."""
    corridor = Corridor()
    here = np.array([12.0, 13.5, 60.0, -0.1, 100.1])
    sensed = corridor.likelihood(here, door=True)
    assert sensed == pytest.approx([0.95, 0.05 + 0.9 * np.exp(-0.5), 0.05, 0.0, 0.0], abs=1e-9)
    assert corridor.likelihood(here, door=False)[:3] == pytest.approx(1.0 - sensed[:3])


@pytest.mark.parametrize("corridor", [Corridor(), Corridor(0.1, 1.0), Corridor(3.0, 0.0)])
def test_densities_have_the_area_one(corridor: Corridor) -> None:
    """Whatever the noise and the sensor, in every step."""
    _, exact = cached_walk(corridor)
    assert exact.given.sum(axis=1) * CELL_M == pytest.approx(np.ones(STEPS + 1))
    assert exact.predicted.sum(axis=1) * CELL_M == pytest.approx(np.ones(STEPS))
    assert (exact.given >= 0.0).all()


def test_without_a_sensor_the_density_only_moves_on() -> None:
    """A sensor that guesses tells nothing: after 12 steps of 3 m it is uniform from 36 m on."""
    _, exact = cached_walk(Corridor(0.6, 0.0))
    after = exact.given[-1]
    assert after[CELLS_M < 25.0].max() < 1e-6
    assert after[(CELLS_M > 46.0) & (CELLS_M < 99.0)] == pytest.approx(1.0 / (LENGTH_M - 36.0), rel=0.02)


def test_total_variation_is_that_of_the_bins() -> None:
    """A cloud in one bin against the uniform density is off by all but that bin's share."""
    cloud = ParticleSet.uniform(np.full((10, 1), 31.0))
    assert assign_bins(CELLS_M, np.full(len(CELLS_M), CELL_M / LENGTH_M)) == pytest.approx(
        0.02 * np.ones(len(BINS_M) - 1)
    )
    assert total_variation(cloud, np.full(len(CELLS_M), 1.0 / LENGTH_M)) == pytest.approx(0.98)


def test_a_filter_without_redrawing_keeps_its_particles_apart() -> None:
    """With the threshold 0 each particle is its own ancestor, and the weights are those of all measurements."""
    walk, _ = cached_walk(Corridor())
    clouds = Corridor().clouds(walk.doors, 50, 1, threshold=0.0)
    assert all((cloud.ancestors == np.arange(50)).all() for cloud in clouds)
    assert clouds[-1].effective_sample_size < clouds[1].effective_sample_size


def test_the_question_is_measured_over_many_repeats() -> None:
    """Four times the particles: the factor is measured, near 2, and said in words."""
    lesson = LESSONS["sir"]
    answer = lesson.answer(SirParameters(**lesson.question.at), 1)
    assert answer.exact == 2.0
    assert "200 repeats" in answer.words
    assert answer.measured == pytest.approx(2, abs=0.1), "what is measured does not contradict what is right"
    assert f"{answer.measured:.3g}" in answer.words
