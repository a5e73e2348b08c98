"""Tracks: where points of a rigid body were seen, how far that is to be trusted, and the error of a reconstruction.

From tracks of an affine camera alone a shape is known up to an affine map, 12 numbers; with cameras that are known to
be orthographic, up to a similarity. That map is fitted before the rest is an error: the distance from the truth that is
left after alignment, relative to the size of the true shape about its centre (Bando 2007, eq. 4.19).
"""

from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from pftrack.core.arrays import Bools, Floats
from pftrack.core.numerics.matrices import least_squares, product
from pftrack.vision.geometry.face import fit_similarity

FEWEST_POINTS = 4
"""Fewer always lie in one plane, and any camera fits them."""

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
        """Keep own read-only copies, and refuse what are no tracks."""
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
        kind: The maps that are allowed. A similarity may be a mirror image, since that of a shape is seen alike.

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
    mapping, determined = least_squares(known, truth)
    if not determined:
        raise ValueError("expected an estimate whose points do not lie in one plane")
    return product(known, mapping)


def residuals(estimate: Floats, truth: Floats, kind: Alignment = "affine") -> Floats:
    """Return each point's distance (n,) from the truth after alignment, in the unit of the truth."""
    return np.asarray(np.sqrt(np.square(align(estimate, truth, kind) - truth).sum(axis=1)))


def shape_error(estimate: Floats, truth: Floats, kind: Alignment = "affine") -> float:
    """Return the error of Bando 2007, eq. 4.19: what alignment leaves, relative to the truth about its centre."""
    apart = align(estimate, truth, kind) - truth
    return float(np.sqrt(np.square(apart).sum() / np.square(truth - truth.mean(axis=0)).sum()))
