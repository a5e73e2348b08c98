"""The Kalman filter and its relatives against closed forms and against each other."""

import numpy as np
import pytest

from pftrack.core.numerics.random import Gaussian, log_density
from pftrack.filters import bootstrap, dynamics, extended, kalman, unscented
from pftrack.filters.dynamics import constant_velocity, random_walk
from pftrack.filters.particles import ParticleSet
from pftrack.filters.sequential import condition, decorrelate

MODEL = constant_velocity(2, 1.0, 0.5)
OBSERVE = np.eye(2, 4)
NOISE = np.array([[2.0, 0.3], [0.3, 1.0]])


def test_linear_models_make_all_three_the_same() -> None:
    """On a linear model the extended and the unscented filter are the Kalman filter."""
    exact = by_slope = by_points = Gaussian(np.zeros(4), np.eye(4))
    move, drive = MODEL.transition, MODEL.noise_covariance
    for seen in np.arange(30.0)[:, None] * (1.0, 0.5) + np.random.default_rng(4).normal(size=(30, 2)):
        exact, evidence = kalman.update(kalman.predict(exact, MODEL), seen, OBSERVE, NOISE)
        by_slope = extended.predict(by_slope, lambda x: move @ x, lambda _: move, drive)
        by_slope, slope_evidence = extended.update(by_slope, seen, lambda x: OBSERVE @ x, lambda _: OBSERVE, NOISE)
        by_points = unscented.predict(by_points, lambda x: x @ move.T, drive)
        by_points, point_evidence = unscented.update(by_points, seen, lambda x: x @ OBSERVE.T, NOISE)
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


# The filter that takes numbers one at a time against the one that takes them all at once.

RNG = np.random.default_rng(0)


def spread(size: int) -> np.ndarray:
    factor = RNG.normal(size=(size, size + 2))
    return factor @ factor.T


@pytest.mark.parametrize("correlated", [False, True])
def test_one_by_one_is_all_at_once(correlated: bool) -> None:
    """Numbers, made independent first if need be, give one by one the posterior and evidence of the Kalman update."""
    prior, observation, measured = Gaussian(RNG.normal(size=5), spread(5)), RNG.normal(size=(7, 5)), RNG.normal(size=7)
    noise = spread(7) if correlated else np.diag(RNG.uniform(0.1, 2.0, 7))
    exact, evidence = kalman.update(prior, measured, observation, noise)
    parts = measured - observation @ prior.mean, observation
    parts = decorrelate(*parts, noise) if correlated else (*parts, noise.diagonal().copy())
    mean, covariance, log_evidence = condition(prior.mean, prior.covariance, *parts)
    assert np.allclose(mean, exact.mean)
    assert np.allclose(covariance, exact.covariance)
    assert log_evidence == pytest.approx(evidence)
    assert np.array_equal(covariance, covariance.T)


def test_singular_noise_stays_finite() -> None:
    """A number that another one determines, and one that is certain already, do no harm one by one.

    All at once, a measurement that is certain already is refused.
    """
    with pytest.raises(np.linalg.LinAlgError):
        kalman.update(Gaussian(np.zeros(2), np.zeros((2, 2))), np.ones(2), np.eye(2), np.zeros((2, 2)))
    parts = decorrelate(np.ones(3), np.eye(3), np.ones((3, 3)))
    mean, covariance, _ = condition(np.zeros(3), np.eye(3), *parts)
    assert np.isfinite([mean, *covariance]).all()
    mean, covariance, log_evidence = condition(np.zeros(2), np.zeros((2, 2)), np.ones(1), np.ones((1, 2)), np.zeros(1))
    assert (mean.tolist(), covariance.tolist(), log_evidence) == ([0.0, 0.0], [[0.0, 0.0], [0.0, 0.0]], 0.0)


LAG = 3
LAG_MODEL = random_walk(1, 1.0)
LAG_NOISE = np.array([[0.5]])
SEEN = [np.array([value]) for value in (0.3, 1.2, 0.4, 2.5, 2.0, 3.1, 2.2, 4.0)]


def _smoothed_exactly() -> Gaussian:
    """Condition the joint of all frames on all measurements, and return the frame LAG before the last."""
    length = len(SEEN)
    joint = np.array([[1.0 + min(i, j) + 1 for j in range(length)] for i in range(length)])
    gain = joint @ np.linalg.inv(joint + LAG_NOISE[0, 0] * np.eye(length))
    mean, covariance = gain @ np.concatenate(SEEN), joint - gain @ joint
    index = length - 1 - LAG
    return Gaussian(mean[index : index + 1], covariance[index : index + 1, index : index + 1])


def test_augmented_kalman_filter_smooths() -> None:
    """The last block of the augmented state is the exact smoothed posterior of its frame."""
    model = dynamics.augment_dynamics(LAG_MODEL, 1, LAG)
    posterior = dynamics.augment(Gaussian(np.zeros(1), np.eye(1)), LAG)
    for seen in SEEN:
        posterior, _ = kalman.update(kalman.predict(posterior, model), seen, np.eye(1, LAG + 1), LAG_NOISE)
    exact, ours = _smoothed_exactly(), dynamics.block(posterior, LAG, 1)
    assert np.allclose(ours.mean, exact.mean)
    assert np.allclose(ours.covariance, exact.covariance)


def test_lineages_smooth() -> None:
    """The weighted ancestors of particles have the exact smoothed mean (tolerance 0.03)."""
    particles = ParticleSet.uniform(np.random.default_rng(0).standard_normal((50_000, 1)))
    lineage = dynamics.begin_lineage(particles, 1)
    for t, seen in enumerate(SEEN):
        near = lambda x, seen=seen: log_density(x, seen, LAG_NOISE)  # noqa: E731 - a likelihood
        particles = bootstrap.step(particles, LAG_MODEL, near, np.random.default_rng(t)).particles
        lineage = dynamics.extend_lineage(lineage, particles, LAG)
    assert len(lineage.paths) == LAG + 1
    assert dynamics.smooth(lineage, particles, LAG)[0] == pytest.approx(_smoothed_exactly().mean[0], abs=0.03)
    assert dynamics.smooth(lineage, particles, 0)[0] == pytest.approx(particles.mean[0])
    with pytest.raises(IndexError):
        dynamics.smooth(lineage, particles, LAG + 1)
