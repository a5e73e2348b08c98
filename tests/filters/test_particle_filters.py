"""Particles, their motion and resampling, and filters against the exact answers of a Kalman filter and of a grid."""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from pftrack.core.numerics.random import Gaussian, log_density
from pftrack.filters import auxiliary, bootstrap, kalman, unscented_particle
from pftrack.filters.dynamics import LinearDynamics, autoregression, constant_velocity, random_walk
from pftrack.filters.particles import ParticleSet, Posterior, normalise
from pftrack.filters.resampling import RESAMPLERS, Resampler, decide, residual, systematic, systematic_parents

MODEL = random_walk(2, 0.7)
NOISE = np.eye(2)
COUNT = 20_000

HALF = COUNT // 2


def mixed(weights: Any, above: int) -> Callable[..., Posterior]:
    """Return the auxiliary filter with so many particles drawn from the prediction, the others from the observation."""
    counts: Any = {"prediction_count": above, "observation_count": COUNT - above}
    return partial(auxiliary.step, weights=weights, **counts)


unscented = partial(unscented_particle.step, observe=lambda x: x)
CONSISTENT: dict[str, Callable[..., Posterior]] = {
    "bootstrap": partial(bootstrap.step, threshold=1.0),
    "bootstrap, adaptive": partial(bootstrap.step, threshold=0.5),
    "auxiliary, corrected": mixed("corrected", 0),
    "mixed, corrected": mixed("corrected", HALF),
    "mixed, balanced": mixed("balanced", HALF),
    "unscented": partial(unscented, noise_covariance=NOISE),
    "unscented, recursive": partial(unscented, noise_covariance=NOISE, recursive=True),
}
rng = np.random.default_rng


@pytest.mark.parametrize("name", CONSISTENT)
def test_agrees_with_the_kalman_filter(name: str) -> None:
    """On a linear Gaussian model mean, covariance and log evidence are the exact ones (tolerance 0.03 and 0.1)."""
    exact = Gaussian(np.zeros(2), np.eye(2))
    particles = ParticleSet.uniform(rng(6).standard_normal((COUNT, 2)))
    evidence, exact_evidence = 0.0, 0.0
    for t in range(8):
        seen = np.array([0.8 * t, -0.4 * t])
        exact, log_evidence = kalman.update(kalman.predict(exact, MODEL), seen, np.eye(2), NOISE)
        exact_evidence += log_evidence
        measured: Any = {"measurement": seen} if name.startswith("unscented") else {}
        near = partial(log_density, means=seen, covariance=NOISE)
        posterior = CONSISTENT[name](particles, MODEL, near, rng(t), **measured)
        particles, evidence = posterior.particles, evidence + posterior.log_evidence
        assert np.allclose(particles.mean, exact.mean, atol=0.03)
        assert np.allclose(particles.covariance, exact.covariance, atol=0.03)
    assert evidence == pytest.approx(exact_evidence, abs=0.1)


def test_agrees_with_a_grid_on_a_bimodal_posterior() -> None:
    """Where the posterior has two modes the bootstrap filter agrees with a grid (tolerance 0.02)."""
    grid = np.linspace(-12, 12, 2401)

    def likelihood(states: np.ndarray) -> np.ndarray:
        return np.log(0.3 * np.exp(-0.5 * (states[:, 0] - 3) ** 2) + 0.7 * np.exp(-0.5 * (states[:, 0] + 3) ** 2))

    density, kernel = np.exp(-0.5 * (grid - 0.3) ** 2 / 4), np.exp(-0.5 * np.linspace(-6, 6, 1201) ** 2)
    particles = ParticleSet.uniform(0.3 + 2 * rng(1).standard_normal((COUNT, 1)))
    for t in range(4):
        density = np.convolve(density, kernel, mode="same") * np.exp(likelihood(grid[:, None]))
        density /= density.sum()
        particles = bootstrap.step(particles, random_walk(1, 1.0), likelihood, rng(t + 10)).particles
        right = particles.weights[particles.states[:, 0] > 0].sum()
        assert right == pytest.approx(density[grid > 0].sum(), abs=0.02)


SMOOTH = autoregression(2 * np.eye(2), -np.eye(2), np.zeros(2), 3 * np.eye(2))


