"""A frame of the particle filter, with the likelihood of the beam: in partitions, the palm first and then the fingers.

A hand has 25 numbers, and particles that are drawn in all of them at once would need to be millions. Fingers hang on
the palm but not on one another, so they are drawn in partitions (J. MacCormick and M. Isard, 2000): many palms; those
that fit the silhouette are drawn again, and for each of these some candidates of every finger, and one is drawn by how
well it fits. The mean fit of a finger's candidates is its part of the particle's weight, so that all of them count. A
share of the candidates is drawn from all that a finger can do, since fingers move fast.

A particle holds its pose and that of its parent: it goes on as it moved, or it stands still, as the beam's predictions.
"""

from typing import NamedTuple

import numpy as np

from pftrack.core.arrays import Floats, Ints
from pftrack.core.geometry.polygons import convex_hull, fill
from pftrack.core.numerics.compiled import compiled
from pftrack.core.numerics.elementary import exponentials, logarithms
from pftrack.core.numerics.random import standard_normals, uniforms
from pftrack.experiments.hand.beams import differing
from pftrack.experiments.hand.candidates import HIGHEST, LOWEST, assign, flexion_limits
from pftrack.experiments.hand.likelihood import PictureTables, finger_fit, unexplained_cost, x_p
from pftrack.experiments.hand.parameters import Settings, Task
from pftrack.experiments.hand.shape import ANGLES, joints, palm_points, parts
from pftrack.filters.particles import normalise
from pftrack.filters.resampling import parents

TRACK = 1
"""Purpose.TRACK, as compiled code needs it."""

PALMS_EACH = 8
"""Palms that are drawn for each particle that is kept."""
CANDIDATES = 12
"""Of each finger."""
ANYWHERE = 0.25
"""Share of the candidates that are drawn from all that a finger can do."""


class Cloud(NamedTuple):
    """What comes of a frame.

    Attributes:
        states: (N, 50) poses, and those of their parents.
        log_weights: (N,) normalised.
        ancestors: (N,).
        log_evidence: Log of the mean of the weights.
    """

    states: Floats
    log_weights: Floats
    ancestors: Ints
    log_evidence: float


@compiled
def sample(
    states: Floats,
    log_weights: Floats,
    wrists: Floats,
    count: int,
    still_share: float,
    seen: PictureTables,
    task: Task,
    seed: int,
    frame: int,
) -> Cloud:
    """Return the particles of a frame.

    Args:
        states: (N, 50) of the frame before.
        log_weights: (N,) of these.
        wrists: (N, 2) where each one's wrist is expected.
        count: How many particles are wanted.
        still_share: Probability that a hand stands still rather than goes on.
        seen: The picture.
        task: The hand, and how it is looked for.
        seed: Of the run.
        frame: Index of the frame.
    """
    expected, ancestors, first = _palms(states, log_weights, wrists, count, still_share, seen, task, seed, frame)
    following, weights = np.empty((count, 2 * ANGLES)), np.empty(count)
    costs = np.empty(seen.lengths.shape[0])
    for p in range(costs.shape[0]):
        costs[p] = unexplained_cost(seen.lengths[p], task.settings.unit)
    for n in range(count):
        pose, fit = _with_fingers(expected[n], costs, seen, task, seed, frame, n)
        corners, counts = parts(pose, task.scale, task.shape)
        drawn = fill(corners, counts, seen.silhouette.shape[0], seen.silhouette.shape[1])
        share = differing(drawn, seen.silhouette) / (task.settings.cover_sd * seen.area)
        weights[n] = fit - share * share
        for i in range(ANGLES):
            following[n, i], following[n, ANGLES + i] = pose[i], states[ancestors[n], i]
    normalised, log_sum = normalise(weights)
    return Cloud(following, normalised, ancestors, first + log_sum - np.log(float(count)))


@compiled
def _palms(
    states: Floats,
    log_weights: Floats,
    wrists: Floats,
    count: int,
    still_share: float,
    seen: PictureTables,
    task: Task,
    seed: int,
    frame: int,
) -> tuple[Floats, Ints, float]:
    """Return poses (count, 25) whose palms fit, with fingers as expected, their ancestors, and the log of the mean."""
    many = PALMS_EACH * count
    settings = task.settings
    chosen = parents(0, log_weights, many, seed, frame, TRACK, 0)
    normals = standard_normals(seed, frame, TRACK, 1, 5 * many).reshape(5, many)
    still = uniforms(seed, frame, TRACK, 2, many)
    poses, weights = np.empty((many, ANGLES)), np.empty(many)
    sds = np.array([settings.wrist_sd, settings.wrist_sd, settings.turn_sd, settings.tilt_sd, settings.turn_sd])
    for n in range(many):
        state, pose = states[chosen[n]], poses[n]
        for i in range(ANGLES):
            pose[i] = state[i] if still[n] < still_share else 2.0 * state[i] - state[ANGLES + i]
            if i < 2:
                pose[i] = wrists[chosen[n], i]
            if i < 5:
                pose[i] += sds[i] * normals[i, n]
            pose[i] = min(max(pose[i], LOWEST[i]), HIGHEST[i])
        misfit = x_p(convex_hull(palm_points(pose, task.scale, task.shape)), seen, task.scale) / settings.palm_fit_sd
        bent = pose[4] / settings.straight_sd
        weights[n] = -0.5 * (misfit * misfit + bent * bent)
    normalised, log_sum = normalise(weights)
    drawn = parents(0, normalised, count, seed, frame, TRACK, 3)
    kept, ancestors = np.empty((count, ANGLES)), np.empty(count, np.int64)
    for n in range(count):
        ancestors[n] = chosen[drawn[n]]
        for i in range(ANGLES):
            kept[n, i] = poses[drawn[n], i]
    return kept, ancestors, log_sum - np.log(float(many))


