"""A pinhole fitted to one view of a shape, and the derivatives of positions by camera and shape; for compiled loops.

The camera has six numbers, a rotation and a translation, kept as a matrix (R, T) of the shape's frame; its focal length
is known. A long focal length at a great distance is the scaled orthographic camera.
"""

from typing import NamedTuple

import numpy as np

from pftrack.core.arrays import Floats
from pftrack.core.numerics.compiled import compiled
from pftrack.vision.structure.factorization import cholesky_log_det, cholesky_solve, invert

SIZE = 6
"""Numbers of a camera: a small rotation, then the translation."""

RIDGE = 1e-9
"""Added to the diagonal of the camera's precision, relative to its mean: few points do not determine a camera."""

SMALLEST = 1e-12
CLOSE = 1e-6
"""A change that raises the squared distances, in units of their noise, by less than this is the last."""

CERTAIN_TURN = 18.0
"""Squared length of a rotation, in units of its noise, up to which it is ignored. With the noise of two views it is
twice a chi-square with three degrees of freedom, which is below this in 97 of 100 cases."""

SURE_TURN = 2000.0
"""Squared length from which on it counts in full."""

NEAREST = 1e-3
"""The least depth, in the unit of the shape."""


class Sight(NamedTuple):
    """Measurements of n points in one frame, and the focal length.

    Attributes:
        focal_px: Focal length.
        rows: (2, n) positions, px from the principal point.
        precisions: (2, n) inverse variances, 1/px^2; 0 where a point was not seen.
    """

    focal_px: float
    rows: Floats
    precisions: Floats


@compiled
def residuals_and_slopes(sight: Sight, camera: Floats, shape: Floats) -> tuple[Floats, Floats, Floats]:
    """Return residuals (2, n), px, and the slopes of the predictions by the points (2, n, 3) and the camera (2, n, 6).

    Args:
        sight: The frame.
        camera: (3, 4).
        shape: (n, 3).
    """
    count = shape.shape[0]
    residuals, by_point, by_camera = np.empty((2, count)), np.empty((2, count, 3)), np.empty((2, count, SIZE))
    turned, slope = np.empty(3), np.empty(3)
    for n in range(count):
        for i in range(3):
            turned[i] = 0.0
            for j in range(3):
                turned[i] += camera[i, j] * shape[n, j]
        depth = max(turned[2] + camera[2, 3], NEAREST)
        scale = sight.focal_px / depth
        for d in range(2):
            seen = scale * (turned[d] + camera[d, 3])
            residuals[d, n] = sight.rows[d, n] - seen
            slope[0] = slope[1] = 0.0
            slope[d] = scale
            slope[2] = -seen / depth
            for j in range(3):
                by_point[d, n, j] = slope[d] * camera[d, j] + slope[2] * camera[2, j]
                by_camera[d, n, 3 + j] = slope[j]
            # A small rotation w turns the point R s by w x (R s).
            by_camera[d, n, 0] = slope[2] * turned[1] - slope[1] * turned[2]
            by_camera[d, n, 1] = slope[0] * turned[2] - slope[2] * turned[0]
            by_camera[d, n, 2] = slope[1] * turned[0] - slope[0] * turned[1]
    return residuals, by_point, by_camera


@compiled
def frontal(sight: Sight, shape: Floats) -> Floats:
    """Return the camera (3, 4) that sees a shape (n, 3) from the front, as large and where it is seen."""
    rows, precisions = sight.rows, sight.precisions
    camera = np.zeros((3, 4))
    means, sizes = np.zeros((2, 2)), np.zeros(2)
    for d in range(2):
        camera[d, d] = 1.0
        total = SMALLEST
        for n in range(shape.shape[0]):
            total += precisions[d, n]
            means[d, 0] += precisions[d, n] * shape[n, d]
            means[d, 1] += precisions[d, n] * rows[d, n]
        for i in range(2):
            means[d, i] /= total
        for n in range(shape.shape[0]):
            offset = shape[n, d] - means[d, 0]
            sizes[0] += precisions[d, n] * offset * offset
            sizes[1] += precisions[d, n] * offset * (rows[d, n] - means[d, 1])
    camera[2, 2] = 1.0
    # If the shape is mirrored or not seen, a harmless scale is used.
    scale = sizes[1] / sizes[0] if sizes[1] > 0.0 and sizes[0] > 0.0 else 1.0
    camera[2, 3] = sight.focal_px / scale
    for d in range(2):
        camera[d, 3] = means[d, 1] / scale - means[d, 0]
    return camera


@compiled
def fit_camera(
    sight: Sight, camera: Floats, shape: Floats, before: Floats, turn_precision: float, most_rounds: int
) -> Floats:
    """Return the camera (3, 4) of the least weighted squared distances, by Gauss and Newton's method from one nearby.

    Args:
        sight: The frame.
        camera: (3, 4) initial camera.
        shape: (n, 3).
        before: (3, 4) camera of the frame before. A large turn from it is unlikely: a body that is narrower than its
            model looks like a turned one, and only this prior separates the two.
        turn_precision: Precision of the rotation since then, 1/rad^2.
        most_rounds: At most.
    """
    found = camera
    for _ in range(most_rounds):
        residuals, _, slopes = residuals_and_slopes(sight, found, shape)
        normal, wanted, _ = normal_of(residuals, slopes, sight.precisions, turn_between(found, before), turn_precision)
        change = cholesky_solve(cholesky_log_det(normal)[0], wanted)
        found = _move(found, change)
        length = 0.0
        for i in range(SIZE):
            length += change[i] * wanted[i]
        if length < CLOSE:
            break
    return found


