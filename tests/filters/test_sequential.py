"""The filter that takes numbers one at a time against the one that takes them all at once."""

import numpy as np
import pytest

from pftrack.core.numerics.random import Gaussian
from pftrack.filters import kalman
from pftrack.filters.dynamics import autoregression
from pftrack.filters.sequential import condition, decorrelate, predict_second_order

RNG = np.random.default_rng(0)


def spread(size: int) -> np.ndarray:
    factor = RNG.normal(size=(size, size + 2))
    return factor @ factor.T


def test_prediction_is_that_of_the_second_order_model() -> None:
    """Mean and covariance are those of the Kalman filter with q_t = 2 q_{t-1} - q_{t-2} + b u."""
    noise, one = np.array([0.5, 1.0, 2.0]), np.eye(3)
    prior = Gaussian(RNG.normal(size=6), spread(6))
    exact = kalman.predict(prior, autoregression(2 * one, -one, np.zeros(3), np.diag(noise)))
    mean, covariance = predict_second_order(prior.mean, prior.covariance, noise)
    assert np.allclose(mean, exact.mean)
    assert np.allclose(covariance, exact.covariance)
    assert np.array_equal(covariance, covariance.T)


def test_one_by_one_is_all_at_once() -> None:
    """Independent numbers, taken in one by one, give the posterior and the evidence of the Kalman update."""
    prior, observation = Gaussian(RNG.normal(size=5), spread(5)), RNG.normal(size=(7, 5))
    measured, variances = RNG.normal(size=7), RNG.uniform(0.1, 2.0, 7)
    exact, evidence = kalman.update(prior, measured, observation, np.diag(variances))
    residuals = measured - observation @ prior.mean
    mean, covariance, log_evidence = condition(prior.mean, prior.covariance, residuals, observation, variances)
    assert np.allclose(mean, exact.mean)
    assert np.allclose(covariance, exact.covariance)
    assert log_evidence == pytest.approx(evidence)
    assert np.array_equal(covariance, covariance.T)


def test_dependent_numbers_are_made_independent() -> None:
    """Numbers with correlated noise, made independent first, give the posterior of the Kalman update."""
    prior, observation, noise = Gaussian(RNG.normal(size=3), spread(3)), RNG.normal(size=(6, 3)), spread(6)
    measured = RNG.normal(size=6)
    exact, evidence = kalman.update(prior, measured, observation, noise)
    parts = decorrelate(measured - observation @ prior.mean, observation, noise)
    mean, covariance, log_evidence = condition(prior.mean, prior.covariance, *parts)
    assert np.allclose(mean, exact.mean)
    assert np.allclose(covariance, exact.covariance)
    assert log_evidence == pytest.approx(evidence)


def test_singular_noise_stays_finite() -> None:
    """A number that another one determines, and one that is certain already, do no harm."""
    noise = np.ones((3, 3))
    parts = decorrelate(np.ones(3), np.eye(3), noise)
    mean, covariance, _ = condition(np.zeros(3), np.eye(3), *parts)
    assert np.isfinite(mean).all()
    assert np.isfinite(covariance).all()
    mean, covariance, log_evidence = condition(np.zeros(2), np.zeros((2, 2)), np.ones(1), np.ones((1, 2)), np.zeros(1))
    assert (mean.tolist(), covariance.tolist(), log_evidence) == ([0.0, 0.0], [[0.0, 0.0], [0.0, 0.0]], 0.0)
