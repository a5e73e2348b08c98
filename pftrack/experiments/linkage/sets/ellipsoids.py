"""Ellipsoids that enclose sets: outer bounds of a cut and of a motion, and the test of inclusion.

An ellipsoid is a centre c (n,) and a shape P (n, n): all x with (x - c)' P^-1 (x - c) <= 1. Everything works in place.

Source: Shimada 1997, chapter 5; the test of inclusion is our own.
"""

import numpy as np

from pftrack.core.arrays import Floats
from pftrack.core.numerics.compiled import compiled
from pftrack.core.numerics.matrices import factorise, orthogonalise, substitute

# An ellipsoid is cut by a strip: the smallest ellipsoid of a family contains what they have in common. For the set {x :
# (x - c)' P^-1 (x - c) <= 1} and the strip |m'x - rho| <= w, and every L >= 0, the sum of the two inequalities, the
# second with the weight L, is an ellipsoid that contains all they share (Fogel and Huang 1982). L = 0 leaves the
# ellipsoid as it is. The L of the least trace, the sum of the squared semi-axes, is the root of a cubic that has one
# positive root or none.
#
# The strip is first replaced by its part between the ellipsoid's two tangent planes: what they have in common is the
# same, and the ellipsoid that is found is smaller where the strip cuts off one side only.
#
# Source: Shimada 1997, section 5.1, eqs. 5.3 to 5.16, with eq. 5.9 corrected and all scaled by m'Pm, and appendix C
# (docs/methods/linkages.md).

NARROWEST = 1e-5
"""Least half width of a strip, relative to the ellipsoid's half extent across it; less would cost definiteness."""

THIN = 1e-7
"""Half extent, in the unit of the coordinates, below which an ellipsoid is not made thinner."""

SLACK = 1e-9
"""Gap up to which sets count as touching, so rounding does not refute anything."""

MOST_STEPS = 200
"""Newton's method takes about ten from nearby and one for each factor 3/2 from afar."""


@compiled
def cut(
    centre: Floats,
    shape: Floats,
    normal: Floats,
    offset: float,
    half_width: float,
) -> bool:
    """Replace an ellipsoid, in place, by the least that contains its intersection with the strip |m'x - rho| <= w.

    Args:
        centre: c, (n,).
        shape: P, (n, n), positive definite.
        normal: m, (n,).
        offset: rho.
        half_width: w.

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
    return _cut(centre, shape, across, gap, half_width, spread, square, norm)


@compiled
def cut_along(centre: Floats, shape: Floats, axis: int, low: float, high: float) -> bool:
    """Cut by low <= x_axis <= high; a strip that leaves all of it costs nothing."""
    half = np.sqrt(max(shape[axis, axis], 0.0))
    if centre[axis] - half >= low and centre[axis] + half <= high:
        return True
    across = shape[axis].copy()
    square = 0.0
    for one in across:
        square += one * one
    gap = 0.5 * (low + high) - centre[axis]
    return _cut(centre, shape, across, gap, 0.5 * (high - low), shape[axis, axis], square, 1.0)


@compiled
def _cut(
    centre: Floats,
    shape: Floats,
    across: Floats,
    gap: float,
    half_width: float,
    spread: float,
    square: float,
    norm: float,
) -> bool:
    """Cut, given P m, e = rho - m'c, w, G = m'Pm, m'P^2 m and m'm."""
    size, trace = centre.shape[0], np.trace(shape)
    half = np.sqrt(max(spread, 0.0))
    if abs(gap) > half_width + half + SLACK * np.sqrt(norm):
        return False
    if not spread > THIN * THIN * norm:
        return True
    low, high = max(gap - half_width, -half), min(gap + half_width, half)
    gap, half_width = 0.5 * (low + high), max(0.5 * (high - low), 0.0)
    width2, gap2 = max(half_width * half_width / spread, NARROWEST * NARROWEST), gap * gap / spread
    ratio = trace_ratio(trace, square / spread, width2, gap2)
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
        return _ratio_of_line(width2, gap2)
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
def _ratio_of_line(width2: float, gap2: float) -> float:
    """Return 1 + L G of an ellipsoid as thin as a line: the cubic's limit is the quadratic of the least area (C.6)."""
    third = 2.0 * (width2 - gap2) - 1.0
    if third >= 0.0:
        return 1.0
    second = 3.0 * width2 - 1.0 + gap2
    root: float = np.sqrt(max(second * second - 4.0 * width2 * third, 0.0))
    return 1.0 - 2.0 * third / (second + root) if second > 0.0 else 1.0 + (root - second) / (2.0 * width2)


# The sum of an ellipsoid and a ball is not an ellipsoid. For every p > 0, (1 + 1/p) P + (1 + p) U contains it, where U
# is the ball's shape, and p = sqrt(tr P / tr U) has the least trace (Kurzhanski and Valyi 1997). Shimada prints P + du
# I, which is not even of one unit, and describes in words the ellipsoid whose semi-axes are each longer by du, which
# touches the sum on the axes and lies inside it elsewhere. They are here for what they lose.
#
# Source: Shimada 1997, section 5.3, eq. 5.31, corrected (docs/methods/linkages.md).

OUTER, LENGTHENED, PRINTED = 0, 1, 2
"""The bound that holds; every semi-axis longer by du, as the source's words say; P + du I, as it is printed."""

