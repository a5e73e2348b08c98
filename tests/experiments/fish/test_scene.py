"""The simulated tank of goldfish, and the outline of a fish that bends, with its distance from edges."""

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from pftrack.core.model.parameters import revise
from pftrack.core.model.source import Frame, History
from pftrack.core.refusal import ParameterError
from pftrack.experiments.fish import model
from pftrack.experiments.fish.model import GOLDFISH, FishShape, Foreground, edges_of, model_points, tail_line
from pftrack.experiments.fish.scene import FishSceneParameters, FishSource
from pftrack.experiments.fish.swimming import FRAMES, clip, has_sharp_turn

DEFAULTS = FishSceneParameters()


def frame(values: dict[str, object], index: int = 0) -> Frame:
    parameters = revise(DEFAULTS, values)
    return FishSource(0, parameters).frame(index, History(((0, parameters),)))


@pytest.mark.parametrize(("number", "count", "lively"), [(200, 2, True), (209, 2, False), (3, 1, True), (3, 1, False)])
def test_a_clip_is_fit_for_the_experiment(number: int, count: int, lively: bool) -> None:
    """Fish stay off the border and apart, and just the lively one turns sharply."""
    poses = clip(number, count, lively, "goldfish")
    assert poses.shape == (FRAMES, count, 4)
    places = poses[..., :2]
    assert ((places >= 50) & (places < (590, 430))).all()
    assert (np.abs(poses[..., 3]) <= 1.35).all()
    assert np.hypot(*(places[:, 0] - places[:, -1]).T).min() > 110 or count == 1
    assert [has_sharp_turn(places[:, fish]) for fish in range(count)] == [lively, False][:count]


def test_a_bend_turns_the_fish_the_other_way() -> None:
    """Over ten clips the spreads and correlations are those of the reference's training set.

    With a strong rudder the return stroke turns the same way as the bend, and the coupling is weaker.
    """
    steps, changes = [], []
    for number in range(100, 110):
        for a, b, theta, phi in clip(number, 2, number < 108, "goldfish").transpose(1, 2, 0):
            velocity, turns = np.diff(np.stack([a, b])), np.diff(np.stack([theta, phi]))
            steps.append(np.vstack([velocity, turns]))
            cosine, sine, (right, down) = np.cos(theta[2:]), np.sin(theta[2:]), np.diff(velocity)
            changes.append(np.vstack([cosine * right + sine * down, cosine * down - sine * right, turns[:, 1:]]))
    assert np.hstack(steps).std(axis=1) == pytest.approx([5.8, 5.7, 0.152, 0.151], rel=0.08)
    assert np.hstack(changes).std(axis=1) == pytest.approx([1.05, 1.21, 0.153, 0.151], rel=0.08)
    correlations = np.corrcoef(np.hstack(changes))
    assert correlations[2, 3] == pytest.approx(-0.87, abs=0.04)
    assert correlations[1, 2] == pytest.approx(0.74, abs=0.06)
    assert correlations[1, 3] == pytest.approx(-0.48, abs=0.08)
    yaw, bend = np.diff(clip(200, 2, True, "strong rudder")[:, 0, 2:], axis=0).T
    assert np.corrcoef(yaw, bend)[0, 1] > -0.8


def test_a_sharp_turn_needs_speed_and_angle() -> None:
    """A right angle at 4 px a frame is one; at 2 px it is none, nor is a wide arc."""
    corner = np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [2.0, 1.0], [2.0, 2.0]])
    assert has_sharp_turn(4.0 * corner)
    assert not has_sharp_turn(2.0 * corner)
    arc = np.linspace(0.0, np.pi / 2, 30)
    assert not has_sharp_turn(100.0 * np.stack([np.sin(arc), 1.0 - np.cos(arc)], axis=1))


def test_the_picture_shows_the_fish_where_it_is() -> None:
    """What is orange has its middle within the silhouette of the truth, and covers as much as the fish does."""
    seen = frame({"fish_count": 1, "image_noise": 0}, 40)
    image = seen.image_rgb.astype(int)
    rows, columns = np.nonzero(image[..., 0] > image[..., 2] + 60)
    target = seen.target
    assert target.holds(np.array([columns.mean(), rows.mean()]))
    assert np.pi * 40 * 15 * 0.9 < len(rows) < np.pi * 40 * 15 * 1.35


def test_noise_is_uniform_and_of_the_clip() -> None:
    """Two clips differ; noise of a picture that is not clipped has the deviation of 19 levels."""
    assert not np.array_equal(frame({}, 3).image_rgb, frame({"tank_number": 201}, 3).image_rgb)
    clean, noisy = (frame(values).image_rgb.astype(int) for values in ({"image_noise": 0}, {}))
    inner = (noisy - clean)[(clean > 20) & (clean < 235)]
    assert (np.abs(inner) <= 9).all()
    assert inner.mean() == pytest.approx(0.0, abs=0.05)
    assert inner.std() == pytest.approx(np.sqrt(19**2 / 12), rel=0.02)


def test_the_occluder_hides_the_fish() -> None:
    """A strip over all of the picture hides it, and the truth says so; one over a part of the fish does not."""
    assert frame({"occlusion_width_px": 640}).target.hidden
    assert not frame({}).target.hidden
    assert not any(frame({"occlusion_width_px": 10}, index).target.hidden for index in range(0, FRAMES, 3))


def test_the_followed_fish_must_be_there() -> None:
    """The second fish of one is refused, with both numbers."""
    with pytest.raises(ParameterError, match="followed_fish must be at most 1, got 2"):
        frame({"fish_count": 1, "followed_fish": 2})