def test_the_covariance_of_a_recursive_unscented_filter_is_that_of_a_kalman_filter() -> None:
    """Handed down from one particle to the next, it equals a Kalman filter's in every frame."""
    exact = Gaussian(np.zeros(4), np.zeros((4, 4)))
    particles = ParticleSet.uniform(np.zeros((20, 4)))
    for t in range(12):
        seen = None if t in (4, 5) else np.array([1.0 * t, 0.0])
        exact = kalman.predict(exact, SMOOTH)
        if seen is not None:
            exact, _ = kalman.update(exact, seen, np.eye(2, 4), 100.0 * np.eye(2))
        given: Any = {"measurement": seen, "noise_covariance": 100.0 * np.eye(2), "recursive": True}
        particles = unscented(particles, SMOOTH, lambda states: np.zeros(len(states)), rng(t), **given).particles
        assert particles.covariances == pytest.approx(np.broadcast_to(exact.covariance, (20, 4, 4)))
    assert exact.covariance[0, 0] > 4 * 9.0


def test_unscented_filter_refuses_noise_it_cannot_handle() -> None:
    """Process noise on lagged coordinates is refused."""
    model = LinearDynamics(np.eye(4), np.zeros(4), np.eye(4)[:, 2:].copy())
    given: Any = {"measurement": np.zeros(2), "noise_covariance": np.eye(2)}
    with pytest.raises(ValueError, match="first coordinates"):
        unscented(ParticleSet.uniform(np.zeros((5, 4))), model, lambda x: x[:, 0], rng(0), **given)


@given(arrays(np.float64, st.integers(1, 50), elements=st.floats(-1e4, 1e4)))
def test_weights_are_normalised(log_weights: np.ndarray) -> None:
    """Weights sum to one and keep their ratios; NaN and infinity count as zero, and weights of zero become equal."""
    normalised, log_sum = normalise(log_weights)
    assert np.exp(normalised).sum() == pytest.approx(1.0)
    assert np.allclose(normalised + log_sum, log_weights, atol=1e-9)
    normalised, _ = normalise(np.array([0.0, np.nan, np.inf, -np.inf, 0.0]))
    assert np.exp(normalised).tolist() == [0.5, 0.0, 0.0, 0.0, 0.5]
    for hopeless in (-np.inf, np.nan):
        normalised, log_sum = normalise(np.full(4, hopeless))
        assert np.allclose(np.exp(normalised), 0.25)
        assert log_sum == -np.inf


