"""The methods of finding a body's shape, frame by frame: each gives a shape and its uncertainty.

Each method has its own type of belief. A method that receives another's belief restarts from the kept frames, so a run
can switch methods: every method can use the last frames of the tracks, the plain one a summary of all frames.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from pftrack.core.arrays import Floats, Ints
from pftrack.core.model.parameters import Parameters, parameter
from pftrack.core.numerics.matrices import cholesky, eigenvalues, product, singular_values, solve_system
from pftrack.experiments.structure.scene import Shape
from pftrack.vision.structure import growing, recursive, variational
from pftrack.vision.structure.cameras import Sight, residuals_and_slopes
from pftrack.vision.structure.factorization import FEWEST_VIEWS, Tracks, metric_transform
from pftrack.vision.structure.growing import Growing, fit_despite_outliers
from pftrack.vision.structure.recursive import (
    Accumulated,
    Recursive,
    accumulate,
    empty,
    from_window,
    pinhole_of,
    principal_shape,
)
from pftrack.vision.structure.variational import Forgetting, Online, strengths_of, transform_covariances

LONGEST = 180
"""Largest number of kept frames."""


@dataclass(frozen=True, eq=False)
class Observed:
    """The frames so far.

    Attributes:
        positions: (W, n, 2) px from the principal point; 0 where the variance is infinite.
        told: (W, n, 2) px^2, infinite where a point was not measured.
        variances: (W, n, 2) px^2, the same over how likely each measurement is right.
        filled: (W, n, 2) px, a point that was not measured where it was last.
        everything: The same of all frames, as the plain factorization needs it.
        frames: Number of frames so far.
        counts: (n,) number of frames in which each point was measured.
    """

    positions: Floats
    told: Floats
    variances: Floats
    filled: Floats
    everything: Accumulated
    frames: int
    counts: Ints


def begin(count: int) -> Observed:
    """Return what is known before the first frame of `count` points."""
    nothing = np.zeros((0, count, 2))
    return Observed(nothing, nothing, nothing, nothing, empty(count), 0, np.zeros(count, np.int64))


def take(seen: Observed, positions: Floats, variances: Floats) -> Observed:
    """Return what is known after a further frame.

    Args:
        seen: Before.
        positions: (n, 2) px; anything where the variance is infinite.
        variances: (n, 2) px^2.
    """
    measured = np.isfinite(variances)
    known = np.where(measured, positions, 0.0)
    # A point that was never measured is in the middle of the others.
    middle = known.sum(axis=0) / np.maximum(measured.sum(axis=0), 1)
    before = seen.filled[-1] if seen.frames else np.broadcast_to(middle, positions.shape)
    filled = np.where(measured, positions, before)
    return Observed(
        _append(seen.positions, known),
        _append(seen.told, variances),
        _append(seen.variances, variances),
        _append(seen.filled, filled),
        accumulate(seen.everything, filled),
        seen.frames + 1,
        seen.counts + measured.all(axis=1),
    )


def _append(rows: Floats, row: Floats) -> Floats:
    return np.concatenate([rows[max(0, len(rows) + 1 - LONGEST) :], row[None]])


METHOD, CAMERA, SCORING = "Method", "Assumed camera", "Scoring"
WINDOWED = ("online", "informed")


class StructureTrackerParameters(Parameters, group=METHOD, constants={"kept_precision": 1}):
    """Everything that trackers of a shape read."""

    window_frames: int = parameter(90, "Window", unit="frames", within=(5, 180, 5), trackers=WINDOWED, role="memory")
    """Number of frames that the online methods use together; before that, all of them."""
    kept_share: float = parameter(0.5, "Memory", within=(0, 1, 0.05), trackers=WINDOWED)
    """Share that the average of the online methods keeps of itself with each frame; 1 forgets nothing."""
    first_frames: int = parameter(20, "First frames", unit="frames", within=(3, 90, 1), trackers=("growing",))
    """Least number of frames for the first shape of an unknown body."""
    frozen: bool = parameter(False, "Freeze", trackers=("growing",))
    """Learn nothing more: the shape stays, and only the pose is followed."""
    trust_px: float = parameter(0, "Least noise", unit="px", within=(0, 50, 0.5), useful=(0, 10))
    """No measurement is taken as more exact than this, in case the variances are too small."""
    wrong_odds: float = parameter(0.02, "Silently wrong", within=(0, 0.5, 0.01), trackers=("growing", *WINDOWED))
    """Assumed share of wrong measurements with a small variance; at 0 all are trusted, as in Bando 2007."""
    lens_factor: float = parameter(1, "Focal length", within=(0.1, 10, 0.05), useful=(0.5, 2), group=CAMERA)
    """Assumed focal length, as a multiple of the camera's."""
    wrong_share: float = parameter(0.6, "Frames that may be off", within=(0, 1, 0.01), group=SCORING, role="loss_share")
    """A run is a success if its shape is off by over 5 % in no more than this share."""


