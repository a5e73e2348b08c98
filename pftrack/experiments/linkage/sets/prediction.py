"""An ellipsoid after a bounded motion: an outer bound of the sum of two sets, and two constructions that are none.

The sum of an ellipsoid and a ball is no ellipsoid. For every p > 0, (1 + 1/p) P + (1 + p) U contains it, where U is
the ball's shape, and p = sqrt(tr P / tr U) has the least trace (Kurzhanski and Valyi 1997). Shimada
prints P + du I, which is not even of one unit, and describes in words the ellipsoid whose semi-axes are each longer
by du, which touches the sum on the axes and lies inside it elsewhere. They are here for what they lose.

Source: Shimada 1997, section 5.3, eq. 5.31, corrected (docs/methods/linkages.md).
"""

import numpy as np
from numpy.typing import NDArray

from pftrack.core.numerics.compiled import compiled
from pftrack.core.numerics.singular import orthogonalise

__all__ = ["LENGTHENED", "OUTER", "PRINTED", "predict"]

OUTER, LENGTHENED, PRINTED = 0, 1, 2
"""The bound that holds; every semi-axis longer by du, as the source's words say; P + du I, as it is printed."""

FLOOR, RELATIVE_FLOOR = 1e-12, 1e-12
"""Added to all squared semi-axes, absolutely and relative to their mean, which keeps them positive for ever."""


@compiled
def predict(shape: NDArray[np.float64], moved: int, radius: float, way: int) -> None:
    """Add a motion to an ellipsoid, in place.

    Args:
        shape: P, (n, n).
        moved: The motion is in the first so many coordinates.
        radius: Of the ball of all motions, in the unit of the coordinates.
        way: `OUTER`, `LENGTHENED` or `PRINTED`; the last two change all coordinates, as the source has it.
    """
    size = shape.shape[0]
    trace = 0.0
    for i in range(size):
        trace += shape[i, i]
    if way == PRINTED:
        for i in range(size):
            shape[i, i] += radius
    elif way == LENGTHENED:
        _lengthen(shape, radius)
    elif radius > 0.0:
        ratio = np.sqrt(max(trace, 0.0) / (moved * radius * radius))
        for i in range(size):
            for j in range(size):
                # No ratio: a point, which becomes the ball.
                shape[i, j] *= 1.0 + 1.0 / ratio if ratio > 0.0 else 1.0
        for i in range(moved):
            shape[i, i] += (1.0 + ratio) * radius * radius
    for i in range(size):
        shape[i, i] += FLOOR + RELATIVE_FLOOR * max(trace, 0.0) / size


@compiled
def _lengthen(shape: NDArray[np.float64], radius: float) -> None:
    """Make every semi-axis longer by the radius, in place."""
    size = shape.shape[0]
    scaled, axes = orthogonalise(shape)
    for i in range(size):
        for j in range(size):
            shape[i, j] = 0.0
    for k in range(size):
        square = 0.0
        for i in range(size):
            square += scaled[k, i] * axes[k, i]
        half = np.sqrt(max(square, 0.0)) + radius
        for i in range(size):
            for j in range(size):
                shape[i, j] += half * half * axes[k, i] * axes[k, j]
