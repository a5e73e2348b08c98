"""Positive definite matrices in compiled loops: roots, solutions and inverses.

`matrices.factorise` says of a matrix whether it is singular. Precisions here are never meant to be: what rounding has
left of a pivot is raised to `SMALLEST_PIVOT` of what it was.
"""

import numpy as np
from numpy.typing import NDArray

from pftrack.core.numerics.compiled import compiled
from pftrack.core.numerics.sums import inner_product

__all__ = ["cholesky_log_det", "cholesky_solve", "invert"]

SMALLEST_PIVOT = 1e-14
"""What is left of a precision, relative to it, at least; beyond that it is rounding."""

SMALLEST = 1e-300


@compiled
def cholesky_log_det(matrix: NDArray[np.float64]) -> tuple[NDArray[np.float64], float]:
    """Return L (n, n) of L L^T = P, of which the lower half is read, and log det P."""
    size = matrix.shape[0]
    lower = np.zeros((size, size))
    log_determinant = 0.0
    for j in range(size):
        pivot = matrix[j, j] - inner_product(lower[j, :j], lower[j, :j])
        pivot = max(pivot, SMALLEST_PIVOT * matrix[j, j], SMALLEST)
        log_determinant += np.log(pivot)
        lower[j, j] = np.sqrt(pivot)
        for i in range(j + 1, size):
            lower[i, j] = (matrix[i, j] - inner_product(lower[i, :j], lower[j, :j])) / lower[j, j]
    return lower, log_determinant


@compiled
def cholesky_solve(lower: NDArray[np.float64], wanted: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return x (n,) of L L^T x = b, given L (n, n)."""
    size = lower.shape[0]
    found = wanted.copy()
    for i in range(size):
        found[i] = (found[i] - inner_product(lower[i, :i], found[:i])) / lower[i, i]
    for i in range(size - 1, -1, -1):
        found[i] /= lower[i, i]
        for k in range(i):
            found[k] -= lower[i, k] * found[i]
    return found


@compiled
def invert(matrix: NDArray[np.float64], inverse: NDArray[np.float64]) -> float:
    """Write the inverse of a positive definite matrix (n, n), of which the lower half is read; return its log det."""
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
