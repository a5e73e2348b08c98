"""A frame of the search: which palms and fingers are tried, by what they are scored, and which hands are kept."""

import numpy as np
import pytest
from numpy.typing import NDArray

from pftrack.core.geometry import convex_hull, distance_to_polygon, fill
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
from pftrack.experiments.hand.candidates import (
    HIDDEN,
    chain_rate,
    contour_rate,
    finger_candidates,
    flexion_rates,
    half_steps,
    palm_candidates,
)
from pftrack.experiments.hand.likelihood import (
    MARGIN,
    PictureTables,
    cell_log_fit,
    finger_fit,
    ideals_of,
    postures,
    reaches,
    tables_of,
    x_p,
)
from pftrack.experiments.hand.model import (
    PALM_FIT_SD,
    SPREAD_SD,
    TILT_SD,
    TURN_SD,
    HandTrackerParameters,
    Predictions,
    Task,
    log_prior,
    log_shares,
    palm_log_shares,
    settings,
)
from pftrack.experiments.hand.shape import (
    HIGH,
    LOW,
    MODEL,
    finger_slice,
    joints,
    open_pose,
    palm_points,
    parts,
    silhouette,
)
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


# What the search scores a hand by: terms over cells and over all predictions, against sums of their own.

POINTS = Task(SCALE, MODEL, settings(HandTrackerParameters(), SCALE))
CELLS = Task(SCALE, MODEL, settings(HandTrackerParameters(scoring="cells"), SCALE))
NO_MOVES = np.empty((0, 4, 2))


def pose_of(tilt: float) -> NDArray[np.float64]:
    pose = open_pose((100.0, 137.0))
    pose[3] = tilt
    return pose


