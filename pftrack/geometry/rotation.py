"""Rotations by three angles: R(theta) = R_Y(theta_y) R_X(theta_x) R_Z(theta_z), acting on column vectors.

Z turns first, so that for a head that looks into the camera theta_x is its nod (positive downwards), theta_y its turn
(positive towards the left of the picture) and theta_z its roll (positive clockwise in the picture), each in the frame
that the later ones carry along. Angles are always written in the order (theta_x, theta_y, theta_z).

Filters linearise R, so its derivatives are here as well; all are compiled, for use inside the loops of filters.

Source: document 1, ch. 4 section 3.2 and Appendix D, as corrected in specification 0.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pftrack.compiled import compiled

__all__ = ["angles", "derivatives", "rotation", "wrapped"]


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


def wrapped(angle_rad: ArrayLike) -> NDArray[np.float64]:
    """Return angles of any shape, brought into (-pi, pi] by whole turns; differences of angles are errors only so."""
    turned = np.pi - np.mod(np.pi - np.asarray(angle_rad, dtype=np.float64), 2.0 * np.pi)
    # Just above half a turn the remainder rounds up to a whole one.
    return np.where(turned <= -np.pi, np.pi, turned)
