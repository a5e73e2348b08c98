"""Exponentials, logarithms, sines and cosines of whole arrays, in compiled loops and outside; angles on the circle.

A compiled loop calls the C library's `exp` once per element; these functions handle eight elements at a time, because
they use only multiplications and additions, which a compiler turns into vector instructions. Weights and likelihoods
consist mostly of them, so a filter's step becomes three times faster. The results are within one unit in the last place
of the correctly rounded ones, and the same on every processor.

NumPy's own functions differ by processor in the last place, so `exponential`, `logarithm` and `power` do the same
outside of compiled loops.

The argument is split into a power of two, written straight into the bits of the number, and a small rest, for which a
short polynomial is exact to double precision. Polynomials: W. Cody and W. Waite 1980, with the coefficients of fdlibm.
"""

import numpy as np
from numpy.typing import ArrayLike

from pftrack.core.arrays import Floats
from pftrack.core.numerics.compiled import compiled
from pftrack.core.numerics.matrices import inner_product

LN2_HIGH, LN2_LOW = 6.93147180369123816490e-01, 1.90821492927058770002e-10
ROUNDING = 1.5 * 2.0**52
"""Adding it to a small number leaves the nearest whole number in the low bits of the sum."""

LEAST, GREATEST = -745.0, 709.0
SMALLEST_NORMAL = 2.0**-1022
SQRT_HALF_BITS = 0x3FE6A09E667F3BCD


def exponential(values: ArrayLike) -> Floats:
    """Return e^x of an array of any shape, as `exponentials` has it."""
    return exponentials(np.array(values, np.float64).ravel()).reshape(np.shape(values))


def logarithm(values: ArrayLike) -> Floats:
    """Return ln x of an array of any shape, as `logarithms` has it."""
    return logarithms(np.array(values, np.float64).ravel()).reshape(np.shape(values))


def power(values: ArrayLike, exponent: float) -> Floats:
    """Return x^p of an array of any shape, not negative, for a positive p."""
    return np.where(np.equal(values, 0.0), 0.0, exponential(exponent * logarithm(values)))


@compiled
def exponentials(values: Floats) -> Floats:
    """Return e^x of (n,) values; below -745 it is 0, above 709 it stays at e^709, and of NaN it is 0."""
    count = values.shape[0]
    results = np.empty(count)
    powers = np.empty(count)
    for i in range(count):
        value = min(max(values[i], LEAST), GREATEST)
        power = value * 1.44269504088896338700 + ROUNDING
        whole = power - ROUNDING
        high = value - whole * LN2_HIGH
        low = whole * LN2_LOW
        rest = high - low
        square = rest * rest
        even = square * (-1.65339022054652515390e-06 + square * 4.13813679705723846039e-08)
        even = square * (-2.77777777770155933842e-03 + square * (6.61375632143793436117e-05 + even))
        even = rest - square * (1.66666666666666019037e-01 + even)
        results[i] = 1.0 - ((low - (rest * even) / (2.0 - even)) - high)
        powers[i] = power
    bits = powers.view(np.int64)
    halves = np.empty(count, np.int64)
    others = np.empty(count, np.int64)
    for i in range(count):
        # Two factors are used, since the power itself may be too small for a normal number. Signed shifts use 32 bits,
        # since AVX2 has none for 64.
        exponent = np.int32(bits[i])
        half = np.int32(exponent >> 1)
        halves[i] = (np.int64(half) + 1023) << 52
        others[i] = (np.int64(np.int32(exponent - half)) + 1023) << 52
    first, second = halves.view(np.float64), others.view(np.float64)
    for i in range(count):
        results[i] = results[i] * first[i] * second[i] if values[i] > LEAST else 0.0
    return results


@compiled
def logarithms(values: Floats) -> Floats:
    """Return ln x of (n,) finite values above 0; smaller values, including 0, count as 2^-1022."""
    count = values.shape[0]
    normal = np.empty(count)
    for i in range(count):
        normal[i] = max(values[i], SMALLEST_NORMAL)
    bits = normal.view(np.int64)
    mantissas = np.empty(count, np.int64)
    results = np.empty(count)
    for i in range(count):
        # The mantissa between sqrt(1/2) and sqrt(2), where the series is shortest.
        offset = bits[i] - SQRT_HALF_BITS
        results[i] = float(np.int32(np.int32(offset >> 32) >> 20))
        mantissas[i] = (offset & 0xFFFFFFFFFFFFF) + SQRT_HALF_BITS
    reduced = mantissas.view(np.float64)
    for i in range(count):
        fraction = reduced[i] - 1.0
        ratio = fraction / (2.0 + fraction)
        square = ratio * ratio
        series = square * (1.531383769920937332e-01 + square * 1.479819860511658591e-01)
        series = square * (2.222219843214978396e-01 + square * (1.818357216161805012e-01 + series))
        series = square * (3.999999999940941908e-01 + square * (2.857142874366239149e-01 + series))
        series = square * (6.666666666666735130e-01 + series)
        half = 0.5 * fraction * fraction
        exponent = results[i]
        results[i] = exponent * LN2_HIGH - ((half - (ratio * (half + series) + exponent * LN2_LOW)) - fraction)
    return results


# For sines and cosines, the angle less the nearest multiple of a quarter turn, in two parts to keep precision for large
# angles, goes into fdlibm's polynomials; the quarter decides which polynomial is the sine, and the signs.

QUARTER_HIGH, QUARTER_LOW = 1.57079632673412561417e00, 6.07710050650619224932e-11
"""Half of pi: its first 33 bits, and the rest."""

"""Adding it to a small number leaves the nearest whole number in the low bits of the sum."""


@compiled
def sines_cosines(angles: Floats) -> tuple[Floats, Floats]:
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


# Angles repeat after a whole turn, so differences and means are taken on the circle. `wrap` is for arrays outside of
# compiled loops, `direction` for one vector there; `less_turns` and `circular_mean` are for inside.


def wrap(angle_rad: ArrayLike) -> Floats:
    """Return angles of any shape, brought into (-pi, pi] by whole turns; differences of angles are errors only so."""
    turned = np.pi - np.mod(np.pi - np.asarray(angle_rad, dtype=np.float64), 2.0 * np.pi)
    # Just above half a turn the remainder rounds up to a whole one.
    return np.where(turned <= -np.pi, np.pi, turned)


@compiled
def less_turns(angle_rad: float) -> float:
    """Return an angle within half a turn of 0, by whole turns."""
    return float(angle_rad - 2.0 * np.pi * np.floor(angle_rad / (2.0 * np.pi) + 0.5))


@compiled
def circular_mean(angles_rad: Floats, weights: Floats) -> float:
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
