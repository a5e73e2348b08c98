"""A frame of the search, and which of its hands are kept."""

import numpy as np
import pytest

from pftrack.experiments.hand.beams import (
    NO_PALM_COST,
    Hands,
    alike,
    differences,
    follow,
    log_score,
    predictions,
    search,
)
from pftrack.experiments.hand.candidates import HIDDEN
from pftrack.experiments.hand.likelihood import PictureTables, ideals_of, tables_of
from pftrack.experiments.hand.model import HandTrackerParameters, Predictions, Task, settings
from pftrack.experiments.hand.shape import HIGH, LOW, MODEL, open_pose
from pftrack.filters.beam import Beam
from tests.experiments.hand.seen import SCALE, SIDE, sight

REFERENCE = Task(SCALE, MODEL, settings(HandTrackerParameters(ranking="reference", scoring="reference"), SCALE))
POSE = open_pose((100.0, 137.0))
POSE[3] = 0.3


def around(predicted: np.ndarray, seen: PictureTables, task: Task = REFERENCE) -> Hands:
    """Return the hands near one prediction."""
    return search(Predictions(predicted[None], np.zeros(1)), ideals_of(predicted[None], seen, task), seen, task)


def test_a_hand_that_is_as_predicted_is_found_with_its_fingers() -> None:
    """The best hand is the prediction, each finger has its protrusion, and no palm is near another."""
    hands = around(POSE, sight(POSE, length=35))
    best = int(np.argmax(hands.scores))
    assert hands.poses[best] == pytest.approx(POSE)
    assert hands.assignments[best].tolist() == [0, 1, 2, 3, 4]
    assert hands.scores[best] == pytest.approx(0.0, abs=0.05)
    apart = np.abs(hands.poses[:, None, 2:5] - hands.poses[None, :, 2:5]).max(axis=2)
    assert apart[~np.eye(len(apart), dtype=bool)].min() > 0.06
    assert len(hands.scores) <= REFERENCE.settings.palm_count


def test_a_finger_that_no_protrusion_shows_is_hidden() -> None:
    """A finger that has folded before the palm is found there, though the prediction has it half as far."""
    pose, predicted = POSE.copy(), POSE.copy()
    pose[14:17], predicted[14:17] = 1.3, 0.7
    hands = around(predicted, sight(pose, fingers=(0, 1, 3, 4), length=35))
    best = int(np.argmax(hands.scores))
    assert hands.assignments[best].tolist() == [0, 1, HIDDEN, 2, 3]
    assert hands.poses[best, 14] > 0.9


def test_a_score_of_the_search_is_that_of_the_whole_hand_without_its_silhouette() -> None:
    """The parts' scores that are added up are those that moving uphill begins with."""
    seen = sight(POSE, length=35)
    task = REFERENCE._replace(settings=REFERENCE.settings._replace(cover_sd=np.inf, cells=False))
    hands = around(POSE, seen, task)
    for n in np.argsort(-hands.scores)[:3]:
        whole = log_score(hands.poses[n], 0, Predictions(POSE[None], np.zeros(1)), hands.assignments[n], seen, task)
        assert whole == pytest.approx(hands.scores[n], abs=0.3)


def test_where_no_palm_fits_the_best_prediction_stays_at_a_price() -> None:
    """So a beam never runs dry."""
    nothing = tables_of(np.zeros((SIDE, SIDE), bool), [])
    found = follow(Beam.of(POSE), predictions(POSE[None], POSE[None]), nothing, REFERENCE, 4)
    assert len(found.beam) == 1
    assert (found.beam.members[0] == POSE).all()
    assert found.log_evidence < -NO_PALM_COST


def test_hands_of_a_frame_are_ranked_with_their_silhouettes() -> None:
    """What is kept differs, the best differs least, and each says by how much."""
    seen = sight(POSE, length=35)
    found = follow(Beam.of(POSE), predictions(POSE[None], POSE[None]), seen, REFERENCE, 4)
    members = np.array(found.beam.members)
    assert len(members) == 4
    assert (found.fit == differences(members, seen, REFERENCE) / seen.area).all()
    assert np.argmin(found.fit) == 0
    assert found.beam.parents.tolist() == [0, 0, 0, 0]
    assert not any(alike(members[i], members[j]) for i in range(4) for j in range(i))


def test_a_prediction_goes_on_or_stays_within_limits() -> None:
    """Twice the pose less that of before, and the pose itself; no angle goes beyond its limits."""
    before, now = POSE.copy(), POSE.copy()
    before[3], now[3], before[10], now[10] = 0.1, 0.3, 0.2, 1.2
    on, still = predictions(now[None], before[None])
    assert on[3] == pytest.approx(0.5)
    assert on[10] == HIGH[10]
    assert (still == now).all()
    assert (on >= LOW).all()
