"""Chains of links before an orthographic camera."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pftrack.core.geometry import matrix, quaternion
from pftrack.experiments.linkage.model import (
    UPRIGHT,
    Bounds,
    directions,
    image_in_plane,
    image_in_space,
    joint_angles,
    mirror,
    observe,
    reverse_in_depth,
    slopes,
)

THETA, R = np.array([0.4, 0.7, -0.3]), np.array([70.0, 60.0, 50.0])
ANGLE = st.floats(-3.0, 3.0)


def test_the_image_is_the_sum_of_projected_links() -> None:
    """A chain stretched along the image is as long as its links; at right angles to it nothing of it is seen."""
    assert image_in_plane(np.zeros(3), R).tolist() == [70.0, 130.0, 180.0]
    assert image_in_plane(np.array([np.pi / 2, 0.0, 0.0]), R) == pytest.approx(np.zeros(3), abs=1e-12)
    assert joint_angles(directions(THETA)) == pytest.approx(THETA)


def test_space_holds_the_plane() -> None:
    """A chain that is turned about the image's axis by a right angle is seen as one in the plane."""
    turn = matrix(np.array([np.pi / 2, 0.0, 0.0]))
    seen = image_in_space(turn, np.array([3.0, -5.0]), THETA, R)
    assert seen[0].tolist() == [3.0, -5.0]
    assert seen[1:, 0] == pytest.approx(3.0 + image_in_plane(THETA, R))
    assert seen[:, 1] == pytest.approx(-5.0)


@pytest.mark.parametrize("size", [9, 17])
def test_derivatives_are_those_of_differences(size: int) -> None:
    """What a filter linearises with agrees with central differences, in space at a rotation that is not small."""
    rng = np.random.default_rng(size)
    state = rng.normal(size=size)
    state[-3:] = R
    attitude = UPRIGHT.copy() if size == 9 else quaternion(rng.normal(size=3))
    step = 1e-5
    columns = [
        (observe(state + step * axis, attitude) - observe(state - step * axis, attitude)) / (2 * step)
        for axis in np.eye(size)
    ]
    assert slopes(state, attitude) == pytest.approx(np.array(columns).T, abs=1e-6)


@given(st.tuples(ANGLE, ANGLE, ANGLE), st.integers(0, 2))
def test_a_mirrored_link_looks_the_same(theta: tuple[float, float, float], link: int) -> None:
    """Mirrored in depth a link leans to the other side, the others keep their directions, and the image is the same."""
    before = directions(np.array(theta))
    after = mirror(before, link)
    others = [k for k in range(3) if k != link]
    assert after[others].tolist() == before[others].tolist()
    assert np.sin(after[link]) == pytest.approx(-np.sin(before[link]), abs=1e-12)
    assert abs(after[link] - before[link]) <= np.pi + 1e-9
    assert image_in_plane(joint_angles(after), R) == pytest.approx(image_in_plane(np.array(theta), R), abs=1e-9)


def test_a_chain_reversed_in_depth_looks_the_same() -> None:
    """Mirrored as a whole a flat chain is turned otherwise, and no point of its image moves."""
    turn = matrix(np.array([0.3, -0.5, 0.2]))
    other = reverse_in_depth(turn)
    assert other @ other.T == pytest.approx(np.eye(3), abs=1e-12)
    assert np.linalg.det(other) == pytest.approx(1.0)
    place = np.array([1.0, 2.0])
    assert image_in_space(other, place, THETA, R) == pytest.approx(image_in_space(turn, place, THETA, R))
    assert abs(other[2, 0] + turn[2, 0]) < 1e-12


def test_bounds_are_inequalities() -> None:
    """Each range and each difference is a row, what is not bounded is left out, and in space so is the first joint."""
    free = (-np.inf, 0.0, 0.0)
    bounds = Bounds(free, (np.inf, 1.5, 1.5), (np.inf, 0.5), (60.0, 50.0, 40.0), (80.0, 70.0, 60.0), (15.0, 15.0))
    rows, low, high = bounds.constraints(in_space=False)
    assert rows.shape == (8, 6)
    assert rows[5].tolist() == [0, 1, -1, 0, 0, 0]
    assert (low[5], high[5]) == (-0.5, 0.5)
    assert not rows[:, 0].any()
    tight = Bounds((0.0, 0.0, 0.0), (2.0, 1.5, 1.5), (0.8, 0.5), bounds.length_low, bounds.length_high, (40.0, 10.0))
    assert len(tight.constraints(in_space=False).rows) == 10
    assert len(tight.constraints(in_space=True).rows) == 8
