"""Edges: the distances of an outline's points from the edges of a picture.

Edges are those of Canny's detector in the grey picture. A state is weighed by the distances from the points of its
outline to the nearest edge. Each distance is capped, so a hidden part costs little (after Isard and Blake,
"Condensation", 1998, section 5):

    log p(z | x) = -1/2 mean_k min(d_k, cap)^2 / spread^2
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Floats, check, check_picture

CANNY = (60, 120)
"""Gradients at which an edge continues, and at which one begins."""


def log_likelihood(
    image_rgb: NDArray[np.uint8], states: Floats, outline_px: Floats, spread_px: float = 3.0, cap_px: float = 10.0
) -> Floats:
    """Return log p(z | x) (N,), up to a constant, for outlines around places.

    Args:
        image_rgb: (height, width, 3).
        states: (N, d) with d >= 2; the first two numbers are the place, px.
        outline_px: (K, 2) points of the outline beside the place, px.
        spread_px: Standard deviation of a point's distance to its edge.
        cap_px: Largest distance that counts; a point outside the picture has this distance.

    Raises:
        TypeError: The picture is not an array of bytes, or the others are not arrays of real numbers.
        ValueError: An array has another shape, or the spread is not above 0.
    """
    check_picture(image_rgb)
    check(missing=True, states=(states, "N d"))
    check(places=(states[:1, :2], "1 2"), missing=True)
    check(outline_px=(outline_px, "K 2"))
    if not spread_px > 0.0:
        raise ValueError(f"the spread must be above 0 px, got {spread_px:g}")
    edges = cv2.Canny(cv2.cvtColor(image_rgb, cv2.COLOR_RGB2GRAY), *CANNY)
    away = cv2.distanceTransform(cv2.bitwise_not(edges), cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    if not edges.any():  # OpenCV does not define the distance if there is no edge
        away = np.full(edges.shape, cap_px, np.float32)
    points = np.nan_to_num(states[:, None, :2] + outline_px, nan=-1.0, posinf=-1.0, neginf=-1.0)
    columns, rows = np.rint(np.clip(points, -1.0, max(edges.shape))).astype(np.int64).transpose(2, 0, 1)
    height, width = edges.shape
    inside = (columns >= 0) & (columns < width) & (rows >= 0) & (rows < height)
    found = away[np.clip(rows, 0, height - 1), np.clip(columns, 0, width - 1)]
    distances = np.where(inside, np.minimum(found, cap_px), cap_px).astype(np.float64)
    return np.asarray(-0.5 * np.square(distances / spread_px).mean(axis=1))
