"""Trackers of a body's shape, by name, and the shape in one frame of reference with the camera that sees it there.

All trackers share one step and one form of belief; they differ in the method (`methods`). A shape is known up to a
similarity, and one from affine cameras up to a mirror image as well. Here it is moved to its centre and scaled to unit
size; frame 0 defines the upright direction, and from there on each shape is turned onto the last one. A camera at a
finite distance distinguishes the two mirror images, since near parts look larger: both predict each frame as seen by a
pinhole, and the log densities are summed. Far away both predict alike, and the question stays open.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property, partial
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Floats
from pftrack.core.geometry import angles, nearest_rotation
from pftrack.core.model.series import SeriesValue
from pftrack.core.model.source import Frame, Target
from pftrack.core.model.tracker import Tracker
from pftrack.core.numerics.matrices import contiguous_copy, product
from pftrack.core.numerics.random import Stream
from pftrack.experiments.declared import read_reported
from pftrack.experiments.structure import methods
from pftrack.experiments.structure.methods import (
    Belief,
    Found,
    Observed,
    StructureTrackerParameters,
    grow,
    plain,
    windowed,
)
from pftrack.experiments.structure.scene import BodyTarget, Shape, normalise_size
from pftrack.vision.face import gaze
from pftrack.vision.structure.cameras import Sight, evidence, fit_camera, frontal
from pftrack.vision.structure.factorization import check_view
from pftrack.vision.structure.growing import Growing, find_right
from pftrack.vision.structure.variational import transform_covariances

ROUNDS = 20
TURN_PRECISION = 100.0
"""Precision of the rotation from frame to frame, 1/rad^2: 6 degrees."""

LARGEST_DIFFERENCE = 5.0
"""Largest difference of two log densities in one frame: an outlier must not decide."""

CLEARLY = 3.0
"""Log odds required to switch to the mirror image."""

ODDS_KEPT = 0.95
"""Share of the sum of these differences kept per frame: the first shapes are poor, and their evidence must fade."""

FEWEST_TO_PLACE = 3
UNKNOWN_DEPTH_SD = 1.0
"""Depth of a body that has not turned: about its size."""

MIRROR: Floats = np.array([1.0, 1.0, -1.0])
MIRROR.flags.writeable = False


@dataclass(frozen=True, eq=False)
class Placed:
    """A shape in the common frame of reference.

    Attributes:
        points: (n, 3) about their centre, of unit size; x to the right and y downwards in frame 0, z away.
        covariances: (n, 3, 3).
        camera: (3, 4) pinhole of the last frame, its translation in units of the body's size.
        known: Whether a method has found it; otherwise it is frame 0, laid flat.
        depth_odds: Log odds against its mirror image, by the frames so far.
    """

    points: Floats
    covariances: Floats
    camera: Floats
    known: bool
    depth_odds: float = 0.0


def flat(filled: Floats, rows: Floats, precisions: Floats, focal_px: float) -> Placed:
    """Return frame 0 as a shape without depth.

    Args:
        filled: (n, 2) px from the principal point, also of points that were not measured.
        rows: (2, n) the same, 0 where not measured.
        precisions: (2, n).
        focal_px: Focal length of the camera.
    """
    points, size = normalise_size(np.column_stack([filled, np.zeros(len(filled))]))
    covariances = np.zeros((len(points), 3, 3))
    for axis in range(2):
        known = precisions[axis] > 0.0
        variance = np.divide(1.0, precisions[axis], out=np.full(len(points), np.inf), where=known)
        covariances[:, axis, axis] = np.minimum(variance / (size * size), UNKNOWN_DEPTH_SD)
    covariances[:, 2, 2] = UNKNOWN_DEPTH_SD
    return Placed(points, covariances, frontal(Sight(focal_px, rows, precisions), points), known=False)


def place(before: Placed, found: Found, rows: Floats, precisions: Floats, focal_px: float) -> Placed:
    """Return a shape that was found, turned onto the one before.

    Args:
        before: The shape of the last frame.
        found: Result of a method.
        rows: (2, n) the frame's positions, px from the principal point.
        precisions: (2, n).
        focal_px: Focal length of the camera.
    """
    centre = found.points.mean(axis=0)
    points, size = normalise_size(found.points)
    covariances = found.covariances / (size * size)
    camera = found.camera.copy()
    camera[:, 3] = (product(found.camera[:, :3], centre[:, None])[:, 0] + found.camera[:, 3]) / size
    direct = _turn(points, covariances, camera, before.points)
    if found.one_handed:
        return settle(before, direct, rows, precisions, focal_px)
    mirrored = _turn(points * MIRROR, _flip(covariances), _mirrored_camera(camera), before.points)
    odds = ODDS_KEPT * before.depth_odds
    if before.known and _apart(mirrored, before) < _apart(direct, before):
        direct, mirrored = mirrored, direct
    first = settle(before, direct, rows, precisions, focal_px)
    if _too_few(precisions):
        return first
    other = settle(before, mirrored, rows, precisions, focal_px)
    difference = _evidence(first, rows, precisions, focal_px) - _evidence(other, rows, precisions, focal_px)
    odds += min(max(difference, -LARGEST_DIFFERENCE), LARGEST_DIFFERENCE)
    # At first nothing speaks for either; later the other one must be clearly better, or the shape would flicker.
    if odds >= (-CLEARLY if before.known else 0.0):
        return replace(first, depth_odds=odds)
    return replace(other, depth_odds=-odds)


def _too_few(precisions: Floats) -> bool:
    """Return whether too few points (2, n) were measured to place a shape."""
    return bool(np.count_nonzero(precisions.max(axis=0)) < FEWEST_TO_PLACE)


def _turn(
    points: Floats,
    covariances: Floats,
    camera: Floats,
    onto: Floats,
) -> Placed:
    """Return a shape and its camera in a frame of reference in which it lies on another one as well as it can."""
    turn = nearest_rotation(product(onto.T, points))
    seen = np.column_stack([product(camera[:, :3], turn.T), camera[:, 3]])
    return Placed(product(points, turn.T), transform_covariances(covariances, turn), seen, known=True)


def _flip(covariances: Floats) -> Floats:
    return np.asarray(covariances * np.outer(MIRROR, MIRROR))


def _mirrored_camera(camera: Floats) -> Floats:
    """Return the camera (3, 4) that sees the mirror image about where this one sees the shape."""
    across, down = camera[0, :3] * MIRROR, camera[1, :3] * MIRROR
    return np.column_stack([np.array([across, down, np.cross(across, down)]), camera[:, 3]])


def _apart(one: Placed, other: Placed) -> float:
    return float(np.square(one.points - other.points).sum())


def settle(before: Placed, shape: Placed, rows: Floats, precisions: Floats, focal_px: float) -> Placed:
    """Return a shape with the pinhole that fits a frame best; the last one, `before`'s, where too little is seen."""
    camera = before.camera
    if not _too_few(precisions):
        start = np.ascontiguousarray(shape.camera)
        camera = fit_camera(Sight(focal_px, rows, precisions), start, shape.points, start, TURN_PRECISION, ROUNDS)
    return Placed(shape.points, shape.covariances, camera, shape.known, before.depth_odds)


