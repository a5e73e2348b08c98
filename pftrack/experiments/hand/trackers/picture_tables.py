"""What the search looks up in a picture, made once of its silhouette and protrusions."""

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from pftrack.core.geometry.polygons import row_sums
from pftrack.experiments.hand.trackers.assignment import MOST_PROTRUSIONS
from pftrack.experiments.hand.trackers.likelihood import PictureTables

__all__ = ["contour_of", "tables_of"]


def contour_of(silhouette: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the pixels (height, width) of a silhouette that have a neighbour outside it; the border has none there."""
    cross = cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3))
    inner = cv2.erode(silhouette.view(np.uint8), cross).view(np.bool_)
    return np.asarray(silhouette & ~inner, np.bool_)


def tables_of(silhouette: NDArray[np.bool_], axes: Sequence[NDArray[np.float64]]) -> PictureTables:
    """Return what is looked up in a picture.

    Args:
        silhouette: (height, width).
        axes: Of the protrusions, (k, 2) points 1 px apart from the tip on; only the longest ones are kept.
    """
    longest = sorted(range(len(axes)), key=lambda p: -len(axes[p]))[:MOST_PROTRUSIONS]
    chosen = [axes[p] for p in sorted(longest)]
    lengths = np.array([len(axis) for axis in chosen], np.int64)
    points = np.zeros((len(chosen), max(lengths, default=1), 2))
    for p, axis in enumerate(chosen):
        points[p, : len(axis)] = axis
    mask = np.ascontiguousarray(silhouette)
    return PictureTables(mask, max(int(mask.sum()), 1), row_sums(~mask), row_sums(contour_of(mask)), points, lengths)
