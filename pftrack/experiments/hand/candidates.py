"""Candidates of palms and fingers, and the assignment of fingers to protrusions (Shimada 1997, sections 2.5 and 2.6.2).

The size of an angle's step depends on its effect on the silhouette: D = closed integral of |v n| ds over the contour of
the turning part, v being the velocity of a point for a turn of 1 rad per unit of time and n the contour's normal (eq.
2.3). Then S_c / D is the angle that changes an area of S_c. Where a turn hardly shows, as for a finger that points to
the camera's side, steps are large; where it shows clearly, they are small.
"""

import numpy as np

from pftrack.core.arrays import Floats, Ints
from pftrack.core.geometry import convex_hull
from pftrack.core.numerics.compiled import compiled
from pftrack.experiments.hand.model import SPREAD_SD, TILT_SD, TURN_SD, Task
from pftrack.experiments.hand.shape import HIGH, LOW, HandShape, joints, palm_points

SMALL = 1e-6
"""A turn whose change of places gives velocities, rad."""

PALM_STEPS = 2, 3, 2
"""Steps of a, b and c to either side."""
PALMS = 175
"""Number of candidates from these steps."""
PALM_AREAS, MOST_PALM_STEP = 3.0, 0.22
"""Share of S_c that a palm's step changes; and its largest size, rad."""

FLEXION_REACH, LEAST_STEP, MOST_STEP = 1.1, 0.10, 0.30
"""Range of a finger's candidates about the prediction, and the bounds of its steps, rad."""
SPREAD_STEP, SPREADS = 0.07, 5
FLEXED = 1.5
"""Angle of all three joints of a fully bent finger, rad; its limits may reduce some."""

LOWEST, HIGHEST = np.maximum(LOW, -1e9), np.minimum(HIGH, 1e9)


@compiled
def _crossing(first: float, second: float) -> float:
    """Return the mean of |x| while x goes evenly from one value to another."""
    if first * second >= 0.0:
        return 0.5 * abs(first + second)
    return 0.5 * (first * first + second * second) / (abs(first) + abs(second))


@compiled
def chain_rate(places: Floats, velocities: Floats, tip_radius: float) -> float:
    """Return D of a chain of capsules that turns about its root, px^2/rad.

    Its contour consists of two sides of each segment and the cap of the last. Thicknesses of the sides cancel, since a
    point of a side moves along the normal like the point of the axis.

    Args:
        places: (n, 2) or wider, positions of the joints and the tip, px.
        velocities: (n, 2) or wider, their velocities, px/rad.
        tip_radius: Radius of the cap, px.
    """
    rate = 0.0
    last = places.shape[0] - 1
    for j in range(last):
        x, y = places[j + 1, 0] - places[j, 0], places[j + 1, 1] - places[j, 1]
        # |v n| ds, with the normal not yet divided by the length that ds brings along
        first = velocities[j, 1] * x - velocities[j, 0] * y
        second = velocities[j + 1, 1] * x - velocities[j + 1, 0] * y
        rate += 2.0 * _crossing(first, second)
    x, y = velocities[last, 0], velocities[last, 1]
    return float(rate + 2.0 * tip_radius * np.sqrt(x * x + y * y))


@compiled
def contour_rate(points: Floats, velocities: Floats) -> float:
    """Return D of the convex hull of points that turn, px^2/rad.

    Args:
        points: (n, 2) px.
        velocities: (n, 2) px/rad.
    """
    hull = convex_hull(points)
    corners = np.empty(hull.shape[0], np.int64)
    for h in range(hull.shape[0]):
        for n in range(points.shape[0]):
            if points[n, 0] == hull[h, 0] and points[n, 1] == hull[h, 1]:
                corners[h] = n
    rate = 0.0
    for h in range(corners.shape[0]):
        i, j = corners[h], corners[(h + 1) % corners.shape[0]]
        x, y = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1]
        rate += _crossing(velocities[i, 1] * x - velocities[i, 0] * y, velocities[j, 1] * x - velocities[j, 0] * y)
    return rate


@compiled
def _velocities(places: Floats, moved: Floats) -> Floats:
    """Return the velocities of the places (5, 4, 3) of fingers per radian of a small turn."""
    # Written as loops, since expressions of whole arrays take many times as long to compile.
    found = np.empty((5, 4, 3))
    for finger in range(5):
        for j in range(4):
            for i in range(3):
                found[finger, j, i] = (moved[finger, j, i] - places[finger, j, i]) / SMALL
    return found


@compiled
def flexion_rates(pose: Floats, scale: float, shape: HandShape) -> Floats:
    """Return D (5,) of each finger for a turn about its first joint, px^2/rad.

    Args:
        pose: (25,).
        scale: Length of the palm axis, px.
        shape: Shape of the hand.
    """
    moved = pose.copy()
    for finger in range(5):
        moved[6 + 4 * finger] += SMALL
    places = joints(pose, scale, shape)
    velocities = _velocities(places, joints(moved, scale, shape))
    rates = np.empty(5)
    for finger in range(5):
        rates[finger] = chain_rate(places[finger], velocities[finger], scale * shape.radii[finger, 3])
    return rates


