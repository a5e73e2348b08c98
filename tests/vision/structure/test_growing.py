from dataclasses import replace

import numpy as np
import pytest

from pftrack.vision.structure import growing
from pftrack.vision.structure.factorization import shape_error
from pftrack.vision.structure.growing import Growing, Settings
from tests.vision.structure.views import FOCAL_PX, covariance, own, usual, views

SETTINGS = Settings(FOCAL_PX)


def grown(shape: np.ndarray, frames: int, settings: Settings = SETTINGS) -> list[Growing]:
    state = growing.begin(usual(), covariance(), settings)
    states = []
    for positions, variances in views(shape, frames):
        state = growing.step(state, positions, variances)
        states.append(state)
    return states


def test_the_own_shape_takes_over_smoothly() -> None:
    """For a body unlike the mean the weight rises to nearly 1, by no more than a thirtieth a frame."""
    states = grown(own(), 100)
    weights = np.array([0.0, *(state.weight for state in states)])
    assert np.abs(np.diff(weights)).max() <= 1.0 / 30.0 + 1e-12
    assert weights[1] == pytest.approx(0.01, abs=0.03)
    assert weights[-1] > 0.9
    assert shape_error(states[-1].shape, own(), "similarity") < 0.4 * shape_error(usual(), own(), "similarity")


def test_the_published_shape_lies_between() -> None:
    """It is the mean and the own shape, aligned, in the proportion of the weight."""
    for state in grown(own(), 40)[::13]:
        between = usual() + state.weight * (state.onto_mean(state.own.shape) - usual())
        assert np.allclose(state.shape, between)
    assert np.array_equal(growing.begin(usual(), covariance(), SETTINGS).shape, usual())


def test_a_body_that_changes_can_be_told() -> None:
    """When another body, like the mean, comes, a shape that does not learn loses its weight again."""
    state = grown(own(), 100)[-1]
    state = replace(state, settings=replace(state.settings, frozen=True))
    learned = state.own.shape
    for positions, variances in views(usual(), 60):
        state = growing.step(state, positions, variances)
    assert np.array_equal(state.own.shape, learned)
    assert state.weight < 0.1
