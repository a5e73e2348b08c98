"""Whole hands beside the silhouette: how much of it they leave uncovered or cover too much, and moves that mend it.

The search's candidates stand on a grid of angles, so the best of them is beside the best there is, and which of two is
beside it less is a matter of luck. Before whole hands are ranked, each is therefore moved uphill: one number of the
pose after the other, by steps that get smaller, on the same posterior that ranks them. While a finger moves, all other
parts stand still and are drawn just once.
"""

import numpy as np
from numpy.typing import NDArray

from pftrack.core.geometry.polygons import convex_hull, fill, spans
from pftrack.core.numerics.compiled import compiled
from pftrack.experiments.hand.shape import capsule, joints, palm_points, parts
from pftrack.experiments.hand.trackers.candidates import HIGHEST, LOWEST
from pftrack.experiments.hand.trackers.likelihood import PictureTables, finger_fit, x_p
from pftrack.experiments.hand.trackers.prior import Predictions, log_prior, log_shares
from pftrack.experiments.hand.trackers.settings import Task

__all__ = ["differences", "differing", "improve", "log_score"]

PALM_MOVES = np.array([1.5, 1.5, 0.04, 0.12, 0.08])
"""First steps of the wrist, px for a palm axis of 52, and of a, b and c, rad."""
SPREAD_MOVE, FLEXION_MOVE = 0.05, 0.15
"""Of a finger, rad."""


@compiled
def differences(poses: NDArray[np.float64], seen: PictureTables, task: Task) -> NDArray[np.int64]:
    """Return by how many pixels (M,) the silhouettes of poses (M, 25) differ from the one that was seen."""
    found = np.empty(poses.shape[0], np.int64)
    for n in range(poses.shape[0]):
        corners, counts = parts(poses[n], task.scale, task.shape)
        found[n] = differing(fill(corners, counts, *seen.silhouette.shape), seen.silhouette)
    return found


@compiled
def improve(
    pose: NDArray[np.float64],
    origin: int,
    predictions: Predictions,
    assignment: NDArray[np.int64],
    seen: PictureTables,
    task: Task,
) -> tuple[NDArray[np.float64], float]:
    """Return a pose (25,) uphill of one, and its log score.

    Args:
        pose: (25,) to begin at.
        origin: Number of the prediction near which it was found.
        predictions: With the wrists that were seen.
        assignment: (5,) number of the protrusion that shows each finger, or HIDDEN.
        seen: The picture.
        task: The hand, and how it is looked for.
    """
    best = pose.copy()
    score = log_score(best, origin, predictions, assignment, seen, task)
    marks, mark = np.zeros(seen.silhouette.shape, np.int32), 0
    share = 2.0
    for _ in range(task.settings.sweeps):
        share *= 0.5
        for i in range(5):
            move = share * PALM_MOVES[i] * (task.settings.unit if i < 2 else 1.0)
            for way in range(2):
                moved = best.copy()
                moved[i] = min(max(moved[i] + (move if way else -move), LOWEST[i]), HIGHEST[i])
                there = log_score(moved, origin, predictions, assignment, seen, task)
                if there > score:
                    best, score = moved, there
                    break
        for finger in range(5):
            corners, counts = parts(best, task.scale, task.shape)
            counts[2 + 3 * finger : 5 + 3 * finger] = 0
            others = fill(corners, counts, seen.silhouette.shape[0], seen.silhouette.shape[1])
            without = differing(others, seen.silhouette)
            here = -np.inf
            for way in range(5):
                moved = best.copy()
                if way > 0:
                    _move_finger(moved, finger, way - 1, share)
                mark += 1
                there = _log_prior(moved, origin, predictions, task)
                there += _finger_fit(moved, finger, assignment[finger], seen, task)
                there += _cover(without + _added_pixels(moved, finger, others, marks, mark, seen, task), seen, task)
                if way == 0:
                    here = there
                elif there > here:
                    best, score, here = moved, score + there - here, there
    return best, score


