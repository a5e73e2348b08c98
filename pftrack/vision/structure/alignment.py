"""Comparing shapes: a reconstruction is known only up to a map, which is fitted before the rest is an error.

From tracks of an affine camera alone a shape is known up to an affine map, 12 numbers; with cameras that are known to
be orthographic, up to a similarity. The error is that of Bando 2007, eq. 4.19: the distance from the truth that is left
after alignment, relative to the size of the true shape about its centre.
"""

from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from pftrack.core.numerics.matrices import least_squares, product
from pftrack.vision.geometry.face_model import fit_similarity

__all__ = ["Alignment", "align", "residuals", "shape_error"]

Alignment: TypeAlias = Literal["affine", "similarity"]
MIRROR: NDArray[np.float64] = np.array([1.0, 1.0, -1.0])


def align(estimate: NDArray[np.float64], truth: NDArray[np.float64], kind: Alignment = "affine") -> NDArray[np.float64]:
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


def residuals(
    estimate: NDArray[np.float64], truth: NDArray[np.float64], kind: Alignment = "affine"
) -> NDArray[np.float64]:
    """Return each point's distance (n,) from the truth after alignment, in the unit of the truth."""
    return np.asarray(np.sqrt(np.square(align(estimate, truth, kind) - truth).sum(axis=1)))


def shape_error(estimate: NDArray[np.float64], truth: NDArray[np.float64], kind: Alignment = "affine") -> float:
    """Return the error of Bando 2007, eq. 4.19: what alignment leaves, relative to the truth about its centre."""
    apart = align(estimate, truth, kind) - truth
    return float(np.sqrt(np.square(apart).sum() / np.square(truth - truth.mean(axis=0)).sum()))
