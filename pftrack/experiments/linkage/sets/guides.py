"""Guides: a box around an ellipsoid, which keeps what the ellipsoid cannot.

An ellipsoid that contains a cut ellipsoid contains more than that, so a bound that was known gets lost in it again. A
box beside it does not forget: a bound of one coordinate, once proved, holds until that coordinate moves. Every strip
bounds each coordinate by where the others can be (interval contraction), and every side of the box is a strip for the
ellipsoid. Each of these steps keeps all points of the true intersection, in any order and however often.

Source: Shimada 1997, section 5.1; eqs. 5.17 and 5.18 are `shrink_to_extent`, the others are added.
"""

import numpy as np
from numpy.typing import NDArray

from pftrack.core.numerics.compiled import compiled
from pftrack.experiments.linkage.sets.strips import SLACK, cut_along

__all__ = ["circumscribe", "contract", "cut_by_guides", "shrink_to_extent"]


@compiled
def contract(
    low: NDArray[np.float64], high: NDArray[np.float64], normal: NDArray[np.float64], least: float, most: float
) -> bool:
    """Shrink a box, in place, to what a strip leaves of it: each coordinate by the extremes of the others.

    Args:
        low: (n,) of the box.
        high: (n,) of the box.
        normal: m, (n,), of the strip least <= m'x <= most.
        least: Its one side.
        most: Its other side.

    Returns:
        Whether anything is left.
    """
    size = low.shape[0]
    lowest, highest = 0.0, 0.0
    for j in range(size):
        factor = normal[j]
        if factor > 0.0:
            lowest += factor * low[j]
            highest += factor * high[j]
        elif factor < 0.0:
            lowest += factor * high[j]
            highest += factor * low[j]
    slack = SLACK * (1.0 + 1e-3 * max(abs(lowest), abs(highest)))
    if lowest > most + slack or highest < least - slack:
        return False
    for j in range(size):
        factor = normal[j]
        if factor == 0.0:
            continue
        own_low, own_high = (low[j], high[j]) if factor > 0.0 else (high[j], low[j])
        one = (least - (highest - factor * own_high)) / factor
        other = (most - (lowest - factor * own_low)) / factor
        room = slack / abs(factor)
        low[j] = max(low[j], min(one, other) - room)
        high[j] = min(high[j], max(one, other) + room)
        if low[j] > high[j]:
            return False
    return True


@compiled
def shrink_to_extent(
    low: NDArray[np.float64], high: NDArray[np.float64], centre: NDArray[np.float64], shape: NDArray[np.float64]
) -> bool:
    """Shrink a box, in place, to the ellipsoid's extent along each axis; return whether anything is left."""
    for j in range(low.shape[0]):
        half = np.sqrt(max(shape[j, j], 0.0)) + SLACK
        low[j] = max(low[j], centre[j] - half)
        high[j] = min(high[j], centre[j] + half)
        if low[j] > high[j]:
            return False
    return True


@compiled
def cut_by_guides(
    low: NDArray[np.float64],
    high: NDArray[np.float64],
    centre: NDArray[np.float64],
    shape: NDArray[np.float64],
    least: int,
    tighten: bool,
) -> bool:
    """Cut the ellipsoid, in place, by each pair of the box's sides; return whether they have a point in common."""
    left = True
    for j in range(low.shape[0]):
        left = left and cut_along(centre, shape, j, low[j], high[j], least, tighten)
    return left


@compiled
def circumscribe(
    low: NDArray[np.float64], high: NDArray[np.float64], centre: NDArray[np.float64], shape: NDArray[np.float64]
) -> None:
    """Put in place the ellipsoid of the least trace around a box: its squared semi-axes are h_j sum(h)."""
    size = low.shape[0]
    total = 0.0
    for j in range(size):
        total += 0.5 * (high[j] - low[j]) + SLACK
    for j in range(size):
        for k in range(size):
            shape[j, k] = 0.0
        centre[j] = 0.5 * (low[j] + high[j])
        shape[j, j] = (0.5 * (high[j] - low[j]) + SLACK) * total
