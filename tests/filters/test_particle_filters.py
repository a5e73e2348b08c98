"""Particle filters against the exact answers of a Kalman filter and of a grid."""

from collections.abc import Callable
from functools import partial

import numpy as np
import pytest
from numpy.typing import NDArray

from pftrack.core.numerics.random import Gaussian, log_density
from pftrack.filters import auxiliary, bootstrap, kalman, unscented_particle
from pftrack.filters.dynamics import LinearDynamics, autoregression, random_walk
from pftrack.filters.particles import ParticleSet, Posterior

MODEL = random_walk(2, 0.7)
NOISE = np.eye(2)
COUNT = 20_000

HALF = COUNT // 2
CONSISTENT: dict[str, Callable[..., Posterior]] = {
    "bootstrap": partial(bootstrap.step, threshold=1.0),
    "bootstrap, adaptive": partial(bootstrap.step, threshold=0.5),
    "auxiliary, corrected": partial(auxiliary.step, weights="corrected", prediction_count=0, observation_count=COUNT),
    "mixed, corrected": partial(auxiliary.step, weights="corrected", prediction_count=HALF, observation_count=HALF),
    "mixed, balanced": partial(auxiliary.step, weights="balanced", prediction_count=HALF, observation_count=HALF),
    "unscented": partial(unscented_particle.step, observe=lambda x: x, noise_covariance=NOISE),
    "unscented, recursive": partial(
        unscented_particle.step, observe=lambda x: x, noise_covariance=NOISE, recursive=True
    ),
}


@pytest.mark.parametrize("name", CONSISTENT)
def test_agrees_with_the_kalman_filter(name: str) -> None:
    """On a linear Gaussian model mean, covariance and log evidence come to the exact ones (tolerance 0.03 and 0.1)."""
    rng = np.random.default_rng(6)
    exact = Gaussian(np.zeros(2), np.eye(2))
    particles = ParticleSet.uniform(rng.standard_normal((COUNT, 2)))
    evidence, exact_evidence = 0.0, 0.0
    for t in range(8):
        seen = np.array([0.8 * t, -0.4 * t])
        exact, log_evidence = kalman.update(kalman.predict(exact, MODEL), seen, np.eye(2), NOISE)
        exact_evidence += log_evidence
        measured = {"measurement": seen} if name.startswith("unscented") else {}
        posterior = CONSISTENT[name](
            particles, MODEL, lambda x, seen=seen: log_density(x, seen, NOISE), np.random.default_rng(t), **measured
        )
        particles = posterior.particles
        evidence += posterior.log_evidence
        assert np.allclose(particles.mean, exact.mean, atol=0.03)
        assert np.allclose(particles.covariance, exact.covariance, atol=0.03)
    assert evidence == pytest.approx(exact_evidence, abs=0.1)


