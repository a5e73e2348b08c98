"""Factorization by singular values: Tomasi and Kanade 1992 (Bando 2007, ch. 4 section 5.1).

Seen by an affine camera, the positions of n points in T frames, one row a coordinate and less the mean of the row, are
a matrix of rank three: W = M S, motion times shape. The three greatest singular values and their vectors give such
factors, up to an invertible matrix A. That the rows of a camera are orthogonal and of equal length determines A up to a
rotation and a mirror image (`metric_transform`); an affine camera cannot tell which mirror image is right.

All positions count alike, so a hidden point spoils all others; `variational` weighs them.
"""

from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from pftrack.core.arrays import Bools, Floats
from pftrack.core.numerics import matrices
from pftrack.core.numerics.compiled import compiled
from pftrack.vision.face import fit_similarity

# Tracks: where points of a rigid body were seen, how far that is to be trusted, and the error of a reconstruction.
#
# From tracks of an affine camera alone a shape is known up to an affine map, 12 numbers; with cameras that are known to
# be orthographic, up to a similarity. That map is fitted first. The error is the remaining distance from the truth
# after alignment, relative to the size of the true shape about its centre (Bando 2007, eq. 4.19).

FEWEST_POINTS = 4
"""Fewer points always lie in one plane, and any camera fits them."""

FEWEST_VIEWS = 2


@dataclass(frozen=True, eq=False)
class Tracks:
    """Points followed over frames.

    Attributes:
        positions: (T, n, 2) px; what has an infinite variance may be anything, NaN too.
        variances: (T, n, 2) px^2 of the noise of each coordinate, above 0; infinite where a point was not seen.

    Raises:
        ValueError: The shapes differ, there are too few points or frames, a variance is not above 0, or a position with
            a finite variance is not finite.
    """

    positions: Floats
    variances: Floats

    def __post_init__(self) -> None:
        """Store read-only copies, and refuse values that are not tracks."""
        positions, variances = np.array(self.positions, np.float64), np.array(self.variances, np.float64)
        if positions.ndim != 3 or positions.shape[-1] != 2 or positions.shape != variances.shape:
            raise ValueError(
                f"expected positions and variances (frames, points, 2), got {positions.shape} and {variances.shape}"
            )
        frames, points, _ = positions.shape
        if points < FEWEST_POINTS or frames < FEWEST_VIEWS:
            raise ValueError(
                f"expected at least {FEWEST_POINTS} points in {FEWEST_VIEWS} frames, got {points} points in {frames}"
            )
        _refuse(positions, variances)
        positions.flags.writeable = variances.flags.writeable = False
        object.__setattr__(self, "positions", positions)
        object.__setattr__(self, "variances", variances)

    @property
    def seen(self) -> Bools:
        """(n,) whether each point has been seen in any frame."""
        return np.asarray(np.isfinite(self.variances).any(axis=(0, 2)))

    @property
    def matrix(self) -> Floats:
        """(2 T, n) positions, by rows x_1, y_1, x_2, y_2, ...; 0 where the variance is infinite."""
        known = np.where(np.isfinite(self.variances), self.positions, 0.0)
        return rows_of(known)

    @property
    def precisions(self) -> Floats:
        """(2 T, n) inverse variances in the same order; 0 where a point was not seen."""
        return rows_of(1.0 / self.variances)


def rows_of(frames: Floats) -> Floats:
    """Return (T, n, 2) as rows (2 T, n)."""
    return np.ascontiguousarray(frames.transpose(0, 2, 1).reshape(-1, frames.shape[1]))


def check_view(positions: Floats, variances: Floats, count: int) -> tuple[Floats, Floats]:
    """Return one frame as rows (2, n) of positions, 0 where not seen, and of precisions.

    Args:
        positions: (n, 2) px.
        variances: (n, 2) px^2, infinite where a point was not seen.
        count: n, which they must have.

    Raises:
        ValueError: As for `Tracks`.
    """
    if positions.shape != (count, 2) or variances.shape != (count, 2):
        raise ValueError(f"expected positions and variances ({count}, 2), got {positions.shape} and {variances.shape}")
    _refuse(positions, variances)
    known = np.where(np.isfinite(variances), positions, 0.0)
    return np.ascontiguousarray(known.T), np.ascontiguousarray(1.0 / variances.T)