def test_a_particle_set_has_moments_a_mode_and_ancestors() -> None:
    """Mean and covariance are NumPy's weighted ones, the mode is the heaviest particle, ancestors count once.

    The effective sample size is N for equal weights and 1 where a single one counts.
    """
    log_weights, _ = normalise(rng(1).normal(size=500))
    particles = ParticleSet(rng(2).normal(size=(500, 4)), log_weights, np.arange(500) // 4)
    assert np.allclose(particles.mean, np.average(particles.states, axis=0, weights=particles.weights))
    assert np.allclose(particles.covariance, np.cov(particles.states.T, aweights=particles.weights, ddof=0))
    assert particles.mode.tolist() == particles.states[log_weights.argmax()].tolist()
    assert (particles.unique_ancestors, len(particles)) == (125, 500)
    for each, size in ((np.zeros(8), 8), (np.array([0.0] + [-np.inf] * 7), 1)):
        particles = ParticleSet(np.zeros((8, 2)), normalise(each)[0], np.arange(8))
        assert particles.effective_sample_size == pytest.approx(size)


ALL = pytest.mark.parametrize("resample", RESAMPLERS.values(), ids=RESAMPLERS)


@ALL
def test_expected_copies(resample: Resampler) -> None:
    """Each parent is drawn count * weight times on average, within four standard errors."""
    weights, count, repeats = np.array([0.05, 0.5, 0.0, 0.25, 0.2]), 12, 1000
    with np.errstate(divide="ignore"):
        log_weights = np.log(weights)
    copies = sum(np.bincount(resample(rng(seed), log_weights, count), minlength=5) for seed in range(repeats))
    error = 4 * np.sqrt(count * weights * (1 - weights) / repeats)
    assert (np.abs(copies / repeats - count * weights) <= error + 1e-12).all()


@ALL
@given(st.data())
def test_ancestors_are_valid(resample: Resampler, data: st.DataObject) -> None:
    """Ancestors are ascending, exist, and none has a weight of zero, whatever the constant of the logarithms."""
    size, count = data.draw(st.integers(1, 40)), data.draw(st.integers(1, 60))
    weights = st.lists(st.just(-np.inf) | st.floats(-700, 700), min_size=size, max_size=size)
    log_weights = np.array(data.draw(weights))
    log_weights[data.draw(st.integers(0, size - 1))] = 0.5
    ancestors = resample(rng(data.draw(st.integers(0, 1000))), log_weights, count)
    assert ancestors.shape == (count,)
    assert (np.diff(ancestors) >= 0).all()
    assert ((ancestors >= 0) & (ancestors < size)).all()
    assert np.isfinite(log_weights[ancestors]).all()


@pytest.mark.parametrize("count", [1, 7, 1000])
@pytest.mark.parametrize("offset", [0.0, 0.5, np.nextafter(1.0, 0.0)])
def test_one_offset_draws_floor_or_ceil_of_a_share(count: int, offset: float) -> None:
    """At either end of its range too, systematic resampling draws each parent floor or ceil of its expectation."""
    weights = np.array([0.0, 0.3, 0.0, 0.5, 0.2, 0.0])
    copies, expected = np.bincount(systematic_parents(weights, offset, count), minlength=6), count * weights
    assert copies.sum() == count
    assert ((copies >= np.floor(expected - 1e-9)) & (copies <= np.ceil(expected + 1e-9))).all()


def test_residual_keeps_whole_parts() -> None:
    """Residual resampling leaves only fractions to chance."""
    for seed in range(50):
        copies = np.bincount(residual(rng(seed), np.log([0.6, 0.3, 0.1]), 5), minlength=3)
        assert (copies >= [3, 1, 0]).all()


def test_it_waits_until_the_effective_sample_size_falls() -> None:
    """Resampling happens below the threshold, at threshold one always, and whenever the number changes."""
    even = ParticleSet.uniform(np.zeros((10, 1)))
    uneven = ParticleSet(np.zeros((10, 1)), normalise(np.array([5.0] + [0.0] * 9))[0], np.arange(10))
    cases: list[Any] = [(0.5, even, 10), (0.5, uneven, 10), (1.0, even, 10), (0.5, even, 20)]
    drawn = [decide(systematic, threshold, rng(0), *case) is not None for threshold, *case in cases]
    assert drawn == [False, True, True, True]


MODELS = {
    "random walk": random_walk(3, 2.0),
    "constant velocity": constant_velocity(2, 0.1, 5.0),
    "autoregression": autoregression(
        np.array([[1.9, 0.1], [0.0, 1.8]]), -0.9 * np.eye(2), np.array([3.0, -1.0]), np.diag([2.0, 0.5])
    ),
}


@pytest.mark.parametrize("model", MODELS.values(), ids=MODELS)
def test_samples_have_the_moments_of_the_model(model: LinearDynamics) -> None:
    """Drawn states have mean A x + d and covariance B B^T, within five standard errors."""
    state, count = rng(2).normal(size=(1, len(model.offset))) * 10, 200_000
    drawn = model.diffuse(rng(3), model.predict(state), np.zeros(count, dtype=np.int64))
    expected = model.transition @ state[0] + model.offset
    scale = np.sqrt(np.diag(model.noise_covariance))
    assert (np.abs(drawn.mean(0) - expected) <= 5 * scale / np.sqrt(count) + 1e-9).all()
    assert np.allclose(np.cov(drawn.T), model.noise_covariance, atol=5 * scale.max() ** 2 / np.sqrt(count) * 2)


def test_drawn_states_follow_their_ancestors_and_their_past() -> None:
    """Without noise each is its ancestor's prediction; an autoregression's second block is the first of before.

    With a constant velocity the position advances by velocity times the interval.
    """
    model, states, ancestors = MODELS["autoregression"], rng(1).normal(size=(5, 4)), np.array([2, 0, 2, 4, 1])
    still = LinearDynamics(model.transition, model.offset, np.zeros((4, 1)))
    assert np.array_equal(still.diffuse(rng(0), still.predict(states), ancestors), still.predict(states)[ancestors])
    drawn = model.diffuse(rng(2), model.predict(states), ancestors)
    assert np.array_equal(drawn[:, 2:], states[ancestors, :2])
    assert np.allclose(constant_velocity(2, 0.5, 1.0).predict(np.array([[1.0, 2.0, 4.0, -6.0]])), [[3, -1, 4, -6]])


@given(st.floats(0, 100), st.floats(0, 50), st.floats(0, 50), st.integers(1, 5000))
def test_switches_by_the_spread(sigma: float, low: float, width: float, count: int) -> None:
    """The hard one takes all from the observation once any axis is wider than gamma.

    The share of the soft one rises linearly between its thresholds (eqs. 3.6 and 3.7), from none to all.
    """
    spreads = [(4.0, 5.0), (5.1, 0.0), (0.0, 5.1), (9.0, 9.0)]
    assert [auxiliary.hard(np.array(each), 5.0, 800) for each in spreads] == [0, 800, 800, 800]
    wide = [auxiliary.soft(np.array([each, 1.0]), 4.0, 20.0, 800) for each in (3.0, 4.0, 4.01, 12.0, 20.0, 99.0)]
    assert wide == [0, 0, 0, 400, 800, 800]
    less, more = (auxiliary.soft(np.array([each]), low, low + width, count) for each in (sigma, sigma + 1))
    assert 0 <= less <= more <= count
