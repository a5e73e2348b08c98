"""Rotations by a vector: about its direction, by its length in rad.

A rotation vector has no preferred axis, and near zero its three numbers are the turns about the three axes, so that a
filter can keep a reference attitude as a quaternion and estimate a small vector beside it. Quaternions are (s, v) with
s the cosine of half the angle.

If R(w + dw) is to be written as R(w) R(du), du = J_r(w) dw with the *right Jacobian* J_r. Hence
d(R(w) x) = -R(w) [x]x J_r(w) dw, with [x]x the matrix of the cross product.

Source: Shimada 1997, appendix A.2, corrected (docs/methods/linkages.md).
"""

import numpy as np
from numpy.typing import NDArray

from pftrack.core.numerics.compiled import compiled

__all__ = [
    "compose",
    "cross_matrix",
    "matrix",
    "matrix_quaternion",
    "quaternion",
    "quaternion_matrix",
    "right_jacobian",
    "vector",
]

SMALL_RAD = 1e-4
"""Below it the first terms of a series are exact to double precision."""


@compiled
def quaternion(omega: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the quaternion (4,) of a rotation vector (3,)."""
    angle = np.sqrt(omega[0] * omega[0] + omega[1] * omega[1] + omega[2] * omega[2])
    share = 0.5 - angle * angle / 48.0 if angle < SMALL_RAD else np.sin(0.5 * angle) / angle
    return np.array([np.cos(0.5 * angle), share * omega[0], share * omega[1], share * omega[2]])


@compiled
def vector(q: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the rotation vector (3,), at most pi long, of a quaternion (4,) of any length and sign but zero."""
    sign = -1.0 if q[0] < 0.0 else 1.0
    sine = np.sqrt(q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    cosine = sign * q[0]
    share = 2.0 / cosine if sine < 1e-8 * cosine else 2.0 * np.arctan2(sine, cosine) / sine
    return np.array([sign * share * q[1], sign * share * q[2], sign * share * q[3]])


@compiled
def compose(first: NDArray[np.float64], second: NDArray[np.float64]) -> NDArray[np.float64]:
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
def quaternion_matrix(q: NDArray[np.float64]) -> NDArray[np.float64]:
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
def matrix(omega: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return R(omega), (3, 3), of a rotation vector (3,)."""
    return quaternion_matrix(quaternion(omega))


@compiled
def matrix_quaternion(turn: NDArray[np.float64]) -> NDArray[np.float64]:
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
def cross_matrix(x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return [x]x, (3, 3), of (3,): its product with y is the cross product of x and y."""
    return np.array([[0.0, -x[2], x[1]], [x[2], 0.0, -x[0]], [-x[1], x[0], 0.0]])


@compiled
def right_jacobian(omega: NDArray[np.float64]) -> NDArray[np.float64]:
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