def _refuse(positions: Floats, variances: Floats) -> None:
    # Comparisons with NaN are false.
    if not (variances > 0.0).all():
        raise ValueError("expected variances above 0, got one that is not, or NaN")
    if not np.isfinite(positions[np.isfinite(variances)]).all():
        raise ValueError("expected finite positions where the variance is finite; a point not seen has an infinite one")


Alignment: TypeAlias = Literal["affine", "similarity"]
MIRROR: Floats = np.array([1.0, 1.0, -1.0])


def align(estimate: Floats, truth: Floats, kind: Alignment = "affine") -> Floats:
    """Return an estimated shape (n, 3) mapped onto the true one with the least sum of squared distances.

    Args:
        estimate: (n, 3).
        truth: (n, 3).
        kind: The maps that are allowed. A similarity may include a mirror image, since a mirrored shape gives the same
            views.

    Raises:
        ValueError: The shapes differ, a number is not finite, or the estimate does not determine the map.
    """
    if estimate.shape != truth.shape or estimate.ndim != 2 or estimate.shape[1] != 3:
        raise ValueError(f"expected two shapes (n, 3), got {estimate.shape} and {truth.shape}")
    if not (np.isfinite(estimate).all() and np.isfinite(truth).all()):
        raise ValueError("expected finite shapes, got one that is not")
    if kind == "similarity":
        candidates = [fit_similarity(one, truth)(one) for one in (estimate, estimate * MIRROR)]
        return min(candidates, key=lambda mapped: float(np.square(mapped - truth).sum()))
    # Centred, since a far origin would cost digits.
    known = np.column_stack([estimate - estimate.mean(axis=0), np.ones(len(estimate))])
    mapping, determined = matrices.least_squares(known, truth)
    if not determined:
        raise ValueError("expected an estimate whose points do not lie in one plane")
    return matrices.product(known, mapping)


def residuals(estimate: Floats, truth: Floats, kind: Alignment = "affine") -> Floats:
    """Return each point's distance (n,) from the truth after alignment, in the unit of the truth."""
    return np.asarray(np.sqrt(np.square(align(estimate, truth, kind) - truth).sum(axis=1)))


def shape_error(estimate: Floats, truth: Floats, kind: Alignment = "affine") -> float:
    """Return the error of Bando 2007, eq. 4.19: what alignment leaves, relative to the truth about its centre."""
    apart = align(estimate, truth, kind) - truth
    return float(np.sqrt(np.square(apart).sum() / np.square(truth - truth.mean(axis=0)).sum()))


UNSEEN_DEPTH = 1e-10
"""The third singular value, relative to the first, that is rounding."""

FEWEST_METRIC_VIEWS = 3
"""Two leave a family of shapes (Ullman 1979)."""

SMALLEST_SQUARE = 1e-9
"""Eigenvalues of A A^T, relative to the greatest, are at least this: noise may make them negative."""


@dataclass(frozen=True, eq=False)
class Factorization:
    """Motion and shape of a body.

    Attributes:
        motion: (2 T, 3) rows of the cameras, x and y alternating, px per unit of the shape.
        shape: (n, 3).
        offsets: (2 T,) px, where the shape's origin is seen.
        strengths: The singular values (min(2 T, n),), px. If the third does not stand out from the fourth, noise hides
            the depth: there was too little rotation, or the points lie in one plane.
    """

    motion: Floats
    shape: Floats
    offsets: Floats
    strengths: Floats


def factorize(tracks: Tracks) -> Factorization:
    """Factor tracks into motion and shape, up to an affine map; variances are ignored.

    Raises:
        ValueError: A point is missing in a frame, or the depth leaves no trace at all: the body does not turn, or its
            points lie in one plane.
    """
    missing = ~np.isfinite(tracks.variances).all(axis=(0, 2))
    if missing.any():
        raise ValueError(
            f"expected every point in every frame, but point {int(np.argmax(missing))} is missing in some; "
            "the variational factorization needs no more than some of them"
        )
    rows = tracks.matrix
    offsets = rows.mean(axis=1)
    left, strengths, right = matrices.singular_values(rows - offsets[:, None])
    if not strengths[2] > UNSEEN_DEPTH * strengths[0]:
        raise ValueError(
            "expected a body that turns and points that do not lie in one plane, got tracks without any depth "
            f"(singular values {strengths[0]:.3g}, {strengths[1]:.3g}, {strengths[2]:.3g} px)"
        )
    roots = np.sqrt(strengths[:3])
    return Factorization(left[:, :3] * roots, right[:, :3] * roots, offsets, strengths)


