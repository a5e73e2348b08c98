"""Sines and cosines of whole arrays, for compiled loops, to the same bits on every processor.

As with `pftrack.core.numerics.elementary`: nothing but multiplications and additions, which a compiler turns into
vector instructions. The angle less the nearest multiple of a quarter turn, in two parts so that little is lost for
large angles, goes into fdlibm's polynomials; which quarter it was says which of the two is which, and the signs.
"""

import numpy as np
from numpy.typing import NDArray

from pftrack.core.numerics.compiled import compiled

__all__ = ["sines_cosines"]

QUARTER_HIGH, QUARTER_LOW = 1.57079632673412561417e00, 6.07710050650619224932e-11
"""Half of pi: its first 33 bits, and the rest."""
ROUNDING = 1.5 * 2.0**52
"""Adding it to a small number leaves the nearest whole number in the low bits of the sum."""


@compiled
def sines_cosines(angles: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the sines (n,) and cosines (n,) of finite angles (n,), rad, of at most a million."""
    count = angles.shape[0]
    shifted = np.empty(count)
    first, second = np.empty(count), np.empty(count)
    for i in range(count):
        shifted[i] = angles[i] * 0.63661977236758134308 + ROUNDING
        whole = shifted[i] - ROUNDING
        rest = (angles[i] - whole * QUARTER_HIGH) - whole * QUARTER_LOW
        square = rest * rest
        odd = square * (-2.50507602534068634195e-08 + square * 1.58969099521155010221e-10)
        odd = square * (-1.98412698298579493134e-04 + square * (2.75573137070700676789e-06 + odd))
        odd = square * (-1.66666666666666324348e-01 + square * (8.33333333332248946124e-03 + odd))
        first[i] = rest + rest * odd
        even = square * (2.08757232129817482790e-09 + square * -1.13596475577881948265e-11)
        even = square * (2.48015872894767294178e-05 + square * (-2.75573143513906633035e-07 + even))
        even = square * square * (4.16666666666666019037e-02 + square * (-1.38888888888741095749e-03 + even))
        second[i] = 1.0 - (0.5 * square - even)
    quarters = shifted.view(np.int64)
    sines, cosines = np.empty(count), np.empty(count)
    for i in range(count):
        turned = (quarters[i] & 1) != 0
        sine = second[i] if turned else first[i]
        cosine = first[i] if turned else second[i]
        sines[i] = -sine if quarters[i] & 2 else sine
        cosines[i] = -cosine if (quarters[i] + 1) & 2 else cosine
    return sines, cosines
