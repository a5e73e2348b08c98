"""A frame of the search, compiled: palms around every prediction, fingers for the best of them, whole hands.

Palms come first, since all fingers hang on them and a palm that sticks out of the silhouette needs no fingers. For each
palm that is left each finger is tried with every protrusion and as a hidden one; then the best assignment makes a hand.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pftrack.core.geometry.polygons import convex_hull
from pftrack.core.numerics.compiled import compiled
from pftrack.experiments.hand.shape import joints, palm_points
from pftrack.experiments.hand.trackers.assignment import HIDDEN, assign
from pftrack.experiments.hand.trackers.candidates import PALMS, finger_candidates, half_steps, palm_candidates
from pftrack.experiments.hand.trackers.cells import CELL_ANGLES, cell_log_fit, displacements
from pftrack.experiments.hand.trackers.likelihood import PictureTables, finger_fits, unexplained_cost, x_p
from pftrack.experiments.hand.trackers.prior import Predictions, log_prior, log_shares, palm_log_shares
from pftrack.experiments.hand.trackers.reach import reaches
from pftrack.experiments.hand.trackers.settings import Task

__all__ = ["Hands", "search"]

MOST_X_P = 6.0
"""Of a palm that is given up at once."""
ALIKE_PALMS = 0.06
"""Within which two palms count as one in all three angles, rad."""


class Hands(NamedTuple):
    """What a search has found.

    Attributes:
        poses: (M, 25).
        scores: (M,) log posteriors up to a constant.
        predictions: (M,) number of the prediction from which each comes, most probably.
        assignments: (M, 5) number of the protrusion that shows each finger, or HIDDEN.
        tried: How many palms were looked at.
    """

    poses: NDArray[np.float64]
    scores: NDArray[np.float64]
    predictions: NDArray[np.int64]
    assignments: NDArray[np.int64]
    tried: int


@compiled
def search(
    predictions: Predictions,
    ideals: NDArray[np.float64],
    seen: PictureTables,
    task: Task,
) -> Hands:
    """Return the best hand of every palm that fits.

    Args:
        predictions: I of them, with the wrists that were seen.
        ideals: (I, 6, n) x_p* of palms and hidden fingers around each; none if hands stand for no cells.
        seen: The picture.
        task: The hand, and how it is looked for.
    """
    palms, scores, origins, tried = _palms(predictions, ideals, seen, task)
    count = palms.shape[0]
    assignments = np.full((count, 5), HIDDEN)
    for i in range(predictions.poses.shape[0]):
        used = False
        for n in range(count):
            used = used or origins[n] == i
        if used:
            angles, priors, counts = finger_candidates(predictions.poses[i], task)
            halves = half_steps(predictions.poses[i], task)
            for n in range(count):
                if origins[n] == i:
                    scores[n] += _give_fingers(
                        palms[n], assignments[n], angles, priors, counts, halves, ideals[i, 1:], seen, task
                    )
    for n in range(count):
        shares = log_shares(palms[n], predictions, task.settings)
        scores[n] += log_prior(shares, origins[n], task.settings.mixture) - shares[origins[n]]
        if task.settings.mixture:
            origins[n] = np.argmax(shares)
    return Hands(palms, scores, origins, assignments, tried)


@compiled
def _give_fingers(
    pose: NDArray[np.float64],
    assignment: NDArray[np.int64],
    angles: NDArray[np.float64],
    priors: NDArray[np.float64],
    counts: NDArray[np.int64],
    halves: NDArray[np.float64],
    ideals: NDArray[np.float64],
    seen: PictureTables,
    task: Task,
) -> float:
    """Put the best fingers into a pose (25,), and which protrusion shows each (5,), in place; return their log score.

    Args:
        pose: Whose palm is settled.
        assignment: What is written.
        angles: (5, C, 4) of the candidates.
        priors: (5, C) of these, not increasing.
        counts: (5,) how many there are of each finger.
        halves: (5, 5) half steps of each finger's cell, rad.
        ideals: (5, n) x_p* of each finger if it is hidden.
        seen: The picture.
        task: The hand, and how it is looked for.
    """
    protrusions, most = seen.lengths.shape[0], counts.max()
    places = np.empty((5, most, 4, 3))
    moves = np.empty((5, most, CELL_ANGLES if task.settings.cells else 0, 4, 2))
    for k in range(most):
        for finger in range(5):
            _put(pose, finger, angles[finger, min(k, counts[finger] - 1)])
        placed = joints(pose, task.scale, task.shape)
        places[:, k] = placed
        if task.settings.cells:
            moves[:, k] = _moves(pose, placed, halves, task)
    fits, chosen = np.empty((5, protrusions + 1)), np.empty((5, protrusions + 1), np.int64)
    for finger in range(5):
        fits[finger], chosen[finger] = finger_fits(
            places[finger],
            moves[finger],
            ideals[finger],
            priors[finger],
            counts[finger],
            task.shape.radii[finger],
            seen,
            task,
        )
    costs = np.empty(protrusions)
    for p in range(protrusions):
        costs[p] = unexplained_cost(seen.lengths[p], task.settings.unit)
    score, best = assign(fits, costs)
    for finger in range(5):
        assignment[finger] = best[finger]
        _put(pose, finger, angles[finger, chosen[finger, best[finger]]])  # hidden is the last column, and -1
    return score


@compiled
def _moves(
    pose: NDArray[np.float64], places: NDArray[np.float64], halves: NDArray[np.float64], task: Task
) -> NDArray[np.float64]:
    """Return by how much joints and tips (5, 5, 4, 2) move for half a step of each angle of a finger's cell, px."""
    moved = pose.copy()
    for finger in range(5):
        moved[5 + 4 * finger] += halves[finger, 3]
    spread = joints(moved, task.scale, task.shape)
    for finger in range(5):
        moved[5 + 4 * finger] -= halves[finger, 3]
        for j in range(6 + 4 * finger, 9 + 4 * finger):
            moved[j] += halves[finger, 4]
    flexed = joints(moved, task.scale, task.shape)
    return displacements(pose, places, spread, flexed, halves[0, :3], task.scale, task.shape.side)


