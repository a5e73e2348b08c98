"""A shape updated with every frame: the joint covariance of all its points, each frame's camera integrated out.

Bando's online method (`variational`) keeps a window of frames and averages the shape over time. It takes shape and
motion as independent, so it processes the frames of its window repeatedly, and it assumes a distant camera. The method
here is this project's own. The belief in all points together is one Gaussian over 3 n numbers, kept as mean and
precision. A frame adds the precision of its positions, less the information spent on the frame's own camera, a pinhole
that is fitted anew and integrated out:

    P <- P + sum w a a^T - C B^-1 C^T,

where a is the derivative of a position by the points, B the precision of the camera and C their coupling: the
Gauss-Newton method with the Schur complement of bundle adjustment. So the information of old views remains although no
frame is stored. Whatever the views do not determine, such as depth before any turn, stays as uncertain as in the prior.

The prior is the mean and covariance of other bodies of the kind, so there is a shape from the first frame on. Without
one (`from_window`) the prior is the metric variational factorization of the first frames, which are then processed
again one by one. A distant camera cannot distinguish the two mirror images; a near one prefers the true one.

**Forgetting.** With `memory` below 1 a point's precision decays, towards the prior's, in proportion to the frame's
information on it relative to the best-seen point: hidden points are not forgotten (Bando 2007, ch. 4 section 5.5
proposes that).
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from pftrack.core.arrays import Bools, Floats
from pftrack.core.geometry import nearest_rotation
from pftrack.core.numerics.compiled import compiled
from pftrack.core.numerics.matrices import eigenvalues, inner_product, product
from pftrack.vision.structure import cameras, factorization, variational
from pftrack.vision.structure.variational import Variational

TURN_SD_RAD = 0.1
"""Default standard deviation of the rotation: 6 degrees from frame to frame."""

FIRST_ROUNDS, LATER_ROUNDS = 30, 6
"""Largest numbers of steps of the camera, in the first frame and in the others."""

HALVINGS = 4
"""Largest number of halvings of a step that makes the fit worse."""

CLOSE = 1e-3
"""A change that promises to lower the squared distances, in units of their noise, by less than this is not made."""


@dataclass(frozen=True, slots=True)
class Settings:
    """The settings.

    Attributes:
        focal_px: Focal length of the pinhole.
        memory: 0..1, share of a well-seen point's precision that is kept per frame; 1 forgets nothing.
        turn_sd_rad: Standard deviation of the rotation about each axis from frame to frame.
        rounds: Gauss-Newton steps on the shape per frame.
    """

    focal_px: float
    memory: float = 1.0
    turn_sd_rad: float = TURN_SD_RAD
    rounds: int = 2

    def __post_init__(self) -> None:
        """Refuse invalid cameras and memories."""
        if not (0.0 < self.focal_px < np.inf and self.turn_sd_rad > 0.0):
            raise ValueError(
                "expected a focal length and a deviation of the rotation above 0, "
                f"got {self.focal_px:g} and {self.turn_sd_rad:g}"
            )
        if not 0.0 <= self.memory <= 1.0 or self.rounds < 1:
            raise ValueError(
                f"expected a memory of 0 to 1 and at least one round, got {self.memory:g} and {self.rounds}"
            )


@dataclass(frozen=True, eq=False)
class Recursive:
    """The state after a frame, immutable.

    Attributes:
        settings: The settings.
        shape: (n, 3) means of the points, in the unit of the prior.
        precision: (3 n, 3 n) joint precision of all coordinates, point by point.
        prior_shape: (n, 3) shape to which forgotten points return.
        prior_precision: (3 n, 3 n).
        camera: (3, 4) of the last frame, (R, T); None before the first.
        reference: (3, 4) camera of the first frame, from which rotations count; None before it.
        frames: Number of frames used.
        log_evidence: The log density that the belief gave to the last frame before it was taken, up to a constant as
            of `cameras.evidence`; 0 before the first.
    """

    settings: Settings
    shape: Floats
    precision: Floats
    prior_shape: Floats
    prior_precision: Floats
    camera: Floats | None = None
    reference: Floats | None = None
    frames: int = 0
    log_evidence: float = 0.0

    @cached_property
    def covariance(self) -> Floats:
        """(3 n, 3 n) of all coordinates together."""
        inverse = np.empty_like(self.precision)
        factorization.invert(self.precision, inverse)
        return inverse

    @property
    def shape_covariances(self) -> Floats:
        """(n, 3, 3) of each point."""
        count = len(self.shape)
        blocks = self.covariance.reshape(count, 3, count, 3)
        return blocks[np.arange(count), :, np.arange(count)].copy()


def begin(
    shape: Floats,
    covariance: Floats,
    settings: Settings,
    camera: Floats | None = None,
) -> Recursive:
    """Begin with a belief in the shape.

    Args:
        shape: (n, 3) mean of the prior.
        covariance: (3 n, 3 n) of all its coordinates together, or (n, 3, 3) of independent points; positive definite.
        settings: The settings.
        camera: (3, 4) near that of the first frame; if not given the shape is first seen from the front.

    Raises:
        ValueError: There are fewer than four points, the arrays do not fit, or a number is not finite.
    """
    count = len(shape)
    if shape.shape != (count, 3) or count < factorization.FEWEST_POINTS:
        raise ValueError(f"expected a shape (n, 3) of at least {factorization.FEWEST_POINTS} points, got {shape.shape}")
    if covariance.shape == (count, 3, 3):
        joint = np.zeros((count, 3, count, 3))
        joint[np.arange(count), :, np.arange(count)] = covariance
        covariance = joint.reshape(3 * count, 3 * count)
    if covariance.shape != (3 * count, 3 * count):
        raise ValueError(f"expected a covariance {(3 * count, 3 * count)}, got {covariance.shape}")
    if camera is not None and camera.shape != (3, 4):
        raise ValueError(f"expected a camera (3, 4), got {camera.shape}")
    if not all(np.isfinite(given).all() for given in (shape, covariance, camera) if given is not None):
        raise ValueError("expected finite numbers in shape, covariance and camera, got one that is not")
    precision = np.empty((3 * count, 3 * count))
    factorization.invert(np.array(covariance, np.float64, order="C"), precision)
    mean = np.array(shape, np.float64, order="C")
    first = None if camera is None else np.array(camera, np.float64, order="C")
    return Recursive(settings, mean, precision, mean, precision, first)


def step(state: Recursive, positions: Floats, variances: Floats) -> Recursive:
    """Take a frame.

    Args:
        state: The state before.
        positions: (n, 2) px from the principal point.
        variances: (n, 2) px^2, infinite where a point was not seen.

    Raises:
        ValueError: The shapes differ, a variance is not above 0, or a position that was seen is not finite.
    """
    return take(
        state,
        cameras.Sight(
            float(state.settings.focal_px), *factorization.check_view(positions, variances, len(state.shape))
        ),
    )


def take(state: Recursive, sight: cameras.Sight) -> Recursive:
    """Take a frame that was checked."""
    camera = cameras.frontal(sight, state.shape) if state.camera is None else state.camera
    start, held = state.shape, state.precision
    # In the first frame it changes nothing, but compiles the function at the start rather than in a later frame.
    if state.settings.memory < 1.0 or state.frames == 0:
        prior = state.prior_shape, state.prior_precision
        start, held = _forgotten(start, held, prior, sight.precisions, float(state.settings.memory))
    rounds = FIRST_ROUNDS if state.frames == 0 else LATER_ROUNDS
    turn_precision = 1.0 / state.settings.turn_sd_rad**2
    reference = state.reference
    if reference is None:
        reference = cameras.fit_camera(sight, camera, state.shape, camera, turn_precision, rounds)
    shape, precision, camera, log_evidence = _improve(
        sight, start, held, camera, reference, turn_precision, state.settings.rounds, rounds
    )
    return replace(
        state,
        shape=shape,
        precision=precision,
        camera=camera,
        reference=reference,
        frames=state.frames + 1,
        log_evidence=log_evidence,
    )


def _improve(
    sight: cameras.Sight,
    start: Floats,
    held: Floats,
    before: Floats,
    reference: Floats,
    turn_precision: float,
    rounds: int,
    camera_rounds: int,
) -> tuple[Floats, Floats, Floats, float]:
    """Return shape, precision, camera and log evidence after a frame, given the belief before it.

    Not compiled: it calls a dozen compiled functions a frame, each of which would be compiled into it once more.
    """
    _, log_before = factorization.cholesky_log_det(held)
    shape = start
    camera = cameras.fit_camera(sight, before, shape, before, turn_precision, camera_rounds)
    seen = before, reference, start, held, turn_precision
    precision, gradient, cost, log_camera = _combine(sight, camera, shape, seen)
    for _ in range(rounds):
        change, gain = _newton_step(precision, gradient)
        if gain < CLOSE:
            break
        better = False
        for _ in range(HALVINGS):
            tried = shape + change.reshape(start.shape)
            seen_from = cameras.fit_camera(sight, camera, tried, before, turn_precision, camera_rounds)
            fresh = _combine(sight, seen_from, tried, seen)
            if fresh[2] <= cost:
                shape, camera = tried, seen_from
                precision, gradient, cost, log_camera = fresh
                better = True
                break
            change *= 0.5
        if not better:
            break
    _, log_after = factorization.cholesky_log_det(precision)
    return shape, precision, camera, -0.5 * (cost + log_after - log_before + log_camera)


@compiled
def _newton_step(precision: Floats, gradient: Floats) -> tuple[Floats, float]:
    """Return Newton's step, and the predicted decrease of the cost."""
    lower, _ = factorization.cholesky_log_det(precision)
    change = factorization.cholesky_solve(lower, gradient)
    return change, inner_product(change, gradient)


