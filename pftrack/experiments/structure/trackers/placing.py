"""A shape in one frame of reference, whatever method it comes from, and the camera that sees it there.

A shape is known up to a similarity, and one from affine cameras up to a mirror image as well. Here it is moved to its
centre and scaled to unit size; frame 0 says what is upright, and from there on each shape is turned onto the last one.
Which of the two mirror images it is, a camera at a finite distance tells, since what is near looks larger: both predict
each frame as a pinhole sees them, and the log densities are summed up. Far away both predict alike, and it stays open.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pftrack.core.geometry.rotation import nearest_rotation
from pftrack.core.numerics.matrices import product
from pftrack.experiments.structure.trackers.methods import Found
from pftrack.vision.structure.cameras import evidence, fit_camera, frontal
from pftrack.vision.structure.variational import transform_covariances

__all__ = ["MIRROR", "Placed", "flat", "place", "place_again"]

ROUNDS = 20
TURN_PRECISION = 100.0
"""Of the rotation from frame to frame, 1/rad^2: 6 degrees."""

LARGEST_DIFFERENCE = 5.0
"""Of two log densities of one frame: an outlier must not decide."""

CLEARLY = 3.0
"""So much more probable a mirror image must be before it is taken."""

ODDS_KEPT = 0.95
"""Of the sum of these differences with each frame: the first shapes are poor, and what they say must fade."""

FEWEST_TO_PLACE = 3
UNKNOWN_DEPTH_SD = 1.0
"""Of a body that has not turned: about as deep as it is large."""

MIRROR: NDArray[np.float64] = np.array([1.0, 1.0, -1.0])
MIRROR.flags.writeable = False


@dataclass(frozen=True, eq=False)
class Placed:
    """A shape in the common frame of reference.

    Attributes:
        points: (n, 3) about their centre, of unit size; x to the right and y downwards in frame 0, z away.
        covariances: (n, 3, 3).
        camera: (3, 4) pinhole of the last frame, its translation in units of the body's size.
        known: Whether a method has found it; otherwise it is frame 0, laid flat.
        depth_odds: Log of how much more probable it is than its mirror image, as far as the frames tell.
    """

    points: NDArray[np.float64]
    covariances: NDArray[np.float64]
    camera: NDArray[np.float64]
    known: bool
    depth_odds: float = 0.0


def flat(
    filled: NDArray[np.float64], rows: NDArray[np.float64], precisions: NDArray[np.float64], focal_px: float
) -> Placed:
    """Return frame 0 as a shape without depth.

    Args:
        filled: (n, 2) px from the principal point, also of points that were not measured.
        rows: (2, n) the same, 0 where not measured.
        precisions: (2, n).
        focal_px: Of the camera.
    """
    points, size = _normalise_size(np.column_stack([filled, np.zeros(len(filled))]))
    covariances = np.zeros((len(points), 3, 3))
    for axis in range(2):
        known = precisions[axis] > 0.0
        variance = np.divide(1.0, precisions[axis], out=np.full(len(points), np.inf), where=known)
        covariances[:, axis, axis] = np.minimum(variance / (size * size), UNKNOWN_DEPTH_SD)
    covariances[:, 2, 2] = UNKNOWN_DEPTH_SD
    return Placed(points, covariances, frontal(focal_px, points, rows, precisions), known=False)


def place(
    before: Placed, found: Found, rows: NDArray[np.float64], precisions: NDArray[np.float64], focal_px: float
) -> Placed:
    """Return a shape that was found, turned onto the one before.

    Args:
        before: The shape of the last frame.
        found: What a method has found.
        rows: (2, n) the frame's positions, px from the principal point.
        precisions: (2, n).
        focal_px: Of the camera.
    """
    centre = found.points.mean(axis=0)
    points, size = _normalise_size(found.points)
    covariances = found.covariances / (size * size)
    camera = found.camera.copy()
    camera[:, 3] = (product(found.camera[:, :3], centre[:, None])[:, 0] + found.camera[:, 3]) / size
    direct = _turn(points, covariances, camera, before.points)
    few = np.count_nonzero(precisions.max(axis=0)) < FEWEST_TO_PLACE
    if found.one_handed:
        return _settle(before, direct, rows, precisions, focal_px, few=bool(few))
    mirrored = _turn(points * MIRROR, _flip(covariances), _mirrored_camera(camera), before.points)
    odds = ODDS_KEPT * before.depth_odds
    if before.known and _apart(mirrored, before) < _apart(direct, before):
        direct, mirrored = mirrored, direct
    first = _settle(before, direct, rows, precisions, focal_px, few=bool(few))
    if few:
        return first
    other = _settle(before, mirrored, rows, precisions, focal_px, few=False)
    difference = _evidence(first, rows, precisions, focal_px) - _evidence(other, rows, precisions, focal_px)
    odds += min(max(difference, -LARGEST_DIFFERENCE), LARGEST_DIFFERENCE)
    # At first nothing speaks for either; later the other one must be clearly better, or the shape would flicker.
    if odds >= (-CLEARLY if before.known else 0.0):
        return replace(first, depth_odds=odds)
    return replace(other, depth_odds=-odds)


def place_again(before: Placed, rows: NDArray[np.float64], precisions: NDArray[np.float64], focal_px: float) -> Placed:
    """Return the shape of before with the camera of a further frame."""
    few = np.count_nonzero(precisions.max(axis=0)) < FEWEST_TO_PLACE
    return before if few else _settle(before, before, rows, precisions, focal_px, few=False)


def _normalise_size(points: NDArray[np.float64]) -> tuple[NDArray[np.float64], float]:
    """Return points about their centre and of unit size, and what their size was."""
    centred = points - points.mean(axis=0)
    size = float(np.sqrt(np.square(centred).sum() / len(centred)))
    return (centred / size, size) if size > 0.0 else (centred, 1.0)


def _turn(
    points: NDArray[np.float64],
    covariances: NDArray[np.float64],
    camera: NDArray[np.float64],
    onto: NDArray[np.float64],
) -> Placed:
    """Return a shape and its camera in a frame of reference in which it lies on another one as well as it can."""
    turn = nearest_rotation(product(onto.T, points))
    seen = np.column_stack([product(camera[:, :3], turn.T), camera[:, 3]])
    return Placed(product(points, turn.T), transform_covariances(covariances, turn), seen, known=True)


def _flip(covariances: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(covariances * np.outer(MIRROR, MIRROR))


def _mirrored_camera(camera: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the camera (3, 4) that sees the mirror image about where this one sees the shape."""
    across, down = camera[0, :3] * MIRROR, camera[1, :3] * MIRROR
    return np.column_stack([np.array([across, down, np.cross(across, down)]), camera[:, 3]])


def _apart(one: Placed, other: Placed) -> float:
    return float(np.square(one.points - other.points).sum())


def _settle(
    before: Placed,
    shape: Placed,
    rows: NDArray[np.float64],
    precisions: NDArray[np.float64],
    focal_px: float,
    *,
    few: bool,
) -> Placed:
    """Return a shape with the pinhole that fits the frame best; the last one where too little is seen."""
    camera = before.camera
    if not few:
        start = np.ascontiguousarray(shape.camera)
        camera = fit_camera(focal_px, start, shape.points, rows, precisions, start, TURN_PRECISION, ROUNDS)
    return Placed(shape.points, shape.covariances, camera, shape.known, before.depth_odds)


def _evidence(shape: Placed, rows: NDArray[np.float64], precisions: NDArray[np.float64], focal_px: float) -> float:
    return evidence(focal_px, shape.camera, shape.points, rows, precisions, shape.camera, TURN_PRECISION)
