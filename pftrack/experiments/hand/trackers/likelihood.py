"""How well parts of a hand fit a silhouette and its protrusions (Shimada 1997, section 2.6).

A palm, and a finger that is hidden before it, must lie within the silhouette. How far they stick out of it is measured
by x_p, the area outside by the length along which it touches the silhouette: a sliver along an edge is a matter of the
step between candidates, a lump is not, though both may have the same area. A finger that is seen must have its tip, or
its last joint, where a protrusion ends, and then run along the protrusion's axis.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pftrack.core.geometry.polygons import spans, sum_within
from pftrack.core.numerics.compiled import compiled
from pftrack.experiments.hand.trackers.cells import axis_distances, cell_log_fit, farthest, tip_distances
from pftrack.experiments.hand.trackers.settings import Task

__all__ = ["PictureTables", "finger_fit", "finger_fits", "hidden_x_p", "unexplained_cost", "x_p"]

TIP = 3
"""Of the four places along a finger, from its root on."""

BOX_SHARE = 0.8
"""Of a finger's radius: half the width of the boxes that stand for a hidden one."""

EXPLAINED_SHARE, EXPLAINED_COST = 0.6, 0.1
"""What share of a protrusion a finger should explain, and what each px less costs."""


class PictureTables(NamedTuple):
    """What is looked up in a picture.

    Attributes:
        silhouette: (height, width).
        area: Of it, px, at least 1.
        outside: (height, width + 1) sums along rows of the pixels that are not in the silhouette.
        contour: (height, width + 1) the same of those in it that touch one outside.
        axes: (P, K, 2) points of the protrusions' axes, from the tip on, 1 px apart.
        lengths: (P,) how many points each has.
    """

    silhouette: NDArray[np.bool_]
    area: int
    outside: NDArray[np.int32]
    contour: NDArray[np.int32]
    axes: NDArray[np.float64]
    lengths: NDArray[np.int64]


@compiled
def x_p(polygon: NDArray[np.float64], seen: PictureTables, scale: float) -> float:
    """Return how far a convex polygon sticks out of the silhouette, in fiftieths of the palm axis (eq. 2.5).

    Args:
        polygon: (m, 2) px.
        seen: The picture.
        scale: Length of the palm axis, px.
    """
    top, firsts, lasts = spans(polygon, seen.outside.shape[0], seen.outside.shape[1] - 1)
    outside, touching = sum_within(seen.outside, top, firsts, lasts), sum_within(seen.contour, top, firsts, lasts)
    return 50.0 * outside / (scale * max(touching, 1))