@compiled
def _combine(
    sight: cameras.Sight, camera: Floats, shape: Floats, seen: tuple[Floats, Floats, Floats, Floats, float]
) -> tuple[Floats, Floats, float, float]:
    """Return precision and gradient of the shape with the camera integrated out, the cost, and log det B.

    Args:
        sight: The frame.
        camera: (3, 4) fitted to it.
        shape: (n, 3) that is tried.
        seen: The state before the frame: its camera, that of the first frame, the shape and its precision, and the
            precision of the turn between two frames.
    """
    before, reference, start, held, turn_precision = seen
    size, precisions = 3 * shape.shape[0], sight.precisions
    residuals, _, _ = cameras.residuals_and_slopes(sight, camera, shape)
    steady = cameras.steady_camera(sight, camera, reference, shape)
    _, by_point, by_camera = cameras.residuals_and_slopes(sight, steady, shape)
    normal, wanted, cost = cameras.normal_of(
        residuals, by_camera, precisions, cameras.turn_between(camera, before), turn_precision
    )
    precision, gradient, coupling = held.copy(), np.zeros(size), np.zeros((size, cameras.SIZE))
    away = (start - shape).reshape(size)
    for i in range(size):
        gradient[i] = inner_product(held[i], away)
        cost += away[i] * gradient[i]
    for d in range(2):
        for n in range(shape.shape[0]):
            for i in range(3):
                place, slope = 3 * n + i, precisions[d, n] * by_point[d, n, i]
                gradient[place] += slope * residuals[d, n]
                for j in range(3):
                    precision[place, 3 * n + j] += slope * by_point[d, n, j]
                for k in range(cameras.SIZE):
                    coupling[place, k] += slope * by_camera[d, n, k]
    lower, log_camera = factorization.cholesky_log_det(normal)
    _pay(precision, gradient, coupling, wanted, lower)
    return precision, gradient, cost, log_camera


