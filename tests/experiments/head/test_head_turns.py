"""Fast turns: what templates in relief are for."""

from functools import cache

import numpy as np
import pytest

from pftrack.core.model.parameters import Value, revise
from pftrack.core.numerics.random import Purpose, Stream
from pftrack.experiments.head import appearance
from pftrack.experiments.head import trackers as head
from pftrack.experiments.head.parameters import AS_PUBLISHED
from pftrack.experiments.head.recording import defaults
from pftrack.experiments.shared.pose.methods import METHODS, Method
from pftrack.reproduce.head_turns import Clip, film, watch
from pftrack.vision.likelihoods import separation
from tests.experiments.head.moving_face import POINTS, begun, frame, grey, memory, parameters, stepped, target

RELIEVED = parameters(templates="relief")


@cache
def clip(person: int, frames: int) -> Clip:
    return film(person, frames)


def test_a_fast_turn_is_followed_by_default() -> None:
    """Within half a second the head turns by 35 degrees; flat templates are left behind, those in relief are not."""
    flat, bent = (watch(clip(323, 26), values, 0) for values in (AS_PUBLISHED, {}))
    assert bent.tracked_share == 1.0
    assert bent.errors_deg[0] < 5.0
    assert bent.errors_deg[0] < flat.errors_deg[0] / 2.0


@pytest.mark.slow
@pytest.mark.parametrize("person", [321, 323, 324])
def test_no_seed_loses_a_fast_head(person: int) -> None:
    """The yaw is right to 5 degrees and the head tracked in 95 % of the frames, with the worst of twenty seeds."""
    outcomes = [watch(clip(person, 150), {}, seed) for seed in range(20)]
    assert max(outcome.errors_deg[0] for outcome in outcomes) <= 5.0
    assert min(outcome.tracked_share for outcome in outcomes) >= 0.95


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("camera", ["affine", "perspective"])
def test_a_face_that_only_moves_keeps_its_pose(method: Method, camera: str) -> None:
    """Every method and either camera may have templates in relief."""
    given = parameters(templates="relief", upper_layer=camera, slack_px=4.0, initial_speed_px=2.0)
    state = begun(method, given)
    assert memory(state).reliefs is not None
    for index in range(1, 6):
        state = stepped(state, method, given, index, grey(2 * index, index))
    assert np.rad2deg(np.abs(state.estimate)).max() < 6
    assert np.abs(state.feature_means - POINTS - (10, 5)).max() < 6
    assert memory(state).correlations.min() > 0.6


def test_relief_may_be_chosen_in_mid_run() -> None:
    """Templates are laid onto the head, or taken off it, and the pose goes on from where it was."""
    flat, bent = parameters(), parameters(templates="relief", slack_px=4.0)
    state = stepped(begun("pf-asd", flat), "pf-asd", flat, 1, grey(1, 0))
    assert memory(state).reliefs is None
    state = stepped(state, "pf-asd", bent, 2, grey(2, 0))
    assert memory(state).reliefs is not None
    small = memory(stepped(state, "pf-asd", revise(bent, {"template_scale": 0.5}), 3, grey(3, 0))).reliefs
    large = memory(state).reliefs
    assert small is not None
    assert large is not None
    assert np.abs(small.points_mm).max() < 0.6 * np.abs(large.points_mm).max()
    state = stepped(state, "pf-asd", flat, 3, grey(3, 0))
    assert memory(state).reliefs is None
    assert np.rad2deg(np.abs(state.estimate)).max() < 6


@pytest.mark.parametrize(
    "part", [(0, 0, 240, 200), (60, 50, 130, 120), (0, 150, 9, 200), (231, 0, 240, 3), (9, 9, 9, 9)]
)
def test_detail_is_the_same_in_every_part(part: separation.Part) -> None:
    """The local mean at the border of a part is taken over what lies beyond it."""
    sight = memory(begun("pf-asd", parameters())).sight
    left, top, right, bottom = part
    whole, found = appearance.detail(grey(), sight), appearance.detail(grey(), sight, part)
    assert found.shape == whole.shape
    assert np.array_equal(found[top:bottom, left:right], whole[top:bottom, left:right])


def test_where_one_looks_does_not_change_what_is_seen() -> None:
    """A look finds detail where it is asked for: here, beside it, within both, and wherever somebody asks for more."""
    sight, bent = memory(begun("pf-asd", parameters())).sight, memory(begun("pf-asd", RELIEVED)).reliefs
    assert bent is not None
    views = separation.project_views(bent, np.tile([[1.1, 0.0, 0.0], [0.0, 1.1, 0.0]], (11, 1, 1)))
    look, whole = appearance.Look(grey(), sight, views), appearance.detail(grey(), sight)
    for shift in (0.0, 30.0, 5.0, -60.0, 500.0, np.nan):
        positions = (POINTS + shift)[:, None] + np.random.default_rng(1).uniform(-9.0, 9.0, (11, 8, 2))
        assert np.array_equal(look(positions), separation.correlations(whole, positions, views))


def test_flat_templates_know_nothing_of_slack_and_speed() -> None:
    """What belongs to templates in relief changes no bit of Bando's trackers."""
    plain, other = parameters(), parameters(slack_px=30.0, initial_speed_px=20.0, pose_change_noise=9.0)
    first, second = (stepped(begun("pf-asd", given), "pf-asd", given, 1, grey(1, 1)) for given in (plain, other))
    assert np.array_equal(first.feature_means, second.feature_means)
    assert np.array_equal(first.estimate, second.estimate)


def test_a_moving_start_is_found() -> None:
    """A face that is already moving by 12 px a frame is followed from its first picture on."""
    given = parameters(
        templates="relief", upper_layer="perspective", sample_count=50, slack_px=8.0, initial_speed_px=8.0
    )
    for seed in range(5):
        state = head.start("pf-asd", target(), frame(0, grey()), given, Stream(seed, 0, Purpose.START))
        for index in range(1, 4):
            picture = frame(index, grey(-12 * index, 0))
            state = head.step("pf-asd", state, picture, given, Stream(seed, index, Purpose.TRACK))
        assert np.abs(np.median(state.feature_means - POINTS, axis=0) - (-36, 0)).max() < 2


@pytest.mark.parametrize(("rate_hz", "noise"), [(30.0, 1.0), (12.0, 6.25), (25.0, 1.44), (120.0, 0.25), (2.0, 20.0)])
def test_a_recording_says_how_fast_a_turn_may_change(rate_hz: float, noise: float) -> None:
    """The change of speed between two pictures grows with the square of the time, and not with the face."""
    for size in (0.5, 2.0):
        found = defaults(size * POINTS, rate_hz)
        assert found.pose_change_noise == pytest.approx(noise)
        values: dict[str, Value] = {"templates": "relief"}
        assert revise(found, values).slack / size == pytest.approx(defaults(POINTS, rate_hz).slack_px)