def moves_by_half_steps(pose: NDArray[np.float64], finger: int, halves: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return by how much joints and tip (5, 4, 2) of a finger move, by the difference of two poses each."""
    here, at, found = joints(pose, SCALE, MODEL)[finger, :, :2], 5 + 4 * finger, np.empty((5, 4, 2))
    for angle, places in enumerate(([2], [3], [4], [at], [at + 1, at + 2, at + 3])):
        moved = pose.copy()
        moved[places] += halves[finger, angle]
        found[angle] = joints(moved, SCALE, MODEL)[finger, :, :2] - here
    return found


@pytest.mark.parametrize("task", [POINTS, CELLS], ids=["points", "cells"])
def test_a_score_is_the_sum_of_its_terms(task: Task) -> None:
    """Prior of all predictions, palm, fingers that are seen, and one that is hidden; each over its cell, if it has one.

    A hand goes on from the prediction that gives most of its prior.
    """
    poses, cells = np.array([pose_of(0.2), pose_of(0.33), pose_of(0.6)]), task.settings.cells
    expected = Predictions(poses, np.log([0.2, 0.5, 0.3]))
    pose = pose_of(0.3)
    pose[14:17] = 1.3  # the middle finger is folded
    poses[:, 14:17] = 1.1
    seen = sight(pose, fingers=(0, 1, 3, 4), length=30)
    ideals = ideals_of(poses, seen, task)
    hands = search(expected, ideals, seen, task)
    assert len(hands.scores) > 5
    compared = 0
    for n in np.argsort(-hands.scores)[:6]:
        one = hands.poses[n]
        shares = log_shares(one, expected, task.settings)
        assert hands.predictions[n] == shares.argmax()
        assert list(hands.assignments[n]) == [0, 1, HIDDEN, 2, 3]
        wanted = np.log(np.exp(shares).sum()) - 0.5 * (one[4] / task.settings.straight_sd) ** 2
        # Steps are those around the prediction near which it was found, of which the score knows; any of them may be.
        totals = []
        for near in range(3):
            halves, own = half_steps(poses[near], task), ideals[near]
            misfit = x_p(convex_hull(palm_points(one, SCALE, MODEL)), seen, SCALE)
            total = wanted + cell_log_fit(misfit**2, own[0], PALM_FIT_SD)
            for finger in range(5):
                moves = moves_by_half_steps(one, finger, halves) if cells else NO_MOVES
                place = joints(one, SCALE, MODEL)[finger]
                total += finger_fit(
                    place,
                    moves,
                    own[1 + finger],
                    MODEL.radii[finger],
                    hands.assignments[n, finger],
                    seen,
                    task,
                    -np.inf,
                )
            totals.append(total)
        compared += bool(np.abs(np.array(totals) - hands.scores[n]).min() < 1e-6)
    assert compared == 6


def test_palms_on_which_predictions_agree_are_looked_at_first() -> None:
    """Two of 0.3 that are near each other outweigh one of 0.4 alone; with shares of their own they do not."""
    nothing = tables_of(np.ones((SIDE, SIDE), bool), [])
    poses = np.array([pose_of(0.2), pose_of(0.22), pose_of(-0.7)])
    expected, chosen = Predictions(poses, np.log([0.3, 0.3, 0.4])), {}
    for reference in (False, True):
        task = POINTS._replace(settings=POINTS.settings._replace(palm_count=1, reference=reference))
        hands = search(expected, np.empty((3, 6, 0)), nothing, task)
        chosen[reference] = hands.poses[0, 3]
    assert chosen[False] == pytest.approx(0.21, abs=0.06)
    assert chosen[True] == pytest.approx(-0.7)


def test_all_palms_that_are_looked_at_reach_what_is_seen() -> None:
    """Of palms around a prediction some do not, and these are not among them."""
    pose = pose_of(0.0)
    seen, turned = sight(pose, fingers=(0, 1, 3, 4), length=30), pose_of(0.0)
    turned[2] = 0.35
    one = Predictions(turned[None], np.zeros(1))
    without = POINTS._replace(settings=POINTS.settings._replace(reference=True))
    reached = {}
    for task in (POINTS, without):
        poses = search(one, np.empty((1, 6, 0)), seen, task).poses
        reached[task.settings.reference] = [reaches(hand, seen, task) for hand in poses]
    assert all(reached[False])
    assert not all(reached[True])


def test_both_ends_of_a_protrusion_are_in_reach_of_one_finger() -> None:
    """One whose tip is, and whose other end is not, is no finger."""
    pose = pose_of(0.0)
    tip = joints(pose, SCALE, MODEL)[4, 3, :2]
    for way, wanted in ((-1.0, False), (1.0, True)):
        root = joints(pose, SCALE, MODEL)[4, 0, :2]
        axis = tip + way * np.linspace(0.0, 1.0, 40)[:, None] * (root - tip)
        seen = tables_of(silhouette(pose, SCALE, MODEL, (SIDE, SIDE)), [axis])
        assert reaches(pose, seen, POINTS) is wanted


# Which palms and fingers are tried, and how far apart.

CANDIDATES_SCALE, CANDIDATES_SIDE, TURN = 312.0, 1200, 0.03
INDEX = 1


def posed(b: float) -> np.ndarray:
    """Return a pose with all fingers bent by 0.5 rad, turned about the forearm."""
    pose = open_pose((600.0, 1000.0))
    pose[3] = b
    pose[10:13] = 0.5
    return pose


def index_finger(pose: np.ndarray) -> np.ndarray:
    corners, counts = parts(pose, CANDIDATES_SCALE, MODEL)
    return fill(corners[5:8], counts[5:8], CANDIDATES_SIDE, CANDIDATES_SIDE)


@pytest.mark.parametrize("b", [0.0, 1.0])
@pytest.mark.parametrize("angle", [9, 10])
def test_the_predicted_change_of_area_is_the_measured_one(b: float, angle: int) -> None:
    """D dtheta is the area by which the finger's silhouette changes, within 20 %, for spread and for flexion."""
    pose = posed(b)
    moved = pose.copy()
    moved[angle] += TURN
    measured = np.count_nonzero(index_finger(moved) ^ index_finger(pose)) / TURN
    velocities = (joints(moved, CANDIDATES_SCALE, MODEL) - joints(pose, CANDIDATES_SCALE, MODEL))[INDEX] / TURN
    rate = chain_rate(
        joints(pose, CANDIDATES_SCALE, MODEL)[INDEX], velocities, CANDIDATES_SCALE * MODEL.radii[INDEX, 3]
    )
    assert rate == pytest.approx(measured, rel=0.2)
    if angle == 10:
        assert flexion_rates(pose, CANDIDATES_SCALE, MODEL)[INDEX] == pytest.approx(rate, rel=0.05)


@pytest.mark.parametrize("angle", [2, 3, 4])
def test_a_palms_change_of_area_is_the_measured_one(angle: int) -> None:
    """The same for the palm's three angles, within 5 %."""
    pose, moved = posed(0.6), posed(0.6)
    moved[angle] += TURN
    before, after = (palm_points(each, CANDIDATES_SCALE, MODEL) for each in (pose, moved))
    masks = [
        fill(hull[None], np.array([len(hull)]), CANDIDATES_SIDE, CANDIDATES_SIDE)
        for hull in map(convex_hull, (before, after))
    ]
    measured = np.count_nonzero(masks[0] ^ masks[1]) / TURN
    assert contour_rate(before, (after - before) / TURN) == pytest.approx(measured, rel=0.05)


def test_candidates_are_within_limits_and_the_most_probable_come_first() -> None:
    """The prediction is among the fingers that are tried, with a prior of 0; so is that of the palm."""
    task = Task(52.0, MODEL, settings(HandTrackerParameters(wrist_prior=False), 52.0))
    predicted = np.clip(posed(0.3), LOW, HIGH)
    angles, log_priors, counts = finger_candidates(predicted, task)
    for finger in range(5):
        size, at = counts[finger], 5 + 4 * finger
        assert (np.diff(log_priors[finger, :size]) <= 0.0).all()
        assert log_priors[finger, 0] == 0.0
        assert (angles[finger, :size] >= LOW[at : at + 4]).all()
        assert (angles[finger, :size] <= HIGH[at : at + 4]).all()
        assert any((each == predicted[at : at + 4]).all() for each in angles[finger, :size])
        assert angles[finger, :size, 1].max() > 0.95  # as far as it goes from 0.5
    poses, priors = palm_candidates(predicted, task)
    assert poses.shape == (175, 25)
    assert (poses[np.argmax(priors)] == predicted).all()
    assert priors.max() == 0.0


# Palms whose fingers can be where fingers are seen (Shimada 1997, section 2.6.1).

TASK = Task(SCALE, MODEL, settings(HandTrackerParameters(), SCALE))
REACH_POSE = open_pose((100.0, 137.0))


@pytest.mark.parametrize("tilt", [-0.8, 0.0, 0.8])
def test_a_region_holds_a_finger_in_all_that_it_can_do(tilt: float) -> None:
    """Whatever its joints do within their limits, if they bend alike as those of candidates do."""
    palm = REACH_POSE.copy()
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
    seen = sight(REACH_POSE, length=30)
    assert reaches(REACH_POSE, seen, TASK)
    for turn in (-1.5, 1.5):
        pose = REACH_POSE.copy()
        pose[2] = turn
        assert not reaches(pose, seen, TASK)
    below = np.array([120.0, 180.0]) + np.column_stack([np.arange(15.0), np.zeros(15)])
    assert not reaches(REACH_POSE, sight(REACH_POSE, below, length=30), TASK)


def test_where_every_palm_is_refused_all_are_tried() -> None:
    """Then something that looks like a finger is none: the hand is found all the same, and pays for it."""
    below = np.array([120.0, 180.0]) + np.column_stack([np.arange(15.0), np.zeros(15)])
    one, ideals = Predictions(REACH_POSE[None], np.zeros(1)), np.empty((1, 6, 0))
    hands = search(one, ideals, sight(REACH_POSE, below, length=30), TASK)
    best = int(np.argmax(hands.scores))
    assert hands.poses[best, 2:5] == pytest.approx(REACH_POSE[2:5])
    assert hands.assignments[best].tolist() == [0, 1, 2, 3, 4]
    alone = search(one, ideals, sight(REACH_POSE, length=30), TASK)
    assert hands.scores[best] < alone.scores.max() - 1.0


# The prior of a hand of which several predictions speak: eq. 2.13 against a direct sum.

SETTINGS = settings(HandTrackerParameters(), 52.0)
RNG = np.random.default_rng(3)
PRIOR_POSE = open_pose((100.0, 137.0))
POSES = PRIOR_POSE + 0.05 * RNG.standard_normal((6, 25))
WEIGHTS = np.log(RNG.dirichlet(np.ones(6)))
PREDICTIONS = Predictions(POSES, WEIGHTS)


def densities() -> np.ndarray:
    """Return exp(-d^2 / 2) of the pose from each prediction, a finger's flexions being one number, their mean."""
    away = PRIOR_POSE - POSES
    fingers = away[:, 5:].reshape(6, 5, 4)
    squares = np.square(away[:, :2] / SETTINGS.wrist_sd).sum(axis=1)
    squares += np.square(away[:, 2:5] / [TURN_SD, TILT_SD, TURN_SD]).sum(axis=1)
    squares += np.square(fingers[:, :, 0] / SPREAD_SD).sum(axis=1)
    squares += np.square(fingers[:, :, 1:].mean(axis=2) / SETTINGS.flexion_sd).sum(axis=1)
    return np.exp(-0.5 * squares)


def test_the_prior_is_the_sum_over_all_predictions() -> None:
    """Each with the probability of the hand that it comes from."""
    shares = log_shares(PRIOR_POSE, PREDICTIONS, SETTINGS)
    assert log_prior(shares, 2, False) == pytest.approx(np.log((np.exp(WEIGHTS) * densities()).sum()))
    assert shares == pytest.approx(WEIGHTS + np.log(densities()))


def test_a_prior_of_one_prediction_is_its_share_and_less_than_the_sum() -> None:
    """By no more than how many predictions there are; where there is one, both ways are the same."""
    shares = log_shares(PRIOR_POSE, PREDICTIONS, SETTINGS)
    own, whole = log_prior(shares, int(shares.argmax()), True), log_prior(shares, 0, False)
    assert own == shares.max()
    assert own < whole <= own + np.log(6.0)
    assert log_prior(shares[:1], 0, True) == pytest.approx(log_prior(shares[:1], 0, False))


def test_the_prior_of_a_palm_has_its_three_angles_alone() -> None:
    """Neither the wrist nor fingers count."""
    moved = PRIOR_POSE.copy()
    moved[:2] += 5.0
    moved[5:] += 0.3
    palm = palm_log_shares(PRIOR_POSE, PREDICTIONS)
    assert (palm_log_shares(moved, PREDICTIONS) == palm).all()
    same = POSES.copy()
    same[:, :2], same[:, 5:] = PRIOR_POSE[:2], PRIOR_POSE[5:]
    assert palm == pytest.approx(log_shares(PRIOR_POSE, Predictions(same, WEIGHTS), SETTINGS))