@compiled
def _palms(
    predictions: Predictions, ideals: NDArray[np.float64], seen: PictureTables, task: Task
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.int64], int]:
    """Return the best palms that differ: poses (M, 25), scores (M,), predictions (M,), and how many were looked at."""
    many = PALMS * predictions.poses.shape[0]
    poses, scores, origins = np.empty((many, 25)), np.empty(many), np.empty(many, np.int64)
    others = np.zeros(many)  # what the other predictions add to a palm's prior
    tried = 0
    for i in range(predictions.poses.shape[0]):
        around, priors = palm_candidates(predictions.poses[i], task)
        for n in range(around.shape[0]):
            misfit = x_p(convex_hull(palm_points(around[n], task.scale, task.shape)), seen, task.scale)
            score = priors[n] + predictions.log_weights[i]
            score += cell_log_fit(misfit * misfit, ideals[i, 0], task.settings.palm_fit_sd)
            if task.settings.mixture:
                shares = palm_log_shares(around[n], predictions, task.settings)
                others[tried] = log_prior(shares, i, True) - shares[i]
            scores[tried], origins[tried] = score if misfit <= MOST_X_P else -np.inf, i
            for j in range(25):
                poses[tried, j] = around[n, j]
            tried += 1
    chosen = _best_that_differ(poses, scores + others, tried, seen, task, task.settings.reach)
    if chosen.shape[0] == 0 and task.settings.reach:  # then some protrusion is no finger
        chosen = _best_that_differ(poses, scores + others, tried, seen, task, False)
    count = chosen.shape[0]
    kept, kept_scores, kept_origins = np.empty((count, 25)), np.empty(count), np.empty(count, np.int64)
    for n in range(count):
        kept_scores[n], kept_origins[n] = scores[chosen[n]], origins[chosen[n]]
        for j in range(25):
            kept[n, j] = poses[chosen[n], j]
    return kept, kept_scores, kept_origins, tried


@compiled
def _best_that_differ(
    poses: NDArray[np.float64], scores: NDArray[np.float64], count: int, seen: PictureTables, task: Task, reach: bool
) -> NDArray[np.int64]:
    """Return the places of the best of the first `count` poses whose palms differ, at most `palm_count`, best first.

    Args:
        poses: (N, 25) or longer.
        scores: (N,) or longer; -inf of what is not wanted.
        count: N.
        seen: The picture.
        task: The hand, and how it is looked for.
        reach: Whether only palms are wanted whose fingers reach all protrusions.
    """
    most = task.settings.palm_count
    left, chosen, size = scores.copy(), np.empty(most, np.int64), 0
    while size < most and count > 0:
        best = 0
        for n in range(count):
            if left[n] > left[best]:
                best = n
        if left[best] == -np.inf:
            break
        left[best] = -np.inf
        differs = True
        for other in chosen[:size]:
            apart = 0.0
            for j in range(2, 5):
                apart = max(apart, abs(poses[best, j] - poses[other, j]))
            differs = differs and apart > ALIKE_PALMS
        if differs and (not reach or reaches(poses[best], seen, task)):
            chosen[size] = best
            size += 1
    return chosen[:size]


@compiled
def _put(pose: NDArray[np.float64], finger: int, angles: NDArray[np.float64]) -> None:
    """Put the angles (4,) of a finger into a pose in place."""
    for j in range(4):
        pose[5 + 4 * finger + j] = angles[j]
