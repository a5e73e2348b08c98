"""Rotations by their properties: orthonormal, invertible, with the derivatives that differences say."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pftrack.core.geometry import angles, derivatives, rotation
from pftrack.core.numerics.elementary import wrap

ANGLE = st.floats(-np.pi, np.pi)
TILT = st.floats(-1.5, 1.5)


def single(axis: int, angle: float) -> np.ndarray:
    return rotation(np.eye(3)[axis] * angle)


@given(ANGLE, ANGLE, ANGLE)
def test_rotations_are_orthonormal_and_proper(x: float, y: float, z: float) -> None:
    """R R^T is the identity and the determinant is 1."""
    matrix = rotation(np.array([x, y, z]))
    assert np.allclose(matrix @ matrix.T, np.eye(3), atol=1e-14)
    assert np.linalg.det(matrix) == pytest.approx(1.0)


@given(ANGLE, ANGLE, ANGLE)
def test_the_order_is_y_x_z(x: float, y: float, z: float) -> None:
    """R is the product of the turns about Y, X and Z, of which Z acts first."""
    assert np.allclose(rotation(np.array([x, y, z])), single(1, y) @ single(0, x) @ single(2, z), atol=1e-14)


@given(TILT, ANGLE, ANGLE)
def test_angles_undo_the_rotation(x: float, y: float, z: float) -> None:
    """While theta_x is within a quarter turn, the angles come back from the matrix."""
    theta = np.array([x, y, z])
    assert np.allclose(wrap(angles(rotation(theta)) - theta), 0.0, atol=1e-9)


@pytest.mark.parametrize("tilt", [-np.pi / 2, np.pi / 2])
def test_the_singular_tilt_still_gives_a_rotation(tilt: float) -> None:
    """At theta_x = +-90 degrees the angles returned are finite."""
    assert np.isfinite(angles(rotation(np.array([tilt, 0.4, -0.2])))).all()


@given(TILT, ANGLE, ANGLE)
def test_derivatives_are_those_of_central_differences(x: float, y: float, z: float) -> None:
    """Each dR/dtheta_k agrees with a central difference within 1e-9."""
    theta, step = np.array([x, y, z]), 1e-5
    for axis, slope in enumerate(derivatives(theta)):
        change = step * np.eye(3)[axis]
        difference = (rotation(theta + change) - rotation(theta - change)) / (2 * step)
        assert np.abs(slope - difference).max() < 1e-9


def test_signs_are_those_of_a_head() -> None:
    """Positive angles nod down, turn the nose to the left of the picture, and roll clockwise in the picture."""
    nose, crown, small = np.array([0.0, 0.0, -1.0]), np.array([0.0, -1.0, 0.0]), 0.1
    assert (single(0, small) @ nose)[1] > 0
    assert (single(1, small) @ nose)[0] < 0
    assert (single(2, small) @ crown)[0] > 0
