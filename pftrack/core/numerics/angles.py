"""Angles: the same after a whole turn, so that a difference or a mean of them is taken on the circle.

`wrap` is for arrays outside of compiled loops, `direction` for one vector there; `less_turns` and `circular_mean`
are for inside.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pftrack.core.numerics.compiled import compiled
from pftrack.core.numerics.sums import inner_product
from pftrack.core.numerics.trigonometry import sines_cosines

__all__ = ["circular_mean", "direction", "less_turns", "wrap"]


def wrap(angle_rad: ArrayLike) -> NDArray[np.float64]:
    """Return angles of any shape, brought into (-pi, pi] by whole turns; differences of angles are errors only so."""
    turned = np.pi - np.mod(np.pi - np.asarray(angle_rad, dtype=np.float64), 2.0 * np.pi)
    # Just above half a turn the remainder rounds up to a whole one.
    return np.where(turned <= -np.pi, np.pi, turned)


@compiled
def less_turns(angle_rad: float) -> float:
    """Return an angle within half a turn of 0, by whole turns."""
    return float(angle_rad - 2.0 * np.pi * np.floor(angle_rad / (2.0 * np.pi) + 0.5))


@compiled
def circular_mean(angles_rad: NDArray[np.float64], weights: NDArray[np.float64]) -> float:
    """Return the direction of the weighted sum of unit vectors, within half a turn of 0.

    Args:
        angles_rad: (n,), together in memory.
        weights: (n,).
    """
    sines, cosines = sines_cosines(angles_rad)
    return float(np.arctan2(inner_product(weights, sines), inner_product(weights, cosines)))


@compiled
def direction(across: float, along: float) -> float:
    """Return the angle of a vector (x, y), within half a turn of 0."""
    return float(np.arctan2(along, across))
