"""Rotations and polygons.

The camera frame has X to the right, Y down and Z away from the camera, in millimetres; pixels count x to the right and
y down. Angles are radians.
"""

import math

import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Bools, Floats, Ints
from pftrack.core.numerics.compiled import compiled
from pftrack.core.numerics.matrices import principal

# Rotations by three angles, R(theta) = R_Y(theta_y) R_X(theta_x) R_Z(theta_z) on column vectors, and by a vector.
#
# Z turns first, so that for a head that looks into the camera theta_x is its nod (positive downwards), theta_y its turn
# (positive towards the left of the picture) and theta_z its roll (positive clockwise in the picture), each in the frame
# that the later rotations carry along. Angles are always written in the order (theta_x, theta_y, theta_z).
#
# Filters linearise R, so its derivatives are here as well; all are compiled, for use inside the loops of filters.
#
# Source: Bando 2007, Appendix D, eq. A.32, whose expansions are corrected (docs/methods/adaptive.md).


@compiled
def rotation(theta: Floats) -> Floats:
    """Return R(theta), (3, 3), for angles (3,) in rad."""
    sx, sy, sz = np.sin(theta[0]), np.sin(theta[1]), np.sin(theta[2])
    cx, cy, cz = np.cos(theta[0]), np.cos(theta[1]), np.cos(theta[2])
    matrix = np.empty((3, 3))
    matrix[0, 0] = cy * cz + sy * sx * sz
    matrix[0, 1] = -cy * sz + sy * sx * cz
    matrix[0, 2] = sy * cx
    matrix[1, 0] = cx * sz
    matrix[1, 1] = cx * cz
    matrix[1, 2] = -sx
    matrix[2, 0] = -sy * cz + cy * sx * sz
    matrix[2, 1] = sy * sz + cy * sx * cz
    matrix[2, 2] = cy * cx
    return matrix


@compiled
def derivatives(theta: Floats) -> Floats:
    """Return dR/dtheta_k, (3, 3, 3) with k first, at angles (3,) in rad."""
    sx, sy, sz = np.sin(theta[0]), np.sin(theta[1]), np.sin(theta[2])
    cx, cy, cz = np.cos(theta[0]), np.cos(theta[1]), np.cos(theta[2])
    slopes = np.zeros((3, 3, 3))
    slopes[0, 0, 0] = sy * cx * sz
    slopes[0, 0, 1] = sy * cx * cz
    slopes[0, 0, 2] = -sy * sx
    slopes[0, 1, 0] = -sx * sz
    slopes[0, 1, 1] = -sx * cz
    slopes[0, 1, 2] = -cx
    slopes[0, 2, 0] = cy * cx * sz
    slopes[0, 2, 1] = cy * cx * cz
    slopes[0, 2, 2] = -cy * sx
    slopes[1, 0, 0] = -sy * cz + cy * sx * sz
    slopes[1, 0, 1] = sy * sz + cy * sx * cz
    slopes[1, 0, 2] = cy * cx
    slopes[1, 2, 0] = -cy * cz - sy * sx * sz
    slopes[1, 2, 1] = cy * sz - sy * sx * cz
    slopes[1, 2, 2] = -sy * cx
    slopes[2, 0, 0] = -cy * sz + sy * sx * cz
    slopes[2, 0, 1] = -cy * cz - sy * sx * sz
    slopes[2, 1, 0] = cx * cz
    slopes[2, 1, 1] = -cx * sz
    slopes[2, 2, 0] = sy * sz + cy * sx * cz
    slopes[2, 2, 1] = sy * cz - cy * sx * sz
    return slopes


@compiled
def angles(matrix: Floats) -> Floats:
    """Return the angles (3,) of a rotation (3, 3): theta_x within +-pi/2, the others within +-pi.

    At theta_x = +-pi/2 exactly only a combination of the other two is determined; theta_y is then 0 or pi.
    """
    tilt = min(max(-matrix[1, 2], -1.0), 1.0)
    return np.array([np.arcsin(tilt), np.arctan2(matrix[0, 2], matrix[2, 2]), np.arctan2(matrix[1, 0], matrix[1, 1])])


