"""Rotations by three angles: R(theta) = R_Y(theta_y) R_X(theta_x) R_Z(theta_z), acting on column vectors.

Z turns first, so that for a head that looks into the camera theta_x is its nod (positive downwards), theta_y its turn
(positive towards the left of the picture) and theta_z its roll (positive clockwise in the picture), each in the frame
that the later ones carry along. Angles are always written in the order (theta_x, theta_y, theta_z).

Filters linearise R, so its derivatives are here as well; all are compiled, for use inside the loops of filters.

Source: Bando 2007, Appendix D, eq. A.32, whose expansions are corrected (docs/methods/adaptive.md).
"""

import math

import numpy as np
from numpy.typing import NDArray

from pftrack.core.numerics.compiled import compiled
from pftrack.core.numerics.matrices import principal

__all__ = ["angles", "derivatives", "nearest_rotation", "rotation", "turn"]


@compiled
def rotation(theta: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return R(theta), (3, 3), of angles (3,) in rad."""
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
def derivatives(theta: NDArray[np.float64]) -> NDArray[np.float64]:
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
def angles(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the angles (3,) of a rotation (3, 3): theta_x within +-pi/2, the others within +-pi.

    At theta_x = +-pi/2 exactly only a combination of the other two is determined; theta_y is then 0 or pi.
    """
    tilt = min(max(-matrix[1, 2], -1.0), 1.0)
    return np.array([np.arcsin(tilt), np.arctan2(matrix[0, 2], matrix[2, 2]), np.arctan2(matrix[1, 0], matrix[1, 1])])


@compiled
def turn(points: NDArray[np.float64], matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return A x, (n, m), of points (n, 3), given A, (m, 3): a rotation, or the slopes of an affine camera."""
    count, size = points.shape[0], matrix.shape[0]
    moved = np.empty((count, size))
    for n in range(count):
        for i in range(size):
            moved[n, i] = matrix[i, 0] * points[n, 0] + matrix[i, 1] * points[n, 1] + matrix[i, 2] * points[n, 2]
    return moved


def nearest_rotation(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the rotation R that has the greatest trace(R^T M), given M (2, 2) or (3, 3).

    In the plane it turns by the angle of (M_00 + M_11, M_10 - M_01); a matrix that prefers none gives no rotation. In
    space its quaternion is the eigenvector of the greatest eigenvalue of a matrix of M's entries (Horn 1987).
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
    w, x, y, z = principal(sums).tolist()
    return np.array(
        [
            [w * w + x * x - y * y - z * z, 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
            [2.0 * (x * y + w * z), w * w - x * x + y * y - z * z, 2.0 * (y * z - w * x)],
            [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), w * w - x * x - y * y + z * z],
        ]
    )
