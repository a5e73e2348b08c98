"""A frame of the search: the palms and fingers that it tries, their scores, and the hands that it keeps."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from pftrack.core.geometry import convex_hull, distance_to_polygon, fill
from pftrack.experiments.hand import beams, candidates, likelihood, model
from pftrack.experiments.hand.shape import HIGH, LOW, MODEL, joints, open_pose, palm_points
from pftrack.filters.beam import Beam
from tests.experiments.hand.seen import SCALE, SIDE, sight


def task_of(**values: Any) -> model.Task:
    return model.Task(SCALE, MODEL, model.settings(model.HandTrackerParameters(**values), SCALE))


def pose_of(tilt: float) -> NDArray[np.float64]:
    pose = open_pose((100.0, 137.0))
    pose[3] = tilt
    return pose


def alone(pose: NDArray[np.float64]) -> model.Predictions:
    return model.Predictions(pose[None], np.zeros(1))


REFERENCE, POINTS = task_of(ranking="reference", scoring="reference"), task_of()
CELLS = task_of(scoring="cells")
POSE, OPEN = pose_of(0.3), pose_of(0.0)
NO_MOVES, NO_IDEALS = np.empty((0, 4, 2)), np.empty((1, 6, 0))
BELOW = np.array([120.0, 180.0]) + np.column_stack([np.arange(15.0), np.zeros(15)])
"""What looks like a finger where no finger can be."""


def around(predicted: NDArray[np.float64], seen: likelihood.PictureTables, task: model.Task = REFERENCE) -> beams.Hands:
    """Return the hands near one prediction."""
    return beams.search(alone(predicted), likelihood.ideals_of(predicted[None], seen, task), seen, task)


def test_a_hand_that_is_as_predicted_is_found_with_its_fingers() -> None:
    """The best hand is the prediction, each finger has its protrusion, and palms keep their distance."""
    hands = around(POSE, sight(POSE, length=35))
    best = int(np.argmax(hands.scores))
    assert hands.poses[best] == pytest.approx(POSE)
    assert hands.assignments[best].tolist() == [0, 1, 2, 3, 4]
    assert hands.scores[best] == pytest.approx(0.0, abs=0.05)
    apart = np.abs(hands.poses[:, None, 2:5] - hands.poses[None, :, 2:5]).max(axis=2)
    assert apart[~np.eye(len(apart), dtype=bool)].min() > 0.06
    assert len(hands.scores) <= REFERENCE.settings.palm_count


def test_a_finger_that_no_protrusion_shows_is_hidden() -> None:
    """A finger folded before the palm is found there, though the prediction bends it half as far."""
    pose, predicted = POSE.copy(), POSE.copy()
    pose[14:17], predicted[14:17] = 1.3, 0.7
    hands = around(predicted, sight(pose, fingers=(0, 1, 3, 4), length=35))
    best = int(np.argmax(hands.scores))
    assert hands.assignments[best].tolist() == [0, 1, candidates.HIDDEN, 2, 3]
    assert hands.poses[best, 14] > 0.9


def test_the_best_prediction_stays_at_a_price_if_no_palm_fits() -> None:
    """The beam never becomes empty."""
    nothing = likelihood.tables_of(np.zeros((SIDE, SIDE), bool), [])
    found = beams.follow(Beam.of(POSE), beams.predictions(POSE[None], POSE[None]), nothing, REFERENCE, 4)
    assert np.array_equal(found.beam.members, [POSE])
    assert found.log_evidence < -beams.NO_PALM_COST


def test_hands_of_a_frame_are_ranked_with_their_silhouettes() -> None:
    """The kept hands differ from each other, the best fits best, and each reports its misfit."""
    seen = sight(POSE, length=35)
    found = beams.follow(Beam.of(POSE), beams.predictions(POSE[None], POSE[None]), seen, REFERENCE, 4)
    members = np.array(found.beam.members)
    assert len(members) == 4
    assert (found.fit == beams.differences(members, seen, REFERENCE) / seen.area).all()
    assert np.argmin(found.fit) == 0
    assert found.beam.parents.tolist() == [0, 0, 0, 0]
    assert not any(beams.alike(members[i], members[j]) for i in range(4) for j in range(i))


# The score of a hand: terms over cells and over all predictions, against direct sums.


def moves_by_half_steps(pose: NDArray[np.float64], finger: int, halves: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return by how much joints and tip (5, 4, 2) of a finger move, by the difference of two poses each."""
    here, at, found = joints(pose, SCALE, MODEL)[finger, :, :2], 5 + 4 * finger, np.empty((5, 4, 2))
    for angle, places in enumerate(([2], [3], [4], [at], [at + 1, at + 2, at + 3])):
        moved = pose.copy()
        moved[places] += halves[finger, angle]
        found[angle] = joints(moved, SCALE, MODEL)[finger, :, :2] - here
    return found


