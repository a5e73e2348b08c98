import numpy as np
import pytest

from pftrack.core.geometry import rotation
from pftrack.core.numerics.random import Gaussian, Purpose, Stream
from pftrack.filters import affine, extended

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


def test_angles_may_walk_together() -> None:
    """A learned covariance takes the place of the step of each angle, by both filters; a diagonal one is the same."""
    prior = Gaussian(np.array([0.1, -0.2, 0.05]), 1e-3 * np.eye(3))
    seen = measured(np.array([0.12, -0.22, 0.04]))
    alone = affine.extended_step(prior, seen, NOISE, REFERENCE, SD)
    same = affine.extended_step(prior, seen, NOISE, REFERENCE, 99.0, SD**2 * np.eye(3))
    assert np.allclose(same.mean, alone.mean, atol=1e-12)
    walk = SD**2 * np.array([[1, 0.9, 0], [0.9, 1, 0], [0, 0, 0.1]])
    wider = Gaussian(prior.mean, prior.covariance + walk)
    exact = affine.extended_step(prior, seen, NOISE, REFERENCE, 99.0, walk)
    by_hand = affine.extended_step(wider, seen, NOISE, REFERENCE, 0.0)
    assert np.array_equal(exact.mean, by_hand.mean)
    rng = Stream(0, 1, Purpose.TRACK)
    particles = prior.sample(rng, 200_000)
    ours, _ = affine.particle(particles, seen, NOISE, REFERENCE, 99.0, rng, 1000, walk)
    assert np.allclose(ours.mean, exact.mean, atol=np.deg2rad(0.1))
    assert np.allclose(ours.standard_deviations, exact.standard_deviations, rtol=0.1)


@pytest.mark.parametrize("camera", [np.zeros((2, 3)), np.array([[5.0, 0, 0], [5.0, 0, 0]])])
def test_a_camera_that_sees_nothing_leaves_the_pose_finite(camera: np.ndarray) -> None:
    """With a singular reference, and with singular noise, pose and covariance stay finite."""
    for noise in (NOISE, np.ones((6, 6)), np.zeros((6, 6))):
        pose = affine.extended_step(Gaussian(np.zeros(3), np.eye(3)), np.ones(6), noise, camera, SD)
        assert np.isfinite(pose.mean).all()
        assert np.isfinite(pose.covariance).all()
        moved, _ = affine.particle(np.zeros((50, 3)), np.ones(6), noise, camera, SD, Stream(0, 1, Purpose.TRACK), 50)
        assert np.isfinite(moved.mean).all()