@compiled
def turn(points: Floats, matrix: Floats) -> Floats:
    """Return A x, (n, m), of points (n, 3), given A, (m, 3): a rotation, or the slopes of an affine camera."""
    count, size = points.shape[0], matrix.shape[0]
    moved = np.empty((count, size))
    for n in range(count):
        for i in range(size):
            moved[n, i] = matrix[i, 0] * points[n, 0] + matrix[i, 1] * points[n, 1] + matrix[i, 2] * points[n, 2]
    return moved


def nearest_rotation(matrix: Floats) -> Floats:
    """Return the rotation R that has the greatest trace(R^T M), given M (2, 2) or (3, 3).

    In the plane it turns by the angle of (M_00 + M_11, M_10 - M_01); a matrix without a preferred angle gives the
    identity. In space its quaternion is the eigenvector of the greatest eigenvalue of a matrix of M's entries (Horn
    1987).
    """
    if matrix.shape == (2, 2):
        along, across = matrix[0, 0] + matrix[1, 1], matrix[1, 0] - matrix[0, 1]
        length = math.hypot(along, across)
        cosine, sine = (along / length, across / length) if length > 0.0 else (1.0, 0.0)
        return np.array([[cosine, -sine], [sine, cosine]])
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = matrix.T.tolist()
    sums = np.array(
        [
            [xx + yy + zz, yz - zy, zx - xz, xy - yx],
            [yz - zy, xx - yy - zz, xy + yx, zx + xz],
            [zx - xz, xy + yx, yy - xx - zz, yz + zy],
            [xy - yx, zx + xz, yz + zy, zz - xx - yy],
        ]
    )
    return quaternion_matrix(principal(sums))


# A rotation vector has no preferred axis, and near zero its three numbers are the turns about the three axes, so that a
# filter can keep a reference attitude as a quaternion and estimate a small vector beside it. Quaternions are (s, v)
# with s the cosine of half the angle.
#
# If R(w + dw) is to be written as R(w) R(du), du = J_r(w) dw with the *right Jacobian* J_r. Hence d(R(w) x) = -R(w)
# [x]x J_r(w) dw, with [x]x the matrix of the cross product.
#
# Source: Shimada 1997, appendix A.2, corrected (docs/methods/linkages.md).

SMALL_RAD = 1e-4
"""Below it the first terms of a series are exact to double precision."""


@compiled
def quaternion(omega: Floats) -> Floats:
    """Return the quaternion (4,) of a rotation vector (3,)."""
    angle = np.sqrt(omega[0] * omega[0] + omega[1] * omega[1] + omega[2] * omega[2])
    share = 0.5 - angle * angle / 48.0 if angle < SMALL_RAD else np.sin(0.5 * angle) / angle
    return np.array([np.cos(0.5 * angle), share * omega[0], share * omega[1], share * omega[2]])


