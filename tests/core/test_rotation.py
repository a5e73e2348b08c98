"""Rotations, angles and cameras by their properties and by differences."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pftrack.core import geometry
from pftrack.core.geometry import angles, compose, derivatives, matrix, quaternion, quaternion_matrix, rotation, vector
from pftrack.core.numerics.elementary import circular_mean, direction, less_turns, wrap
from pftrack.core.numerics.matrices import NEAREST_MM, affine_fit, affine_projection, pinhole, pinhole_jacobian

ANGLE = st.floats(-np.pi, np.pi)
TILT = st.floats(-1.5, 1.5)


def single(axis: int, angle: float) -> np.ndarray:
    return rotation(np.eye(3)[axis] * angle)


@given(ANGLE, ANGLE, ANGLE)
def test_rotations_are_proper_and_turn_about_y_x_z(x: float, y: float, z: float) -> None:
    """R R^T is the identity, the determinant is 1, and of the turns about Y, X and Z the last acts first."""
    matrix = rotation(np.array([x, y, z]))
    assert np.allclose(matrix @ matrix.T, np.eye(3), atol=1e-14)
    assert np.linalg.det(matrix) == pytest.approx(1.0)
    assert np.allclose(matrix, single(1, y) @ single(0, x) @ single(2, z), atol=1e-14)


@given(TILT, ANGLE, ANGLE)
def test_angles_and_derivatives_belong_to_the_rotation(x: float, y: float, z: float) -> None:
    """Below a quarter turn of theta_x the angles come back; dR/dtheta_k agrees with a central difference to 1e-9."""
    theta, step = np.array([x, y, z]), 1e-5
    assert np.allclose(wrap(angles(rotation(theta)) - theta), 0.0, atol=1e-9)
    for slope, change in zip(derivatives(theta), step * np.eye(3), strict=True):
        difference = (rotation(theta + change) - rotation(theta - change)) / (2 * step)
        assert np.abs(slope - difference).max() < 1e-9


# Rotations by a vector, and quaternions.

NUMBER = st.floats(-1.7, 1.7)
VECTOR = st.tuples(NUMBER, NUMBER, NUMBER).map(np.array)


@given(VECTOR)
def test_vector_quaternion_and_matrix_say_the_same(omega: np.ndarray) -> None:
    """Each is got back from the others, also of half a turn, and the matrix is a rotation about the vector."""
    assert vector(quaternion(omega)) == pytest.approx(omega, abs=1e-9)
    assert vector(-quaternion(omega)) == pytest.approx(omega, abs=1e-9)
    turn = matrix(omega)
    assert turn @ turn.T == pytest.approx(np.eye(3), abs=1e-12)
    assert turn @ omega == pytest.approx(omega, abs=1e-12)
    for each in (turn, *(matrix(np.pi * axis) for axis in np.eye(3))):
        assert quaternion_matrix(geometry.matrix_quaternion(each)) == pytest.approx(each, abs=1e-12)


@given(VECTOR, VECTOR)
def test_quaternions_compose_as_rotations_do(one: np.ndarray, other: np.ndarray) -> None:
    """The product of quaternions is that of the matrices."""
    both = quaternion_matrix(compose(quaternion(one), quaternion(other)))
    assert both == pytest.approx(matrix(one) @ matrix(other), abs=1e-12)


@pytest.mark.parametrize("size", [0.0, 1e-3, 0.54, 2.0])
def test_the_right_jacobian_is_the_small_turn_of_a_small_change(size: int) -> None:
    """R(w + dw) = R(w) R(J_r dw) but for what is of second order; neither R' nor R would do."""
    omega = size * np.array([0.6, -0.6, 0.53])
    step, jacobian = 1e-6, geometry.right_jacobian(omega)
    for axis in np.eye(3):
        found = vector(compose(quaternion(-omega), quaternion(omega + step * axis))) / step
        assert found == pytest.approx(jacobian @ axis, abs=2e-6)
    if size == 0.54:
        length = np.linalg.norm(jacobian)
        assert np.linalg.norm(matrix(omega).T - jacobian) / length == pytest.approx(0.2, abs=0.05)
        assert np.linalg.norm(matrix(omega) - jacobian) / length == pytest.approx(0.6, abs=0.1)


