"""The trackers of a hand, on few frames of the simulated one."""

from collections.abc import Mapping
from functools import cache
from typing import Any

import numpy as np
import pytest

from pftrack.core.model.parameters import revise
from pftrack.core.model.source import Frame
from pftrack.core.numerics.random import Purpose, Stream
from pftrack.experiments.hand.model import HandState, HandTrackerParameters, Task, settings
from pftrack.experiments.hand.scene import HandTarget
from pftrack.experiments.hand.shape import HIGH, LOW, MODEL, joints, open_pose
from pftrack.experiments.hand.trackers import ANYWHERE, TRACKERS, _gains, sample
from tests.experiments.hand.seen import SCALE, sight, simulated

DEFAULTS = HandTrackerParameters()
Values = Mapping[str, object]
NONE_CHANGED: Values = {}
SEED, FIRST = 0, 3
"""Frame from which the two fingers fold: those before are still."""


@cache
def frame(index: int, **scene: object) -> Any:
    return simulated(index, SEED, **{"motion": "occlusion", **scene})


def started(
    values: Values = NONE_CHANGED, target: HandTarget | None = None, tracker: str = "beam", **scene: object
) -> HandState:
    """Return the state of frame `FIRST`, where the target is, or another one."""
    begin, parameters = frame(FIRST, **scene), revise(DEFAULTS, values)
    return TRACKERS[tracker].start(target or begin.target, begin, parameters, Stream(SEED, 0, Purpose.START))


def stepped(state: HandState, shown: Frame, values: Values = NONE_CHANGED, tracker: str = "beam") -> HandState:
    return TRACKERS[tracker].step(state, shown, revise(DEFAULTS, values), Stream(SEED, shown.index, Purpose.TRACK))


def tracked(tracker: str, last: int, values: Values = NONE_CHANGED, **scene: object) -> list[HandState]:
    """Return the states of the frames from `FIRST` to `last`."""
    states = [started(values, None, tracker, **scene)]
    for index in range(FIRST + 1, last + 1):
        states.append(stepped(states[-1], frame(index, **scene), values, tracker))
    return states


def tip_error(state: HandState, index: int) -> float:
    """Return the mean distance of the best hand's tips from the true ones, palm axes."""
    target = frame(index).target
    tips = joints(state.pose, state.scale, state.shape)[:, 3, :2]
    return float(np.hypot(*(tips - target.tips).T).mean() / target.scale)


@pytest.mark.parametrize(("tracker", "values"), [("beam", {}), ("particles", {"sample_count": 60})])
def test_two_fingers_that_fold_within_two_frames_are_followed(tracker: str, values: dict[str, object]) -> None:
    """Their tips move by half a palm, and the estimate stays within a fifth."""
    states = tracked(tracker, 6, values)
    assert tip_error(states[-1], 6) < 0.2
    folded = states[-1].pose[5:].reshape(5, 4)[2:4, 1:].mean()
    assert folded == pytest.approx(1.3, abs=0.35)


@pytest.mark.parametrize("tracker", TRACKERS)
def test_a_flash_pauses_the_tracker(tracker: str) -> None:
    """In a white frame the pose stays and the state gives the reason; the next frame is tracked again."""
    before, flash, after = tracked(tracker, 5, {"sample_count": 20}, flash_every=5)
    assert "flash" in flash.finding
    assert TRACKERS[tracker].searching(flash)
    assert (flash.pose == before.pose).all()
    assert (after.searching, after.finding) == (False, "")


def test_a_hand_that_does_not_fit_is_lost_and_found_again_when_open() -> None:
    """The tracker reports the misfit of its best hand, waits, and starts again with the open hand."""
    values = {"highest_misfit": 0.05, "lost_after_frames": 1, "ranking": "reference"}
    states = [started(values)]
    for index in (5, 7, 20):
        states.append(stepped(states[-1], frame(index), values))
    _, state, folded, found = states
    assert [TRACKERS["beam"].searching(one) for one in states[1:]] == [True, True, False]
    assert "differs from the silhouette by" in state.finding
    assert "3 fingers are seen" in folded.finding
    assert (folded.pose == state.pose).all()
    assert tip_error(found, 20) < 0.1


def test_a_hand_that_comes_nearer_is_seen_to_grow() -> None:
    """Started 4 % too small, the hand grows by a step in each frame until it fits, unless its size is fixed."""
    begin = frame(FIRST)
    true = begin.target
    small = HandTarget.of(true.pose, 0.96 * true.scale, true.shape, true.model)
    for growth, expected in ((0.02, 1.0), (0, 0.96)):
        values = {"growth_sd": growth, "beam_width": 1}
        state = stepped(stepped(started(values, small), begin, values), begin, values)
        assert state.scale == pytest.approx(expected * true.scale, rel=0.015)


# A frame of the particle filter of a hand.

TASK = Task(SCALE, MODEL, settings(HandTrackerParameters(), SCALE))
POSE = open_pose((100.0, 137.0))


def test_a_hand_that_stands_still_is_held() -> None:
    """The heaviest particle has its tips near the true ones; all are within limits, and weights sum to one.

    Parents are drawn by weight, so one without weight has no children, and each child keeps its parent's pose.
    """
    states, log_weights = np.tile(POSE, (3, 2)), np.array([-np.inf, np.log(0.5), np.log(0.5)])
    found = sample(states, log_weights, states[:, :2].copy(), 40, 0.5, sight(POSE, length=20), TASK, 0, 1)
    assert np.exp(found.log_weights).sum() == pytest.approx(1.0)
    poses = found.states[:, :25]
    assert ((poses >= LOW) & (poses <= HIGH)).all()
    best = poses[np.argmax(found.log_weights)]
    tips, true = (joints(pose, SCALE, MODEL)[:, 3, :2] for pose in (best, POSE))
    assert np.hypot(*(tips - true).T).mean() < 0.2 * SCALE
    assert set(found.ancestors.tolist()) == {1, 2}
    assert (found.states[:, 25:] == POSE).all()


def test_uniform_draws_are_weighed_by_the_prior() -> None:
    """Weighted means over draws of the mixture are those over the prior."""
    draw, count, low, high = np.random.default_rng(0), 40_000, -2.0, 3.0
    anywhere = draw.random(count) < ANYWHERE
    bends = np.where(anywhere, draw.uniform(low, high, count), draw.normal(size=count))
    inside = np.where((low < bends) & (bends < high), 1.0 / (high - low), 0.0)
    weights = np.exp(_gains(bends, inside))
    for power, (moment, within) in enumerate(((1.0, 0.02), (0.0, 0.02), (1.0, 0.03))):
        assert (weights * bends**power).mean() == pytest.approx(moment, abs=within)
