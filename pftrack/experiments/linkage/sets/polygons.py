"""Where a point of the picture can be that lies in several strips: a convex polygon, cut from a square by each side."""

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

__all__ = ["FAR_PX", "Strip", "extent", "intersect"]

FAR_PX = 1e6
"""Half the side of the square that stands for the plane."""

SLACK_PX = 1e-6
"""By how much strips are widened, so that rounding loses nothing."""

Strip: TypeAlias = tuple[NDArray[np.float64], float, float]
"""(n, low, high) of low <= n . p <= high, with n (2,) a unit vector."""


def intersect(strips: list[Strip]) -> NDArray[np.float64]:
    """Return the corners (k, 2) of all that is in every strip and in the square; none if nothing is."""
    corners = FAR_PX * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    for normal, low, high in strips:
        corners = _cut(corners, normal, high + SLACK_PX)
        corners = _cut(corners, -normal, SLACK_PX - low)
    return corners


def extent(corners: NDArray[np.float64], direction: NDArray[np.float64]) -> tuple[float, float]:
    """Return the least and the greatest of direction . p over a polygon; infinite both where it has no end on a side.

    Args:
        corners: (k, 2), at least one.
        direction: (2,) unit vector.
    """
    along = (corners * direction).sum(axis=1)
    low, high = float(along.min()), float(along.max())
    return (low, high) if max(-low, high) < 0.5 * FAR_PX else (-np.inf, np.inf)


def _cut(corners: NDArray[np.float64], normal: NDArray[np.float64], limit: float) -> NDArray[np.float64]:
    """Return the corners of the part of a convex polygon in which n . p <= limit (Sutherland and Hodgman 1974)."""
    beyond = (corners * normal).sum(axis=1) - limit
    kept: list[NDArray[np.float64]] = []
    for k in range(len(corners)):
        one, other = beyond[k - 1], beyond[k]
        if (one > 0.0) != (other > 0.0):
            kept.append(corners[k - 1] + one / (one - other) * (corners[k] - corners[k - 1]))
        if other <= 0.0:
            kept.append(corners[k])
    return np.array(kept).reshape(-1, 2)
