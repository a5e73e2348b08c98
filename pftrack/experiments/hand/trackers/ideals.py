"""How far the palm and hidden fingers of a right hand stick out of its silhouette, since they stand on a grid.

That is x_p* of `cells`. The hand of a prediction is drawn, and palm and fingers that are half a step away are laid over
it. As in the source, the values between are interpolated, here evenly from 0 at the prediction (Shimada 1997, 2.6.4).
"""

import numpy as np
from numpy.typing import NDArray

from pftrack.core.geometry.polygons import convex_hull, fill
from pftrack.core.numerics.compiled import compiled
from pftrack.experiments.hand.shape import joints, palm_points, parts
from pftrack.experiments.hand.trackers.candidates import HIGHEST, LOWEST, half_steps
from pftrack.experiments.hand.trackers.cells import CELL_ANGLES, NODES
from pftrack.experiments.hand.trackers.likelihood import PictureTables, hidden_x_p, x_p
from pftrack.experiments.hand.trackers.picture_tables import tables_of
from pftrack.experiments.hand.trackers.settings import Task

__all__ = ["ideal_x_p", "ideals_of"]


@compiled
def ideal_x_p(predicted: NDArray[np.float64], drawn: PictureTables, task: Task) -> NDArray[np.float64]:
    """Return x_p* (6, n) in points of the cell: of the palm, and of each finger if it is hidden.

    Args:
        predicted: (25,) pose.
        drawn: The silhouette of its hand.
        task: The hand, and how it is looked for.
    """
    halves = half_steps(predicted, task)
    ways = np.zeros((6, CELL_ANGLES, 2))
    for i in range(CELL_ANGLES):
        for way in range(2):
            sign = 1.0 if way else -1.0
            moved = predicted.copy()
            if i < 3:
                moved[2 + i] += sign * halves[0, i]
                palm = convex_hull(palm_points(moved, task.scale, task.shape))
                ways[0, i, way] = x_p(palm, drawn, task.scale)
            else:
                for finger in range(5):
                    at, last = (5, 6) if i == 3 else (6, 9)
                    for j in range(4 * finger + at, 4 * finger + last):
                        moved[j] = min(max(moved[j] + sign * halves[finger, i], LOWEST[j]), HIGHEST[j])
            places = joints(moved, task.scale, task.shape)
            for finger in range(5):
                ways[1 + finger, i, way] = hidden_x_p(places[finger], task.shape.radii[finger], drawn, task.scale)
    found = np.zeros((6, NODES.shape[0]))
    for part in range(6):
        for n in range(NODES.shape[0]):
            for i in range(CELL_ANGLES):
                found[part, n] += abs(NODES[n, i]) * ways[part, i, 1 if NODES[n, i] > 0.0 else 0]
    return found


def ideals_of(predictions: NDArray[np.float64], seen: PictureTables, task: Task) -> NDArray[np.float64]:
    """Return x_p* (I, 6, n) around predictions (I, 25); (I, 6, 0) if hands stand for no cells."""
    if not task.settings.cells:
        return np.empty((len(predictions), 6, 0))
    height, width = seen.silhouette.shape
    drawn = [tables_of(fill(*parts(pose, task.scale, task.shape), height, width), []) for pose in predictions]
    return np.array([ideal_x_p(pose, tables, task) for pose, tables in zip(predictions, drawn, strict=True)])
