"""A frame of the beam: predictions of every hand that is kept, the hands near them, and which of those are kept.

Each kept hand predicts two: that its motion goes on, and that it stands still, since angles which go by coarse steps
make velocities that are mostly noise. A hand's prior is that of its own prediction.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pftrack.experiments.hand.shape import HIGH, LOW, joints
from pftrack.experiments.hand.trackers.assignment import HIDDEN
from pftrack.experiments.hand.trackers.ideals import ideals_of
from pftrack.experiments.hand.trackers.likelihood import PictureTables
from pftrack.experiments.hand.trackers.prior import Predictions
from pftrack.experiments.hand.trackers.ranking import differences, improve
from pftrack.experiments.hand.trackers.search import Hands, search
from pftrack.experiments.hand.trackers.settings import Task
from pftrack.filters.beam import Beam, select_best
from pftrack.filters.particles import normalise

__all__ = ["COMPARED", "Found", "alike", "follow", "predictions"]

COMPARED = 12
"""So many of the best hands are compared with the silhouette as wholes."""

ALIKE_PALM_RAD, ALIKE_FINGERS_RAD = 0.08, 0.3
"""Two hands that differ by no more are one."""

LEAST_GAIN = 0.5
"""In log score, by which another size must be better."""

NO_PALM_COST = 10.0
"""Of keeping a prediction in whose neighbourhood no palm fits."""


class Found(NamedTuple):
    """What a frame comes to.

    Attributes:
        beam: The hands that are kept, the best first.
        origins: (K, 25) their parents' poses.
        fit: (K,) share of the silhouette's area by which each differs from it.
        tried: How many palms were looked at.
        log_evidence: Log of the sum of the posteriors of all hands that were compared.
        growth: How many times as large as before the hand is seen, where that may change.
    """

    beam: Beam[NDArray[np.float64]]
    origins: NDArray[np.float64]
    fit: NDArray[np.float64]
    tried: int
    log_evidence: float
    growth: float = 1.0


def alike(first: NDArray[np.float64], second: NDArray[np.float64]) -> bool:
    """Tell whether two poses (25,) are one hypothesis."""
    apart = np.abs(first - second)
    return bool(apart[2:5].max() <= ALIKE_PALM_RAD and apart[5:].max() <= ALIKE_FINGERS_RAD)


def predictions(members: NDArray[np.float64], origins: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the predictions (2 K, 25) of poses (K, 25): all of them moved on, then all of them as they are.

    Args:
        members: (K, 25).
        origins: (K, 25) where each was in the frame before.
    """
    expected: NDArray[np.float64] = np.clip(np.concatenate([2.0 * members - origins, members]), LOW, HIGH)
    return expected


def follow(
    before: Beam[NDArray[np.float64]],
    expected: NDArray[np.float64],
    still_penalty: float,
    seen: PictureTables,
    task: Task,
    width: int,
) -> Found:
    """Return the hands of a frame.

    Args:
        before: The beam of the frame before, K hands.
        expected: (2 K, 25) its predictions, with the wrists that were seen.
        still_penalty: Of the second half of them.
        seen: The picture.
        task: The hand, and how it is looked for.
        width: How many hands are kept.
    """
    members = np.array(before.members)
    log_priors = np.concatenate([before.log_weights, before.log_weights - still_penalty])
    wanted = Predictions(expected, log_priors)
    hands = search(wanted, ideals_of(expected, seen, task), seen, task)
    if not len(hands.scores):
        best = int(np.argmax(log_priors))
        hands = Hands(
            expected[[best]],
            np.array([log_priors[best] - NO_PALM_COST]),
            np.array([best]),
            np.full((1, 5), HIDDEN),
            hands.tried,
        )
    order = np.argsort(-hands.scores, kind="stable")[:COMPARED]
    poses, scores, origins = hands.poses[order], hands.scores[order], hands.predictions[order]
    assignments = hands.assignments[order]
    growth = 1.0
    if task.settings.sweeps:
        for n in range(len(order)):
            poses[n], scores[n] = improve(poses[n], origins[n], wanted, assignments[n], seen, task)
        best = int(np.argmax(scores))
        if task.settings.growth_sd > 0.0:
            poses[best], growth = _regrow(
                poses[best], origins[best], wanted, assignments[best], scores[best], seen, task
            )
    elif np.isfinite(task.settings.cover_sd):
        scores -= np.square(differences(poses, seen, task) / (task.settings.cover_sd * seen.area))
    beam = select_best(list(poses), scores, origins % len(members), width, alike)
    off = differences(np.array(beam.members), seen, task._replace(scale=growth * task.scale)) / seen.area
    return Found(beam, members[beam.parents], off, hands.tried, float(normalise(scores)[1]), growth)


def _regrow(
    pose: NDArray[np.float64],
    origin: int,
    wanted: Predictions,
    assignment: NDArray[np.int64],
    score: float,
    seen: PictureTables,
    task: Task,
) -> tuple[NDArray[np.float64], float]:
    """Return a pose (25,) and how many times as large as before its hand is: as large, or a step larger or smaller.

    Args:
        pose: (25,) of the hand that is as large as before.
        origin: Number of the prediction near which it was found.
        wanted: The predictions.
        assignment: (5,) number of the protrusion that shows each finger, or HIDDEN.
        score: Of the pose.
        seen: The picture.
        task: The hand, and how it is looked for.
    """
    best, growth, limit = pose, 1.0, score + LEAST_GAIN
    middle = joints(pose, task.scale, task.shape)[:, :, :2].reshape(-1, 2).mean(axis=0)
    for factor in (1.0 - task.settings.growth_sd, 1.0 + task.settings.growth_sd):
        begin, poses = pose.copy(), wanted.poses.copy()
        shift = (1.0 - factor) * (middle - pose[:2])
        begin[:2] += shift
        poses[:, :2] += shift
        moved = wanted._replace(poses=poses)
        found, there = improve(begin, origin, moved, assignment, seen, task._replace(scale=factor * task.scale))
        if there > limit:
            best, growth, limit = found, factor, there
    return best, growth