@compiled
def palm_rates(pose: Floats, scale: float, shape: HandShape) -> Floats:
    """Return D (3,) of the palm's angles a, b and c, px^2/rad; the palm turns with all fingers.

    Args:
        pose: (25,).
        scale: Length of the palm axis, px.
        shape: Shape of the hand.
    """
    points, places = palm_points(pose, scale, shape), joints(pose, scale, shape)
    rates = np.empty(3)
    for i in range(3):
        moved = pose.copy()
        moved[2 + i] += SMALL
        turned = palm_points(moved, scale, shape)
        for n in range(turned.shape[0]):
            turned[n, 0], turned[n, 1] = (turned[n, 0] - points[n, 0]) / SMALL, (turned[n, 1] - points[n, 1]) / SMALL
        rates[i] = contour_rate(points, turned)
        velocities = _velocities(places, joints(moved, scale, shape))
        for finger in range(5):
            rates[i] += chain_rate(places[finger], velocities[finger], scale * shape.radii[finger, 3])
    return rates


@compiled
def finger_candidates(predicted: Floats, task: Task) -> tuple[Floats, Floats, Ints]:
    """Return angles and log priors of every finger's candidates, the most probable first.

    The three joints of a finger bend alike; the prediction itself and the extreme far from it are also tried.

    Args:
        predicted: (25,) pose.
        task: The hand, steps and standard deviations.

    Returns:
        (5, C, 4) spread and three flexions, (5, C) log priors, and the number (5,) of candidates per finger.
    """
    most = SPREADS * (2 * int(FLEXION_REACH / LEAST_STEP) + 3)
    angles, log_priors, counts = np.zeros((5, most, 4)), np.zeros((5, most)), np.zeros(5, np.int64)
    rates = flexion_rates(predicted, task.scale, task.shape)
    for finger in range(5):
        at = 5 + 4 * finger
        bent, off = _flexions(predicted, finger, rates[finger], task)
        for i in range(off.shape[0]):
            for s in range(SPREADS):
                spread = predicted[at] + (s - SPREADS // 2) * SPREAD_STEP
                if spread < LOWEST[at] or spread > HIGHEST[at]:
                    continue
                bend, turn = off[i] / task.settings.flexion_sd, (spread - predicted[at]) / SPREAD_SD
                prior = -0.5 * (bend * bend + turn * turn)
                place = counts[finger]
                while place > 0 and log_priors[finger, place - 1] < prior:
                    log_priors[finger, place] = log_priors[finger, place - 1]
                    for j in range(4):
                        angles[finger, place, j] = angles[finger, place - 1, j]
                    place -= 1
                log_priors[finger, place], angles[finger, place, 0] = prior, spread
                for j in range(3):
                    angles[finger, place, 1 + j] = bent[i, j]
                counts[finger] += 1
    return angles, log_priors, counts


@compiled
def half_steps(predicted: Floats, task: Task) -> Floats:
    """Return half the steps (5, 5) around a prediction, rad: for each finger of a, b, c, its spread and flexion.

    Args:
        predicted: (25,) pose.
        task: The hand, and the settings of the search.
    """
    palm, rates = _palm_steps(predicted, task), flexion_rates(predicted, task.scale, task.shape)
    halves = np.empty((5, 5))
    for finger in range(5):
        for i in range(3):
            halves[finger, i] = 0.5 * palm[i]
        halves[finger, 3] = 0.5 * SPREAD_STEP
        halves[finger, 4] = 0.5 * _flexion_step(rates[finger], task)
    return halves


@compiled
def _palm_steps(predicted: Floats, task: Task) -> Floats:
    """Return the steps (3,) of a, b and c around a prediction (25,), rad."""
    steps = palm_rates(predicted, task.scale, task.shape)
    for i in range(3):
        steps[i] = min(PALM_AREAS * task.settings.step_area / max(steps[i], 1e-9), MOST_PALM_STEP)
    return steps


@compiled
def _flexion_step(rate: float, task: Task) -> float:
    """Return the step of a finger's flexion whose D is `rate`, rad."""
    return min(max(task.settings.step_area / max(rate, 1e-9), LEAST_STEP), MOST_STEP)


@compiled
def flexion_limits(finger: int) -> tuple[float, float]:
    """Return the range of angles of a finger's joints if not all of them can bend fully, rad."""
    at = 6 + 4 * finger
    lowest = min(LOWEST[at], LOWEST[at + 1], LOWEST[at + 2])
    highest = max(HIGHEST[at], HIGHEST[at + 1], HIGHEST[at + 2])
    return lowest, min(highest, FLEXED)


@compiled
def _flexions(predicted: Floats, finger: int, rate: float, task: Task) -> tuple[Floats, Floats]:
    """Return the tried flexions (C, 3) of a finger, and their distances from the prediction (C,), rad."""
    at = 6 + 4 * finger
    middle = (predicted[at] + predicted[at + 1] + predicted[at + 2]) / 3.0
    lowest, highest = flexion_limits(finger)
    step = _flexion_step(rate, task)
    steps = int(FLEXION_REACH / step)
    bent, off = np.empty((2 * steps + 3, 3)), np.empty(2 * steps + 3)
    bent[0, 0], bent[0, 1], bent[0, 2], off[0] = predicted[at], predicted[at + 1], predicted[at + 2], 0.0
    extreme = highest if middle < 0.5 * (lowest + highest) else lowest
    found = 1
    for i in range(-steps - 1, steps + 1):
        flexion = extreme if i == -steps - 1 else middle + i * step
        if lowest <= flexion <= highest:
            for j in range(3):
                bent[found, j] = min(max(flexion, LOWEST[at + j]), HIGHEST[at + j])
            off[found] = flexion - middle
            found += 1
    return bent[:found], off[:found]


@compiled
def palm_candidates(predicted: Floats, task: Task) -> tuple[Floats, Floats]:
    """Return poses (C, 25) whose palms are around a prediction, and log priors (C,) of the palms.

    Args:
        predicted: (25,) pose.
        task: The hand, steps and standard deviations.
    """
    steps = _palm_steps(predicted, task)
    counts = 2 * PALM_STEPS[0] + 1, 2 * PALM_STEPS[1] + 1, 2 * PALM_STEPS[2] + 1
    poses, log_priors = np.empty((PALMS, 25)), np.empty(PALMS)
    found = 0
    for i in range(counts[0]):
        for j in range(counts[1]):
            for k in range(counts[2]):
                a, b, c = (i - PALM_STEPS[0]) * steps[0], (j - PALM_STEPS[1]) * steps[1], (k - PALM_STEPS[2]) * steps[2]
                pose = poses[found]
                for n in range(25):
                    pose[n] = predicted[n]
                pose[2], pose[3], pose[4] = predicted[2] + a, predicted[3] + b, predicted[4] + c
                if abs(pose[3]) > HIGHEST[3] or abs(pose[4]) > HIGHEST[4]:
                    continue
                turn, tilt = TURN_SD, TILT_SD
                log_priors[found] = -0.5 * (a * a / (turn * turn) + b * b / (tilt * tilt) + c * c / (turn * turn))
                log_priors[found] -= 0.5 * pose[4] * pose[4] / (task.settings.straight_sd * task.settings.straight_sd)
                found += 1
    return poses[:found], log_priors[:found]


# Shimada 1997, section 2.6.2, assigns greedily and repairs. With five fingers and some protrusions an exact search is
# feasible: a table over the sets of used protrusions, finger by finger, holds the best assignment of each.

HIDDEN = -1
"""Used instead of a protrusion's number."""

MOST_PROTRUSIONS = 8
"""Number of assigned fingers; a hand has five."""


@compiled
def assign(scores: Floats, costs: Floats) -> tuple[float, Ints]:
    """Return the greatest sum of scores that an assignment has, and its protrusion (F,) for each finger, or HIDDEN.

    Args:
        scores: (F, P + 1) scores of each finger with each protrusion, and hidden in the last column.
        costs: (P,) of protrusions that no finger explains.
    """
    fingers, protrusions = scores.shape[0], costs.shape[0]
    sets = 1 << protrusions
    best = np.full((fingers + 1, sets), -np.inf)
    taken = np.full((fingers, sets), HIDDEN)
    best[0, 0] = 0.0
    for finger in range(fingers):
        for before in range(sets):
            for p in range(protrusions + 1):
                after = before | (1 << p) if p < protrusions else before
                score = best[finger, before] + scores[finger, p]
                free = after != before or p == protrusions
                if free and score > best[finger + 1, after]:
                    best[finger + 1, after] = score
                    taken[finger, after] = p if p < protrusions else HIDDEN
    greatest, last = -np.inf, 0
    for after in range(sets):
        score = best[fingers, after]
        for p in range(protrusions):
            score -= 0.0 if after & (1 << p) else costs[p]
        if score > greatest:
            greatest, last = score, after
    return greatest, _trace_back(taken, last)


@compiled
def _trace_back(taken: Ints, last: int) -> Ints:
    """Return the protrusion (F,) of each finger that led to a set of used ones."""
    chosen = np.empty(taken.shape[0], np.int64)
    for finger in range(taken.shape[0] - 1, -1, -1):
        chosen[finger] = taken[finger, last]
        if chosen[finger] != HIDDEN:
            last ^= 1 << chosen[finger]
    return chosen
