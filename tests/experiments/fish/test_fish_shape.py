"""The outline of a fish that bends."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pftrack.experiments.fish.model import GOLDFISH, inside, model_points, tail_line

ANGLE = st.floats(-10.0, 10.0)
PLACE = st.floats(-500.0, 500.0)


def test_a_straight_fish_lies_on_its_axis() -> None:
    """The body's points lie on the ellipse, the tail runs from its rear end straight back."""
    points = model_points(np.array([100.0, 50.0, 0.0, 0.0]), GOLDFISH)
    assert points.shape == (32, 2)
    body = (points[:24] - (100.0, 50.0)) / (40.0, 15.0)
    assert np.square(body).sum(axis=1) == pytest.approx(1.0)
    assert points[24:, 1] == pytest.approx(50.0)
    assert points[24:, 0] == pytest.approx(60.0 - 40.0 * np.arange(1, 9) / 8)


def test_a_positive_bend_swings_the_tail_to_its_own_side() -> None:
    """With the head to the right, a bend of a quarter turn lays the tail along -u(pi/2), upwards on the screen."""
    root, tip = tail_line(np.array([0.0, 0.0, 0.0, np.pi / 2]), GOLDFISH)
    assert root == pytest.approx([-40.0, 0.0])
    assert tip == pytest.approx([-40.0, -40.0])


@given(PLACE, PLACE, ANGLE, st.floats(-1.5, 1.5), PLACE, PLACE, ANGLE)
def test_points_turn_and_move_with_the_pose(
    a: float, b: float, theta: float, phi: float, right: float, down: float, turn: float
) -> None:
    """A pose that is turned and moved has the points of the pose, turned and moved."""
    cosine, sine = np.cos(turn), np.sin(turn)
    rotation = np.array([[cosine, -sine], [sine, cosine]])
    here = model_points(np.array([a, b, theta, phi]), GOLDFISH)
    moved = rotation @ (a, b) + (right, down)
    there = model_points(np.array([*moved, theta + turn, phi]), GOLDFISH)
    assert there == pytest.approx(here @ rotation.T + (right, down), abs=1e-9)


@pytest.mark.parametrize("phi", [-1.2, 0.0, 0.7])
def test_the_silhouette_holds_body_and_tail(phi: float) -> None:
    """The centre, the head, and the middle of the tail are inside; what is beside them is not."""
    pose = np.array([10.0, 20.0, 0.4, phi])
    ahead = np.array([np.cos(0.4), np.sin(0.4)])
    root, tip = tail_line(pose, GOLDFISH)
    beside = np.array([-(tip - root)[1], (tip - root)[0]]) / 40.0
    for share, expected in ((0.99, True), (1.01, False)):
        assert inside(pose[:2] + share * 40.0 * ahead, pose, GOLDFISH) is expected
    assert inside(0.5 * (root + tip), pose, GOLDFISH)
    near_tip = 0.1 * root + 0.9 * tip
    for side in (-beside, beside):
        assert inside(near_tip + 1.5 * side, pose, GOLDFISH)
        assert not inside(near_tip + 4.5 * side, pose, GOLDFISH)
