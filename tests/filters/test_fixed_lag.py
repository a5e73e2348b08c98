import numpy as np
import pytest

from pftrack.core.numerics.random import Gaussian, log_density
from pftrack.filters import bootstrap, dynamics, kalman
from pftrack.filters.dynamics import autoregression, random_walk
from pftrack.filters.particles import ParticleSet

LAG = 3
MODEL = random_walk(1, 1.0)
NOISE = np.array([[0.5]])
SEEN = [np.array([value]) for value in (0.3, 1.2, 0.4, 2.5, 2.0, 3.1, 2.2, 4.0)]


def _smoothed_exactly() -> Gaussian:
    """Condition the joint of all frames on all measurements, and return the frame LAG before the last."""
    length = len(SEEN)
    joint = np.array([[1.0 + min(i, j) + 1 for j in range(length)] for i in range(length)])
    gain = joint @ np.linalg.inv(joint + NOISE[0, 0] * np.eye(length))
    mean, covariance = gain @ np.concatenate(SEEN), joint - gain @ joint
    index = length - 1 - LAG
    return Gaussian(mean[index : index + 1], covariance[index : index + 1, index : index + 1])


def test_augmented_kalman_filter_smooths() -> None:
    """The last block of the augmented state is the exact smoothed posterior of its frame."""
    model = dynamics.augment_dynamics(MODEL, 1, LAG)
    posterior = dynamics.augment(Gaussian(np.zeros(1), np.eye(1)), LAG)
    for seen in SEEN:
        posterior, _ = kalman.update(kalman.predict(posterior, model), seen, np.eye(1, LAG + 1), NOISE)
    exact, ours = _smoothed_exactly(), dynamics.block(posterior, LAG, 1)
    assert np.allclose(ours.mean, exact.mean)
    assert np.allclose(ours.covariance, exact.covariance)


def test_lineages_smooth() -> None:
    """The weighted ancestors of particles come to the exact smoothed mean (tolerance 0.03)."""
    particles = ParticleSet.uniform(np.random.default_rng(0).standard_normal((50_000, 1)))
    lineage = dynamics.begin_lineage(particles, 1)
    for t, seen in enumerate(SEEN):
        particles = bootstrap.step(
            particles, MODEL, lambda x, seen=seen: log_density(x, seen, NOISE), np.random.default_rng(t)
        ).particles
        lineage = dynamics.extend_lineage(lineage, particles, LAG)
    assert len(lineage.paths) == LAG + 1
    assert dynamics.smooth(lineage, particles, LAG)[0] == pytest.approx(_smoothed_exactly().mean[0], abs=0.03)
    assert dynamics.smooth(lineage, particles, 0)[0] == pytest.approx(particles.mean[0])
    with pytest.raises(IndexError):
        dynamics.smooth(lineage, particles, LAG + 1)


def test_second_order_models_are_augmented() -> None:
    """The augmented dynamics predict the same newest position and shift the rest."""
    model = autoregression(1.9 * np.eye(2), -0.9 * np.eye(2), np.array([1.0, 2.0]), np.eye(2))
    wide = dynamics.augment_dynamics(model, 2, 4)
    past = np.arange(10.0)
    advanced = wide.predict(past[None])[0]
    assert np.allclose(advanced[:2], model.predict(past[None, :4])[0, :2])
    assert np.array_equal(advanced[2:], past[:8])
    with pytest.raises(ValueError, match="lag must be at least 1"):
        dynamics.augment_dynamics(model, 2, 0)
