"""What the search scores a hand by: terms over cells and over all predictions, against sums of their own."""

import numpy as np
import pytest
from numpy.typing import NDArray

from pftrack.core.geometry import convex_hull
from pftrack.experiments.hand.beams import search
from pftrack.experiments.hand.candidates import HIDDEN, half_steps
from pftrack.experiments.hand.likelihood import (
    cell_log_fit,
    finger_fit,
    ideals_of,
    reaches,
    tables_of,
    x_p,
)
from pftrack.experiments.hand.model import PALM_FIT_SD, HandTrackerParameters, Predictions, Task, log_shares, settings
from pftrack.experiments.hand.shape import MODEL, joints, open_pose, palm_points, silhouette
from tests.experiments.hand.seen import SCALE, SIDE, sight

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
