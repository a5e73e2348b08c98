import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from pftrack.filters.particles import ParticleSet, normalise

LOG_WEIGHTS = arrays(np.float64, st.integers(1, 50), elements=st.floats(-1e4, 1e4))


@given(LOG_WEIGHTS)
def test_normalised_weights_sum_to_one(log_weights: np.ndarray) -> None:
    """Weights sum to one, keep their ratios, and the log of the sum is right."""
    normalised, log_sum = normalise(log_weights)
    assert np.exp(normalised).sum() == pytest.approx(1.0)
    assert np.allclose(normalised + log_sum, log_weights, atol=1e-9)


def test_impossible_weights_count_as_zero() -> None:
    """NaN and +inf become a weight of zero and leave the others alone."""
    normalised, _ = normalise(np.array([0.0, np.nan, np.inf, -np.inf, 0.0]))
    assert np.exp(normalised).tolist() == [0.5, 0.0, 0.0, 0.0, 0.5]


@pytest.mark.parametrize("hopeless", [-np.inf, np.nan])
def test_all_zero_becomes_uniform(hopeless: float) -> None:
    """If every weight is zero the set becomes uniform, and the log sum says so."""
    normalised, log_sum = normalise(np.full(4, hopeless))
    assert np.allclose(np.exp(normalised), 0.25)
    assert log_sum == -np.inf


def test_moments_agree_with_numpy() -> None:
    """Mean and covariance are the weighted ones, without a divisor N - 1."""
    rng = np.random.default_rng(1)
    log_weights, _ = normalise(rng.normal(size=500))
    particles = ParticleSet(rng.normal(size=(500, 4)), log_weights, np.arange(500))
    assert np.allclose(particles.mean, np.average(particles.states, axis=0, weights=particles.weights))
    expected = np.cov(particles.states.T, aweights=particles.weights, ddof=0)
    assert np.allclose(particles.covariance, expected)


def test_effective_sample_size_bounds() -> None:
    """It is N for equal weights and 1 for a single one that counts."""
    states = np.zeros((8, 2))
    assert ParticleSet.uniform(states).effective_sample_size == pytest.approx(8)
    alone, _ = normalise(np.array([0.0] + [-np.inf] * 7))
    assert ParticleSet(states, alone, np.arange(8)).effective_sample_size == pytest.approx(1)


def test_mode_and_ancestors() -> None:
    """The mode is the heaviest particle; ancestors are counted once each."""
    log_weights, _ = normalise(np.log([0.2, 0.5, 0.3]))
    particles = ParticleSet(np.array([[1.0], [2.0], [3.0]]), log_weights, np.array([4, 4, 9]))
    assert particles.mode.tolist() == [2.0]
    assert particles.unique_ancestors == 2
    assert len(particles) == 3