@compiled
def finger_fits(
    places: NDArray[np.float64],
    moves: NDArray[np.float64],
    ideals: NDArray[np.float64],
    log_priors: NDArray[np.float64],
    count: int,
    radii: NDArray[np.float64],
    seen: PictureTables,
    task: Task,
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Return the best candidate of a finger for each protrusion, and for none.

    No term is above 0, so a candidate whose prior is already below the best score need not be looked at, nor any after
    it.

    Args:
        places: (C, 4, 3) or longer, joints and tip of every candidate, px.
        moves: (C, m, 4, 2) or longer, of each by half a step of m angles, px.
        ideals: (n,) x_p* of a hidden finger in points of the cell.
        log_priors: (C,) or longer, of the candidates, not increasing.
        count: C.
        radii: (4,) at these places, palm axes.
        seen: The picture, with P protrusions.
        task: The hand, and standard deviations and costs.

    Returns:
        (P + 1,) log scores, and the number of the candidate (P + 1,) that has each; the last of hiding.
    """
    protrusions = seen.lengths.shape[0]
    scores, chosen = np.full(protrusions + 1, -np.inf), np.zeros(protrusions + 1, np.int64)
    for p in range(protrusions + 1):
        for k in range(count):
            least = scores[p] - log_priors[k]
            if least >= 0.0:
                break
            score = log_priors[k] + finger_fit(places[k], moves[k], ideals, radii, p, seen, task, least)
            if score > scores[p]:
                scores[p], chosen[p] = score, k
    return scores, chosen


@compiled
def finger_fit(
    places: NDArray[np.float64],
    moves: NDArray[np.float64],
    ideals: NDArray[np.float64],
    radii: NDArray[np.float64],
    protrusion: int,
    seen: PictureTables,
    task: Task,
    least: float,
) -> float:
    """Return the log likelihood of a finger that a protrusion shows, or none.

    Args:
        places: (4, 3) joints and tip, px.
        moves: (m, 4, 2) of these by half a step of m angles, px; none of a hand that stands for no cell.
        ideals: (n,) x_p* of a hidden finger in points of the cell; none for no cell.
        radii: (4,) at these places, palm axes.
        protrusion: Its number; how many there are, or less than 0, for a hidden finger.
        seen: The picture.
        task: The hand, and standard deviations and costs.
        least: What is not above it is of no interest: then -inf may be returned.
    """
    if not 0 <= protrusion < seen.lengths.shape[0]:
        if -task.settings.hidden_cost <= least:
            return -np.inf
        misfit = hidden_x_p(places, radii, seen, task.scale)
        return -task.settings.hidden_cost + cell_log_fit(misfit * misfit, ideals, task.settings.hidden_fit_sd)
    axis = seen.axes[protrusion, : seen.lengths[protrusion]]
    best = -np.inf
    for end in range(TIP, task.settings.lowest_end - 1, -1):
        price = task.settings.joint_cost if end < TIP else 0.0
        across, down = axis[0, 0] - places[end, 0], axis[0, 1] - places[end, 1]
        square = across * across + down * down
        beyond = max(np.sqrt(square) - farthest(moves, end), 0.0) / task.settings.tip_sd
        if -0.5 * beyond * beyond - price <= max(best, least):
            continue
        score = cell_log_fit(square, tip_distances(moves, end), task.settings.tip_sd) - price
        if score > max(best, least):
            apart, explained = _along(places, end, axis)
            lacking = EXPLAINED_SHARE * axis.shape[0] - explained
            score += cell_log_fit(apart * apart, axis_distances(moves, places, end, explained), task.settings.axis_sd)
            best = max(best, score - EXPLAINED_COST * max(lacking, 0.0) / task.settings.unit)
    return best


@compiled
def unexplained_cost(length: int, unit: float) -> float:
    """Return what a protrusion of a length, px, costs that no finger explains."""
    nominal = length / unit
    return float(min(0.05 * nominal * np.sqrt(nominal), 30.0))


@compiled
def _along(places: NDArray[np.float64], end: int, axis: NDArray[np.float64]) -> tuple[float, float]:
    """Return the mean distance of a finger's axis from a protrusion's once their ends coincide, and over which length.

    Points at equal length from the end are compared, up to the end of the shorter axis (eq. 2.7).
    """
    across, down = axis[0, 0] - places[end, 0], axis[0, 1] - places[end, 1]
    total, count, joint, begun = 0.0, 0, end, 0.0
    while joint > 0 and count < axis.shape[0]:
        x, y = places[joint, 0] + across, places[joint, 1] + down
        over, under = places[joint - 1, 0] - places[joint, 0], places[joint - 1, 1] - places[joint, 1]
        length = np.sqrt(over * over + under * under)
        while count < axis.shape[0] and count <= begun + length:
            share = (count - begun) / length if length > 0.0 else 0.0
            right, below = x + share * over - axis[count, 0], y + share * under - axis[count, 1]
            total += np.sqrt(right * right + below * below)
            count += 1
        begun += length
        joint -= 1
    return total / max(count, 1), float(max(count - 1, 0))


@compiled
def hidden_x_p(places: NDArray[np.float64], radii: NDArray[np.float64], seen: PictureTables, scale: float) -> float:
    """Return x_p of the boxes of a finger's three phalanges together, in fiftieths of the palm axis.

    Args:
        places: (4, 3) or narrower, joints and tip, px.
        radii: (4,) at these places, palm axes.
        seen: The picture.
        scale: Length of the palm axis, px.
    """
    outside, touching = 0, 0
    box = np.empty((4, 2))
    for j in range(3):
        x, y = places[j + 1, 0] - places[j, 0], places[j + 1, 1] - places[j, 1]
        length = np.sqrt(x * x + y * y)
        across, down = (-y / length, x / length) if length > 0.0 else (1.0, 0.0)
        for corner in range(4):
            end = j if corner in (0, 3) else j + 1
            half = BOX_SHARE * radii[end] * scale
            half = half if corner < 2 else -half
            box[corner, 0], box[corner, 1] = places[end, 0] + half * across, places[end, 1] + half * down
        top, firsts, lasts = spans(box, seen.outside.shape[0], seen.outside.shape[1] - 1)
        outside += sum_within(seen.outside, top, firsts, lasts)
        touching += sum_within(seen.contour, top, firsts, lasts)
    return 50.0 * outside / (scale * max(touching, 1))
