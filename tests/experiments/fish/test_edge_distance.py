"""The outline of a fish that bends, and its distance from edges, looked up and by brute force."""

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from pftrack.core.numerics.compiled import read_only
from pftrack.experiments.fish.model import (
    CAP_PX,
    GOLDFISH,
    FishShape,
    Foreground,
    body_points,
    edges_of,
    inside,
    largest_distances,
    log_likelihoods,
    model_points,
    tail_corners,
    tail_line,
)

ORANGE, WATER = (235, 105, 40), (110, 130, 150)
COLOUR = Foreground("colour", 3, 22, 110, 110, 20, 15)
SMALL, POSE = FishShape(20.0, 8.0, 20.0), np.array([70.0, 60.0, 0.5, 0.4])


def picture(pose: NDArray[np.float64], shape: FishShape = SMALL, colour: tuple[int, int, int] = ORANGE) -> NDArray:
    image = np.full((120, 160, 3), WATER, np.uint8)
    for corners in (body_points(pose, shape, 60), tail_corners(pose, shape)):
        cv2.fillPoly(image, [np.rint(corners).astype(np.int32)], colour)
    return image


def test_look_ups_are_the_distances_by_brute_force() -> None:
    """The largest distance is that of the farthest point from the nearest edge pixel, to a quarter of a pixel."""
    seen = edges_of(picture(POSE), COLOUR)
    rows, columns = np.nonzero(seen.edges)
    assert len(rows) > 50
    many = POSE + np.random.default_rng(1).normal(size=(60, 4)) * [25.0, 25.0, 0.5, 0.5]
    found = largest_distances(seen.distances, many, SMALL) / 4.0
    for one, distance in zip(many, found, strict=True):
        at = np.floor(model_points(one, SMALL) + 0.5)
        away = np.hypot(at[:, :1] - columns, at[:, 1:] - rows).min(axis=1)
        inside = ((at >= 0) & (at < (160, 120))).all(axis=1)
        expected = np.where(inside, np.minimum(away, CAP_PX), CAP_PX).max()
        assert distance == pytest.approx(expected, abs=0.126)


def test_the_likelihood_is_of_the_largest_distance_and_limits_the_bend() -> None:
    """Eq. 7: -d^2 / sigma_d; a bend beyond a right angle is impossible unless the limit is off."""
    largest = np.array([0, 4, 40], np.uint8)
    states = np.zeros((3, 4))
    states[2, 3] = 1.6
    assert log_likelihoods(largest, states, 25.0, True).tolist() == [0.0, -1 / 25, -np.inf]
    assert log_likelihoods(largest, states, 25.0, False).tolist() == [0.0, -1 / 25, -4.0]


def test_what_is_far_outside_has_the_cap() -> None:
    """A hypothesis anywhere outside the picture, however far, is at the largest distance; without any edge all are."""
    distances, none = edges_of(picture(POSE), COLOUR).distances, edges_of(np.full((40, 50, 3), WATER, np.uint8), COLOUR)
    for wild in (1e6, -1e6, 1e300, -1e300, 1e18):
        assert largest_distances(distances, np.array([[wild, 60.0, 0.0, 0.0]]), SMALL)[0] == 4 * CAP_PX
    assert not none.edges.any()
    assert (none.distances == 4 * CAP_PX).all()
    assert none.distances.shape == (42, 52)


@pytest.mark.parametrize(("told", "colour"), [("dark", (60, 75, 90)), ("light", (190, 210, 230))])
def test_a_body_is_told_by_its_brightness(told: str, colour: tuple[int, int, int]) -> None:
    """A body without a colour of its own is told by being darker or lighter than what is around it."""
    shape, foreground = FishShape(8.0, 3.0, 8.0), Foreground(told, 0, 0, 0, 0, 20, 15)  # type: ignore[arg-type] # a value
    seen = edges_of(picture(POSE, shape, colour), foreground)
    assert (seen.mask[60, 70], seen.mask[10, 10]) == (255, 0)
    assert not edges_of(picture(POSE, shape, WATER), foreground).edges.any()


def test_a_range_of_hues_may_go_through_red() -> None:
    """With the lower bound above the upper one the range is what is outside of them."""
    red = picture(POSE, colour=(230, 40, 60))  # hue 177
    assert edges_of(red, COLOUR._replace(hue_low=170, hue_high=5)).mask[60, 70] == 255
    assert edges_of(red, COLOUR).mask[60, 70] == 0


def test_a_picture_that_stays_is_looked_at_once() -> None:
    """Edges of a read-only picture are kept while it lasts; of one that may be written they are looked for again."""
    image = picture(POSE)
    first = edges_of(image, COLOUR)
    image[:] = WATER
    assert not edges_of(image, COLOUR).edges.any()
    assert first.edges.any()
    kept, same = read_only(image), read_only(image.copy())
    assert edges_of(kept, COLOUR) is edges_of(kept, COLOUR)
    assert edges_of(kept, COLOUR._replace(value=200)) is not edges_of(kept, COLOUR)
    assert edges_of(same, COLOUR) is not edges_of(kept, COLOUR)


# The outline of a fish that bends.

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
    tail = tail_line(np.array([0.0, 0.0, 0.0, np.pi / 2]), GOLDFISH)
    assert np.array(tail) == pytest.approx(np.array([[-40.0, 0.0], [-40.0, -40.0]]))


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
    pose, ahead = np.array([10.0, 20.0, 0.4, phi]), 40.0 * np.array([np.cos(0.4), np.sin(0.4)])
    root, tip = tail_line(pose, GOLDFISH)
    beside, near_tip = np.array([-(tip - root)[1], (tip - root)[0]]) / 40.0, 0.1 * root + 0.9 * tip
    places = [(pose[:2] + 0.99 * ahead, True), (pose[:2] + 1.01 * ahead, False), (0.5 * (root + tip), True)]
    for side in (-beside, beside):
        places += [(near_tip + 1.5 * side, True), (near_tip + 4.5 * side, False)]
    assert [inside(place, pose, GOLDFISH) for place, _ in places] == [expected for _, expected in places]