@compiled
def _pay(precision: Floats, gradient: Floats, coupling: Floats, wanted: Floats, lower: Floats) -> None:
    """Subtract C B^-1 C^T from the precision, and C B^-1 times the camera's gradient from the gradient, in place.

    The factor L of B = L L^T is given.
    """
    size = coupling.shape[0]
    for k in range(cameras.SIZE):
        for m in range(k):
            wanted[k] -= lower[k, m] * wanted[m]
            for i in range(size):
                coupling[i, k] -= lower[k, m] * coupling[i, m]
        wanted[k] /= lower[k, k]
        for i in range(size):
            coupling[i, k] /= lower[k, k]
    for i in range(size):
        for k in range(cameras.SIZE):
            gradient[i] -= coupling[i, k] * wanted[k]
        for j in range(i + 1):
            paid = 0.0
            for k in range(cameras.SIZE):
                paid += coupling[i, k] * coupling[j, k]
            precision[i, j] -= paid
            precision[j, i] = precision[i, j]


@compiled
def _forgotten(
    shape: Floats, known: Floats, prior: tuple[Floats, Floats], precisions: Floats, memory: float
) -> tuple[Floats, Floats]:
    """Return shape and precision after what is well seen has been forgotten a little, towards the prior's."""
    prior_shape, prior_precision = prior
    count = shape.shape[0]
    kept = precisions[0] + precisions[1]
    most = kept.max()
    for n in range(count):
        kept[n] = 1.0 - (1.0 - memory) * (kept[n] / most) if most > 0.0 else 1.0
    held, pull = np.empty_like(known), np.zeros(3 * count)
    for p in range(3 * count):
        for q in range(3 * count):
            keep, back = np.sqrt(kept[p // 3] * kept[q // 3]), np.sqrt((1.0 - kept[p // 3]) * (1.0 - kept[q // 3]))
            held[p, q] = keep * known[p, q] + back * prior_precision[p, q]
            pull[p] += back * prior_precision[p, q] * (prior_shape[q // 3, q % 3] - shape[q // 3, q % 3])
    lower, _ = factorization.cholesky_log_det(held)
    return shape + factorization.cholesky_solve(lower, pull).reshape(count, 3), held


# Factorization by singular values has a form frame by frame, too. The shape of `factorization` are the right singular
# vectors of W, the positions of all frames less the means of their rows. They are the eigenvectors of the Gram matrix
# W^T W (n, n), to which each frame adds its two rows. So no frame need be kept, and a further one costs the same
# however many there were. Every position counts alike, as there.

UNSEEN_DEPTH = 1e-13
"""The third eigenvalue, relative to the first, that is rounding."""


@dataclass(frozen=True, eq=False)
class Accumulated:
    """The summary of all frames.

    Attributes:
        gram: (n, n) px^2, W^T W.
        frames: How many there were.
    """

    gram: Floats
    frames: int


def empty(count: int) -> Accumulated:
    """Return what is kept of no frame of `count` points."""
    return Accumulated(np.zeros((count, count)), 0)


def accumulate(known: Accumulated, positions: Floats) -> Accumulated:
    """Add a frame, positions (n, 2) px of all points."""
    rows = np.ascontiguousarray((positions - positions.mean(axis=0)).T)
    return Accumulated(known.gram + product(rows.T, rows), known.frames + 1)


def principal_shape(known: Accumulated) -> tuple[Floats, Floats] | None:
    """Return the shape (n, 3), up to an affine map, and the singular values (n,) of all frames, px.

    The shape is V sqrt(s), as that of `factorization.factorize` is; None where no frame has shown any depth.
    """
    values, vectors = eigenvalues(known.gram)
    strengths = np.sqrt(np.maximum(values, 0.0))
    if known.frames < 2 or not values[2] > UNSEEN_DEPTH * values[0]:
        return None
    return vectors[:, :3] * np.sqrt(strengths[:3]), strengths


SPREAD = 0.15
"""Standard deviation of the first shape's coordinates, relative to that of the points about their centre. With a larger
one the first frames cause jumps from which the shape does not recover."""

LEAST_STRENGTH = 1.5
"""Strength of the third direction of the shape below which it may be noise."""

SMALLEST = 1e-12
"""Scale of a camera without measurements."""


def from_window(tracks: factorization.Tracks, settings: Settings, found: Variational | None = None) -> Recursive:
    """Begin without a prior, by the variational factorization of the first frames; the unit is such that 1 is 1 px.

    Args:
        tracks: The first frames; positions from the principal point.
        settings: The settings.
        found: Their factorization, if it is there already.

    Raises:
        ValueError: The frames do not determine a shape: there are fewer than three, or they show no rotation or no
            depth.
    """
    found = found or variational.fit(tracks)
    if not found.strengths[2] > LEAST_STRENGTH:
        raise ValueError(
            "expected a body that turns and points that do not lie in one plane: the depth in these frames is no more "
            f"than noise makes (strength {found.strengths[2]:.2g}, at least {LEAST_STRENGTH:g} is needed)"
        )
    found = variational.metric(found)
    if not np.isfinite(found.shape).all():
        raise ValueError("expected cameras that determine a metric shape, got frames from which none comes")
    best: tuple[float, Recursive] | None = None
    for state in _mirror(found, settings, tracks.seen):
        total, after = 0.0, state
        for positions, variances in zip(tracks.positions, tracks.variances, strict=True):
            after = step(after, positions, variances)
            total += after.log_evidence
        if best is None or total > best[0]:
            best = total, after
    if best is None:
        raise RuntimeError("there are two mirror images")
    return best[1]


def _mirror(found: Variational, settings: Settings, seen: Bools) -> Iterator[Recursive]:
    """Yield the beginnings with both mirror images of a metric shape; a point that was never seen may be anywhere."""
    spread = SPREAD * float(np.sqrt(found.shape.var(axis=0).mean()))
    covariance = np.where(seen[:, None, None], spread**2 * np.eye(3), found.shape_covariances)
    for sign in (1.0, -1.0):
        mirror = np.array([1.0, 1.0, sign])
        yield begin(
            found.shape * mirror,
            covariance * np.outer(mirror, mirror),
            settings,
            pinhole_of(found.motion[:2] * np.append(mirror, 1.0), settings.focal_px),
        )


def pinhole_of(rows: Floats, focal_px: float) -> Floats:
    """Return the pinhole (3, 4) that is nearest to the rows (2, 4) of an orthographic camera."""
    across, down = rows[:, :3]
    scale = max(float(np.sqrt(0.5 * (np.square(across).sum() + np.square(down).sum()))), SMALLEST)
    turn = nearest_rotation(np.array([across, down, np.cross(across, down) / scale]))
    return np.column_stack([turn, [rows[0, 3] / scale, rows[1, 3] / scale, focal_px / scale]])
