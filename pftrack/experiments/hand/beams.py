"""A frame of the beam: predictions from every kept hand, candidates near them, and the selection of the next hands.

Each kept hand makes two predictions, that its motion continues and that it stands still, since angles on a coarse grid
give velocities that are mostly noise. A hand's prior is that of its own prediction.

Palms are tried first, since all fingers depend on them and a palm that sticks out of the silhouette needs no fingers.
For each remaining palm each finger is tried with every protrusion and as a hidden one; the best assignment gives a
hand. Whole hands are then improved by hill climbing and ranked.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Bools, Floats, Ints
from pftrack.core.geometry import convex_hull, fill, spans
from pftrack.core.numerics.compiled import compiled
from pftrack.experiments.hand import candidates, likelihood, model
from pftrack.experiments.hand.shape import HIGH, LOW, capsule, joints, palm_points, parts
from pftrack.filters.beam import Beam, select_best
from pftrack.filters.particles import normalise

# The search's candidates lie on a grid of angles, so the best of them is near the optimum, and chance decides which of
# two is nearer. Before whole hands are ranked, each is therefore moved uphill: one number of the pose after the other,
# by steps that get smaller, on the same posterior that ranks them. While a finger moves, all other parts are fixed and
# drawn just once.

PALM_MOVES = np.array([1.5, 1.5, 0.04, 0.12, 0.08])
"""First steps of the wrist, px for a palm axis of 52, and of a, b and c, rad."""
SPREAD_MOVE, FLEXION_MOVE = 0.05, 0.15
"""Steps of a finger's angles, rad."""


@compiled
def differences(poses: Floats, seen: likelihood.PictureTables, task: model.Task) -> Ints:
    """Return the number of pixels (M,) in which the silhouettes of poses (M, 25) differ from the measured one."""
    found = np.empty(poses.shape[0], np.int64)
    for n in range(poses.shape[0]):
        corners, counts = parts(poses[n], task.scale, task.shape)
        found[n] = differing(fill(corners, counts, *seen.silhouette.shape), seen.silhouette)
    return found


@compiled
def improve(
    pose: Floats,
    origin: int,
    predictions: model.Predictions,
    assignment: Ints,
    seen: likelihood.PictureTables,
    task: model.Task,
) -> tuple[Floats, float]:
    """Return a pose (25,) improved by hill climbing, and its log score.

    Args:
        pose: (25,) to begin at.
        origin: Number of the prediction near which it was found.
        predictions: With the wrists that were seen.
        assignment: (5,) number of the protrusion that shows each finger, or HIDDEN.
        seen: The picture.
        task: The hand, and the settings of the search.
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
                moved[i] = min(max(moved[i] + (move if way else -move), candidates.LOWEST[i]), candidates.HIGHEST[i])
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
    pose: Floats,
    origin: int,
    predictions: model.Predictions,
    assignment: Ints,
    seen: likelihood.PictureTables,
    task: model.Task,
) -> float:
    """Return the log posterior of a hand up to a constant; the arguments are those of `improve`."""
    settings = task.settings
    score = _log_prior(pose, origin, predictions, task)
    score -= 0.5 * pose[4] * pose[4] / (settings.straight_sd * settings.straight_sd)
    misfit = likelihood.x_p(convex_hull(palm_points(pose, task.scale, task.shape)), seen, task.scale)
    score -= 0.5 * misfit * misfit / (model.PALM_FIT_SD * model.PALM_FIT_SD)
    for finger in range(5):
        score += _finger_fit(pose, finger, assignment[finger], seen, task)
    corners, counts = parts(pose, task.scale, task.shape)
    drawn = fill(corners, counts, seen.silhouette.shape[0], seen.silhouette.shape[1])
    return float(score + _cover(differing(drawn, seen.silhouette), seen, task))


@compiled
def _log_prior(pose: Floats, origin: int, predictions: model.Predictions, task: model.Task) -> float:
    return model.log_prior(model.log_shares(pose, predictions, task.settings), origin, task.settings.reference)


@compiled
def _cover(differing: int, seen: likelihood.PictureTables, task: model.Task) -> float:
    share = differing / (task.settings.cover_sd * seen.area)
    return -share * share


@compiled
def differing(mask: Bools, silhouette: Bools) -> int:
    """Return the number of pixels in which two masks (height, width) differ."""
    count = 0
    for row in range(mask.shape[0]):
        for column in range(mask.shape[1]):
            count += mask[row, column] != silhouette[row, column]
    return count


@compiled
def _finger_fit(pose: Floats, finger: int, protrusion: int, seen: likelihood.PictureTables, task: model.Task) -> float:
    """Return the log likelihood of one finger of a pose (25,), moved freely, so it does not represent a cell."""
    places = joints(pose, task.scale, task.shape)[finger]
    return likelihood.finger_fit(
        places, np.empty((0, 4, 2)), np.empty(0), task.shape.radii[finger], protrusion, seen, task, -np.inf
    )


@compiled
def _move_finger(pose: Floats, finger: int, way: int, share: float) -> None:
    """Move a finger of a pose in place: spread it either way, or bend all its joints either way."""
    at = 5 + 4 * finger
    sign = 1.0 if way % 2 else -1.0
    if way < 2:
        pose[at] = min(max(pose[at] + sign * share * SPREAD_MOVE, candidates.LOWEST[at]), candidates.HIGHEST[at])
        return
    for j in range(1, 4):
        pose[at + j] = min(
            max(pose[at + j] + sign * share * FLEXION_MOVE, candidates.LOWEST[at + j]), candidates.HIGHEST[at + j]
        )


@compiled
def _added_pixels(
    pose: Floats,
    finger: int,
    others: Bools,
    marks: NDArray[np.int32],
    mark: int,
    seen: likelihood.PictureTables,
    task: model.Task,
) -> int:
    """Return the increase in differing pixels between a hand and the silhouette by one of its fingers.

    Args:
        pose: (25,).
        finger: Its number.
        others: (height, width) pixels of the other parts.
        marks: (height, width) marks of the finger's pixels, so each counts once.
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


