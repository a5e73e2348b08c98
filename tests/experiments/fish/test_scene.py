"""The simulated tank of goldfish."""

import numpy as np
import pytest

from pftrack.core.model.parameters import revise
from pftrack.core.model.source import Frame, History
from pftrack.core.refusal import ParameterError
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
    """Over ten clips the spreads and correlations are those of the reference's training set."""
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


def test_a_strong_rudder_uncouples_bend_and_turn() -> None:
    """In the counterexample the return stroke turns the same way as the bend, and the coupling is weaker."""
    poses = clip(200, 2, True, "strong rudder")
    yaw, bend = np.diff(poses[:, 0, 2]), np.diff(poses[:, 0, 3])
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


def test_noise_is_of_the_clip_and_not_of_the_run() -> None:
    """Frames do not depend on the run's seed; two clips differ, and so do two frames of one clip."""
    one, other = (FishSource(seed, DEFAULTS).frame(3, History(((0, DEFAULTS),))).image_rgb for seed in (0, 9))
    assert np.array_equal(one, other)
    assert not np.array_equal(one, frame({"tank_number": 201}, 3).image_rgb)
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
