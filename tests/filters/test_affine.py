"""The affine camera, its pose, and what both make of features."""

from dataclasses import replace

import numpy as np
import pytest

from pftrack.core.geometry import rotation
from pftrack.core.numerics.matrices import affine_projection
from pftrack.core.numerics.random import Gaussian, Purpose, Stream
from pftrack.filters import affine, extended, kalman
from pftrack.filters.affine import AffineBelief, AffineLayer
from pftrack.filters.dynamics import autoregression

POINTS = np.random.default_rng(1).normal(size=(9, 3)) * 15
CAMERA = np.array([[5.0, 0.1, -0.2, 12.0], [0.3, 4.9, 0.2, -7.0]])
LAYER = AffineLayer(POINTS, CAMERA)


def rng(frame: int = 1) -> Stream:
    return Stream(3, frame, Purpose.TRACK)


def watched(frames: int = 6) -> tuple[AffineBelief, list[tuple[np.ndarray, np.ndarray]]]:
    numbers = np.random.default_rng(2)
    belief, seen = LAYER.begin(), []
    for t in range(1, frames):
        camera = np.column_stack([CAMERA[:, :3] @ rotation(np.array([0.02, -0.03, 0.01]) * t), CAMERA[:, 3]])
        positions = affine_projection(camera, POINTS) + numbers.normal(size=(9, 2))
        seen.append((positions, numbers.uniform(0.25, 4.0, size=(9, 2))))
        belief = LAYER.update(LAYER.predict(belief), *seen[-1], rng(t))
    return belief, seen


def test_the_camera_is_filtered_exactly() -> None:
    """Two filters of eight components give what one Kalman filter over sixteen, with all features at once, gives."""
    belief, seen = watched()
    noise = np.tile(LAYER.noise_sd, 2)
    one = np.eye(8)
    model = autoregression(2 * one, -one, np.zeros(8), np.diag(noise))
    # Order of the whole state: both rows of the camera, then both a frame ago.
    exact = Gaussian(np.tile(CAMERA.ravel(), 2), np.diag(np.tile(noise**2, 2)))
    row = np.column_stack([POINTS, np.ones(len(POINTS))])
    none = np.zeros_like(row)
    observation = np.hstack([np.vstack([row, none]), np.vstack([none, row]), np.zeros((2 * len(row), 8))])
    for positions, variances in seen:
        prior = kalman.predict(exact, model)
        exact, _ = kalman.update(prior, positions.T.ravel(), observation, np.diag(variances.T.ravel()))
    for axis in range(2):
        part = np.concatenate([np.arange(4) + 4 * axis, np.arange(4) + 8 + 4 * axis])
        assert np.allclose(belief.mean[axis], exact.mean[part])
        assert np.allclose(belief.covariance[axis], exact.covariance[np.ix_(part, part)])


def test_features_are_projected_with_their_past() -> None:
    """Means are those of the camera now and a frame ago, covariances [C; L] V [C; L]^T."""
    belief = LAYER.predict(watched()[0])
    projection = LAYER.project(belief)
    assert np.allclose(projection.positions, affine_projection(belief.camera, POINTS))
    assert np.allclose(projection.means[:, :, 1], affine_projection(belief.mean[:, 4:], POINTS))
    for n, point in enumerate(POINTS):
        rows = np.kron(np.eye(2), np.append(point, 1.0))
        for axis in range(2):
            assert np.allclose(projection.covariances[n, axis], rows @ belief.covariance[axis] @ rows.T)
    assert np.array_equal(projection.variances, projection.covariances[:, :, 0, 0])


def test_particles_of_the_pose_begin_at_the_belief() -> None:
    """An object whose pose was estimated otherwise before has its first particles where that was."""
    theta = np.array([0.3, -0.2, 0.1])
    # Entries that may be anything say nothing of the pose, so that the particles alone say what it was.
    layer = AffineLayer(POINTS, CAMERA, np.full(4, 1e4), estimator="particle", theta_count=4000)
    belief = replace(layer.begin(), theta=Gaussian(theta, 1e-4 * np.eye(3)))
    after = layer.update(belief, affine_projection(CAMERA, POINTS), np.full((9, 2), 1e12), rng())
    for found in (after.theta_particles.mean(axis=0), after.theta.mean):
        assert found == pytest.approx(theta, abs=0.01)


REFERENCE = np.array([[5.0, 0.2, -0.3], [0.1, 4.8, 0.4]])
NOISE = 0.05**2 * (np.eye(6) + 0.3)
SD = affine.THETA_SD_RAD


def measured(theta: np.ndarray) -> np.ndarray:
    return (REFERENCE @ rotation(theta)).ravel()


def test_the_extended_filter_is_the_one_of_the_library() -> None:
    """A step is a random walk and the extended Kalman update with the Jacobian taken by differences."""
    prior = Gaussian(np.array([0.1, -0.2, 0.05]), np.diag([0.01, 0.02, 0.005]))
    seen = measured(np.array([0.15, -0.3, 0.0]))

    def jacobian(theta: np.ndarray) -> np.ndarray:
        changes = 1e-6 * np.eye(3)
        return np.column_stack([(measured(theta + d) - measured(theta - d)) / 2e-6 for d in changes])

    walked = extended.predict(prior, lambda theta: theta, lambda _: np.eye(3), SD**2 * np.eye(3))
    exact, _ = extended.update(walked, seen, measured, jacobian, NOISE)
    ours = affine.extended_step(prior, seen, NOISE, REFERENCE, SD)
    assert np.allclose(ours.mean, exact.mean, atol=1e-8)
    assert np.allclose(ours.covariance, exact.covariance, atol=1e-8)


@pytest.mark.parametrize("camera", [np.zeros((2, 3)), np.array([[5.0, 0, 0], [5.0, 0, 0]])])
@pytest.mark.parametrize("noise", [NOISE, np.ones((6, 6)), np.zeros((6, 6))])
def test_a_camera_that_sees_nothing_leaves_the_pose_finite(camera: np.ndarray, noise: np.ndarray) -> None:
    """With a singular reference, and with singular noise, pose and covariance stay finite."""
    pose = affine.extended_step(Gaussian(np.zeros(3), np.eye(3)), np.ones(6), noise, camera, SD)
    moved, _ = affine.particle(np.zeros((50, 3)), np.ones(6), noise, camera, SD, rng(), 50)
    assert all(np.isfinite(found).all() for found in (pose.mean, pose.covariance, moved.mean))