MOST_X_P = 6.0
"""Score below which a palm is dropped at once."""
ALIKE_PALMS = 0.06
"""Difference in all three angles within which two palms count as one, rad."""


class Hands(NamedTuple):
    """Results of a search.

    Attributes:
        poses: (M, 25).
        scores: (M,) log posteriors up to a constant.
        predictions: (M,) index of the most probable prediction of each.
        assignments: (M, 5) number of the protrusion that shows each finger, or HIDDEN.
    """

    poses: Floats
    scores: Floats
    predictions: Ints
    assignments: Ints


@compiled
def search(
    predictions: model.Predictions,
    ideals: Floats,
    seen: likelihood.PictureTables,
    task: model.Task,
) -> Hands:
    """Return the best hand of every palm that fits.

    Args:
        predictions: I predictions, with the measured wrists.
        ideals: (I, 6, n) x_p* of palms and hidden fingers around each; empty if hands do not represent cells.
        seen: The picture.
        task: The hand, and the settings of the search.
    """
    palms, scores, origins = _palms(predictions, ideals, seen, task)
    count = palms.shape[0]
    assignments = np.full((count, 5), candidates.HIDDEN)
    for i in range(predictions.poses.shape[0]):
        used = False
        for n in range(count):
            used = used or origins[n] == i
        if used:
            angles, priors, counts = candidates.finger_candidates(predictions.poses[i], task)
            halves = candidates.half_steps(predictions.poses[i], task)
            for n in range(count):
                if origins[n] == i:
                    scores[n] += _give_fingers(
                        palms[n], assignments[n], angles, priors, counts, halves, ideals[i, 1:], seen, task
                    )
    for n in range(count):
        shares = model.log_shares(palms[n], predictions, task.settings)
        scores[n] += model.log_prior(shares, origins[n], task.settings.reference) - shares[origins[n]]
        if not task.settings.reference:
            origins[n] = np.argmax(shares)
    return Hands(palms, scores, origins, assignments)