@compiled
def evidence(sight: Sight, camera: Floats, shape: Floats, before: Floats, turn_precision: float) -> float:
    """Return the log density of a view given a shape, its camera integrated out, up to a constant; see `fit_camera`.

    The constant is that of the camera's prior, which is flat in the translation: the same for all shapes in one unit.
    """
    residuals, _, slopes = residuals_and_slopes(sight, camera, shape)
    normal, _, cost = normal_of(residuals, slopes, sight.precisions, turn_between(camera, before), turn_precision)
    _, log_determinant = cholesky_log_det(normal)
    return -0.5 * (cost + log_determinant)


@compiled
def turn_between(camera: Floats, reference: Floats) -> Floats:
    """Return the rotation (3,) that leads from one camera's to another's, rad about each axis of the camera."""
    turn = np.zeros((3, 3))
    for i in range(3):
        for j in range(3):
            for k in range(3):
                turn[i, j] += camera[i, k] * reference[j, k]
    axis = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    sine = 0.5 * np.sqrt(axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2])
    angle = np.arctan2(sine, 0.5 * (turn[0, 0] + turn[1, 1] + turn[2, 2] - 1.0))
    for i in range(3):
        axis[i] *= 0.5 * angle / sine if sine > 0.0 else 0.5
    return axis


@compiled
def steady_camera(sight: Sight, camera: Floats, reference: Floats, shape: Floats) -> Floats:
    """Return a camera (3, 4) without the part of its rotation from a reference that may be noise.

    A body at rest seems to turn a little because of the noise of its points; taken for a rotation, this noise would
    give a false depth. So the rotation rho is shrunk towards none (James and Stein 1961) by 1 - 18 / q, at least 0,
    with q = rho^T V^-1 rho and V the covariance of the fitted rotation.

    Args:
        sight: The frame.
        camera: (3, 4) fitted to the sight.
        reference: (3, 4) of the view from which rotations count.
        shape: (n, 3).
    """
    turn = turn_between(camera, reference)
    angle = np.sqrt(turn[0] * turn[0] + turn[1] * turn[1] + turn[2] * turn[2])
    residuals, _, slopes = residuals_and_slopes(sight, camera, shape)
    normal, _, _ = normal_of(residuals, slopes, sight.precisions, turn, 0.0)
    covariance, precision = np.empty((SIZE, SIZE)), np.empty((3, 3))
    invert(normal, covariance)
    invert(covariance[:3, :3].copy(), precision)
    square = 0.0
    for i in range(3):
        for j in range(3):
            square += turn[i] * precision[i, j] * turn[j]
    if square >= SURE_TURN or angle > 0.5 * np.pi:
        return camera
    share = max(0.0, 1.0 - CERTAIN_TURN / square) if square > 0.0 else 0.0
    change = np.zeros(SIZE)
    for i in range(3):
        # The step whose quaternion is (1, w / 2) turns by 2 arctan(|w| / 2).
        change[i] = 2.0 * np.tan(0.5 * share * angle) / angle * turn[i] if angle > 0.0 else 0.0
    found = _move(reference, change)
    for i in range(3):
        found[i, 3] = camera[i, 3]
    return found


@compiled
def _stiffen(normal: Floats) -> None:
    """Add the ridge to the precision of a camera (6, 6), in place."""
    mean = 0.0
    for i in range(SIZE):
        mean += normal[i, i] / SIZE
    for i in range(SIZE):
        normal[i, i] += RIDGE * mean + SMALLEST


@compiled
def normal_of(
    residuals: Floats, slopes: Floats, precisions: Floats, turn: Floats, turn_precision: float
) -> tuple[Floats, Floats, float]:
    """Return precision (6, 6), lower half, and gradient (6,) of the camera, and the squared distances, weighted.

    Args:
        residuals: (2, n) px.
        slopes: (2, n, 6) of the predictions by the camera.
        precisions: (2, n).
        turn: (3,) rotation from the frame before, rad.
        turn_precision: Precision of that rotation, 1/rad^2.
    """
    normal, wanted, cost = np.zeros((SIZE, SIZE)), np.zeros(SIZE), 0.0
    for i in range(3):
        normal[i, i] = turn_precision
        wanted[i] = -turn_precision * turn[i]
        cost += turn_precision * turn[i] * turn[i]
    for d in range(2):
        for n in range(residuals.shape[1]):
            weight = precisions[d, n]
            cost += weight * residuals[d, n] * residuals[d, n]
            for i in range(SIZE):
                wanted[i] += weight * residuals[d, n] * slopes[d, n, i]
                for j in range(i + 1):
                    normal[i, j] += weight * slopes[d, n, i] * slopes[d, n, j]
    _stiffen(normal)
    return normal, wanted, cost


@compiled
def _move(camera: Floats, change: Floats) -> Floats:
    """Return a camera (3, 4) after a small rotation and a translation (6,)."""
    # The rotation of the quaternion (1, w / 2), made a unit.
    square = change[0] * change[0] + change[1] * change[1] + change[2] * change[2]
    w = 1.0 / np.sqrt(1.0 + 0.25 * square)
    x, y, z = 0.5 * w * change[0], 0.5 * w * change[1], 0.5 * w * change[2]
    turn = np.empty((3, 3))
    turn[0, 0], turn[0, 1], turn[0, 2] = 1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)
    turn[1, 0], turn[1, 1], turn[1, 2] = 2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)
    turn[2, 0], turn[2, 1], turn[2, 2] = 2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)
    found = camera.copy()
    for i in range(3):
        for j in range(3):
            found[i, j] = 0.0
            for k in range(3):
                found[i, j] += turn[i, k] * camera[k, j]
        found[i, 3] += change[3 + i]
    return found
