"""The trackers of a hand, on few frames of the simulated one."""

from functools import cache

import numpy as np
import pytest

from pftrack.core.model.parameters import revise
from pftrack.core.model.source import Frame, History
from pftrack.core.numerics.random import Purpose, Stream
from pftrack.experiments.hand.beams import alike
from pftrack.experiments.hand.likelihood import tables_of
from pftrack.experiments.hand.model import HandState, HandTrackerParameters, Task, settings
from pftrack.experiments.hand.scene import HandSceneParameters, HandSource, HandTarget
from pftrack.experiments.hand.shape import HIGH, LOW, MODEL, joints, open_pose, silhouette
from pftrack.experiments.hand.trackers import ANYWHERE, TRACKERS, Cloud, _gains, sample

DEFAULTS = HandTrackerParameters()
SEED, FIRST = 0, 3
"""Frame from which the two fingers fold: those before are still."""


@cache
def source(**scene: object) -> HandSource:
    return HandSource(SEED, HandSceneParameters(**{"motion": "occlusion", **scene}))


@cache
def frame(index: int, **scene: object) -> Frame:
    parameters = HandSceneParameters(**{"motion": "occlusion", **scene})
    return source(**scene).frame(index, History(((0, parameters),)))


def tracked(tracker: str, last: int, values: dict[str, object] | None = None, **scene: object) -> list[HandState]:
    """Return the states of the frames from `FIRST` to `last`."""
    parameters = revise(DEFAULTS, values or {})
    begin = frame(FIRST, **scene)
    states = [TRACKERS[tracker].start(begin.target, begin, parameters, Stream(SEED, 0, Purpose.START))]
    for index in range(FIRST + 1, last + 1):
        rng = Stream(SEED, index, Purpose.TRACK)
        states.append(TRACKERS[tracker].step(states[-1], frame(index, **scene), parameters, rng))
    return states


def tip_error(state: HandState, index: int) -> float:
    """Return the mean distance of the best hand's tips from the true ones, palm axes."""
    target = frame(index).target
    tips = joints(state.pose, state.scale, state.shape)[:, 3, :2]
    return float(np.hypot(*(tips - target.tips).T).mean() / target.scale)


@pytest.mark.parametrize(("tracker", "values"), [("beam", {}), ("particles", {"sample_count": 60})])
def test_two_fingers_that_fold_within_two_frames_are_followed(tracker: str, values: dict[str, object]) -> None:
    """While they fold their tips move by half a palm; the estimate is within a fifth."""
    states = tracked(tracker, 6, values)
    assert tip_error(states[-1], 6) < 0.2
    folded = states[-1].pose[5:].reshape(5, 4)[2:4, 1:].mean()
    assert folded == pytest.approx(1.3, abs=0.35)


def test_kept_hands_are_different_and_know_their_parents() -> None:
    """No two are alike, the best comes first, there are no more than the width, and origins are the parents' poses."""
    before, after = tracked("beam", 5)[-2:]
    members = after.beam.members
    assert 1 < len(members) <= DEFAULTS.beam_width
    assert (np.diff(after.beam.log_weights) <= 0.0).all()
    assert after.beam.weights.sum() == pytest.approx(1.0)
    assert not any(alike(one, other) for i, one in enumerate(members) for other in members[:i])
    for parent, origin in zip(after.beam.parents, after.origins, strict=True):
        assert (origin == before.beam.members[parent]).all()


def test_a_wide_beam_begins_with_the_narrow_ones_hands() -> None:
    """From the same state, what a beam of 1 keeps is the best of a beam of 4."""
    one, four = (tracked("beam", 4, {"beam_width": width})[-1] for width in (1, 4))
    assert len(one.beam) == 1
    assert (one.pose == four.pose).all()


@pytest.mark.parametrize("tracker", TRACKERS)
def test_a_flash_is_waited_for_and_said(tracker: str) -> None:
    """In a frame that is all white nothing moves and the reason is told; the next one is followed again."""
    values = {"sample_count": 20}
    before, flash, after = tracked(tracker, 5, values, flash_every=5)
    assert "flash" in flash.finding
    assert TRACKERS[tracker].searching(flash)
    assert (flash.pose == before.pose).all()
    assert not after.searching
    assert not after.finding


def test_a_hand_that_does_not_fit_is_lost_and_found_again_when_open() -> None:
    """The tracker says by how much its best hand is off, then waits, and begins anew with the open hand."""
    begin = frame(FIRST)
    values = {"highest_misfit": 0.05, "lost_after_frames": 1}
    parameters = revise(DEFAULTS, values | {"ranking": "reference"})
    state = TRACKERS["beam"].start(begin.target, begin, parameters, Stream(SEED, 0, Purpose.START))
    state = TRACKERS["beam"].step(state, frame(5), parameters, Stream(SEED, 5, Purpose.TRACK))
    assert "differs from the silhouette by" in state.finding
    assert TRACKERS["beam"].searching(state)
    folded = TRACKERS["beam"].step(state, frame(7), parameters, Stream(SEED, 7, Purpose.TRACK))
    assert TRACKERS["beam"].searching(folded)
    assert "3 fingers are seen" in folded.finding
    assert (folded.pose == state.pose).all()
    found = TRACKERS["beam"].step(folded, frame(20), parameters, Stream(SEED, 20, Purpose.TRACK))
    assert not TRACKERS["beam"].searching(found)
    assert tip_error(found, 20) < 0.1