@compiled
def log_score(
    pose: NDArray[np.float64],
    origin: int,
    predictions: Predictions,
    assignment: NDArray[np.int64],
    seen: PictureTables,
    task: Task,
) -> float:
    """Return the log posterior of a hand up to a constant; the arguments are those of `improve`."""
    settings = task.settings
    score = _log_prior(pose, origin, predictions, task)
    score -= 0.5 * pose[4] * pose[4] / (settings.straight_sd * settings.straight_sd)
    misfit = x_p(convex_hull(palm_points(pose, task.scale, task.shape)), seen, task.scale)
    score -= 0.5 * misfit * misfit / (settings.palm_fit_sd * settings.palm_fit_sd)
    for finger in range(5):
        score += _finger_fit(pose, finger, assignment[finger], seen, task)
    corners, counts = parts(pose, task.scale, task.shape)
    drawn = fill(corners, counts, seen.silhouette.shape[0], seen.silhouette.shape[1])
    return float(score + _cover(differing(drawn, seen.silhouette), seen, task))


@compiled
def _log_prior(pose: NDArray[np.float64], origin: int, predictions: Predictions, task: Task) -> float:
    return log_prior(log_shares(pose, predictions, task.settings), origin, task.settings.mixture)


@compiled
def _cover(differing: int, seen: PictureTables, task: Task) -> float:
    share = differing / (task.settings.cover_sd * seen.area)
    return -share * share


@compiled
def differing(mask: NDArray[np.bool_], silhouette: NDArray[np.bool_]) -> int:
    """Return in how many pixels two masks (height, width) differ."""
    count = 0
    for row in range(mask.shape[0]):
        for column in range(mask.shape[1]):
            count += mask[row, column] != silhouette[row, column]
    return count


@compiled
def _finger_fit(pose: NDArray[np.float64], finger: int, protrusion: int, seen: PictureTables, task: Task) -> float:
    """Return the log likelihood of one finger of a pose (25,), which is moved freely and so stands for no cell."""
    places = joints(pose, task.scale, task.shape)[finger]
    return finger_fit(
        places, np.empty((0, 4, 2)), np.empty(0), task.shape.radii[finger], protrusion, seen, task, -np.inf
    )


@compiled
def _move_finger(pose: NDArray[np.float64], finger: int, way: int, share: float) -> None:
    """Move a finger of a pose in place: spread it either way, or bend all its joints either way."""
    at = 5 + 4 * finger
    sign = 1.0 if way % 2 else -1.0
    if way < 2:
        pose[at] = min(max(pose[at] + sign * share * SPREAD_MOVE, LOWEST[at]), HIGHEST[at])
        return
    for j in range(1, 4):
        pose[at + j] = min(max(pose[at + j] + sign * share * FLEXION_MOVE, LOWEST[at + j]), HIGHEST[at + j])


@compiled
def _added_pixels(
    pose: NDArray[np.float64],
    finger: int,
    others: NDArray[np.bool_],
    marks: NDArray[np.int32],
    mark: int,
    seen: PictureTables,
    task: Task,
) -> int:
    """Return by how many pixels more a hand differs from the silhouette with one finger than without it.

    Args:
        pose: (25,).
        finger: Its number.
        others: (height, width) pixels of the other parts.
        marks: (height, width) in which pixels of the finger are marked, so that each counts once.
        mark: A number that is not in it.
        seen: The picture.
        task: The hand.
    """
    places, radii = joints(pose, task.scale, task.shape)[finger], task.shape.radii[finger]
    height, width = others.shape
    added = 0
    for j in range(3):
        outline = capsule(places[j], task.scale * radii[j], places[j + 1], task.scale * radii[j + 1])
        top, firsts, lasts = spans(outline, height, width)
        for i in range(firsts.shape[0]):
            for column in range(firsts[i], lasts[i] + 1):
                if marks[top + i, column] != mark and not others[top + i, column]:
                    marks[top + i, column] = mark
                    added += -1 if seen.silhouette[top + i, column] else 1
    return added
