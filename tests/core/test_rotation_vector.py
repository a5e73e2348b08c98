"""Rotations by a vector, and quaternions."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pftrack.core.geometry import (
    compose,
    cross_matrix,
    matrix,
    matrix_quaternion,
    quaternion,
    quaternion_matrix,
    right_jacobian,
    vector,
)

NUMBER = st.floats(-1.7, 1.7)
VECTOR = st.tuples(NUMBER, NUMBER, NUMBER).map(np.array)


@given(VECTOR)
def test_vector_quaternion_and_matrix_say_the_same(omega: np.ndarray) -> None:
    """Each is got back from the others, and the matrix is a rotation about the vector."""
    assert vector(quaternion(omega)) == pytest.approx(omega, abs=1e-9)
    assert vector(-quaternion(omega)) == pytest.approx(omega, abs=1e-9)
    turn = matrix(omega)
    assert turn @ turn.T == pytest.approx(np.eye(3), abs=1e-12)
    assert turn @ omega == pytest.approx(omega, abs=1e-12)
    assert quaternion_matrix(matrix_quaternion(turn)) == pytest.approx(turn, abs=1e-12)


@pytest.mark.parametrize("axis", range(3))
def test_half_turns_have_a_quaternion(axis: int) -> None:
    """Where the trace is least, another entry of the diagonal is started from."""
    turn = matrix(np.pi * np.eye(3)[axis])
    assert quaternion_matrix(matrix_quaternion(turn)) == pytest.approx(turn, abs=1e-12)


@given(VECTOR, VECTOR)
def test_quaternions_compose_as_rotations_do(one: np.ndarray, other: np.ndarray) -> None:
    """The product of quaternions is that of the matrices."""
    both = quaternion_matrix(compose(quaternion(one), quaternion(other)))
    assert both == pytest.approx(matrix(one) @ matrix(other), abs=1e-12)


@pytest.mark.parametrize("size", [0.0, 1e-6, 1e-3, 0.54, 2.0])
def test_the_right_jacobian_is_the_small_turn_of_a_small_change(size: int) -> None:
    """R(w + dw) = R(w) R(J_r dw) but for what is of second order; neither R' nor R would do."""
    omega = size * np.array([0.6, -0.6, 0.53])
    step, jacobian = 1e-6, right_jacobian(omega)
    for axis in np.eye(3):
        found = vector(compose(quaternion(-omega), quaternion(omega + step * axis))) / step
        assert found == pytest.approx(jacobian @ axis, abs=2e-6)
    if size == 0.54:
        length = np.linalg.norm(jacobian)
        assert np.linalg.norm(matrix(omega).T - jacobian) / length == pytest.approx(0.2, abs=0.05)
        assert np.linalg.norm(matrix(omega) - jacobian) / length == pytest.approx(0.6, abs=0.1)


def test_the_cross_product_is_a_matrix() -> None:
    """[x]x y is the cross product of x and y."""
    x, y = np.array([1.0, 2.0, 3.0]), np.array([-4.0, 5.0, 0.5])
    assert (cross_matrix(x) @ y).tolist() == np.cross(x, y).tolist()
