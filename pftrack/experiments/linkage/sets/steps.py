"""What is done to a region of anything: let it move, cut it by strips, let its two parts bound each other.

All work in place and return whether anything is left.
"""

import numpy as np
from numpy.typing import NDArray

from pftrack.core.numerics.compiled import compiled
from pftrack.experiments.linkage.sets.guides import circumscribe, contract, cut_by_guides, shrink_to_extent
from pftrack.experiments.linkage.sets.prediction import predict
from pftrack.experiments.linkage.sets.regions import CENTRE, HIGH, LOW, SHAPE, Ways
from pftrack.experiments.linkage.sets.strips import cut

__all__ = ["apply_strip", "constrain", "move", "settle"]


@compiled
def apply_strip(
    region: NDArray[np.float64], normal: NDArray[np.float64], least: float, most: float, ways: Ways
) -> bool:
    """Cut a region (n + 3, n) by the strip least <= m'x <= most."""
    if ways.contraction and not contract(region[LOW], region[HIGH], normal, least, most):
        return False
    return not ways.ellipsoids or cut(
        region[CENTRE],
        region[SHAPE:],
        normal,
        0.5 * (least + most),
        0.5 * (most - least),
        ways.least,
        ways.tighten,
    )


@compiled
def settle(region: NDArray[np.float64], ways: Ways) -> bool:
    """Let guides and ellipsoid bound each other."""
    if not ways.ellipsoids:
        return True
    low, high, centre, shape = region[LOW], region[HIGH], region[CENTRE], region[SHAPE:]
    if not shrink_to_extent(low, high, centre, shape):
        return False
    if not ways.sides:
        return True
    return cut_by_guides(low, high, centre, shape, ways.least, ways.tighten) and shrink_to_extent(
        low, high, centre, shape
    )


@compiled
def move(region: NDArray[np.float64], moved: int, radius: float, ways: Ways) -> None:
    """Let the first so many coordinates move, all together by at most a radius; the guides each by as much."""
    low, high = region[LOW], region[HIGH]
    for j in range(moved):
        low[j] -= radius
        high[j] += radius
    if ways.ellipsoids:
        predict(region[SHAPE:], moved, radius, ways.way)
        if ways.sides and not settle(region, ways):
            # What has moved is not empty: they are apart by rounding alone.
            circumscribe(low, high, region[CENTRE], region[SHAPE:])


@compiled
def constrain(
    region: NDArray[np.float64],
    rows: NDArray[np.float64],
    least: NDArray[np.float64],
    most: NDArray[np.float64],
    ways: Ways,
) -> bool:
    """Cut a region by all of least <= A x <= most.

    Args:
        region: (n + 3, n).
        rows: A, (m, n).
        least: (m,), -inf for a row with one side only.
        most: (m,), inf for a row with one side only.
        ways: How.
    """
    for row in range(rows.shape[0]):
        low, high = least[row], most[row]
        if low == -np.inf or high == np.inf:
            # The side that is missing is where the guides end.
            lowest, highest = 0.0, 0.0
            for j in range(region.shape[1]):
                one, other = rows[row, j] * region[LOW, j], rows[row, j] * region[HIGH, j]
                lowest += min(one, other)
                highest += max(one, other)
            low, high = max(low, min(lowest, high)), min(high, max(highest, low))
        if not apply_strip(region, rows[row], low, high, ways):
            return False
    return settle(region, ways)
