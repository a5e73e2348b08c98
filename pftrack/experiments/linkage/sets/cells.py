"""Where a link can be that shows a given length in the picture: a rigorous cover by cells of its direction.

A link of length r in the direction theta (0 is parallel to the image) shows r cos theta. The interval of directions is
cut into cells, and in each the lengths are bounded by all that is known: the ellipse that the ellipsoid leaves of
(theta, r), the guide of r, and the observation, with the exact range of cos over the cell. No pair (theta, r) that fits
is outside the cells, which points sampled instead could not promise.

It replaces the five points per axis with which Shimada samples (5.47).

Source: Shimada 1997, sections 5.2 and 5.5; see docs/methods/linkages.md.
"""

import numpy as np
from numpy.typing import NDArray

from pftrack.core.numerics.compiled import compiled
from pftrack.experiments.linkage.sets.strips import SLACK

__all__ = ["below", "cosine_range", "link_cells", "section"]

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
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
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
