"""Gaussians cut by half-spaces: the remaining part, approximated by a Gaussian with the same moments.

A hard bound a'x <= b removes the part of a Gaussian beyond it. Along a, the remaining part is a normal distribution cut
at one side, with mean and variance in closed form; other directions change only by correlation. Several bounds are
applied one after the other, each to the Gaussian that the previous one gave, and those that cut least come first. The
order matters, since the remaining part is not Gaussian.

With c = (b - a'x) / sqrt(a'Pa), phi and Phi the standard normal density and distribution:

    mu = -phi(c) / Phi(c),   s = 1 + c mu - mu^2,
    x <- x + P a mu / sqrt(a'Pa),   P <- P - (1 - s) P a (P a)' / (a'Pa).

Apply a bound once. If it is applied to the same Gaussian in every frame, it shrinks the Gaussian further without any
observation: N(65, 10^2) cut to [60, 80] has a standard deviation of 5.98, after 21 times 3.02, after 300 times 2.36.

Source: Shimada 1997, section 4.4, eqs. 4.22 to 4.30, and appendix B, corrected (docs/methods/linkages.md); Simon and
Simon 2010.
"""

from typing import TypeAlias

import numpy as np

from pftrack.core.arrays import Floats
from pftrack.core.numerics.compiled import compiled

Bounds: TypeAlias = tuple[Floats, Floats, Floats]
"""A, lo and hi of lo <= A x <= hi."""

BEYOND_NOTICE = 8.0
"""A bound this many standard deviations away has no effect in double precision."""
LEAST_SHARE = 1e-12
"""Least share of the variance along a bound that remains, however far beyond it the Gaussian is."""
FAR = 50.0
"""Beyond it four terms of a series are exact, where the closed form of the variance would cancel."""

# W. J. Cody 1969, "Rational Chebyshev approximations for the error function": erf below 0.46875, and exp(x^2) erfc(x)
# from there to 4, and beyond.
ERF_ABOVE = np.array(
    [
        1.85777706184603153e-1,
        3.16112374387056560e00,
        1.13864154151050156e02,
        3.77485237685302021e02,
        3.20937758913846947e03,
    ]
)
ERF_BELOW = np.array(
    [1.0, 2.36012909523441209e01, 2.44024637934444173e02, 1.28261652607737228e03, 2.84423683343917062e03]
)
MIDDLE_ABOVE = np.array(
    [
        *(2.15311535474403846e-8, 5.64188496988670089e-1, 8.88314979438837594e00, 6.61191906371416295e01),
        *(2.98635138197400131e02, 8.81952221241769090e02, 1.71204761263407058e03, 2.05107837782607147e03),
        1.23033935479799725e03,
    ]
)
MIDDLE_BELOW = np.array(
    [
        *(1.0, 1.57449261107098347e01, 1.17693950891312499e02, 5.37181101862009858e02, 1.62138957456669019e03),
        *(3.29079923573345963e03, 4.36261909014324716e03, 3.43936767414372164e03, 1.23033935480374942e03),
    ]
)
OUTER_ABOVE = np.array(
    [
        *(1.63153871373020978e-2, 3.05326634961232344e-1, 3.60344899949804439e-1, 1.25781726111229246e-1),
        *(1.60837851487422766e-2, 6.58749161529837803e-4),
    ]
)
OUTER_BELOW = np.array(
    [
        *(1.0, 2.56852019228982242e00, 1.87295284992346725e00, 5.27905102951428412e-1, 6.05183413124413191e-2),
        2.33520497626869185e-3,
    ]
)


@compiled
def _ratio(above: Floats, below: Floats, x: float) -> float:
    """Return the quotient of two polynomials, the highest power first."""
    first, second = 0.0, 0.0
    for i in range(above.shape[0]):
        first = first * x + above[i]
    for i in range(below.shape[0]):
        second = second * x + below[i]
    return float(first / second)


@compiled
def mills_ratio(x: float) -> float:
    """Return Phi(-x) / phi(x) of the standard normal distribution, for any x from -37 on."""
    y = abs(x) * 0.70710678118654752440
    if y <= 0.46875:
        tail = 1.0 - y * _ratio(ERF_ABOVE, ERF_BELOW, y * y)
        scaled = tail * np.exp(y * y)
    elif y <= 4.0:
        scaled = _ratio(MIDDLE_ABOVE, MIDDLE_BELOW, y)
    else:
        inverse = 1.0 / (y * y)
        scaled = (0.56418958354775628695 - inverse * _ratio(OUTER_ABOVE, OUTER_BELOW, inverse)) / y
    if x < 0.0:
        scaled = 2.0 * np.exp(y * y) - scaled
    return float(1.25331413731550025121 * scaled)


