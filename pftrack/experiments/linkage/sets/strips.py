"""An ellipsoid cut by a strip: the smallest ellipsoid of a family that contains what they have in common.

The set {x : (x - c)' P^-1 (x - c) <= 1} and the strip |m'x - rho| <= w have no ellipsoid in common, but for every
L >= 0 the sum of the two inequalities, the second with the weight L, is one that contains all they share (Fogel and
Huang 1982). L = 0 leaves the ellipsoid as it is. The L of the least trace is the root of a cubic, the L of the least
volume that of a quadratic; both have one positive root or none.

Source: Shimada 1997, section 5.1, eqs. 5.3 to 5.16, with eq. 5.9 corrected and all scaled by m'Pm, and appendix C
(docs/methods/linkages.md).
"""

import numpy as np
from numpy.typing import NDArray

from pftrack.core.numerics.compiled import compiled

__all__ = ["SLACK", "THIN", "TRACE", "VOLUME", "cut", "cut_along"]

TRACE, VOLUME = 0, 1
"""What is made least: the sum of the squared semi-axes, or their product."""

NARROWEST = 1e-5
"""Least half width of a strip, relative to the ellipsoid's half extent across it; less would cost definiteness."""

THIN = 1e-7
"""Half extent, in the unit of the coordinates, below which an ellipsoid is not made thinner."""

SLACK = 1e-9
"""By how much sets may miss each other and still count as touching, so that rounding refutes nothing."""

MOST_STEPS = 200
"""Newton's method takes about ten from nearby and one for each factor 3/2 from afar."""


@compiled
def cut(
    centre: NDArray[np.float64],
    shape: NDArray[np.float64],
    normal: NDArray[np.float64],
    offset: float,
    half_width: float,
    least: int,
    tighten: bool,
) -> bool:
    """Replace an ellipsoid, in place, by one that contains its intersection with the strip |m'x - rho| <= w.

    Args:
        centre: c, (n,).
        shape: P, (n, n), positive definite.
        normal: m, (n,).
        offset: rho.
        half_width: w.
        least: `TRACE` or `VOLUME`.
        tighten: First replace the strip by its part between the ellipsoid's two tangent planes: the intersection is
            the same, and the ellipsoid found is smaller where the strip cuts off one side only.

    Returns:
        Whether they have a point in common; if not, the ellipsoid stays as it is.
    """
    size = centre.shape[0]
    across = np.zeros(size)
    gap, spread, square, norm = offset, 0.0, 0.0, 0.0
    for i in range(size):
        for j in range(size):
            across[i] += shape[i, j] * normal[j]
        gap -= normal[i] * centre[i]
        norm += normal[i] * normal[i]
    for i in range(size):
        spread += normal[i] * across[i]
        square += across[i] * across[i]
    return _cut(centre, shape, across, gap, half_width, spread, square, norm, least, tighten)


@compiled
def cut_along(
    centre: NDArray[np.float64],
    shape: NDArray[np.float64],
    axis: int,
    low: float,
    high: float,
    least: int,
    tighten: bool,
) -> bool:
    """Do as `cut` does for the strip low <= x_axis <= high; one that leaves all of the ellipsoid costs nothing."""
    half = np.sqrt(max(shape[axis, axis], 0.0))
    if centre[axis] - half >= low and centre[axis] + half <= high:
        return True
    across = np.empty(centre.shape[0])
    square = 0.0
    for i in range(centre.shape[0]):
        across[i] = shape[axis, i]
        square += across[i] * across[i]
    gap = 0.5 * (low + high) - centre[axis]
    return _cut(centre, shape, across, gap, 0.5 * (high - low), shape[axis, axis], square, 1.0, least, tighten)


@compiled
def _cut(
    centre: NDArray[np.float64],
    shape: NDArray[np.float64],
    across: NDArray[np.float64],
    gap: float,
    half_width: float,
    spread: float,
    square: float,
    norm: float,
    least: int,
    tighten: bool,
) -> bool:
    """Cut, given P m, e = rho - m'c, w, G = m'Pm, m'P^2 m and m'm."""
    size, trace = centre.shape[0], 0.0
    half = np.sqrt(max(spread, 0.0))
    if abs(gap) > half_width + half + SLACK * np.sqrt(norm):
        return False
    if not spread > THIN * THIN * norm:
        return True
    if tighten:
        low, high = max(gap - half_width, -half), min(gap + half_width, half)
        gap, half_width = 0.5 * (low + high), max(0.5 * (high - low), 0.0)
    width2, gap2 = max(half_width * half_width / spread, NARROWEST * NARROWEST), gap * gap / spread
    for i in range(size):
        trace += shape[i, i]
    ratio = volume_ratio(size, width2, gap2) if least == VOLUME else trace_ratio(trace, square / spread, width2, gap2)
    if not ratio > 1.0:
        return True
    share = (ratio - 1.0) / ratio
    factor = 1.0 + (ratio - 1.0) * width2 - share * gap2
    if not factor > 0.0:
        # Rounding at the ellipsoid's very edge: nothing is cut off rather than everything.
        return True
    for i in range(size):
        centre[i] += share * gap * across[i] / spread
        for j in range(i + 1):
            shape[i, j] = factor * (shape[i, j] - share * across[i] * across[j] / spread)
            shape[j, i] = shape[i, j]
    return True


@compiled
def trace_ratio(trace: float, along: float, width2: float, gap2: float) -> float:
    """Return 1 + L G of the least trace, 1 where the ellipsoid had better stay.

    Args:
        trace: tr P.
        along: m'P^2 m / G.
        width2: w^2 / G.
        gap2: e^2 / G.
    """
    rest = trace * (width2 - gap2) - along
    if rest >= 0.0:
        return 1.0
    under = width2 * (trace - along)
    if not under > 1e-300:
        return volume_ratio(2, width2, gap2)  # as thin as a line: both are the same in the limit
    second = (trace * (3.0 * width2 - gap2) - along * (2.0 * (width2 - gap2) + 1.0)) / under
    third = rest / under
    # From the right of the largest root of a convex function: every step is too short.
    ratio = 2.0 + max(abs(second), abs(third), 3.0)
    for _ in range(MOST_STEPS):
        value = (ratio * ratio + second - 3.0) * ratio + (2.0 - second + third)
        step = value / (3.0 * ratio * ratio + second - 3.0)
        if not step > 1e-15 * ratio:
            break
        ratio -= step
    return max(ratio, 1.0)


@compiled
def volume_ratio(size: int, width2: float, gap2: float) -> float:
    """Return 1 + L G of the least volume, 1 where the ellipsoid had better stay (C.1-C.6)."""
    third = size * (width2 - gap2) - 1.0
    if third >= 0.0:
        return 1.0
    first = (size - 1.0) * width2
    second = (2.0 * size - 1.0) * width2 - 1.0 + gap2
    root: float = np.sqrt(max(second * second - 4.0 * first * third, 0.0))
    if second > 0.0:
        return 1.0 - 2.0 * third / (second + root)
    return 1.0 + (root - second) / (2.0 * first)
