"""Palms whose fingers can be where fingers are seen (Shimada 1997, section 2.6.1)."""

import numpy as np
import pytest

from pftrack.core.geometry import convex_hull, distance_to_polygon
from pftrack.experiments.hand.beams import search
from pftrack.experiments.hand.likelihood import MARGIN, postures, reaches
from pftrack.experiments.hand.model import HandTrackerParameters, Predictions, Task, settings
from pftrack.experiments.hand.shape import HIGH, LOW, MODEL, finger_slice, joints, open_pose
from tests.experiments.hand.seen import SCALE, sight

TASK = Task(SCALE, MODEL, settings(HandTrackerParameters(), SCALE))
POSE = open_pose((100.0, 137.0))


@pytest.mark.parametrize("tilt", [-0.8, 0.0, 0.8])
def test_a_region_holds_a_finger_in_all_that_it_can_do(tilt: float) -> None:
    """Whatever its joints do within their limits, if they bend alike as those of candidates do."""
    palm = POSE.copy()
    palm[3] = tilt
    regions = [convex_hull(points) for points in postures(palm, TASK)]
    rng = np.random.default_rng(0)
    for _ in range(100):
        pose = palm.copy()
        for finger in range(5):
            at = finger_slice(finger)
            pose[at] = LOW[at] + np.repeat(rng.uniform(size=2), (1, 3)) * (HIGH[at] - LOW[at])
        places = joints(pose, SCALE, MODEL)[:, :, :2]
        off = [[distance_to_polygon(place, regions[f]) for place in places[f]] for f in range(5)]
        assert np.max(off) < 0.8 * MARGIN * SCALE


def test_a_palm_is_refused_from_which_no_finger_reaches_what_is_seen() -> None:
    """The own palm reaches all its fingers; one that is turned by a right angle does not."""
    seen = sight(POSE, length=30)
    assert reaches(POSE, seen, TASK)
    for turn in (-1.5, 1.5):
        pose = POSE.copy()
        pose[2] = turn
        assert not reaches(pose, seen, TASK)
    below = np.array([120.0, 180.0]) + np.column_stack([np.arange(15.0), np.zeros(15)])
    assert not reaches(POSE, sight(POSE, below, length=30), TASK)


def test_where_every_palm_is_refused_all_are_tried() -> None:
    """Then something that looks like a finger is none: the hand is found all the same, and pays for it."""
    below = np.array([120.0, 180.0]) + np.column_stack([np.arange(15.0), np.zeros(15)])
    one, ideals = Predictions(POSE[None], np.zeros(1)), np.empty((1, 6, 0))
    hands = search(one, ideals, sight(POSE, below, length=30), TASK)
    best = int(np.argmax(hands.scores))
    assert hands.poses[best, 2:5] == pytest.approx(POSE[2:5])
    assert hands.assignments[best].tolist() == [0, 1, 2, 3, 4]
    alone = search(one, ideals, sight(POSE, length=30), TASK)
    assert hands.scores[best] < alone.scores.max() - 1.0
