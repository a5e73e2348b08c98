"""Where a link can be that shows a given length in the picture: a rigorous cover by cells of its direction.

A link of length r in the direction theta (0 is parallel to the image) shows r cos theta. The interval of directions is
cut into cells, and in each the lengths are bounded by all that is known: the ellipse that the ellipsoid leaves of
(theta, r), the guide of r, and the observation, with the exact range of cos over the cell. No pair (theta, r) that fits
is outside the cells, which points sampled instead could not promise.

It replaces the five points per axis with which Shimada samples (5.47).

Source: Shimada 1997, sections 5.2 and 5.5; see docs/methods/linkages.md.
"""

from typing import TypeAlias

import numpy as np

from pftrack.core.arrays import Bools, Floats, Ints
from pftrack.core.numerics.compiled import compiled

# An ellipsoid is cut by a strip: the smallest ellipsoid of a family contains what they have in common. For the set {x :
# (x - c)' P^-1 (x - c) <= 1} and the strip |m'x - rho| <= w, and every L >= 0, the sum of the two inequalities, the
# second with the weight L, is an ellipsoid that contains all they share (Fogel and Huang 1982). L = 0 leaves the
# ellipsoid as it is. The L of the least trace is the root of a cubic, the L of the least volume that of a quadratic;
# both have one positive root or none.
#
# Source: Shimada 1997, section 5.1, eqs. 5.3 to 5.16, with eq. 5.9 corrected and all scaled by m'Pm, and appendix C
# (docs/methods/linkages.md).

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
    centre: Floats,
    shape: Floats,
    normal: Floats,
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
    centre: Floats,
    shape: Floats,
    axis: int,
    low: float,
    high: float,
) -> bool:
    """Cut to the least trace, tightened, by low <= x_axis <= high; a strip that leaves all of it costs nothing."""
    half = np.sqrt(max(shape[axis, axis], 0.0))
    if centre[axis] - half >= low and centre[axis] + half <= high:
        return True
    across = np.empty(centre.shape[0])
    square = 0.0
    for i in range(centre.shape[0]):
        across[i] = shape[axis, i]
        square += across[i] * across[i]
    gap = 0.5 * (low + high) - centre[axis]
    return _cut(centre, shape, across, gap, 0.5 * (high - low), shape[axis, axis], square, 1.0, TRACE, True)


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


MARGIN = 1e-12
"""What rounding may take from a sum of a few numbers, relative to them."""


@compiled
def cosine_range(first: float, last: float) -> tuple[float, float]:
    """Return the least and the greatest cosine of the angles from first to last, rad."""
    one, other = np.cos(first), np.cos(last)
    least, most = min(one, other), max(one, other)
    begin, end = first / np.pi, last / np.pi
    whole = np.ceil(begin)
    if whole <= end:
        if whole % 2.0 == 0.0:
            most = 1.0
        else:
            least = -1.0
        if whole + 1.0 <= end:
            least, most = -1.0, 1.0
    return least, most


@compiled
def section(first: float, last: float, wide: float, both: float, tall: float) -> tuple[float, float]:
    """Return the least and the greatest y of the ellipse about 0 where x is between two values; low > high if nowhere.

    The upper edge is b x / a + sqrt((c - b^2 / a) (1 - x^2 / a)): it rises to its apex, sqrt(c) at x = b / sqrt(c), and
    falls from there.

    Args:
        first: Least x.
        last: Greatest x.
        wide: a of the shape matrix (a, b; b, c).
        both: b.
        tall: c.
    """
    half, top = np.sqrt(max(wide, 0.0)), np.sqrt(max(tall, 0.0))
    if first > half + SLACK or last < -half - SLACK:
        return 1.0, -1.0
    if not half > SLACK:
        return -top, top
    first, last = max(first, -half), min(last, half)
    slope = both / wide
    rest = max(tall - both * slope, 0.0)
    one = np.sqrt(rest * max(1.0 - first * first / wide, 0.0))
    other = np.sqrt(rest * max(1.0 - last * last / wide, 0.0))
    low = min(slope * first - one, slope * last - other)
    high = max(slope * first + one, slope * last + other)
    apex = both / top if top > 0.0 else 0.0
    if first <= apex <= last:
        high = top
    if first <= -apex <= last:
        low = -top
    return low, high


@compiled
def link_cells(
    angles: tuple[float, float],
    lengths: tuple[float, float],
    seen: float,
    bound: float,
    place: tuple[float, float],
    ellipse: tuple[float, float, float],
    count: int,
) -> tuple[Floats, Floats, Floats]:
    """Return the edges (N + 1,) of cells of directions, rad, and the least and greatest length (N,) in each, px.

    Where the least length is above the greatest, nothing in that cell fits.

    Args:
        angles: Interval of the direction, rad.
        lengths: Interval of the length, px, not negative.
        seen: Observed length in the picture, with its sign, px.
        bound: Of the error of that, px.
        place: Centre (theta, r) of the ellipse.
        ellipse: (a, b, c) of its shape matrix, rad^2, rad px and px^2; a < 0 for no ellipse.
        count: N.
    """
    wide, both, tall = ellipse
    start, end = angles
    if wide >= 0.0:
        half = np.sqrt(wide) + SLACK
        start, end = max(start, place[0] - half), min(end, place[0] + half)
    edges, low, high = np.empty(count + 1), np.empty(count), np.empty(count)
    for n in range(count):
        edges[n], low[n], high[n] = start + (end - start) * (n / count), 1.0, -1.0
    edges[count] = end
    if start > end:
        return edges, low, high
    slack = SLACK + MARGIN * (abs(seen) + bound + lengths[1])
    least_seen, most_seen = seen - bound - slack, seen + bound + slack
    for n in range(count):
        shortest, longest = lengths
        if wide >= 0.0:
            bottom, top = section(edges[n] - place[0], edges[n + 1] - place[0], wide, both, tall)
            if bottom > top:
                continue
            shortest, longest = max(shortest, place[1] + bottom - slack), min(longest, place[1] + top + slack)
        least, most = cosine_range(edges[n], edges[n + 1])
        # Some cosine of the cell has r cos between the two: r least <= most_seen and r most >= least_seen.
        shortest, longest = below(shortest, longest, least, most_seen)
        low[n], high[n] = below(shortest, longest, -most, -least_seen)
    return edges, low, high


