"""Convex polygons on a grid of pixels: hulls, rows of pixels inside, sums over these, and distances.

Coordinates are (column, row down) in px, and the centre of a pixel has whole ones. A pixel is inside a polygon if its
centre is, so a convex polygon covers one span of pixels in each row. With sums along the rows of a mask, made once for
a picture, what lies inside a polygon is counted with two look-ups a row: thousands of hypotheses in some milliseconds.
"""

import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Bools, Floats, Ints
from pftrack.core.numerics.compiled import compiled


@compiled
def convex_hull(points: Floats) -> Floats:
    """Return the corners (m, 2) of the convex hull of points (n, 2), in order around it, without points between them.

    The monotone chain of A. Andrew (1979), with the sorting of few points by insertion.
    """
    count = points.shape[0]
    order = np.empty(count, np.int64)
    for i in range(count):
        place = i
        while place > 0 and _before(points, i, order[place - 1]):
            order[place] = order[place - 1]
            place -= 1
        order[place] = i
    hull = np.empty((2 * count + 1, 2))
    size = 0
    for half in range(2):
        floor = size if half else 1
        for step in range(half, count):
            point = order[count - 1 - step] if half else order[step]
            x, y = points[point, 0], points[point, 1]
            while size > floor and _turn(hull[size - 2], hull[size - 1], x, y) <= 0.0:
                size -= 1
            hull[size, 0], hull[size, 1] = x, y
            size += 1
    return hull[: max(size - 1, 1)].copy()


@compiled
def spans(polygon: Floats, height: int, width: int) -> tuple[int, Ints, Ints]:
    """Return which pixels of a picture are inside a convex polygon.

    Args:
        polygon: (m, 2) corners in order, either way around.
        height: Of the picture, px.
        width: Of the picture, px.

    Returns:
        The uppermost row, and the first and the last column (k,) in that row and in those below it; where no pixel of a
        row is inside, the last is the one before the first.
    """
    corners = polygon.shape[0]
    low, high = np.inf, -np.inf
    for i in range(corners):
        low, high = min(low, polygon[i, 1]), max(high, polygon[i, 1])
    top, bottom = max(int(np.ceil(max(low, 0.0))), 0), min(int(np.floor(min(high, height - 1.0))), height - 1)
    rows = max(bottom - top + 1, 0)
    left, right = np.full(rows, np.inf), np.full(rows, -np.inf)
    for i in range(corners):
        j = i + 1 if i + 1 < corners else 0
        upper, lower = (i, j) if polygon[i, 1] <= polygon[j, 1] else (j, i)
        x, y = polygon[upper, 0], polygon[upper, 1]
        over, down = polygon[lower, 0] - x, polygon[lower, 1] - y
        first, last = max(int(np.ceil(max(y, 0.0))), top), min(int(np.floor(min(y + down, float(bottom)))), bottom)
        slope = over / down if down > 0.0 else 0.0
        for row in range(first, last + 1):
            crossing = x + (row - y) * slope
            left[row - top], right[row - top] = min(left[row - top], crossing), max(right[row - top], crossing)
    firsts, lasts = np.empty(rows, np.int64), np.empty(rows, np.int64)
    for i in range(rows):
        firsts[i] = int(np.ceil(min(max(left[i], 0.0), float(width))))
        lasts[i] = max(int(np.floor(max(min(right[i], width - 1.0), -1.0))), firsts[i] - 1)
    return top, firsts, lasts


@compiled
def row_sums(mask: Bools) -> NDArray[np.int32]:
    """Return the sums (height, width + 1) of the pixels before each column of a mask (height, width), row by row."""
    height, width = mask.shape
    sums = np.zeros((height, width + 1), np.int32)
    for row in range(height):
        running = 0
        for column in range(width):
            running += mask[row, column]
            sums[row, column + 1] = running
    return sums


@compiled
def sum_within(sums: NDArray[np.int32], top: int, firsts: Ints, lasts: Ints) -> int:
    """Return how many pixels of a mask are within spans.

    Args:
        sums: Of `row_sums`.
        top: Of `spans`, and so are the others.
        firsts: (k,).
        lasts: (k,).
    """
    found = 0
    for i in range(firsts.shape[0]):
        found += sums[top + i, lasts[i] + 1] - sums[top + i, firsts[i]]
    return found


@compiled
def fill(corners: Floats, counts: Ints, height: int, width: int) -> Bools:
    """Return the union (height, width) of convex polygons as a mask.

    Args:
        corners: (P, K, 2) of P polygons, in order around each.
        counts: (P,) how many corners each has; the rest is not looked at.
        height: Of the picture, px.
        width: Of the picture, px.
    """
    mask = np.zeros((height, width), np.bool_)
    for polygon in range(corners.shape[0]):
        top, firsts, lasts = spans(corners[polygon, : counts[polygon]], height, width)
        for i in range(firsts.shape[0]):
            mask[top + i, firsts[i] : lasts[i] + 1] = True
    return mask


@compiled
def distance_to_segment(point: Floats, first: Floats, second: Floats) -> float:
    """Return the distance of a point (2,) from the line between two others."""
    x, y = second[0] - first[0], second[1] - first[1]
    square = x * x + y * y
    share = 0.0
    if square > 0.0:
        share = ((point[0] - first[0]) * x + (point[1] - first[1]) * y) / square
        share = min(max(share, 0.0), 1.0)
    across, down = point[0] - first[0] - share * x, point[1] - first[1] - share * y
    return float(np.sqrt(across * across + down * down))


@compiled
def distance_to_polygon(point: Floats, polygon: Floats) -> float:
    """Return the distance of a point (2,) from a convex polygon (m, 2); 0 inside it."""
    corners = polygon.shape[0]
    nearest, left, right = np.inf, False, False
    for i in range(corners):
        j = i + 1 if i + 1 < corners else 0
        turn = _turn(polygon[i], polygon[j], point[0], point[1])
        left, right = left or turn > 0.0, right or turn < 0.0
        nearest = min(nearest, distance_to_segment(point, polygon[i], polygon[j]))
    return nearest if (left and right) or corners < 3 else 0.0


@compiled
def _before(points: Floats, first: int, second: int) -> bool:
    """Tell whether a point comes before another from left to right, and from the top where they are level."""
    if points[first, 0] != points[second, 0]:
        return bool(points[first, 0] < points[second, 0])
    return bool(points[first, 1] < points[second, 1])


@compiled
def _turn(first: Floats, second: Floats, x: float, y: float) -> float:
    """Return twice the area of a triangle, positive if it turns one way and negative if the other."""
    return float((second[0] - first[0]) * (y - first[1]) - (second[1] - first[1]) * (x - first[0]))


@compiled
def paint_disc(image_rgb: NDArray[np.uint8], u: float, v: float, radius: float, colour: tuple[int, int, int]) -> None:
    """Fill the pixels whose centres are within `radius` px of (u, v), in place."""
    height, width, _ = image_rgb.shape
    for row in range(max(int(np.ceil(v - radius)), 0), min(int(np.floor(v + radius)), height - 1) + 1):
        for column in range(max(int(np.ceil(u - radius)), 0), min(int(np.floor(u + radius)), width - 1) + 1):
            if (column - u) ** 2 + (row - v) ** 2 <= radius * radius:
                for channel in range(3):
                    image_rgb[row, column, channel] = colour[channel]
