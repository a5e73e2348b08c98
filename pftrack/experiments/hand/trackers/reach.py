"""Which palms can be: those from which fingers reach all that looks like a finger (Shimada 1997, section 2.6.1).

The fingers of a palm can be within certain regions of the picture: all that they sweep within the limits of their
joints. A protrusion that lies in none of them is no finger of this palm, so the palm is refused before any finger is
tried.

Here the region of a finger is the convex hull of its joints and tips in some postures. Its joints bend alike in these,
as they do in the candidates.
"""

import numpy as np
from numpy.typing import NDArray

from pftrack.core.geometry.polygons import convex_hull, distance_to_polygon
from pftrack.core.numerics.compiled import compiled
from pftrack.experiments.hand.shape import ANGLES, joints
from pftrack.experiments.hand.trackers.candidates import HIGHEST, LOWEST
from pftrack.experiments.hand.trackers.likelihood import PictureTables
from pftrack.experiments.hand.trackers.settings import Task

__all__ = ["postures", "reaches"]

SPREADS, FLEXIONS = 3, 5
"""Postures from one limit to the other."""
MARGIN = 0.12
"""By how much a protrusion may leave a region, palm axes: hands and steps are not exact."""


@compiled
def postures(pose: NDArray[np.float64], task: Task) -> NDArray[np.float64]:
    """Return joints and tips (5, n, 2) of the fingers of a palm (25,) in postures up to their limits, px."""
    moved, points = pose.copy(), np.empty((5, 4 * SPREADS * FLEXIONS, 2))
    for posture in range(SPREADS * FLEXIONS):
        spread, flexion = posture // FLEXIONS / (SPREADS - 1), posture % FLEXIONS / (FLEXIONS - 1)
        for j in range(5, ANGLES):
            share = spread if (j - 5) % 4 == 0 else flexion
            moved[j] = LOWEST[j] + share * (HIGHEST[j] - LOWEST[j])
        places = joints(moved, task.scale, task.shape)
        for finger in range(5):
            for j in range(4):
                for k in range(2):
                    points[finger, 4 * posture + j, k] = places[finger, j, k]
    return points


@compiled
def reaches(pose: NDArray[np.float64], seen: PictureTables, task: Task) -> bool:
    """Tell whether each protrusion lies where a finger of a palm (25,) can be, from its tip to its other end."""
    points, margin = postures(pose, task), MARGIN * task.scale
    reached = np.zeros(seen.lengths.shape[0], np.bool_)
    for finger in range(5):
        region = convex_hull(points[finger])
        for p in range(reached.shape[0]):
            axis = seen.axes[p, : seen.lengths[p]]
            if not reached[p] and distance_to_polygon(axis[0], region) <= margin:
                reached[p] = distance_to_polygon(axis[-1], region) <= margin
    return bool(reached.all())