FLOOR, RELATIVE_FLOOR = 1e-12, 1e-12
"""Added to all squared semi-axes, absolutely and relative to their mean, which keeps them positive for ever."""


@compiled
def predict(shape: Floats, moved: int, radius: float, way: int) -> None:
    """Add a motion to an ellipsoid, in place.

    Args:
        shape: P, (n, n).
        moved: The motion is in the first so many coordinates.
        radius: Radius of the ball of all motions, in the unit of the coordinates.
        way: `OUTER`, `LENGTHENED` or `PRINTED`; the last two change all coordinates, as the source has it.
    """
    size, trace = shape.shape[0], np.trace(shape)
    if way == PRINTED:
        shape += radius * np.eye(size)
    elif way == LENGTHENED:
        _lengthen(shape, radius)
    elif radius > 0.0:
        ratio = np.sqrt(max(trace, 0.0) / (moved * radius * radius))
        if ratio > 0.0:  # else it is a point, which becomes the ball
            shape *= 1.0 + 1.0 / ratio
        for i in range(moved):
            shape[i, i] += (1.0 + ratio) * radius * radius
    for i in range(size):
        shape[i, i] += FLOOR + RELATIVE_FLOOR * max(trace, 0.0) / size


@compiled
def _lengthen(shape: Floats, radius: float) -> None:
    """Make every semi-axis longer by the radius, in place."""
    size = shape.shape[0]
    scaled, axes = orthogonalise(shape)
    shape[:] = 0.0
    for k in range(size):
        square = 0.0
        for i in range(size):
            square += scaled[k, i] * axes[k, i]
        half = np.sqrt(max(square, 0.0)) + radius
        for i in range(size):
            for j in range(size):
                shape[i, j] += half * half * axes[k, i] * axes[k, j]


# An ellipsoid lies in another if the greatest value of the other's quadratic over it is at most 1. That is a quadratic
# over a ball: with its eigenvalues l_i and slopes g_i it is the least mu + sum g_i^2 / (mu - l_i) + value at the
# centre, over all mu above the greatest l_i (the secular equation is where its derivative is zero). Every mu gives an
# upper bound, so whichever the search ends with, a yes is a proof.

MOST_HALVINGS = 60
"""Halvings of the interval of mu."""

LIMIT = 1.0 + 1e-9
"""By so little the one may stick out, for the sake of rounding."""


@compiled
def box_in_ellipsoid(low: Floats, high: Floats, centre: Floats, shape: Floats) -> bool:
    """Return whether all corners of a box (n,) to (n,) lie in an ellipsoid, and with them all of the box."""
    size = low.shape[0]
    root, positive = factorise(shape)
    if not positive:
        return False
    corners = np.empty((size, 1 << size))
    for number in range(1 << size):
        for j in range(size):
            corners[j, number] = (high[j] if number >> j & 1 else low[j]) - centre[j]
    off = substitute(root, corners)
    for number in range(1 << size):
        value = 0.0
        for j in range(size):
            value += off[j, number] * off[j, number]
        if not value <= 1.0:
            return False
    return True


@compiled
def ellipsoid_in_ellipsoid(
    centre: Floats,
    shape: Floats,
    other_centre: Floats,
    other_shape: Floats,
) -> bool:
    """Return whether an ellipsoid, centre (n,) and shape (n, n), lies in another."""
    size = centre.shape[0]
    own, regular = factorise(shape)
    root, positive = factorise(other_shape)
    if not (regular and positive):
        return False
    # In coordinates in which the other is the unit ball about 0, the one is d + A u, |u| <= 1.
    apart, across = np.empty((size, 1)), np.empty((size, size))
    for j in range(size):
        apart[j, 0] = centre[j] - other_centre[j]
    apart, image = substitute(root, apart), substitute(root, own)
    for j in range(size):
        for k in range(size):
            across[k, j] = image[j, k]
    turned, _ = orthogonalise(across)
    squares, slopes = np.zeros(size), np.zeros(size)
    distance = 0.0
    for k in range(size):
        for j in range(size):
            squares[k] += turned[k, j] * turned[k, j]
            slopes[k] += turned[k, j] * apart[j, 0]
        distance += apart[k, 0] * apart[k, 0]
    return _at_most_one(squares, slopes, distance)


@compiled
def _at_most_one(squares: Floats, slopes: Floats, distance: float) -> bool:
    """Return whether sum l_k v_k^2 + 2 g_k v_k + distance is at most 1 for all |v| <= 1."""
    most, steepest = 0.0, 0.0
    for k in range(squares.shape[0]):
        most = max(most, squares[k])
        steepest += slopes[k] * slopes[k]
    if not most + distance <= LIMIT:
        return False
    least, greatest = most, most + np.sqrt(steepest)
    for _ in range(MOST_HALVINGS):
        middle = 0.5 * (least + greatest)
        bound, slope = middle + distance, 1.0
        for k in range(squares.shape[0]):
            if slopes[k] != 0.0:
                share = slopes[k] / (middle - squares[k])
                bound += share * slopes[k]
                slope -= share * share
        if bound <= LIMIT:
            return True
        if slope > 0.0:
            greatest = middle
        else:
            least = middle
    return False