def test_a_hand_out_of_the_picture_is_waited_for() -> None:
    """Nothing in the picture is said to be nothing; after the patience is over only an open hand is taken."""
    empty = Frame(0, 0.0, image_rgb=np.zeros((200, 200, 3), np.uint8))
    state = tracked("beam", FIRST)[-1]
    parameters = revise(DEFAULTS, {"patience_frames": 1})
    for _ in range(2):
        state = TRACKERS["beam"].step(state, empty, parameters, Stream(SEED, 1, Purpose.TRACK))
        assert "nothing" in state.finding
    state = TRACKERS["beam"].step(state, frame(7), parameters, Stream(SEED, 7, Purpose.TRACK))
    assert state.lost
    assert "fingers are seen" in state.finding


def test_a_hand_that_comes_nearer_is_seen_to_grow() -> None:
    """Begun 4 % too small, it is larger by a step in each frame until it fits; where size stays it does not."""
    begin = frame(FIRST)
    small = HandTarget.of(begin.target.pose, 0.96 * begin.target.scale, begin.target.shape, begin.target.model)
    for growth, expected in ((0.02, 1.0), (0, 0.96)):
        parameters = revise(DEFAULTS, {"growth_sd": growth, "beam_width": 1})
        state = TRACKERS["beam"].start(small, begin, parameters, Stream(SEED, 0, Purpose.START))
        for _ in range(2):
            state = TRACKERS["beam"].step(state, begin, parameters, Stream(SEED, 1, Purpose.TRACK))
        assert state.scale == pytest.approx(expected * begin.target.scale, rel=0.015)


def test_a_turn_that_one_hand_loses_is_kept_by_four() -> None:
    """A turn either way looks alike at first: one hand goes on the wrong way, and of four another one takes over."""
    turn = HandSource(151, HandSceneParameters(motion="wrist"))
    history = History(((0, HandSceneParameters(motion="wrist")),))
    frames = [turn.frame(index, history) for index in range(19)]
    wrong: dict[int, list[bool]] = {}
    for width in (1, 4):
        parameters = revise(DEFAULTS, {"beam_width": width})
        state = TRACKERS["beam"].start(turn.start, frames[0], parameters, Stream(151, 0, Purpose.START))
        wrong[width] = []
        for index, shown in enumerate(frames[1:], 1):
            state = TRACKERS["beam"].step(state, shown, parameters, Stream(151, index, Purpose.TRACK))
            wrong[width].append(bool(abs(state.pose[3] - shown.target.pose[3]) > 0.3))
    assert all(wrong[1][-6:])
    assert any(wrong[4])
    assert not any(wrong[4][-3:])


# A frame of the particle filter of a hand.

SCALE, SIDE, COUNT = 52.0, 200, 40
TASK = Task(SCALE, MODEL, settings(HandTrackerParameters(), SCALE))
POSE = open_pose((100.0, 137.0))


def cloud(seed: int = 0, count: int = COUNT) -> Cloud:
    """Return the particles of a frame in which a hand stands still."""
    axes = []
    for finger in range(5):
        tip, joint = joints(POSE, SCALE, MODEL)[finger, [3, 2], :2]
        way = (joint - tip) / np.hypot(*(joint - tip))
        axes.append(tip + np.arange(20.0)[:, None] * way)
    seen = tables_of(silhouette(POSE, SCALE, MODEL, (SIDE, SIDE)), axes)
    states = np.tile(POSE, (3, 2))
    return sample(
        states, np.array([-np.inf, np.log(0.5), np.log(0.5)]), states[:, :2].copy(), count, 0.5, seen, TASK, seed, 1
    )


def test_a_hand_that_stands_still_is_held() -> None:
    """The heaviest particle has its tips near the true ones; all are within limits, and weights sum to one."""
    found = cloud()
    assert np.exp(found.log_weights).sum() == pytest.approx(1.0)
    poses = found.states[:, :25]
    assert (poses >= LOW).all()
    assert (poses <= HIGH).all()
    best = poses[np.argmax(found.log_weights)]
    tips, true = (joints(pose, SCALE, MODEL)[:, 3, :2] for pose in (best, POSE))
    assert np.hypot(*(tips - true).T).mean() < 0.2 * SCALE


def test_parents_are_drawn_by_weight_and_their_poses_are_carried() -> None:
    """One of no weight has no children."""
    found = cloud()
    assert set(found.ancestors.tolist()) == {1, 2}
    assert (found.states[:, 25:] == POSE).all()


def test_what_is_drawn_from_anywhere_counts_as_much_as_the_prior_has_it() -> None:
    """The mean of a function over draws of the mixture, with these weights, is that over the prior."""
    draw = np.random.default_rng(0)
    count, low, high = 40_000, -2.0, 3.0
    anywhere = draw.random(count) < ANYWHERE
    bends = np.where(anywhere, draw.uniform(low, high, count), draw.normal(size=count))
    inside = np.where((low < bends) & (bends < high), 1.0 / (high - low), 0.0)
    weights = np.exp(_gains(bends, inside))
    assert weights.mean() == pytest.approx(1.0, abs=0.02)
    assert (weights * bends).mean() == pytest.approx(0.0, abs=0.02)
    assert (weights * np.square(bends)).mean() == pytest.approx(1.0, abs=0.03)
