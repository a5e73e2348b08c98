"""A hand of sixteen parts and its silhouette."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from pftrack.experiments.hand.shape import (
    HIGH,
    LOW,
    MODEL,
    HandShape,
    arm_corners,
    capsule,
    joints,
    open_pose,
    palm_points,
    silhouette,
)

Numbers = NDArray[np.float64]
SCALE = 52.0
WRIST = np.array([100.0, 137.0])


def any_pose(number: int) -> Numbers:
    generator = np.random.default_rng(number)
    low, high = np.maximum(LOW, -np.pi), np.minimum(HIGH, np.pi)
    pose: Numbers = generator.uniform(low, high)
    pose[:2] = WRIST
    return pose


def turns(pose: Numbers) -> Numbers:
    """R = Rz(a) Ry(b) Rx(c), for y up."""
    a, b, c = pose[2:5]
    about_z = np.array([[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1]])
    about_y = np.array([[np.cos(b), 0, np.sin(b)], [0, 1, 0], [-np.sin(b), 0, np.cos(b)]])
    about_x = np.array([[1, 0, 0], [0, np.cos(c), -np.sin(c)], [0, np.sin(c), np.cos(c)]])
    return np.asarray(about_z @ about_y @ about_x)


def seen(pose: Numbers, points: Numbers) -> Numbers:
    """Points of the hand's frame, palm axes, in the picture."""
    return SCALE * points @ turns(pose).T * [1, -1, 1] + [*pose[:2], 0]


def by_hand(pose: Numbers, shape: HandShape) -> Numbers:
    """The equations of docs/methods/hands.md, one by one."""
    places = np.empty((5, 4, 3))
    for finger in range(5):
        spread, *flexions = pose[5 + 4 * finger : 9 + 4 * finger]
        direction = shape.rest[finger] + spread
        places[finger, 0] = shape.roots[finger]
        for j in (1, 2, 3):
            bend = sum(flexions[:j])
            turned, tilt = (direction, bend) if finger else (direction + 0.7 * bend, 0.5 * bend)
            way = np.array([-np.sin(turned) * np.cos(tilt), np.cos(turned) * np.cos(tilt), np.sin(tilt)])
            places[finger, j] = places[finger, j - 1] + shape.phalanges[finger, j - 1] * way
    return seen(pose, places.reshape(-1, 3)).reshape(5, 4, 3)


def area(corners: Numbers) -> float:
    x, y = corners.T
    return abs(float(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1)))) / 2


@pytest.mark.parametrize("number", range(6))
def test_joints_palm_and_arm_are_those_of_the_equations(number: int) -> None:
    """Compiled and written out, they are the same; the plate has two sides; the arm turns with a alone."""
    pose = any_pose(number)
    assert joints(pose, SCALE, MODEL) == pytest.approx(by_hand(pose, MODEL), abs=1e-9)
    plate = [[x, y, z] for z in (MODEL.thickness, -MODEL.thickness) for x, y in MODEL.outline]
    assert palm_points(pose, SCALE, MODEL) == pytest.approx(seen(pose, np.array(plate))[:, :2], abs=1e-9)
    flat = pose * np.array([1, 1, 1, 0, 0] + 20 * [1])
    width, length = MODEL.arm
    board = np.array([[-width, 0, 0], [width, 0, 0], [width, -length, 0], [-width, -length, 0]])
    assert arm_corners(pose, SCALE, MODEL) == pytest.approx(seen(flat, board)[:, :2], abs=1e-9)


@pytest.mark.parametrize("number", range(3))
def test_the_other_side_is_the_mirror_image(number: int) -> None:
    """A shape with side -1 and the turns a and b the other way round is the mirror image of the hand."""
    pose = any_pose(number)
    mirrored = joints(pose * np.array([1, 1, -1, -1] + 21 * [1]), SCALE, MODEL.with_changes(side=-1.0))
    expected = joints(pose, SCALE, MODEL) * [-1, 1, 1] + [2 * WRIST[0], 0, 0]
    assert mirrored == pytest.approx(expected, abs=1e-9)


@settings(max_examples=60)
@given(st.floats(-30, 30), st.floats(-30, 30), st.floats(0.5, 12), st.floats(0.5, 12))
def test_a_capsule_is_convex_and_has_nearly_the_area_of_two_discs_hull(
    x: float, y: float, first: float, second: float
) -> None:
    """All corners lie on the discs, none turns inwards, and 97 % of the exact area is within."""
    corners = capsule(np.zeros(2), first, np.array([x, y]), second)
    assert 16 <= len(corners) <= 24
    edges = np.roll(corners, -1, axis=0) - corners
    following = np.roll(edges, -1, axis=0)
    assert (edges[:, 0] * following[:, 1] - edges[:, 1] * following[:, 0] >= -1e-7).all()
    on_first = np.abs(np.hypot(*corners.T) - first)
    assert np.minimum(on_first, np.abs(np.hypot(*(corners - [x, y]).T) - second)) == pytest.approx(0, abs=1e-9)
    apart, more = np.hypot(x, y), abs(first - second)
    exact = np.pi * max(first, second) ** 2
    if apart > more:
        half = np.arccos((first - second) / apart)
        sides = (first + second) * np.sqrt(apart**2 - more**2)
        exact = sides + first**2 * (np.pi - half) + second**2 * half
    assert 0.96 * exact <= area(corners) <= exact + 1e-9


def test_the_silhouette_is_the_union_of_the_parts() -> None:
    """Points on the axis of each phalanx, the wrist and the arm are within; what is beside the hand is not."""
    pose = open_pose(WRIST)
    picture = silhouette(pose, SCALE, MODEL, (200, 200))
    assert picture.shape == (200, 200)
    places = np.rint(joints(pose, SCALE, MODEL)[..., :2]).astype(int)
    assert picture[places[..., 1], places[..., 0]].all()
    assert picture[[137, 199], 100].all()
    assert not picture[[100, 100, 20], [40, 185, 140]].any()
    for outside in ((-900.0, 100.0), (100.0, 5000.0), (900.0, -900.0)):
        assert not silhouette(open_pose(outside), SCALE, MODEL, (200, 150)).any()
