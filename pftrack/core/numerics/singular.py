"""Singular values and eigenvalues of matrices of moderate size, to the same bits on every processor.

NumPy leaves these to LAPACK, whose code depends on the processor. Here they are found by rotations in the plane of two
columns, one pair after another, until all columns are at right angles (one-sided Jacobi; Hestenes 1958). Small singular
values come out as exactly as large ones, since the matrix is never multiplied by its transpose.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pftrack.core.numerics.compiled import compiled
from pftrack.core.numerics.matrices import contiguous_copy
from pftrack.core.numerics.sums import inner_product

__all__ = ["eigenvalues", "orthogonalise", "singular_values"]

RIGHT_ANGLE = 1e-15
"""The cosine of two columns below which they are at right angles."""

MOST_ROUNDS = 60
"""Six to ten are enough for the matrices that are met here."""


def singular_values(matrix: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return U (m, k), s (k,) and V (n, k) of A = U diag(s) V^T, k = min(m, n), the greatest value first.

    A vector that belongs to a singular value of zero is zero on the side of the longer axis.

    Args:
        matrix: A, (m, n), finite.
    """
    array = contiguous_copy(matrix)
    if array.shape[0] >= array.shape[1]:
        scaled, turn = orthogonalise(array.T.copy())
    else:
        turn, scaled = orthogonalise(array)[::-1]
    lengths = np.sqrt(np.square(scaled).sum(axis=1))
    order = np.argsort(-lengths, kind="stable")
    lengths, scaled, turn = lengths[order], scaled[order], turn[order]
    unit = np.divide(scaled, lengths[:, None], out=np.zeros_like(scaled), where=lengths[:, None] > 0.0)
    if array.shape[0] >= array.shape[1]:
        return unit.T.copy(), lengths, turn.T.copy()
    return turn.T.copy(), lengths, unit.T.copy()


def eigenvalues(symmetric: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the eigenvalues (n,) of a symmetric matrix (n, n), the greatest first, and the eigenvectors as columns.

    They are the singular values of the matrix less a multiple of the identity that makes it positive.
    """
    array = contiguous_copy(symmetric)
    # No eigenvalue is larger than the largest sum of a row (Gershgorin).
    bound = float(np.abs(array).sum(axis=1).max(initial=0.0))
    _, values, vectors = singular_values(array + bound * np.eye(len(array)))
    return values - bound, vectors


@compiled
def orthogonalise(rows: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return T A and T, a rotation (n, n) of the rows of A (n, m) after which they are at right angles."""
    count, size = rows.shape
    turned = rows.copy()
    turn = np.eye(count)
    for _ in range(MOST_ROUNDS):
        done = True
        for i in range(count):
            for j in range(i + 1, count):
                one, other = inner_product(turned[i], turned[i]), inner_product(turned[j], turned[j])
                both = inner_product(turned[i], turned[j])
                if not abs(both) > RIGHT_ANGLE * np.sqrt(one) * np.sqrt(other):
                    continue
                done = False
                half = 0.5 * (other - one) / both
                tangent = 1.0 / (abs(half) + np.sqrt(half * half + 1.0))
                if half < 0.0:
                    tangent = -tangent
                cosine = 1.0 / np.sqrt(tangent * tangent + 1.0)
                sine = tangent * cosine
                for k in range(size):
                    first, second = turned[i, k], turned[j, k]
                    turned[i, k], turned[j, k] = cosine * first - sine * second, sine * first + cosine * second
                for k in range(count):
                    first, second = turn[i, k], turn[j, k]
                    turn[i, k], turn[j, k] = cosine * first - sine * second, sine * first + cosine * second
        if done:
            break
    return turned, turn