def _evidence(shape: Placed, rows: Floats, precisions: Floats, focal_px: float) -> float:
    return evidence(Sight(focal_px, rows, precisions), shape.camera, shape.points, shape.camera, TURN_PRECISION)


@dataclass(frozen=True, eq=False)
class StructureState:
    """The belief after a frame, immutable; the estimate is the shape.

    Attributes:
        body: Edges and faces between its points.
        principal_px: (2,) where the camera's axis meets the picture.
        seen: The frames so far.
        belief: The method's own.
        placed: The shape in the common frame of reference, and the camera.
        told_focal_px: Known focal length of the camera.
        focal_px: Focal length assumed in this frame.
    """

    body: Shape
    principal_px: Floats
    seen: Observed
    belief: Belief
    placed: Placed
    told_focal_px: float
    focal_px: float

    @property
    def log_evidence(self) -> float:
        """Log density of this frame before its use, where the method has one; else 0."""
        return self.belief.log_evidence

    @property
    def estimate(self) -> Floats:
        """(3 n,) the shape about its centre, of unit size."""
        return self.placed.points.ravel()

    @cached_property
    def sigma(self) -> Floats:
        """(3 n,) standard deviations of the same."""
        variances = np.diagonal(self.placed.covariances, axis1=1, axis2=2)
        return np.asarray(np.sqrt(np.maximum(variances, 0.0)).ravel())

    def arrays(self) -> Mapping[str, NDArray[Any]]:
        """Return the shape's covariances and the camera, for a file."""
        return {"covariances": self.placed.covariances, "camera": self.placed.camera}


Method: TypeAlias = Callable[[Belief, methods.Observed, Shape, float, StructureTrackerParameters], Belief]
View: TypeAlias = tuple[Floats, Floats]

ANGLES = ("yaw", "pitch", "roll")
REPORTED = read_reported(Path(__file__).parent)
FREE_ENERGY, SWITCH = ("free_energy",), ("own_probability", "own_weight")
"""Series that only some trackers report."""