@compiled
def _give_fingers(
    pose: Floats,
    assignment: Ints,
    angles: Floats,
    priors: Floats,
    counts: Ints,
    halves: Floats,
    ideals: Floats,
    seen: likelihood.PictureTables,
    task: model.Task,
) -> float:
    """Put the best fingers into a pose (25,), and which protrusion shows each (5,), in place; return their log score.

    Args:
        pose: Whose palm is settled.
        assignment: Output array.
        angles: (5, C, 4) of the candidates.
        priors: (5, C) of these, not increasing.
        counts: (5,) number of candidates of each finger.
        halves: (5, 5) half steps of each finger's cell, rad.
        ideals: (5, n) x_p* of each finger if it is hidden.
        seen: The picture.
        task: The hand, and the settings of the search.
    """
    protrusions, most = seen.lengths.shape[0], counts.max()
    places = np.empty((5, most, 4, 3))
    moves = np.empty((5, most, likelihood.CELL_ANGLES if task.settings.cells else 0, 4, 2))
    for k in range(most):
        for finger in range(5):
            _put(pose, finger, angles[finger, min(k, counts[finger] - 1)])
        placed = joints(pose, task.scale, task.shape)
        places[:, k] = placed
        if task.settings.cells:
            moves[:, k] = _moves(pose, placed, halves, task)
    fits, chosen = np.empty((5, protrusions + 1)), np.empty((5, protrusions + 1), np.int64)
    for finger in range(5):
        fits[finger], chosen[finger] = likelihood.finger_fits(
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
        costs[p] = likelihood.unexplained_cost(seen.lengths[p], task.settings.unit)
    score, best = candidates.assign(fits, costs)
    for finger in range(5):
        assignment[finger] = best[finger]
        _put(pose, finger, angles[finger, chosen[finger, best[finger]]])  # hidden is the last column, and -1
    return score


@compiled
def _moves(pose: Floats, places: Floats, halves: Floats, task: model.Task) -> Floats:
    """Return the displacements (5, 5, 4, 2) of joints and tips for half a step of each angle of a finger's cell, px."""
    moved = pose.copy()
    for finger in range(5):
        moved[5 + 4 * finger] += halves[finger, 3]
    spread = joints(moved, task.scale, task.shape)
    for finger in range(5):
        moved[5 + 4 * finger] -= halves[finger, 3]
        for j in range(6 + 4 * finger, 9 + 4 * finger):
            moved[j] += halves[finger, 4]
    flexed = joints(moved, task.scale, task.shape)
    return likelihood.displacements(pose, places, spread, flexed, halves[0, :3], task.scale, task.shape.side)


@compiled
def _palms(
    predictions: model.Predictions, ideals: Floats, seen: likelihood.PictureTables, task: model.Task
) -> tuple[Floats, Floats, Ints]:
    """Return the best palms that differ: poses (M, 25), scores (M,), and predictions (M,)."""
    many = candidates.PALMS * predictions.poses.shape[0]
    poses, scores, origins = np.empty((many, 25)), np.empty(many), np.empty(many, np.int64)
    others = np.zeros(many)  # the other predictions' share of a palm's prior
    tried = 0
    for i in range(predictions.poses.shape[0]):
        around, priors = candidates.palm_candidates(predictions.poses[i], task)
        for n in range(around.shape[0]):
            misfit = likelihood.x_p(convex_hull(palm_points(around[n], task.scale, task.shape)), seen, task.scale)
            score = priors[n] + predictions.log_weights[i]
            score += likelihood.cell_log_fit(misfit * misfit, ideals[i, 0], model.PALM_FIT_SD)
            if not task.settings.reference:
                shares = model.palm_log_shares(around[n], predictions)
                others[tried] = model.log_prior(shares, i, False) - shares[i]
            scores[tried], origins[tried] = score if misfit <= MOST_X_P else -np.inf, i
            for j in range(25):
                poses[tried, j] = around[n, j]
            tried += 1
    chosen = _best_that_differ(poses, scores + others, tried, seen, task, not task.settings.reference)
    if chosen.shape[0] == 0:  # then some protrusion is not a finger
        chosen = _best_that_differ(poses, scores + others, tried, seen, task, False)
    count = chosen.shape[0]
    kept, kept_scores, kept_origins = np.empty((count, 25)), np.empty(count), np.empty(count, np.int64)
    for n in range(count):
        kept_scores[n], kept_origins[n] = scores[chosen[n]], origins[chosen[n]]
        for j in range(25):
            kept[n, j] = poses[chosen[n], j]
    return kept, kept_scores, kept_origins


@compiled
def _best_that_differ(
    poses: Floats, scores: Floats, count: int, seen: likelihood.PictureTables, task: model.Task, reach: bool
) -> Ints:
    """Return the places of the best of the first `count` poses whose palms differ, at most `palm_count`, best first.

    Args:
        poses: (N, 25) or longer.
        scores: (N,) or longer; -inf for unwanted entries.
        count: N.
        seen: The picture.
        task: The hand, and the settings of the search.
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
        if differs and (not reach or likelihood.reaches(poses[best], seen, task)):
            chosen[size] = best
            size += 1
    return chosen[:size]


@compiled
def _put(pose: Floats, finger: int, angles: Floats) -> None:
    """Put the angles (4,) of a finger into a pose in place."""
    for j in range(4):
        pose[5 + 4 * finger + j] = angles[j]


COMPARED = 12
"""Number of the best hands that are compared with the silhouette as wholes."""

ALIKE_PALM_RAD, ALIKE_FINGERS_RAD = 0.08, 0.3
"""Two hands that differ by no more are one."""

LEAST_GAIN = 0.5
"""Gain in log score required for another size."""

NO_PALM_COST = 10.0
"""Cost of keeping a prediction without a fitting palm nearby."""


class Found(NamedTuple):
    """The result of a frame.

    Attributes:
        beam: The hands that are kept, the best first.
        fit: (K,) difference of each from the silhouette, as a share of the silhouette's area.
        log_evidence: Log of the sum of the posteriors of all compared hands.
        growth: Size of the hand relative to the frame before, if it may change.
    """

    beam: Beam[Floats]
    fit: Floats
    log_evidence: float
    growth: float = 1.0


def alike(first: Floats, second: Floats) -> bool:
    """Return whether two poses (25,) are one hypothesis."""
    apart = np.abs(first - second)
    return bool(apart[2:5].max() <= ALIKE_PALM_RAD and apart[5:].max() <= ALIKE_FINGERS_RAD)


def predictions(members: Floats, origins: Floats) -> Floats:
    """Return the predictions (2 K, 25) of poses (K, 25): first all moved by their motion, then all unmoved.

    Args:
        members: (K, 25).
        origins: (K, 25) where each was in the frame before.
    """
    expected: Floats = np.clip(np.concatenate([2.0 * members - origins, members]), LOW, HIGH)
    return expected


def follow(
    before: Beam[Floats],
    expected: Floats,
    seen: likelihood.PictureTables,
    task: model.Task,
    width: int,
) -> Found:
    """Return the hands of a frame.

    Args:
        before: The beam of the frame before, K hands.
        expected: (2 K, 25) its predictions, with the wrists that were seen; in the second half hands stay still.
        seen: The picture.
        task: The hand, and the settings of the search.
        width: Number of kept hands.
    """
    members = np.array(before.members)
    log_priors = np.concatenate([before.log_weights, before.log_weights - model.STILL_COST])
    wanted = model.Predictions(expected, log_priors)
    hands = search(wanted, likelihood.ideals_of(expected, seen, task), seen, task)
    if not len(hands.scores):
        best = int(np.argmax(log_priors))
        hands = Hands(
            expected[[best]],
            np.array([log_priors[best] - NO_PALM_COST]),
            np.array([best]),
            np.full((1, 5), candidates.HIDDEN),
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
    return Found(beam, off, float(normalise(scores)[1]), growth)


def _regrow(
    pose: Floats,
    origin: int,
    wanted: model.Predictions,
    assignment: Ints,
    score: float,
    seen: likelihood.PictureTables,
    task: model.Task,
) -> tuple[Floats, float]:
    """Return a pose (25,) and the relative size of its hand: unchanged, or a step larger or smaller.

    Args:
        pose: (25,) of the hand that is as large as before.
        origin: Number of the prediction near which it was found.
        wanted: The predictions.
        assignment: (5,) number of the protrusion that shows each finger, or HIDDEN.
        score: Score of the pose.
        seen: The picture.
        task: The hand, and the settings of the search.
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
