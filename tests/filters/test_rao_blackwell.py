from functools import partial

import numpy as np
import pytest

from pftrack.core.numerics.matrices import affine_projection
from pftrack.core.numerics.random import Purpose, Stream
from pftrack.filters import rao_blackwell
from pftrack.filters.affine import AffineLayer
from pftrack.vision.likelihoods import points

CAMERA = np.array([[5.0, 0.0, 0.0, 0.0], [0.0, 5.0, 0.0, 0.0]])
LAYER = AffineLayer(np.array([[0.0, 0.0, 0.0], [6.0, 2.0, -3.0]]), CAMERA)
NOISE = np.array([2.0, 3.0])


def rng(frame: int) -> Stream:
    return Stream(4, frame, Purpose.TRACK)


@pytest.mark.parametrize("threshold", [0.0, 0.5, 1.0])
def test_it_is_exact_where_the_kalman_filter_is(threshold: float) -> None:
    """On Gaussian measurements of two points the camera is the Kalman filter's, however often it resamples."""
    numbers = np.random.default_rng(0)
    exact, state = LAYER.begin(), rao_blackwell.begin(LAYER, 60_000)
    for t in range(1, 5):
        seen = affine_projection(CAMERA, LAYER.points_mm) + [1.5, -1.0] * np.array([t]) + numbers.normal(size=(2, 2))
        variances = np.repeat(NOISE[:, None] ** 2 + 1.0, 2, axis=1)
        predicted = LAYER.predict(exact)
        exact = LAYER.update(predicted, seen, variances, rng(t))
        near = partial(points.log_likelihood, measured=seen, noise_sd=NOISE)
        state = rao_blackwell.step(state, LAYER, near, rng(t), threshold=threshold)
        weights = np.exp(state.log_weights)
        means = state.cameras @ weights
        known = LAYER.project(exact)
        # In px at the points: the entries themselves are poorly determined by two of them.
        row = np.column_stack([LAYER.points_mm, np.ones(2)])
        assert np.allclose((row @ means[:, :4].T), known.positions, atol=0.05)
        for axis in range(2):
            between = np.cov(state.cameras[axis], aweights=weights, bias=True)
            spread = row @ (between + state.covariance)[:4, :4] @ row.T
            assert np.allclose(np.diag(spread), known.variances[:, axis], rtol=0.05)
    assert np.allclose(state.pose.mean, exact.theta.mean, atol=np.deg2rad(0.3))


def test_the_features_are_weighted_means() -> None:
    """Means and covariances of the features are those of the particles' positions."""
    state = rao_blackwell.begin(LAYER, 500)
    seen = affine_projection(CAMERA, LAYER.points_mm) + 2.0
    state = rao_blackwell.step(state, LAYER, lambda x: points.log_likelihood(x, seen, NOISE), rng(1))
    weights = np.exp(state.log_weights)
    assert weights.sum() == pytest.approx(1.0)
    assert state.positions.shape == (2, 500, 2)
    assert np.allclose(state.feature_means, weights @ state.positions)
    for n in range(2):
        assert np.allclose(state.feature_covariances[n], np.cov(state.positions[n].T, aweights=weights, bias=True))
    assert 1.0 <= state.effective_sample_size <= 500.0


def test_it_resamples_when_it_must() -> None:
    """With few particles of weight the next ones descend from those; the number may change; nothing kills it."""
    state = rao_blackwell.begin(LAYER, 300)
    state = rao_blackwell.step(state, LAYER, lambda x: -1e3 * np.square(x).sum(axis=2), rng(1))
    assert state.effective_sample_size < 10
    fewer = rao_blackwell.step(state, LAYER, lambda x: np.zeros(x.shape[:2]), rng(2), count=100)
    assert fewer.effective_sample_size == pytest.approx(100.0)
    # Where the parents' points were, before and after they were drawn by weight.
    row = np.column_stack([LAYER.points_mm, np.ones(2)])
    cameras = state.cameras[:, :4]
    by_weight, by_number = row @ (cameras @ np.exp(state.log_weights)).T, row @ cameras.mean(2).T
    drawn = row @ fewer.cameras[:, 4:].mean(axis=2).T
    assert np.abs(drawn - by_weight).max() < 0.3 < np.abs(by_number - by_weight).max()
    lost = rao_blackwell.step(fewer, LAYER, lambda x: np.full(x.shape[:2], np.nan), rng(3))
    assert lost.log_evidence == -np.inf
    assert np.isfinite(lost.pose.mean).all()