def start(
    method: Method, target: Target, frame: Frame, parameters: StructureTrackerParameters, _rng: Stream
) -> StructureState:
    """Begin with the first view: a shape without depth, or the mean of other bodies where one is known."""
    if not isinstance(target, BodyTarget):
        raise TypeError(f"a tracker of shapes follows a body, got a {type(target).__name__}")
    shape = target.shape
    positions, variances = _measure(frame, target.principal_px, parameters)
    seen = methods.take(methods.begin(len(shape.names)), positions, variances)
    rows, precisions = check_view(positions, variances, len(shape.names))
    focal = target.focal_px * parameters.lens_factor
    guess = flat(seen.filled[-1], rows, precisions, focal)
    state = StructureState(shape, target.principal_px, seen, Belief(), guess, target.focal_px, focal)
    return _take(method, state, parameters)


def step(
    method: Method, state: StructureState, frame: Frame, parameters: StructureTrackerParameters, _rng: Stream
) -> StructureState:
    """Take a further view."""
    positions, variances = _measure(frame, state.principal_px, parameters)
    seen = methods.take(state.seen, positions, variances)
    return _take(method, replace(state, seen=seen), parameters)


def _take(method: Method, state: StructureState, parameters: StructureTrackerParameters) -> StructureState:
    focal = float(state.told_focal_px * parameters.lens_factor)
    robust = parameters.wrong_odds > 0.0
    seen = doubt(state.seen, state.belief, focal, parameters.wrong_odds) if robust else state.seen
    belief = method(state.belief, seen, state.body, focal, parameters)
    state = replace(state, seen=seen)
    view = check_view(seen.positions[-1], seen.variances[-1], len(state.body.names))
    if belief.found is None:
        shape = settle(state.placed, state.placed, *view, focal)
    else:
        shape = place(state.placed, belief.found, *view, focal)
    return replace(state, belief=belief, placed=shape, focal_px=focal)


def doubt(seen: methods.Observed, belief: Belief, focal_px: float, wrong: float) -> methods.Observed:
    """Return what was seen, with the last frame's variances over how likely each measurement is right.

    Args:
        seen: The frames so far.
        belief: In the shape before it; nothing is doubted if nothing is known of it yet.
        focal_px: Focal length of the camera.
        wrong: Share of the measurements that are wrong.
    """
    if belief.found is None:
        return seen
    shape, covariances = contiguous_copy(belief.found.points), contiguous_copy(belief.found.covariances)
    sight = Sight(focal_px, *check_view(seen.positions[-1], seen.told[-1], len(shape)))
    right = find_right(sight, contiguous_copy(belief.found.camera), shape, covariances, wrong)
    variances = seen.variances.copy()
    variances[-1] = seen.told[-1] / right[:, None]
    return replace(seen, variances=variances)


def _measure(frame: Frame, principal_px: Floats, parameters: StructureTrackerParameters) -> View:
    """Return positions (n, 2) from the principal point and variances (n, 2), infinite where a point is missing."""
    if frame.measurements is None:
        raise ValueError("a tracker of shapes needs measured points, got a frame without them")
    positions = frame.measurements.points_px - principal_px
    sd = np.broadcast_to(frame.measurements.sd_px.reshape(len(positions), -1), positions.shape)
    missing = ~(np.isfinite(positions) & np.isfinite(sd)).all(axis=1, keepdims=True)
    variances = np.where(missing, np.inf, np.square(np.maximum(sd, parameters.trust_px)))
    return np.where(missing, 0.0, positions), variances


def measure(state: StructureState) -> Mapping[str, SeriesValue]:
    """Return the values of the series."""
    belief, turn = state.belief, np.ascontiguousarray(state.placed.camera[:, :3])
    values: dict[str, SeriesValue] = {
        "depth_strength": belief.strength,
        "depth_odds": state.placed.depth_odds,
        "measured": tuple(np.isfinite(state.seen.variances[-1]).all(axis=1).astype(np.float64).tolist()),
    }
    pose = np.rad2deg(gaze(angles(turn)))
    values |= {f"{angle}_deg": float(value) for angle, value in zip(ANGLES, pose, strict=True)}
    if math.isfinite(belief.free_energy):
        values["free_energy"] = belief.free_energy
    if isinstance(belief.known, Growing):
        values["own_probability"] = belief.known.probability
        values["own_weight"] = belief.known.weight
    return values


def _tracker(name: str, method: Method, *own: str) -> Tracker:
    others = {*FREE_ENERGY, *SWITCH}.difference(own)
    series = tuple(each for each in REPORTED.values() if each.name not in others)
    return Tracker(name, partial(start, method), partial(step, method), series=series, measure=measure)


TRACKERS: dict[str, Tracker] = {
    tracker.id: tracker
    for tracker in (
        _tracker("growing", grow, *SWITCH),
        _tracker("informed", partial(windowed, "by-information"), *FREE_ENERGY),
        _tracker("online", partial(windowed, "common"), *FREE_ENERGY),
        _tracker("svd", plain),
    )
}
"""The trackers of a shape, by name, in the order in which they are shown; `experiment.yaml` has their titles."""