@compiled
def _with_fingers(
    expected: Floats,
    costs: Floats,
    seen: PictureTables,
    task: Task,
    seed: int,
    frame: int,
    n: int,
) -> tuple[Floats, float]:
    """Return a pose (25,) whose fingers are drawn by how well they fit, and the log of their mean fits."""
    settings, protrusions = task.settings, costs.shape[0]
    normals = standard_normals(seed, frame, TRACK, 4 + 2 * n, 10 * CANDIDATES).reshape(2, 5, CANDIDATES)
    numbers = uniforms(seed, frame, TRACK, 5 + 2 * n, 10 * CANDIDATES + 5)
    anywhere = numbers[: 10 * CANDIDATES].reshape(2, 5, CANDIDATES)
    no_moves, no_ideals = np.empty((0, 4, 2)), np.empty(0)
    poses, log_fits = np.empty((CANDIDATES, ANGLES)), np.empty((5, protrusions + 1, CANDIDATES))
    bends, uniform = np.empty(5 * CANDIDATES), np.empty(5 * CANDIDATES)
    for k in range(CANDIDATES):
        poses[k] = expected
        for finger in range(5):
            at = finger * CANDIDATES + k
            bends[at], uniform[at] = _draw_finger(
                poses[k], finger, normals[:, finger, k], anywhere[:, finger, k], settings
            )
    gains = _gains(bends, uniform)
    for k in range(CANDIDATES):
        places = joints(poses[k], task.scale, task.shape)
        for finger in range(5):
            at = finger * CANDIDATES + k
            for p in range(protrusions + 1):
                radii = task.shape.radii[finger]
                fit = finger_fit(places[finger], no_moves, no_ideals, radii, p, seen, task, -np.inf)
                log_fits[finger, p, k] = fit + gains[at]
    means = np.empty((5, protrusions + 1))
    for finger in range(5):
        for p in range(protrusions + 1):
            means[finger, p] = normalise(log_fits[finger, p])[1] - np.log(float(CANDIDATES))
    fit, assignment = assign(means, costs)
    pose = expected.copy()
    for finger in range(5):
        at = 5 + 4 * finger
        shares = exponentials(normalise(log_fits[finger, assignment[finger]])[0])
        left, k = numbers[10 * CANDIDATES + finger], 0
        while k < CANDIDATES - 1 and left >= shares[k]:
            left -= shares[k]
            k += 1
        pose[at : at + 4] = poses[k, at : at + 4]
    return pose, fit


@compiled
def _gains(bends: Floats, uniform: Floats) -> Floats:
    """Return logs (n,) of the prior of bends by the density of drawing them, a mixture of the prior and of anywhere."""
    log_priors = np.empty(bends.shape[0])
    for n in range(bends.shape[0]):
        log_priors[n] = -0.5 * bends[n] * bends[n] - 0.5 * np.log(2.0 * np.pi)
    densities = exponentials(log_priors)
    for n in range(bends.shape[0]):
        densities[n] = ANYWHERE * uniform[n] + (1.0 - ANYWHERE) * densities[n]
    densities = logarithms(densities)
    for n in range(bends.shape[0]):
        log_priors[n] -= densities[n]
    return log_priors


@compiled
def _draw_finger(
    pose: Floats,
    finger: int,
    normals: Floats,
    numbers: Floats,
    settings: Settings,
) -> tuple[float, float]:
    """Draw a finger of a pose in place; return its bend and the density of drawing it from anywhere, in flexion_sd."""
    at = 5 + 4 * finger
    middle = (pose[at + 1] + pose[at + 2] + pose[at + 3]) / 3.0
    lowest, highest = flexion_limits(finger)
    turn, bend = normals[0], normals[1]
    if numbers[0] < ANYWHERE:
        bend = (lowest + numbers[1] * (highest - lowest) - middle) / settings.flexion_sd
    pose[at] = min(max(pose[at] + settings.spread_sd * turn, LOWEST[at]), HIGHEST[at])
    for j in range(1, 4):
        pose[at + j] = min(max(pose[at + j] + settings.flexion_sd * bend, LOWEST[at + j]), HIGHEST[at + j])
    return bend, settings.flexion_sd / (highest - lowest)
