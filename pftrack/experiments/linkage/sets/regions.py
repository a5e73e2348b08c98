"""Regions: an ellipsoid and the box of its guides; what is possible is in both.

For compiled code a region is one array (n + 3, n): the ellipsoid's centre, the low and the high guides, and the
ellipsoid's shape matrix. So it is copied, passed on and kept in one piece.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pftrack.core.numerics.matrices import solve_system
from pftrack.experiments.linkage.sets.strips import SLACK

__all__ = ["CENTRE", "HIGH", "LOW", "SHAPE", "Ways", "contains", "region_of"]

CENTRE, LOW, HIGH, SHAPE = 0, 1, 2, 3
"""Rows of a region; the shape has all from its first."""


class Ways(NamedTuple):
    """How regions are treated. Every choice but `way` keeps all points that are possible.

    Attributes:
        ellipsoids: Whether there are ellipsoids at all, or boxes alone.
        least: `strips.TRACE` or `strips.VOLUME`.
        tighten: Whether a strip is cut off at the ellipsoid first, see `strips.cut`.
        contraction: Whether every strip shrinks the guides by interval arithmetic.
        sampled: Whether guides shrink to the cells that fit the observation.
        sides: Whether the guides are strips for the ellipsoid.
        splitting: Whether cells that fall apart make regions of their own.
        way: Of prediction: `prediction.OUTER`, or one that may lose the truth.
    """

    ellipsoids: bool
    least: int
    tighten: bool
    contraction: bool
    sampled: bool
    sides: bool
    splitting: bool
    way: int


def region_of(
    low: NDArray[np.float64], high: NDArray[np.float64], shape: NDArray[np.float64] | None = None
) -> NDArray[np.float64]:
    """Return a region: a box (n,) to (n,) and an ellipsoid about its middle.

    Args:
        low: Of the guides.
        high: Of the guides.
        shape: (n, n) of the ellipsoid; by default that of the least trace around the box.
    """
    half = 0.5 * (high - low) + SLACK
    return np.vstack([0.5 * (low + high), low, high, np.diag(half * half.sum()) if shape is None else shape])


def contains(region: NDArray[np.float64], point: NDArray[np.float64], *, ellipsoids: bool = True) -> bool:
    """Return whether a point (n,) is in a region; of the ellipsoid as well as within the guides, unless told otherwise.

    A millionth of the unit, of the ellipsoid's size and of the quadratic is left to rounding; an ellipsoid that is
    flat, because something is known exactly, has an inverse by that as well.
    """
    slack = 1e-6
    if np.any(point < region[LOW] - slack) or np.any(point > region[HIGH] + slack):
        return False
    if not ellipsoids:
        return True
    off, shape = point - region[CENTRE], region[SHAPE:]
    rounding = slack * slack * max(float(np.trace(shape)), 1.0)
    return float((off * solve_system(shape + rounding * np.eye(len(off)), off)).sum()) <= 1.0 + slack