FIRST_AT_MOST = 90
"""Number of frames used together for a first shape."""

CAMERA_NUMBERS = 6
MISFIT_SHARE = 0.1
"""Weight of the last frame in the mean misfit."""

FURTHEST = 1e4
"""From where on a point is nowhere: a first shape that was too far off may take a leap."""

WORST_MISFIT = 6.0
"""From which on a shape is given up."""

SURE_STRENGTH = 8.0
"""Least strength of the third direction of a first shape: it is tested in every frame, so noise has many chances. The
perspective of a plane looks like a depth of up to 6.4 at the usual distance, and two of 16 first shapes that were made
from 3.5 on were wrong by half of their size; bodies that turn reach 8 a few frames after that at most, unless they turn
by 10 degrees only under four times the noise (25 to 35 frames)."""

LEAST_MOTION = 1e-12
"""Added to the mean square of the cameras, relative to it: one direction may not have been seen at all."""

FIRST_VIEWS = 3
"""Two leave a family of metric shapes (Ullman 1979)."""


@dataclass(frozen=True, eq=False)
class Found:
    """The shape that a method has found.

    Attributes:
        points: (n, 3) in a frame of the method's own.
        covariances: (n, 3, 3).
        camera: (3, 4) pinhole near the one of the last frame, in the same frame of reference.
        one_handed: Whether the method itself has decided between the two mirror images.
    """

    points: Floats
    covariances: Floats
    camera: Floats
    one_handed: bool = False


@dataclass(frozen=True, eq=False)
class Belief:
    """A method's belief; the plain factorization has nothing beyond the tracks.

    Attributes:
        found: The shape; None as long as there is none.
        strength: Strength of the third direction of the shape over the noise.
        known: State of the online variational method, None until the window is full; or of the recursion, None until
            the frames determine a shape.
        free_energy: Free energy of the window of a variational method.
        misfit: Mean square of the residuals of the last frames in units of their noise; about 1 if all is well.
    """

    found: Found | None = None
    strength: float = math.nan
    known: Online | Growing | Recursive | None = None
    free_energy: float = math.nan
    misfit: float = 1.0

    @property
    def own(self) -> Recursive | None:
        """The belief of the recursion in the body's own shape."""
        if isinstance(self.known, Growing):
            return self.known.own
        return self.known if isinstance(self.known, Recursive) else None

    @property
    def log_evidence(self) -> float:
        """The log density that the belief gave to the last frame before it was taken; 0 where a method has none."""
        return 0.0 if self.own is None else self.own.log_evidence


def plain(
    belief: Belief, seen: Observed, body: Shape, focal_px: float, parameters: StructureTrackerParameters
) -> Belief:
    """Factor all frames so far by singular values (Bando 2007, ch. 4 section 5.1)."""
    del belief, body, parameters
    principal = principal_shape(seen.everything)
    if principal is None:
        return Belief()
    shape, strengths = principal
    count = len(shape)
    means = seen.filled.mean(axis=1, keepdims=True)
    rows = (seen.filled - means).transpose(0, 2, 1).reshape(-1, count)
    # The right singular vectors times the roots of the values: what is left of W = M S is the motion.
    motion = product(rows, shape / strengths[:3])
    noise = float(np.square(strengths[3:]).sum()) / max((2 * seen.frames - 3) * (count - 4), 1)
    spread = noise * np.diag(1.0 / strengths[:3])
    covariances = np.broadcast_to(spread, (count, 3, 3)).copy()
    strength = float(strengths[2] / strengths[3]) if strengths[3] > 0.0 else math.nan
    newest = np.column_stack([motion[-2:], means[-1, 0]])
    return Belief(_upgrade(shape, covariances, motion, newest, focal_px), strength)