@pytest.mark.parametrize("task", [POINTS, CELLS], ids=["points", "cells"])
def test_a_score_is_the_sum_of_its_terms(task: model.Task) -> None:
    """The terms are the prior of all predictions, the palm, the visible fingers and a hidden one, each over its cell.

    A hand's parent is the prediction with the largest share of its prior.
    """
    poses, pose = np.array([pose_of(0.2), pose_of(0.33), pose_of(0.6)]), pose_of(0.3)
    poses[:, 14:17], pose[14:17] = 1.1, 1.3  # the middle finger is folded
    expected = model.Predictions(poses, np.log([0.2, 0.5, 0.3]))
    seen = sight(pose, fingers=(0, 1, 3, 4), length=30)
    ideals = likelihood.ideals_of(poses, seen, task)
    hands = beams.search(expected, ideals, seen, task)
    assert len(hands.scores) > 5
    for n in np.argsort(-hands.scores)[:6]:
        one, assignment = hands.poses[n], hands.assignments[n]
        shares = model.log_shares(one, expected, task.settings)
        assert hands.predictions[n] == shares.argmax()
        assert assignment.tolist() == [0, 1, candidates.HIDDEN, 2, 3]
        wanted = np.log(np.exp(shares).sum()) - 0.5 * (one[4] / task.settings.straight_sd) ** 2
        misfit = likelihood.x_p(convex_hull(palm_points(one, SCALE, MODEL)), seen, SCALE)
        # Half steps are those of the prediction near which the hand was found, which may be any of them.
        totals = []
        for near, own in zip(poses, ideals, strict=True):
            halves = candidates.half_steps(near, task)
            total = wanted + likelihood.cell_log_fit(misfit**2, own[0], model.PALM_FIT_SD)
            for finger, places in enumerate(joints(one, SCALE, MODEL)):
                moves = moves_by_half_steps(one, finger, halves) if task is CELLS else NO_MOVES
                radii, given = MODEL.radii[finger], assignment[finger]
                total += likelihood.finger_fit(places, moves, own[1 + finger], radii, given, seen, task, -np.inf)
            totals.append(total)
        assert np.abs(np.array(totals) - hands.scores[n]).min() < 1e-6


def test_palms_of_agreeing_predictions_come_first() -> None:
    """Two neighbours of 0.3 outweigh one of 0.4 alone; with separate shares they do not."""
    nothing = likelihood.tables_of(np.ones((SIDE, SIDE), bool), [])
    poses = np.array([pose_of(0.2), pose_of(0.22), pose_of(-0.7)])
    expected = model.Predictions(poses, np.log([0.3, 0.3, 0.4]))
    for reference, chosen in ((False, pytest.approx(0.21, abs=0.06)), (True, pytest.approx(-0.7))):
        task = POINTS._replace(settings=POINTS.settings._replace(palm_count=1, reference=reference))
        assert beams.search(expected, np.empty((3, 6, 0)), nothing, task).poses[0, 3] == chosen


def test_only_palms_in_reach_of_the_fingers_are_scored() -> None:
    """A palm reaches its own fingers and no finger below it; the reference method also scores palms out of reach."""
    assert likelihood.reaches(OPEN, sight(OPEN, length=30), POINTS)
    assert not likelihood.reaches(OPEN, sight(OPEN, BELOW, length=30), POINTS)
    seen, turned = sight(OPEN, fingers=(0, 1, 3, 4), length=30), pose_of(0.0)
    turned[2] = 0.35
    for reference in (False, True):
        task = POINTS._replace(settings=POINTS.settings._replace(reference=reference))
        poses = beams.search(alone(turned), NO_IDEALS, seen, task).poses
        assert all(likelihood.reaches(hand, seen, task) for hand in poses) != reference


def test_both_ends_of_a_protrusion_are_in_reach_of_one_finger() -> None:
    """A protrusion with only its tip in reach is not a finger."""
    root, tip = joints(OPEN, SCALE, MODEL)[4, [0, 3], :2]
    for way, wanted in ((-1.0, False), (1.0, True)):
        axis = tip + way * np.linspace(0.0, 1.0, 40)[:, None] * (root - tip)
        assert likelihood.reaches(OPEN, sight(OPEN, axis, fingers=()), POINTS) is wanted


# The palms and fingers that are tried, and their distances.

LARGE, LARGE_SIDE, TURN = 312.0, 1200, 0.03


def posed(b: float) -> np.ndarray:
    """Return a pose with all fingers bent by 0.5 rad, turned about the forearm."""
    pose = open_pose((600.0, 1000.0))
    pose[3] = b
    pose[10:13] = 0.5
    return pose


@pytest.mark.parametrize("angle", [2, 3, 4])
def test_a_palms_change_of_area_is_the_measured_one(angle: int) -> None:
    """For each of the palm's three angles the predicted rate is the measured one, within 5 %.

    The result `hand-steps` measures the rates of fingers.
    """
    pose, moved = posed(0.6), posed(0.6)
    moved[angle] += TURN
    before, after = (palm_points(each, LARGE, MODEL) for each in (pose, moved))
    hulls = [convex_hull(each) for each in (before, after)]
    one, other = (fill(hull[None], np.array([len(hull)]), LARGE_SIDE, LARGE_SIDE) for hull in hulls)
    measured = np.count_nonzero(one ^ other) / TURN
    assert candidates.contour_rate(before, (after - before) / TURN) == pytest.approx(measured, rel=0.05)