# Angles on the circle.


def test_whole_turns_do_not_count() -> None:
    """An angle less whole turns lies within half a turn of 0, and points the same way; half a turn is positive."""
    for angle in np.linspace(-20.0, 20.0, 401).tolist():
        within = less_turns(angle)
        assert -np.pi <= within <= np.pi
        assert np.exp([1j * within, 1j * float(wrap(angle))]) == pytest.approx(np.exp([1j * angle] * 2))
    # The next number beyond half a turn would be taken a whole turn back by rounding.
    assert wrap([np.pi, -np.pi, np.nextafter(np.pi, 4.0)]).tolist() == [np.pi] * 3


def test_means_and_directions_are_on_the_circle() -> None:
    """Half a turn is the mean of angles to either side, and weights count; a direction is right in all quadrants."""
    assert abs(circular_mean(np.array([3.0, -3.0]), np.array([0.5, 0.5]))) == pytest.approx(np.pi)
    assert circular_mean(np.array([0.0, 0.1, 7.0]), np.array([0.5, 0.5, 0.0])) == pytest.approx(0.05)
    for angle in (0.0, 0.3, 2.0, -0.4, -3.0):
        assert direction(2.0 * np.cos(angle), 2.0 * np.sin(angle)) == pytest.approx(angle)
    assert direction(-1.0, 0.0) == pytest.approx(np.pi)


POINTS = np.random.default_rng(0).normal(size=(11, 3)) * 20
AHEAD = POINTS + np.array([0.0, 0.0, 100.0])


def test_the_pinhole_divides_by_depth() -> None:
    """Twice as deep is half as far from the principal point; the Jacobian is a central difference within 1e-6 px/mm.

    At the pinhole itself and behind it nothing becomes infinite.
    """
    assert np.allclose(pinhole(AHEAD, 400.0), 400.0 * AHEAD[:, :2] / AHEAD[:, 2:])
    behind = np.array([[3.0, -2.0, 0.0], [3.0, -2.0, -50.0]])
    assert np.allclose(pinhole(behind, 400.0), 400.0 * behind[:, :2] / NEAREST_MM)
    assert np.isfinite(pinhole_jacobian(behind, 400.0)).all()
    slopes = pinhole_jacobian(AHEAD, 400.0)
    for axis, change in enumerate(1e-4 * np.eye(3)):
        difference = (pinhole(AHEAD + change, 400.0) - pinhole(AHEAD - change, 400.0)) / 2e-4
        assert np.abs(slopes[:, :, axis] - difference).max() < 1e-6


def test_the_affine_fit_is_the_best_one() -> None:
    """On pinhole pixels no small change of the fitted camera comes closer."""
    pixels = pinhole(AHEAD, 400.0)
    best = affine_fit(POINTS, pixels)
    least = ((affine_projection(best, POINTS) - pixels) ** 2).sum()
    for change in np.random.default_rng(1).normal(size=(50, 2, 4)) * 1e-2:
        assert ((affine_projection(best + change, POINTS) - pixels) ** 2).sum() > least


def test_what_does_not_determine_a_camera_is_refused() -> None:
    """Points in a plane, and mismatched shapes, are refused, with what was expected."""
    with pytest.raises(ValueError, match="do not lie in one plane"):
        affine_fit(POINTS * [1, 1, 0], pinhole(AHEAD, 400.0))
    with pytest.raises(ValueError, match=r"got \(11, 3\) and \(10, 2\)"):
        affine_fit(POINTS, np.zeros((10, 2)))