def windowed(
    forgetting: Forgetting,
    belief: Belief,
    seen: Observed,
    body: Shape,
    focal_px: float,
    parameters: StructureTrackerParameters,
) -> Belief:
    """Factor by variational Bayes: a window frame by frame, or all frames while they are fewer (section 5.2)."""
    del body
    window = parameters.window_frames
    settings = variational.Settings(window, parameters.kept_share, forgetting)
    known = belief.known if isinstance(belief.known, Online) else None
    if known is not None and known.settings.window == window:
        known = replace(known, settings=settings)
        known = variational.step(known, seen.positions[-1], seen.variances[-1])
    elif len(seen.positions) >= window:
        known = variational.begin(len(seen.counts), settings)
        for positions, variances in zip(seen.positions[-window:], seen.variances[-window:], strict=True):
            known = variational.step(known, positions, variances)
    else:
        return _batch(seen, focal_px, parameters.wrong_odds)
    strength = _strength(known.rows, known.precisions, known.shape, known.motion)
    newest = known.motion[-2:]
    found = _upgrade(known.shape, known.shape_covariances, known.motion[:, :3], newest, focal_px)
    return Belief(found, strength, known, known.free_energy)


def _batch(seen: Observed, focal_px: float, wrong: float) -> Belief:
    if len(seen.positions) < FEWEST_VIEWS:
        return Belief()
    tracks, fit = fit_despite_outliers(Tracks(seen.positions, seen.told), wrong)
    strength = _strength(tracks.matrix, tracks.precisions, fit.shape, fit.motion)
    found = _upgrade(fit.shape, fit.shape_covariances, fit.motion[:, :3], fit.motion[-2:], focal_px)
    return Belief(found, strength, free_energy=float(fit.free_energies[-1]))


def _strength(
    rows: Floats,
    precisions: Floats,
    shape: Floats,
    motion: Floats,
) -> float:
    """Return the strength of the third direction over the noise, by the shape and by the weighted tracks alone.

    A shape may be fitted to the noise of hidden points, the tracks may have many directions where points are missing;
    the lesser of both deceives less.
    """
    totals = precisions.sum(axis=1, keepdims=True)
    means = np.divide(
        (precisions * rows).sum(axis=1, keepdims=True), totals, out=np.zeros_like(totals), where=totals > 0
    )
    values = singular_values(np.sqrt(precisions) * (rows - means))[1]
    noise = np.sqrt(float(rows.shape[0])) + np.sqrt(float(rows.shape[1]))
    return min(float(strengths_of(precisions, shape, motion)[2]), float(values[2] / noise))


def grow(
    belief: Belief, seen: Observed, body: Shape, focal_px: float, parameters: StructureTrackerParameters
) -> Belief:
    """Let a shape grow, from the mean of other bodies or from the first frames (`pftrack.vision.structure.growing`).

    A first shape that was too far off leads nowhere. It does not fit the frames, and is given up for a new one.
    """
    known = None if isinstance(belief.known, Online) else belief.known
    last = len(seen.positions) - 1
    if known is not None and (belief.misfit < WORST_MISFIT or parameters.frozen):
        return _grown_shape(_after(known, seen, last, focal_px, parameters), seen, focal_px, belief.misfit)
    first = max(0, last + 1 - FIRST_AT_MOST)
    if body.mean is not None:
        covariance = np.broadcast_to(body.prior_sd**2 * np.eye(3), (len(body.mean), 3, 3))
        begun = growing.begin(body.mean, covariance, _settings(focal_px, parameters))
        return _grown_shape(_after(begun, seen, first, focal_px, parameters), seen, focal_px)
    if last + 1 < max(parameters.first_frames, FIRST_VIEWS):
        return Belief()
    tracks, fit = fit_despite_outliers(Tracks(seen.positions[first:], seen.told[first:]), parameters.wrong_odds)
    strength = _strength(tracks.matrix, tracks.precisions, fit.shape, fit.motion)
    if not strength > SURE_STRENGTH:
        # The body has not turned, or its points lie in one plane.
        return Belief(strength=strength)
    try:
        shape = from_window(tracks, recursive.Settings(focal_px), fit)
    except ValueError:
        # The cameras determine no metric shape yet.
        return Belief(strength=strength)
    return _grown_shape(shape, seen, focal_px)


