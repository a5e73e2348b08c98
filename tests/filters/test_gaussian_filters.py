"""The Kalman filter and its relatives against closed forms and against each other."""

import numpy as np
import pytest
from numpy.typing import NDArray

from pftrack.core.numerics.random import Gaussian, log_density
from pftrack.filters import extended, kalman, unscented
from pftrack.filters.dynamics import autoregression, constant_velocity

MODEL = constant_velocity(2, 1.0, 0.5)
OBSERVE = np.eye(2, 4)
NOISE = np.array([[2.0, 0.3], [0.3, 1.0]])


def _signal(length: int = 30) -> list[NDArray[np.float64]]:
    rng = np.random.default_rng(4)
    return [np.array([t, 0.5 * t]) + rng.normal(size=2) for t in range(length)]


def test_kalman_agrees_with_the_joint_gaussian() -> None:
    """Filtering step by step gives what conditioning the joint Gaussian of all frames at once gives."""
    prior = Gaussian(np.array([0.0, 0.0, 1.0, 0.5]), np.diag([4.0, 4.0, 1.0, 1.0]))
    length = 6
    posterior, evidence = prior, 0.0
    for measurement in _signal(length):
        posterior, log_evidence = kalman.update(kalman.predict(posterior, MODEL), measurement, OBSERVE, NOISE)
        evidence += log_evidence

    powers = [np.linalg.matrix_power(MODEL.transition, n) for n in range(length + 1)]
    means = np.concatenate([OBSERVE @ powers[t + 1] @ prior.mean for t in range(length)])
    blocks = [powers[t + 1] for t in range(length)]
    joint = np.zeros((4 * length, 4 * length))
    for i in range(length):
        for j in range(length):
            joint[4 * i : 4 * i + 4, 4 * j : 4 * j + 4] = blocks[i] @ prior.covariance @ blocks[j].T + sum(
                powers[i - s] @ MODEL.noise_covariance @ powers[j - s].T for s in range(min(i, j) + 1)
            )
    observe = np.kron(np.eye(length), OBSERVE)
    seen = np.concatenate(_signal(length))
    spread = observe @ joint @ observe.T + np.kron(np.eye(length), NOISE)
    gain = joint[-4:] @ observe.T @ np.linalg.inv(spread)
    assert np.allclose(posterior.mean, powers[length] @ prior.mean + gain @ (seen - means))
    assert np.allclose(posterior.covariance, joint[-4:, -4:] - gain @ observe @ joint[:, -4:])
    assert evidence == pytest.approx(float(log_density(seen, means, spread)))


def test_linear_models_make_all_three_the_same() -> None:
    """On a linear model the extended and the unscented filter are the Kalman filter."""
    exact = by_slope = by_points = Gaussian(np.zeros(4), np.eye(4))
    for measurement in _signal():
        exact, evidence = kalman.update(kalman.predict(exact, MODEL), measurement, OBSERVE, NOISE)
        predicted = extended.predict(
            by_slope, lambda x: MODEL.transition @ x, lambda _: MODEL.transition, MODEL.noise_covariance
        )
        by_slope, slope_evidence = extended.update(
            predicted, measurement, lambda x: OBSERVE @ x, lambda _: OBSERVE, NOISE
        )
        predicted = unscented.predict(by_points, lambda x: x @ MODEL.transition.T, MODEL.noise_covariance)
        by_points, point_evidence = unscented.update(predicted, measurement, lambda x: x @ OBSERVE.T, NOISE)
        for other, other_evidence in ((by_slope, slope_evidence), (by_points, point_evidence)):
            assert np.allclose(other.mean, exact.mean)
            assert np.allclose(other.covariance, exact.covariance)
            assert other_evidence == pytest.approx(evidence)


def test_unscented_transform_is_right_to_second_order() -> None:
    """The mean and variance of the square of a Gaussian are exact: m^2 + s^2 and 4 m^2 s^2 + 2 s^4."""
    mean, variance = 1.5, 0.49
    means, covariances, cross = unscented.transform(np.array([[mean]]), np.array([[[variance]]]), np.square)
    assert means[0, 0] == pytest.approx(mean**2 + variance)
    assert covariances[0, 0, 0] == pytest.approx(4 * mean**2 * variance + 2 * variance**2)
    assert cross[0, 0, 0] == pytest.approx(2 * mean * variance)


def test_singular_measurement_is_refused() -> None:
    """A measurement that is certain already cannot be conditioned on, and the filter says so."""
    with pytest.raises(np.linalg.LinAlgError):
        kalman.update(Gaussian(np.zeros(2), np.zeros((2, 2))), np.ones(2), np.eye(2), np.zeros((2, 2)))


def test_sine_posterior_spread() -> None:
    """The posterior spread on Bando's sine after one period is the published 0.03632."""
    one = np.eye(1)
    model = autoregression(2 * one, -one, np.zeros(1), 0.001 * one)
    posterior = Gaussian(np.zeros(2), np.eye(2))
    for _ in range(360):
        posterior, _ = kalman.update(kalman.predict(posterior, model), np.zeros(1), np.eye(1, 2), 0.01 * one)
    assert posterior.standard_deviations[0] == pytest.approx(0.03632, abs=1e-5)