@compiled
def _check(mean: Floats, covariance: Floats, bounds: Bounds) -> None:
    rows, low, high = bounds
    count, size = rows.shape
    if mean.shape[0] != size or covariance.shape != (size, size) or low.shape[0] != count or high.shape[0] != count:
        raise ValueError("expected a mean (n,), a covariance (n, n) and bounds (m,) for rows (m, n), got other sizes")


@compiled
def least_room(mean: Floats, covariance: Floats, bounds: Bounds) -> float:
    """Return the least distance of the mean from a bound, in standard deviations; negative if it lies beyond one.

    Arguments and errors as for `truncate`.
    """
    _check(mean, covariance, bounds)
    rows, low, high = bounds
    least = np.inf
    for k in range(rows.shape[0]):
        value, variance, _ = _along(mean, covariance, rows[k])
        if variance > 0.0:
            least = min(least, (high[k] - value) / np.sqrt(variance), (value - low[k]) / np.sqrt(variance))
    return least


@compiled
def log_share(mean: Floats, covariance: Floats, bounds: Bounds) -> float:
    """Return the log of a Gaussian's probability within lo <= A x <= hi, each bound taken independently.

    A direction without spread is either inside or outside a bound. Arguments and errors as for `truncate`; none is
    changed.
    """
    _check(mean, covariance, bounds)
    rows, low, high = bounds
    share = 0.0
    for k in range(rows.shape[0]):
        value, variance = 0.0, 0.0
        for i in range(mean.shape[0]):
            if rows[k, i] != 0.0:
                value += rows[k, i] * mean[i]
                for j in range(mean.shape[0]):
                    if rows[k, j] != 0.0:
                        variance += rows[k, i] * covariance[i, j] * rows[k, j]
        if not variance > 0.0:
            if not low[k] <= value <= high[k]:
                return -np.inf
            continue
        deviation = np.sqrt(variance)
        for room in ((high[k] - value) / deviation, (value - low[k]) / deviation):
            if room < BEYOND_NOTICE:
                share += np.log(mills_ratio(-room)) - 0.5 * room * room - 0.91893853320467274178
    return share


@compiled
def truncate(mean: Floats, covariance: Floats, bounds: Bounds) -> int:
    """Cut a Gaussian by lo <= A x <= hi, in place, and return the number of bounds that cut it.

    Args:
        mean: (n,).
        covariance: (n, n).
        bounds: A, (m, n), and lo and hi, (m,), which may be infinite.

    Raises:
        ValueError: The sizes do not agree.
    """
    _check(mean, covariance, bounds)
    rows, low, high = bounds
    count = rows.shape[0]
    room = np.empty(2 * count)
    for k in range(count):
        value, variance, _ = _along(mean, covariance, rows[k])
        deviation = np.sqrt(variance) if variance > 0.0 else 0.0
        room[2 * k] = (high[k] - value) / deviation if deviation > 0.0 else np.inf
        room[2 * k + 1] = (value - low[k]) / deviation if deviation > 0.0 else np.inf
    order = np.argsort(-room, kind="mergesort")
    cut = 0
    for place in order:
        if room[place] < np.inf:
            row = rows[place // 2]
            bound, sign = (high[place // 2], 1.0) if place % 2 == 0 else (low[place // 2], -1.0)
            cut += _cut(mean, covariance, row, bound, sign)
    return cut


@compiled
def _along(mean: Floats, covariance: Floats, row: Floats) -> tuple[float, float, Floats]:
    """Return a'x, a'Pa and P a."""
    size = mean.shape[0]
    spread = np.zeros(size)
    value, variance = 0.0, 0.0
    for j in range(size):
        if row[j] != 0.0:
            value += row[j] * mean[j]
            for i in range(size):
                spread[i] += covariance[i, j] * row[j]
    for i in range(size):
        variance += row[i] * spread[i]
    return value, variance, spread


@compiled
def _cut(mean: Floats, covariance: Floats, row: Floats, bound: float, sign: float) -> int:
    """Cut by sign (a'x - b) <= 0, in place, and return whether that took anything off."""
    value, variance, spread = _along(mean, covariance, row)
    if not variance > 0.0:
        return 0
    deviation = np.sqrt(variance)
    c = sign * (bound - value) / deviation
    if c > BEYOND_NOTICE:
        return 0
    if c < -FAR:
        inverse = 1.0 / (c * c)
        mu = c + (1.0 - inverse * (2.0 - 10.0 * inverse)) / c
        share = inverse * (1.0 - inverse * (6.0 - 50.0 * inverse))
    else:
        mu = -1.0 / mills_ratio(-c)
        share = 1.0 + c * mu - mu * mu
    share = max(share, LEAST_SHARE)
    size = mean.shape[0]
    for i in range(size):
        mean[i] += sign * spread[i] * mu / deviation
        for j in range(size):
            covariance[i, j] -= (1.0 - share) * spread[i] * spread[j] / variance
    return 1