def _settings(focal_px: float, parameters: StructureTrackerParameters) -> growing.Settings:
    return growing.Settings(focal_px, frozen=parameters.frozen)


def _after(
    known: Growing | Recursive, seen: Observed, begin: int, focal_px: float, parameters: StructureTrackerParameters
) -> Growing | Recursive:
    """Return what is known after the kept frames from one on."""
    for positions, variances in zip(seen.positions[begin:], seen.variances[begin:], strict=True):
        if isinstance(known, Growing):
            known = growing.step(replace(known, settings=_settings(focal_px, parameters)), positions, variances)
        elif not parameters.frozen:
            settings = replace(known.settings, focal_px=focal_px)
            known = recursive.step(replace(known, settings=settings), positions, variances)
    return known


def _grown_shape(state: Growing | Recursive, seen: Observed, focal_px: float, misfit: float = 1.0) -> Belief:
    own = state.own if isinstance(state, Growing) else state
    camera = state.mean_camera if isinstance(state, Growing) else state.camera
    if camera is None or own.camera is None:
        raise RuntimeError("a frame has been taken, so it has a camera")
    covariances = own.shape_covariances
    # For the median point: some may never have been seen.
    noise = float(np.sqrt(np.median(np.trace(covariances, axis1=1, axis2=2)) / 3.0))
    if not (float(np.abs(own.shape).max()) < FURTHEST and noise < FURTHEST and np.isfinite(covariances).all()):
        return Belief()
    thickness = np.sqrt(max(float(_least(state.shape)), 0.0))
    found = Found(state.shape, covariances, camera, one_handed=True)
    misfit += MISFIT_SHARE * (_misfit(own.shape, own.camera, seen, focal_px) - misfit)
    return Belief(found, float(thickness / noise), state, misfit=misfit)


def _misfit(shape: Floats, camera: Floats, seen: Observed, focal_px: float) -> float:
    """Return the mean square of the last frame's residuals in units of their noise; 1 if all is as it should be."""
    rows = np.ascontiguousarray(seen.positions[-1].T)
    precisions = 1.0 / np.ascontiguousarray(seen.variances[-1].T)
    residuals, _, _ = residuals_and_slopes(Sight(focal_px, rows, precisions), camera, shape)
    free = int(np.count_nonzero(precisions)) - CAMERA_NUMBERS
    return float((precisions * residuals * residuals).sum() / free) if free > 0 else 1.0


def _least(shape: Floats) -> float:
    """Return the variance of the points in the direction in which they differ least."""
    centred = shape - shape.mean(axis=0)
    return float(eigenvalues(product(centred.T, centred) / len(shape))[0][2])


def _upgrade(
    shape: Floats,
    covariances: Floats,
    motion: Floats,
    newest: Floats,
    focal_px: float,
) -> Found:
    """Return an affine shape after the map that makes its cameras orthographic, or as nearly so as can be had.

    Args:
        shape: (n, 3) up to an affine map.
        covariances: (n, 3, 3).
        motion: (2 W, 3) rows of cameras, px.
        newest: (2, 4) rows of the last frame's camera with where its origin is seen.
        focal_px: Focal length of the pinhole that should be near it.
    """
    try:
        transform = metric_transform(motion)
    except ValueError:
        # The views do not differ enough. Then the cameras are alike in the mean, in every direction.
        mean = product(motion.T, motion) / len(motion)
        mean += (LEAST_MOTION * np.trace(mean) + LEAST_MOTION) * np.eye(3)
        transform = solve_system(cholesky(mean).T, np.eye(3))
    inverse = solve_system(transform, np.eye(3))
    rows = np.column_stack([product(newest[:, :3], transform), newest[:, 3]])
    return Found(product(shape, inverse.T), transform_covariances(covariances, inverse), pinhole_of(rows, focal_px))