@compiled
def below(shortest: float, longest: float, factor: float, limit: float) -> tuple[float, float]:
    """Return what r * factor <= limit leaves of an interval of r."""
    if factor > 0.0:
        return shortest, min(longest, limit / factor)
    if factor < 0.0:
        return max(shortest, limit / factor), longest
    return (shortest, longest) if limit >= 0.0 else (1.0, -1.0)


# Two cells are neighbours if they touch, at a corner at least: 2 in one dimension, 80 in four. What is apart in the
# grid is apart in the world too, so each run of neighbours may become a region of its own.


@compiled
def label_components(feasible: Bools, sizes: Ints) -> tuple[Ints, int]:
    """Return the number (N,) of the run that each feasible cell is in, -1 for others, and how many runs there are.

    Args:
        feasible: (N,) cells, the last axis together.
        sizes: (d,) of the grid, N their product.
    """
    dimension, count = sizes.shape[0], feasible.shape[0]
    labels, stack = np.empty(count, np.int64), np.empty(count, np.int64)
    place, step = np.empty(dimension, np.int64), np.empty(dimension, np.int64)
    runs, left = 0, 0
    for cell in range(count):
        labels[cell] = -1
        left += feasible[cell]
    for begin in range(count):
        if not feasible[begin] or labels[begin] >= 0:
            continue
        labels[begin] = runs
        left -= 1
        stack[0] = begin
        waiting = 1
        # Once every cell has its number, nobody needs to be asked for neighbours any more.
        while waiting > 0 and left > 0:
            waiting -= 1
            rest = stack[waiting]
            for axis in range(dimension - 1, -1, -1):
                place[axis] = rest % sizes[axis]
                rest //= sizes[axis]
                step[axis] = -1
            more = True
            while more:
                other, inside = 0, True
                for axis in range(dimension):
                    moved = place[axis] + step[axis]
                    inside = inside and 0 <= moved < sizes[axis]
                    other = other * sizes[axis] + moved
                if inside and feasible[other] and labels[other] < 0:
                    labels[other] = runs
                    left -= 1
                    stack[waiting] = other
                    waiting += 1
                more = _increment(step)
        runs += 1
    return labels, runs


@compiled
def _increment(step: Ints) -> bool:
    """Count up digits of -1, 0 and 1, in place; return whether there was a next number."""
    axis = step.shape[0] - 1
    while axis >= 0 and step[axis] == 1:
        step[axis] = -1
        axis -= 1
    if axis >= 0:
        step[axis] += 1
    return bool(axis >= 0)


FAR_PX = 1e6
"""Half the side of the square that stands for the plane."""

SLACK_PX = 1e-6
"""By how much strips are widened, so that rounding loses nothing."""

Strip: TypeAlias = tuple[Floats, float, float]
"""(n, low, high) of low <= n . p <= high, with n (2,) a unit vector."""


def intersect(strips: list[Strip]) -> Floats:
    """Return the corners (k, 2) of all that is in every strip and in the square; none if nothing is."""
    corners = FAR_PX * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    for normal, low, high in strips:
        corners = _clip(corners, normal, high + SLACK_PX)
        corners = _clip(corners, -normal, SLACK_PX - low)
    return corners


def extent(corners: Floats, direction: Floats) -> tuple[float, float]:
    """Return the least and the greatest of direction . p over a polygon; infinite both where it has no end on a side.

    Args:
        corners: (k, 2), at least one.
        direction: (2,) unit vector.
    """
    along = (corners * direction).sum(axis=1)
    low, high = float(along.min()), float(along.max())
    return (low, high) if max(-low, high) < 0.5 * FAR_PX else (-np.inf, np.inf)


def _clip(corners: Floats, normal: Floats, limit: float) -> Floats:
    """Return the corners of the part of a convex polygon in which n . p <= limit (Sutherland and Hodgman 1974)."""
    beyond = (corners * normal).sum(axis=1) - limit
    kept: list[Floats] = []
    for k in range(len(corners)):
        one, other = beyond[k - 1], beyond[k]
        if (one > 0.0) != (other > 0.0):
            kept.append(corners[k - 1] + one / (one - other) * (corners[k] - corners[k - 1]))
        if other <= 0.0:
            kept.append(corners[k])
    return np.array(kept).reshape(-1, 2)