def metric_transform(motion: Floats) -> Floats:
    """Return A (3, 3) such that the rows of the motion M A are orthogonal and of length 1, and the shape A^-1 s in px.

    Args:
        motion: (2 T, 3) up to an affine map.

    Raises:
        ValueError: The cameras do not determine the map, since there are too few or they do not differ in rotation.
    """
    return _root(_metric(motion))


def _metric(motion: Floats) -> Floats:
    """Return Q = A A^T (3, 3) by least squares from the constraints on each pair of rows."""
    across, down = motion[0::2], motion[1::2]
    if len(across) < FEWEST_METRIC_VIEWS:
        raise ValueError(f"expected at least {FEWEST_METRIC_VIEWS} views for a metric shape, got {len(across)}")
    equations = np.concatenate([_quadratic(across, across), _quadratic(down, down), _quadratic(across, down)])
    wanted = np.repeat([1.0, 1.0, 0.0], len(across))
    entries, determined = matrices.least_squares(equations, wanted)
    if not determined:
        raise ValueError("expected views that differ in rotation; these do not determine a metric shape")
    xx, yy, zz, xy, xz, yz = entries
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def _quadratic(first: Floats, second: Floats) -> Floats:
    """Return the coefficients (T, 6) of a^T Q b in the entries xx, yy, zz, xy, xz, yz of Q."""
    squares = first * second
    pairs = [first[:, i] * second[:, j] + first[:, j] * second[:, i] for i, j in ((0, 1), (0, 2), (1, 2))]
    return np.column_stack([squares, *pairs])


def _root(metric: Floats) -> Floats:
    """Return A (3, 3) of A A^T = Q; eigenvalues below the smallest that are plausible are raised to that."""
    values, vectors = matrices.eigenvalues(matrices.contiguous_copy(metric))
    if not values[0] > 0.0:
        raise ValueError("expected cameras with rows at right angles; no map makes them so")
    return np.asarray(vectors * np.sqrt(np.maximum(values, SMALLEST_SQUARE * values[0])))


# `matrices.factorise` reports a singular matrix. Precisions here should never be singular: a pivot that rounding has
# reduced is raised to `SMALLEST_PIVOT` of its first value.

SMALLEST_PIVOT = 1e-14
"""Least relative remainder of a precision; less is rounding."""

SMALLEST = 1e-300


@compiled
def cholesky_log_det(matrix: Floats) -> tuple[Floats, float]:
    """Return L (n, n) of L L^T = P, and log det P; only the lower half of P is read."""
    size = matrix.shape[0]
    lower = np.zeros((size, size))
    log_determinant = 0.0
    for j in range(size):
        pivot = matrix[j, j] - matrices.inner_product(lower[j, :j], lower[j, :j])
        pivot = max(pivot, SMALLEST_PIVOT * matrix[j, j], SMALLEST)
        log_determinant += np.log(pivot)
        lower[j, j] = np.sqrt(pivot)
        for i in range(j + 1, size):
            lower[i, j] = (matrix[i, j] - matrices.inner_product(lower[i, :j], lower[j, :j])) / lower[j, j]
    return lower, log_determinant


@compiled
def cholesky_solve(lower: Floats, wanted: Floats) -> Floats:
    """Return x (n,) of L L^T x = b, given L (n, n)."""
    size = lower.shape[0]
    found = wanted.copy()
    for i in range(size):
        found[i] = (found[i] - matrices.inner_product(lower[i, :i], found[:i])) / lower[i, i]
    for i in range(size - 1, -1, -1):
        found[i] /= lower[i, i]
        for k in range(i):
            found[k] -= lower[i, k] * found[i]
    return found


@compiled
def invert(matrix: Floats, inverse: Floats) -> float:
    """Write the inverse of a positive definite matrix (n, n), reading its lower half; return its log det."""
    size = matrix.shape[0]
    lower, log_determinant = cholesky_log_det(matrix)
    # The inverse of the root, in place, and then its product with its transpose.
    for j in range(size):
        lower[j, j] = 1.0 / lower[j, j]
        for i in range(j + 1, size):
            rest = 0.0
            for k in range(j, i):
                rest -= lower[i, k] * lower[k, j]
            lower[i, j] = rest / lower[i, i]
    for i in range(size):
        for j in range(i + 1):
            entry = 0.0
            for k in range(i, size):
                entry += lower[k, i] * lower[k, j]
            inverse[i, j] = entry
            inverse[j, i] = entry
    return log_determinant