@pytest.mark.parametrize("followed", [1, 2])
def test_the_truth_is_of_the_followed_fish(followed: int) -> None:
    """Pose and velocity of the truth are those of the fish that is followed, and so is the start."""
    values = {"fish_count": 2, "followed_fish": followed}
    parameters = revise(DEFAULTS, values)
    poses = clip(parameters.tank_number, 2, parameters.lively, parameters.tank)[:, followed - 1]
    for target, at, last in ((frame(values, 7).target, 7, 7), (FishSource(0, parameters).start, 0, 1)):
        assert np.array_equal(target.pose, poses[at])
        assert np.array_equal(target.velocity, poses[last, :2] - poses[last - 1, :2])


ORANGE, WATER = (235, 105, 40), (110, 130, 150)
COLOUR = Foreground("colour", 3, 22, 110, 110, 20, 15)
SMALL, POSE = FishShape(20.0, 8.0, 20.0), np.array([70.0, 60.0, 0.5, 0.4])


def picture(pose: NDArray[np.float64], shape: FishShape = SMALL, colour: tuple[int, int, int] = ORANGE) -> NDArray:
    image = np.full((120, 160, 3), WATER, np.uint8)
    for corners in (model.body_points(pose, shape, 60), model.tail_corners(pose, shape)):
        cv2.fillPoly(image, [np.rint(corners).astype(np.int32)], colour)
    return image


def test_look_ups_are_the_distances_by_brute_force() -> None:
    """The largest distance is that of the farthest point from the nearest edge pixel, to a quarter of a pixel."""
    seen = edges_of(picture(POSE), COLOUR)
    rows, columns = np.nonzero(seen.edges)
    assert len(rows) > 50
    many = POSE + np.random.default_rng(1).normal(size=(60, 4)) * [25.0, 25.0, 0.5, 0.5]
    found = model.largest_distances(seen.distances, many, SMALL) / 4.0
    for one, distance in zip(many, found, strict=True):
        at = np.floor(model_points(one, SMALL) + 0.5)
        away = np.hypot(at[:, :1] - columns, at[:, 1:] - rows).min(axis=1)
        inside = ((at >= 0) & (at < (160, 120))).all(axis=1)
        expected = np.where(inside, np.minimum(away, model.CAP_PX), model.CAP_PX).max()
        assert distance == pytest.approx(expected, abs=0.126)


def test_the_likelihood_is_of_the_largest_distance_and_limits_the_bend() -> None:
    """Eq. 7: -d^2 / sigma_d; a bend beyond a right angle is impossible unless the limit is off."""
    largest = np.array([0, 4, 40], np.uint8)
    states = np.zeros((3, 4))
    states[2, 3] = 1.6
    assert model.log_likelihoods(largest, states, 25.0, True).tolist() == [0.0, -1 / 25, -np.inf]
    assert model.log_likelihoods(largest, states, 25.0, False).tolist() == [0.0, -1 / 25, -4.0]


def test_what_is_far_outside_has_the_cap() -> None:
    """A hypothesis anywhere outside the picture, however far, is at the largest distance; without any edge all are."""
    distances, none = edges_of(picture(POSE), COLOUR).distances, edges_of(np.full((40, 50, 3), WATER, np.uint8), COLOUR)
    for wild in (1e6, -1e6, 1e300, -1e300, 1e18):
        assert model.largest_distances(distances, np.array([[wild, 60.0, 0.0, 0.0]]), SMALL)[0] == 4 * model.CAP_PX
    assert not none.edges.any()
    assert (none.distances == 4 * model.CAP_PX).all()
    assert none.distances.shape == (42, 52)


@pytest.mark.parametrize(("told", "colour"), [("dark", (60, 75, 90)), ("light", (190, 210, 230))])
def test_a_body_is_told_by_its_brightness(told: str, colour: tuple[int, int, int]) -> None:
    """A body without a colour of its own is found by its brightness against the surroundings."""
    shape, foreground = FishShape(8.0, 3.0, 8.0), Foreground(told, 0, 0, 0, 0, 20, 15)  # type: ignore[arg-type] # a value
    seen = edges_of(picture(POSE, shape, colour), foreground)
    assert (seen.mask[60, 70], seen.mask[10, 10]) == (255, 0)
    assert not edges_of(picture(POSE, shape, WATER), foreground).edges.any()


def test_a_range_of_hues_may_go_through_red() -> None:
    """With the lower bound above the upper one the range is what is outside of them."""
    red = picture(POSE, colour=(230, 40, 60))  # hue 177
    assert edges_of(red, COLOUR._replace(hue_low=170, hue_high=5)).mask[60, 70] == 255
    assert edges_of(red, COLOUR).mask[60, 70] == 0


# The outline of a fish that bends.

ANGLE = st.floats(-10.0, 10.0)
PLACE = st.floats(-500.0, 500.0)


def test_a_straight_fish_lies_on_its_axis() -> None:
    """The body's points lie on the ellipse, the tail runs from its rear end straight back.

    With the head to the right, a bend of a quarter turn lays the tail along -u(pi/2), upwards on the screen.
    """
    points = model_points(np.array([100.0, 50.0, 0.0, 0.0]), GOLDFISH)
    assert points.shape == (32, 2)
    body = (points[:24] - (100.0, 50.0)) / (40.0, 15.0)
    assert np.square(body).sum(axis=1) == pytest.approx(1.0)
    assert points[24:, 1] == pytest.approx(50.0)
    assert points[24:, 0] == pytest.approx(60.0 - 40.0 * np.arange(1, 9) / 8)
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
    assert [model.inside(place, pose, GOLDFISH) for place, _ in places] == [expected for _, expected in places]