def test_agrees_with_a_grid_on_a_bimodal_posterior() -> None:
    """Where the posterior has two modes the bootstrap filter comes to what a grid says (tolerance 0.02)."""
    grid = np.linspace(-12, 12, 2401)

    def likelihood(states: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.log(0.3 * np.exp(-0.5 * (states[:, 0] - 3) ** 2) + 0.7 * np.exp(-0.5 * (states[:, 0] + 3) ** 2))

    model = random_walk(1, 1.0)
    density = np.exp(-0.5 * (grid - 0.3) ** 2 / 4)
    particles = ParticleSet.uniform(0.3 + 2 * np.random.default_rng(1).standard_normal((COUNT, 1)))
    kernel = np.exp(-0.5 * np.linspace(-6, 6, 1201) ** 2)
    for t in range(4):
        density = np.convolve(density, kernel, mode="same") * np.exp(likelihood(grid[:, None]))
        density /= density.sum()
        particles = bootstrap.step(particles, model, likelihood, np.random.default_rng(t + 10)).particles
        right = particles.weights[particles.states[:, 0] > 0].sum()
        assert right == pytest.approx(density[grid > 0].sum(), abs=0.02)


def test_hopeless_frame_keeps_the_prediction() -> None:
    """If every weight is zero the particles stay where the prediction put them, with equal weights, and it is said."""
    particles = ParticleSet.uniform(np.random.default_rng(0).standard_normal((100, 2)))

    def nothing(states: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.full(len(states), -np.inf)

    for posterior in (
        bootstrap.step(particles, MODEL, nothing, np.random.default_rng(1)),
        auxiliary.step(
            particles,
            MODEL,
            nothing,
            np.random.default_rng(1),
            weights="sharpened",
            prediction_count=0,
            observation_count=100,
        ),
    ):
        assert np.allclose(posterior.particles.weights, 0.01)
        assert posterior.log_evidence == -np.inf
        assert posterior.observation_count == 0


def test_the_number_of_particles_can_change() -> None:
    """More or fewer particles than before are drawn on demand."""
    particles = ParticleSet.uniform(np.zeros((50, 2)))
    for count in (1, 7, 400):
        posterior = bootstrap.step(
            particles, MODEL, lambda x: -(x**2).sum(1), np.random.default_rng(0), count=count, threshold=0.0
        )
        assert len(posterior.particles) == count
        assert posterior.resampled


def test_unscented_filter_with_useless_measurement_is_the_bootstrap_filter() -> None:
    """With huge measurement noise the proposals are the predictions, to 1e-12 px."""
    one = np.eye(2)
    model = autoregression(2 * one, -one, np.zeros(2), 3 * one)
    rng = np.random.default_rng(3)
    positions = 160 + rng.normal(size=(800, 2))
    plain = nudged = ParticleSet.uniform(np.hstack([positions, positions]))
    for t in range(5):

        def likelihood(states: NDArray[np.float64]) -> NDArray[np.float64]:
            return -0.01 * ((states[:, :2] - 165) ** 2).sum(1)

        plain = bootstrap.step(plain, model, likelihood, np.random.default_rng(t)).particles
        nudged = unscented_particle.step(
            nudged,
            model,
            likelihood,
            np.random.default_rng(t),
            measurement=np.array([50.0, 60.0]),
            observe=lambda x: x,
            noise_covariance=1e26 * one,
        ).particles
        assert np.abs(plain.states - nudged.states).max() <= 1e-12
        assert np.abs(plain.mean - nudged.mean).max() <= 1e-12


def test_the_covariance_of_a_recursive_unscented_filter_is_that_of_a_kalman_filter() -> None:
    """Handed down from one particle to the next it comes, frame by frame, to what a Kalman filter's does."""
    one = np.eye(2)
    model = autoregression(2 * one, -one, np.zeros(2), 3 * one)
    exact = Gaussian(np.zeros(4), np.zeros((4, 4)))
    particles = ParticleSet.uniform(np.zeros((20, 4)))
    for t in range(12):
        seen = None if t in (4, 5) else np.array([1.0 * t, 0.0])
        exact = kalman.predict(exact, model)
        if seen is not None:
            exact, _ = kalman.update(exact, seen, np.eye(2, 4), 100.0 * one)
        particles = unscented_particle.step(
            particles,
            model,
            lambda states: np.zeros(len(states)),
            np.random.default_rng(t),
            measurement=seen,
            observe=lambda x: x,
            noise_covariance=100.0 * one,
            recursive=True,
        ).particles
        assert isinstance(particles, unscented_particle.UnscentedParticles)
        assert particles.covariances == pytest.approx(np.broadcast_to(exact.covariance, (20, 4, 4)))
    assert exact.covariance[0, 0] > 4 * 9.0


def test_unscented_filter_refuses_noise_it_cannot_handle() -> None:
    """Process noise on lagged coordinates is refused."""
    model = LinearDynamics(np.eye(4), np.zeros(4), np.vstack([np.zeros((2, 2)), np.eye(2)]))
    particles = ParticleSet.uniform(np.zeros((5, 4)))
    with pytest.raises(ValueError, match="first coordinates"):
        unscented_particle.step(
            particles,
            model,
            lambda x: x[:, 0],
            np.random.default_rng(0),
            measurement=np.zeros(2),
            observe=lambda x: x,
            noise_covariance=np.eye(2),
        )
