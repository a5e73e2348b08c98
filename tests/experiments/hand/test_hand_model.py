"""A hand of sixteen parts and its silhouette."""

import numpy as np
import pytest

from pftrack.core.arrays import Floats
from pftrack.experiments.hand.shape import HIGH, LOW, MODEL, arm_corners, joints, open_pose, palm_points, silhouette

SCALE = 52.0
WRIST = np.array([100.0, 137.0])


def turns(pose: Floats) -> Floats:
    """R = Rz(a) Ry(b) Rx(c), for y up."""
    a, b, c = pose[2:5]
    about_z = np.array([[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1]])
    about_y = np.array([[np.cos(b), 0, np.sin(b)], [0, 1, 0], [-np.sin(b), 0, np.cos(b)]])
    about_x = np.array([[1, 0, 0], [0, np.cos(c), -np.sin(c)], [0, np.sin(c), np.cos(c)]])
    return np.asarray(about_z @ about_y @ about_x)


def seen(pose: Floats, points: Floats) -> Floats:
    """Return where points of the hand's frame, in palm axes, are in the picture."""
    return SCALE * points @ turns(pose).T * [1, -1, 1] + [*pose[:2], 0]


def by_hand(pose: Floats) -> Floats:
    """Evaluate the equations of docs/methods/hands.md one by one."""
    places = np.empty((5, 4, 3))
    for finger in range(5):
        spread, *flexions = pose[5 + 4 * finger : 9 + 4 * finger]
        direction = MODEL.rest[finger] + spread
        places[finger, 0] = MODEL.roots[finger]
        for j in (1, 2, 3):
            bend = sum(flexions[:j])
            turned, tilt = (direction, bend) if finger else (direction + 0.7 * bend, 0.5 * bend)
            way = np.array([-np.sin(turned) * np.cos(tilt), np.cos(turned) * np.cos(tilt), np.sin(tilt)])
            places[finger, j] = places[finger, j - 1] + MODEL.phalanges[finger, j - 1] * way
    return seen(pose, places.reshape(-1, 3)).reshape(5, 4, 3)


@pytest.mark.parametrize("number", range(3))
def test_joints_palm_and_arm_are_those_of_the_equations(number: int) -> None:
    """The compiled functions agree with the equations; the plate has two sides; only the angle a turns the arm."""
    pose = np.random.default_rng(number).uniform(np.maximum(LOW, -np.pi), np.minimum(HIGH, np.pi))
    pose[:2] = WRIST
    assert joints(pose, SCALE, MODEL) == pytest.approx(by_hand(pose), abs=1e-9)
    plate = [[x, y, z] for z in (MODEL.thickness, -MODEL.thickness) for x, y in MODEL.outline]
    assert palm_points(pose, SCALE, MODEL) == pytest.approx(seen(pose, np.array(plate))[:, :2], abs=1e-9)
    flat = pose * np.array([1, 1, 1, 0, 0] + 20 * [1])
    width, length = MODEL.arm
    board = np.array([[-width, 0, 0], [width, 0, 0], [width, -length, 0], [-width, -length, 0]])
    assert arm_corners(pose, SCALE, MODEL) == pytest.approx(seen(flat, board)[:, :2], abs=1e-9)


def test_the_silhouette_is_the_union_of_the_parts() -> None:
    """It contains the axis of each phalanx, the wrist and the arm, and nothing beside the hand."""
    pose = open_pose(WRIST)
    picture = silhouette(pose, SCALE, MODEL, (200, 200))
    assert picture.shape == (200, 200)
    places = np.rint(joints(pose, SCALE, MODEL)[..., :2]).astype(int)
    assert picture[places[..., 1], places[..., 0]].all()
    assert picture[[137, 199], 100].all()
    assert not picture[[100, 100, 20], [40, 185, 140]].any()
    for outside in ((-900.0, 100.0), (100.0, 5000.0), (900.0, -900.0)):
        assert not silhouette(open_pose(outside), SCALE, MODEL, (200, 150)).any()