@compiled
def vector(q: Floats) -> Floats:
    """Return the rotation vector (3,), at most pi long, of a quaternion (4,) of any length and sign but zero."""
    sign = -1.0 if q[0] < 0.0 else 1.0
    sine = np.sqrt(q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    cosine = sign * q[0]
    share = 2.0 / cosine if sine < 1e-8 * cosine else 2.0 * np.arctan2(sine, cosine) / sine
    return np.array([sign * share * q[1], sign * share * q[2], sign * share * q[3]])


@compiled
def compose(first: Floats, second: Floats) -> Floats:
    """Return the quaternion (4,) of R(first) R(second), of unit length."""
    a, b, c, d = first[0], first[1], first[2], first[3]
    w, x, y, z = second[0], second[1], second[2], second[3]
    q = np.array(
        [
            a * w - b * x - c * y - d * z,
            a * x + w * b + c * z - d * y,
            a * y + w * c + d * x - b * z,
            a * z + w * d + b * y - c * x,
        ]
    )
    length = np.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    for i in range(4):
        q[i] /= length
    return q


@compiled
def quaternion_matrix(q: Floats) -> Floats:
    """Return R(q), (3, 3), of a quaternion (4,) of unit length."""
    w, x, y, z = q[0], q[1], q[2], q[3]
    turn = np.empty((3, 3))
    turn[0, 0] = w * w + x * x - y * y - z * z
    turn[0, 1] = 2.0 * (x * y - w * z)
    turn[0, 2] = 2.0 * (x * z + w * y)
    turn[1, 0] = 2.0 * (x * y + w * z)
    turn[1, 1] = w * w - x * x + y * y - z * z
    turn[1, 2] = 2.0 * (y * z - w * x)
    turn[2, 0] = 2.0 * (x * z - w * y)
    turn[2, 1] = 2.0 * (y * z + w * x)
    turn[2, 2] = w * w - x * x - y * y + z * z
    return turn


@compiled
def matrix(omega: Floats) -> Floats:
    """Return R(omega), (3, 3), of a rotation vector (3,)."""
    return quaternion_matrix(quaternion(omega))


@compiled
def matrix_quaternion(turn: Floats) -> Floats:
    """Return the quaternion (4,) of a rotation matrix (3, 3), its largest entry from the diagonal (Shepperd 1978)."""
    trace = turn[0, 0] + turn[1, 1] + turn[2, 2]
    best = 0
    for i in range(3):
        if turn[i, i] > trace and (best == 0 or turn[i, i] > turn[best - 1, best - 1]):
            best = i + 1
    q = np.empty(4)
    if best == 0:
        q[0] = 1.0 + trace
        for i in range(3):
            j, k = (i + 1) % 3, (i + 2) % 3
            q[1 + i] = turn[k, j] - turn[j, k]
    else:
        i = best - 1
        j, k = (i + 1) % 3, (i + 2) % 3
        q[0] = turn[k, j] - turn[j, k]
        q[1 + i] = 1.0 + turn[i, i] - turn[j, j] - turn[k, k]
        q[1 + j] = turn[j, i] + turn[i, j]
        q[1 + k] = turn[k, i] + turn[i, k]
    length = np.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    for i in range(4):
        q[i] /= length
    return q


@compiled
def cross_matrix(x: Floats) -> Floats:
    """Return [x]x, (3, 3), of (3,): its product with y is the cross product of x and y."""
    return np.array([[0.0, -x[2], x[1]], [x[2], 0.0, -x[0]], [-x[1], x[0], 0.0]])


@compiled
def right_jacobian(omega: Floats) -> Floats:
    """Return J_r(omega) = I - (1 - cos a) / a^2 [w]x + (a - sin a) / a^3 [w]x^2, (3, 3), a the length of w (A.10)."""
    square = omega[0] * omega[0] + omega[1] * omega[1] + omega[2] * omega[2]
    angle = np.sqrt(square)
    if angle < SMALL_RAD:
        first, second = 0.5 - square / 24.0, 1.0 / 6.0 - square / 120.0
    else:
        half = np.sin(0.5 * angle)
        first, second = 2.0 * half * half / square, (angle - np.sin(angle)) / (square * angle)
    skew = cross_matrix(omega)
    jacobian = np.eye(3)
    for i in range(3):
        for j in range(3):
            jacobian[i, j] -= first * skew[i, j]
            for k in range(3):
                jacobian[i, j] += second * skew[i, k] * skew[k, j]
    return jacobian


# Convex polygons on a grid of pixels: hulls, rows of pixels inside, sums over these, and distances.
#
# Coordinates are (column, row down) in px, and the centre of a pixel has whole ones. A pixel is inside a polygon if its
# centre is, so a convex polygon covers one span of pixels in each row. With row sums of a mask, computed once per
# picture, the pixels inside a polygon are counted with two look-ups per row: thousands of hypotheses in some
# milliseconds.


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
        height: Height of the picture, px.
        width: Width of the picture, px.

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
        sums: Result of `row_sums`.
        top: Result of `spans`, like the others.
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
        counts: (P,) number of corners of each; the rest is ignored.
        height: Height of the picture, px.
        width: Width of the picture, px.
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
    """Return whether a point precedes another from left to right, and from the top if they are level."""
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
