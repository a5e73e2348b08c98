"""A frame of the particle filter of a hand."""

import numpy as np
import pytest

from pftrack.experiments.hand.likelihood import tables_of
from pftrack.experiments.hand.model import HandTrackerParameters, Task, settings
from pftrack.experiments.hand.shape import HIGH, LOW, MODEL, joints, open_pose, silhouette
from pftrack.experiments.hand.trackers import ANYWHERE, Cloud, _gains, sample

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
