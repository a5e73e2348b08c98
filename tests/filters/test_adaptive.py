"""Particles of features from two predictions: where they come from, and what becomes of them."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pftrack.core.numerics.random import Gaussian, Purpose, Stream
from pftrack.filters import adaptive, kalman
from pftrack.filters.adaptive import Projection
from pftrack.filters.dynamics import autoregression
from pftrack.filters.particles import ParticleSet

PLACES = np.array([[10.0, 20.0], [-30.0, 5.0], [100.0, -100.0]])
SPREAD = np.array([[4.0, 3.0], [3.0, 9.0]])


def rng(frame: int = 1) -> Stream:
    return Stream(5, frame, Purpose.TRACK)


def from_above(means: np.ndarray = PLACES) -> Projection:
    both = np.stack([means, means - 2.0], axis=2)
    return Projection(both, np.broadcast_to(SPREAD, (len(means), 2, 2, 2)).copy())


def drawn(ratio: float, count: int = 40_000) -> adaptive.Draw:
    features = adaptive.begin(PLACES, 1.0, count, rng(0))
    return adaptive.draw(features, from_above(PLACES + 500.0), np.full(3, ratio), 5.0, count, rng())


def test_from_above_comes_the_joint_prediction() -> None:
    """With a ratio of 1, positions now and a frame ago have the projection's mean and covariance, each axis apart."""
    cloud = drawn(1.0)
    assert cloud.upper_counts.tolist() == [40_000] * 3
    for n in range(3):
        for axis in range(2):
            pairs = cloud.coordinates[n, [axis, 2 + axis]]
            assert np.allclose(pairs.mean(axis=1), PLACES[n, axis] + [500.0, 498.0], atol=0.1)
            assert np.allclose(np.cov(pairs), SPREAD, atol=0.3)
        assert abs(np.corrcoef(cloud.coordinates[n, :2])[0, 1]) < 0.03


def test_parents_are_where_particles_were() -> None:
    """A particle from below was, in the last frame, where its parent is; one from above has no parent."""
    features = adaptive.weigh(drawn(0.5, 30), np.random.default_rng(3).normal(size=(3, 30)), rng())
    cloud = adaptive.draw(features, from_above(), np.array([0.2, 0.0, 1.0]), 5.0, 20, rng(2))
    assert [np.count_nonzero(row < 0) for row in cloud.parents] == [4, 0, 20]
    positions = features.positions.reshape(-1, 2)
    for n in range(3):
        below = cloud.parents[n] >= 0
        assert not below[: cloud.upper_counts[n]].any()
        assert np.array_equal(positions[cloud.parents[n, below]], cloud.coordinates[n, 2:, below])
        assert np.isin(cloud.parents[n, below], 30 * n + features.survivors[n]).all()
    assert np.array_equal(adaptive.weigh(cloud, np.zeros((3, 20)), rng()).parents, cloud.parents)


def test_what_is_held_is_its_own_parent() -> None:
    """Without a draw each particle is what it was; of another filter's particles none descends."""
    features = adaptive.begin(PLACES, 1.0, 4, rng(0))
    assert (features.parents == -1).all()
    held = adaptive.hold(features)
    assert held.parents.tolist() == [[0, 1, 2, 3], [4, 5, 6, 7], [8, 9, 10, 11]]
    assert (adaptive.orphan(held).parents == -1).all()


def test_features_are_resampled_apart() -> None:
    """Each feature has its own random offset: equal weights do not make equal parents."""
    count = 50
    places = np.random.default_rng(2).normal(size=(8, 4, count))
    cloud = adaptive.Draw(places, np.zeros(8, np.int64), np.full((8, count), -1))
    scores = np.tile(np.linspace(-3.0, 0.0, count), (8, 1))
    parents = {tuple(survivors) for survivors in adaptive.weigh(cloud, scores, rng()).survivors.tolist()}
    assert len(parents) > 4


@given(st.floats(0, 1), st.integers(1, 60))
def test_the_ratio_is_a_division_not_a_draw(ratio: float, count: int) -> None:
    """Of N particles round(alpha N) come from above, and they are the first."""
    cloud = drawn(ratio, count)
    expected = int(np.rint(ratio * count))
    assert cloud.upper_counts.tolist() == [expected] * 3
    assert (cloud.coordinates[0, 0, :expected] > 300).all()
    assert (cloud.coordinates[0, 0, expected:] < 300).all()


def test_the_weight_is_the_likelihood_alone() -> None:
    """Weights, moments and evidence are those of a particle set weighed by the likelihood."""
    cloud = drawn(0.4, 50)
    scores = np.random.default_rng(0).normal(size=(3, 50))
    features = adaptive.weigh(cloud, scores, rng())
    for n in range(3):
        exact = np.exp(scores[n]) / np.exp(scores[n]).sum()
        assert np.allclose(np.exp(features.log_weights[n]), exact)
        alike = ParticleSet(cloud.positions[n], features.log_weights[n], np.arange(50))
        assert np.allclose(features.means[n], alike.mean)
        assert np.allclose(features.covariances[n], alike.covariance)
        assert features.log_evidences[n] == pytest.approx(np.log(np.exp(scores[n]).mean()))
        copies = np.bincount(features.survivors[n], minlength=50)
        assert (np.abs(copies - 50 * exact) < 1).all()
    assert np.array_equal(features.variances, features.covariances[:, [0, 1], [0, 1]])
    assert features.particles.shape == (3, 50, 4)
    assert np.array_equal(features.positions, features.particles[..., :2])


def test_what_cannot_be_keeps_the_prediction() -> None:
    """A feature whose particles are all impossible, or have no number for a score, keeps them equally."""
    cloud = drawn(0.5, 50)
    scores = np.zeros((3, 50))
    scores[0], scores[1], scores[2, 1:] = -np.inf, np.nan, -np.inf
    features = adaptive.weigh(cloud, scores, rng())
    assert np.allclose(np.exp(features.log_weights[:2]), 1 / 50)
    assert features.log_evidences[:2].tolist() == [-np.inf, -np.inf]
    assert np.allclose(features.means[2], cloud.positions[2, 0])
    assert not features.survivors[2].any()


def test_alone_it_is_a_bootstrap_filter() -> None:
    """From below only, on Gaussian measurements, mean and covariance come to the Kalman filter's (tolerance 3 %)."""
    one = np.eye(1)
    model = autoregression(2 * one, -one, np.zeros(1), 5 * one)
    exact = Gaussian(np.zeros(2), np.ones((2, 2)))
    features = adaptive.begin(np.zeros((1, 2)), 1.0, 100_000, rng(0))
    for t in range(1, 6):
        seen = 4.0 * t
        exact, _ = kalman.update(kalman.predict(exact, model), np.array([seen]), np.eye(1, 2), 9 * one)
        cloud = adaptive.draw(features, from_above(np.zeros((1, 2))), np.zeros(1), 5.0, 100_000, rng(t))
        scores = -0.5 * ((cloud.positions - seen) ** 2).sum(axis=2) / 9
        features = adaptive.weigh(cloud, scores, rng(t))
        assert np.allclose(features.means[0], exact.mean[0], atol=0.15)
        assert np.allclose(features.variances[0], exact.covariance[0, 0], rtol=0.03)
