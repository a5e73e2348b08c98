"""Factorization by singular values, frame by frame: what counts of all frames is a matrix of the points alone.

The shape of `factorization` are the right singular vectors of W, the positions of all frames less the means of their
rows. They are the eigenvectors of the Gram matrix W^T W (n, n), to which each frame adds its two rows. So no frame need
be kept, and a further one costs the same however many there were. Every position counts alike, as there.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pftrack.core.numerics.matrices import product
from pftrack.core.numerics.singular import eigenvalues

__all__ = ["Accumulated", "accumulate", "empty", "principal_shape"]

UNSEEN_DEPTH = 1e-13
"""The third eigenvalue, relative to the first, that is rounding."""


@dataclass(frozen=True, eq=False)
class Accumulated:
    """What is kept of all frames.

    Attributes:
        gram: (n, n) px^2, W^T W.
        frames: How many there were.
    """

    gram: NDArray[np.float64]
    frames: int


def empty(count: int) -> Accumulated:
    """Return what is kept of no frame of `count` points."""
    return Accumulated(np.zeros((count, count)), 0)


def accumulate(known: Accumulated, positions: NDArray[np.float64]) -> Accumulated:
    """Add a frame, positions (n, 2) px of all points."""
    rows = np.ascontiguousarray((positions - positions.mean(axis=0)).T)
    return Accumulated(known.gram + product(rows.T, rows), known.frames + 1)


def principal_shape(known: Accumulated) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
    """Return the shape (n, 3), up to an affine map, and the singular values (n,) of all frames, px.

    The shape is V sqrt(s), as that of `factorization.factorize` is; None where no frame has shown any depth.
    """
    values, vectors = eigenvalues(known.gram)
    strengths = np.sqrt(np.maximum(values, 0.0))
    if known.frames < 2 or not values[2] > UNSEEN_DEPTH * values[0]:
        return None
    return vectors[:, :3] * np.sqrt(strengths[:3]), strengths
