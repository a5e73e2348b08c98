import numpy as np

from pftrack.core.numerics.random import Gaussian, Purpose, Stream
from pftrack.filters import extended
from pftrack.filters.perspective import PerspectiveLayer, features

POINTS = np.random.default_rng(1).normal(size=(8, 3)) * 15
STATE = np.array([0.2, -0.5, 0.1, 12.0, -8.0, 300.0])
FOCAL = 400.0
MIDDLE = np.array([320.0, 240.0])
LAYER = PerspectiveLayer(POINTS, FOCAL, STATE, MIDDLE)


def seen(state: np.ndarray) -> np.ndarray:
    return features(state, POINTS, FOCAL)[0]


def test_the_jacobian_is_that_of_differences() -> None:
    """Derivatives by angles and translation agree with central differences within 1e-5 px."""
    _, jacobian = features(STATE, POINTS, FOCAL)
    for entry in range(6):
        change = 1e-5 * np.eye(6)[entry]
        difference = (seen(STATE + change) - seen(STATE - change)) / 2e-5
        assert np.abs(jacobian[:, :, entry] - difference).max() < 1e-5


def test_the_update_is_the_extended_kalman_filter() -> None:
    """Positions taken in one by one give the posterior of the library's extended Kalman filter."""
    rng = np.random.default_rng(0)
    prior = LAYER.predict(LAYER.begin())
    positions, variances = seen(STATE) + MIDDLE + rng.normal(size=(8, 2)), rng.uniform(0.25, 4, (8, 2))

    def observe(state: np.ndarray) -> np.ndarray:
        return (seen(state[:6]) + MIDDLE).ravel()

    def jacobian(state: np.ndarray) -> np.ndarray:
        return np.hstack([features(state[:6], POINTS, FOCAL)[1].reshape(16, 6), np.zeros((16, 6))])

    exact, _ = extended.update(prior, positions.ravel(), observe, jacobian, np.diag(variances.ravel()))
    ours = LAYER.update(prior, positions, variances, Stream(0, 1, Purpose.TRACK))
    assert np.allclose(ours.mean, exact.mean)
    assert np.allclose(ours.covariance, exact.covariance)
    assert np.array_equal(LAYER.pose(ours).mean, ours.mean[:3])


def test_features_are_projected_now_and_a_frame_ago() -> None:
    """Means are the projections of both states, covariances H V H^T over both."""
    rng = np.random.default_rng(3)
    factor = rng.normal(size=(12, 12)) * 0.01
    belief = Gaussian(np.concatenate([STATE, STATE + 0.01]), factor @ factor.T)
    projection = LAYER.project(belief)
    assert np.allclose(projection.positions, seen(STATE) + MIDDLE)
    assert np.allclose(projection.means[:, :, 1], seen(STATE + 0.01) + MIDDLE)
    now, before = (features(belief.mean[part], POINTS, FOCAL)[1] for part in (slice(6), slice(6, 12)))
    for n in range(8):
        for axis in range(2):
            rows = np.zeros((2, 12))
            rows[0, :6], rows[1, 6:] = now[n, axis], before[n, axis]
            assert np.allclose(projection.covariances[n, axis], rows @ belief.covariance @ rows.T)


def test_an_object_at_the_camera_stays_finite() -> None:
    """Predicted into the camera, the object is projected and updated without infinities."""
    belief = Gaussian(np.tile([0.0, 0.0, 0.0, 1.0, 1.0, -5.0], 2), np.eye(12))
    updated = LAYER.update(belief, np.zeros((8, 2)), np.ones((8, 2)), Stream(0, 1, Purpose.TRACK))
    assert np.isfinite(LAYER.project(belief).covariances).all()
    assert np.isfinite(updated.mean).all()