def test_the_rate_of_a_flexion_is_that_of_its_moving_joints() -> None:
    """The area of the index finger changes by its joints' velocities, found here by a difference."""
    pose, moved = posed(1.0), posed(1.0)
    moved[10] += TURN
    before, after = (joints(each, LARGE, MODEL)[1] for each in (pose, moved))
    rate = candidates.chain_rate(before, (after - before) / TURN, LARGE * MODEL.radii[1, 3])
    assert candidates.flexion_rates(pose, LARGE, MODEL)[1] == pytest.approx(rate, rel=0.05)


def test_candidates_are_within_limits_and_the_most_probable_come_first() -> None:
    """The predicted fingers and the predicted palm are among them, with a prior of 0."""
    task, predicted = task_of(wrist_prior=False), np.clip(posed(0.3), LOW, HIGH)
    for finger, (angles, log_priors, size) in enumerate(
        zip(*candidates.finger_candidates(predicted, task), strict=True)
    ):
        tried, at = angles[:size], slice(5 + 4 * finger, 9 + 4 * finger)
        assert (np.diff(log_priors[:size]) <= 0.0).all()
        assert log_priors[0] == 0.0
        assert ((LOW[at] <= tried) & (tried <= HIGH[at])).all()
        assert (tried == predicted[at]).all(axis=1).any()
        assert tried[:, 1].max() > 0.95  # as far as it goes from 0.5
    poses, priors = candidates.palm_candidates(predicted, task)
    assert poses.shape == (175, 25)
    assert (poses[np.argmax(priors)] == predicted).all()
    assert priors.max() == 0.0


# Palms whose fingers reach the visible ones (Shimada 1997, section 2.6.1).


@pytest.mark.parametrize("tilt", [-0.8, 0.0, 0.8])
def test_a_region_contains_all_positions_of_its_finger(tilt: float) -> None:
    """This holds for all angles within limits, with joints that bend alike, as those of candidates do."""
    regions = [convex_hull(points) for points in likelihood.postures(pose_of(tilt), POINTS)]
    rng, pose = np.random.default_rng(0), pose_of(tilt)
    low, high = LOW[5:].reshape(5, 4), HIGH[5:].reshape(5, 4)
    for _ in range(30):
        pose[5:] = (low + np.repeat(rng.uniform(size=(5, 2)), (1, 3), axis=1) * (high - low)).ravel()
        places = joints(pose, SCALE, MODEL)[:, :, :2]
        off = [[distance_to_polygon(place, regions[f]) for place in places[f]] for f in range(5)]
        assert np.max(off) < 0.8 * likelihood.MARGIN * SCALE


def test_all_palms_are_tried_if_each_is_refused() -> None:
    """A false finger then costs score, and the hand is found."""
    hands = beams.search(alone(OPEN), NO_IDEALS, sight(OPEN, BELOW, length=30), POINTS)
    best = int(np.argmax(hands.scores))
    assert hands.poses[best, 2:5] == pytest.approx(OPEN[2:5])
    assert hands.assignments[best].tolist() == [0, 1, 2, 3, 4]
    without = beams.search(alone(OPEN), NO_IDEALS, sight(OPEN, length=30), POINTS)
    assert hands.scores[best] < without.scores.max() - 1.0


# The prior of a hand with several predictions: eq. 2.13 against a direct sum.

SETTINGS, RNG = POINTS.settings, np.random.default_rng(3)
PREDICTIONS = model.Predictions(OPEN + 0.05 * RNG.standard_normal((6, 25)), np.log(RNG.dirichlet(np.ones(6))))
SHARES = model.log_shares(OPEN, PREDICTIONS, SETTINGS)


def test_the_prior_is_the_sum_over_all_predictions() -> None:
    """Each has the probability of its parent hand; a finger's flexions count by their mean.

    For one prediction only, it is that prediction's share.
    """
    away = OPEN - PREDICTIONS.poses
    fingers = away[:, 5:].reshape(6, 5, 4)
    squares = np.square(away[:, :2] / SETTINGS.wrist_sd).sum(axis=1)
    squares += np.square(away[:, 2:5] / [model.TURN_SD, model.TILT_SD, model.TURN_SD]).sum(axis=1)
    squares += np.square(fingers[:, :, 0] / model.SPREAD_SD).sum(axis=1)
    squares += np.square(fingers[:, :, 1:].mean(axis=2) / SETTINGS.flexion_sd).sum(axis=1)
    assert pytest.approx(PREDICTIONS.log_weights - 0.5 * squares) == SHARES
    assert model.log_prior(SHARES, 2, False) == pytest.approx(np.log(np.exp(SHARES).sum()))
    assert model.log_prior(SHARES, 2, True) == SHARES[2]
