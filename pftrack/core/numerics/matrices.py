"""Small matrices: products, roots and systems of equations, to the same bits on every processor.

NumPy leaves these to a BLAS that chooses its code, and with it the order of its sums, by the processor. The matrices of
a filter are small, where a compiled loop in plain order is faster than the call of a library besides.

Names with a leading verb are for compiled loops and take two-dimensional arrays that lie together in memory; `product`,
`solve_system`, `cholesky` and `least_squares` are the same for the interpreter, and take arrays of any layout.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pftrack.core.numerics.compiled import compiled
from pftrack.core.numerics.sums import inner_product

__all__ = [
    "cholesky",
    "contiguous_copy",
    "factorise",
    "least_squares",
    "multiply",
    "principal",
    "product",
    "solve",
    "solve_system",
    "substitute",
]

NEGLIGIBLE = 1e-13
"""What is left of a column, relative to all of it, that is rounding and no direction of its own."""

ROUNDING = 1e-14
"""What is left of a variance, relative to it, when it is known and only rounding is left."""

MOST_ROUNDS = 30
"""Jacobi's method takes five or six for matrices of this size."""


def product(first: ArrayLike, second: ArrayLike) -> NDArray[np.float64]:
    """Return the matrix product of arrays (n, k) or (k,) and (k, m) or (k,).

    Raises:
        ValueError: The shapes do not fit.
    """
    left, right = contiguous_copy(first), contiguous_copy(second)
    if left.shape[-1] != right.shape[0]:
        raise ValueError(f"expected as many columns as rows, got shapes {left.shape} and {right.shape}")
    rows = left if left.ndim == 2 else left[None]
    columns = right if right.ndim == 2 else right[:, None]
    return multiply(rows, columns).reshape(left.shape[:-1] + right.shape[1:])


def solve_system(matrix: ArrayLike, wanted: ArrayLike) -> NDArray[np.float64]:
    """Return X of A X = B, given A (n, n) and B (n, m) or (n,).

    Raises:
        numpy.linalg.LinAlgError: A is singular.
    """
    right = contiguous_copy(wanted)
    found, regular = solve(contiguous_copy(matrix), right if right.ndim == 2 else right[:, None])
    if not regular:
        raise np.linalg.LinAlgError("Singular matrix")
    return found.reshape(right.shape)


def cholesky(covariance: ArrayLike) -> NDArray[np.float64]:
    """Return L, lower triangular, of L L^T = P (n, n), which may be singular; a pivot below 0 counts as 0."""
    return factorise(contiguous_copy(covariance))[0]


def least_squares(slopes: ArrayLike, wanted: ArrayLike) -> tuple[NDArray[np.float64], bool]:
    """Return X (k, m) or (k,) of the least sum of squares of A X - B, and whether A determines it.

    Args:
        slopes: A, (n, k) with n >= k.
        wanted: B, (n, m) or (n,).
    """
    right = contiguous_copy(wanted)
    found, determined = _least_squares(contiguous_copy(slopes), right if right.ndim == 2 else right[:, None])
    return found.reshape((found.shape[0], *right.shape[1:])), bool(determined)


def principal(symmetric: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the eigenvector (n,) of the greatest eigenvalue of a symmetric matrix (n, n), of either sign.

    Jacobi's method: each entry off the diagonal is turned away, round after round, until nothing is left of them.
    """
    return _principal(contiguous_copy(symmetric))


def contiguous_copy(array: ArrayLike) -> NDArray[np.float64]:
    """Return a copy that may be written and lies together: compiled code is compiled again for any other kind."""
    return np.array(array, dtype=np.float64, order="C")


@compiled
def multiply(first: NDArray[np.float64], second: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the product (n, m) of (n, k) and (k, m)."""
    rows, inner = first.shape
    columns = second.shape[1]
    result = np.zeros((rows, columns))
    for i in range(rows):
        for k in range(inner):
            factor = first[i, k]
            for j in range(columns):
                result[i, j] += factor * second[k, j]
    return result


@compiled
def factorise(covariance: NDArray[np.float64]) -> tuple[NDArray[np.float64], bool]:
    """Return L (n, n) of L L^T = P by Cholesky's method, and whether P is positive definite.

    A pivot that is 0 but for rounding, or NaN, has a column of zeros: a direction without any spread.
    """
    size = covariance.shape[0]
    lower = np.zeros((size, size))
    positive = True
    for j in range(size):
        pivot = covariance[j, j]
        for k in range(j):
            pivot -= lower[j, k] * lower[j, k]
        if not pivot > ROUNDING * covariance[j, j]:
            positive = False
            continue
        lower[j, j] = np.sqrt(pivot)
        for i in range(j + 1, size):
            rest = covariance[i, j]
            for k in range(j):
                rest -= lower[i, k] * lower[j, k]
            lower[i, j] = rest / lower[j, j]
    return lower, positive


@compiled
def substitute(lower: NDArray[np.float64], wanted: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return X (n, m) of L X = B, given L (n, n), lower triangular, and B (n, m)."""
    size, columns = wanted.shape
    found = wanted.copy()
    for i in range(size):
        for k in range(i):
            factor = lower[i, k]
            for j in range(columns):
                found[i, j] -= factor * found[k, j]
        for j in range(columns):
            found[i, j] /= lower[i, i]
    return found


@compiled
def solve(matrix: NDArray[np.float64], wanted: NDArray[np.float64]) -> tuple[NDArray[np.float64], bool]:
    """Return X (n, m) of A X = B, by elimination with row pivots, and whether A (n, n) is regular."""
    size, columns = wanted.shape
    left, right = matrix.copy(), wanted.copy()
    for k in range(size):
        best = k
        for i in range(k + 1, size):
            if abs(left[i, k]) > abs(left[best, k]):
                best = i
        if not abs(left[best, k]) > 0.0:
            return right, False
        _exchange(left, k, best)
        _exchange(right, k, best)
        for i in range(k + 1, size):
            factor = left[i, k] / left[k, k]
            _subtract(left, i, factor, k)
            _subtract(right, i, factor, k)
    for k in range(size - 1, -1, -1):
        for i in range(k + 1, size):
            _subtract(right, k, left[k, i], i)
        for j in range(columns):
            right[k, j] /= left[k, k]
    return right, True


@compiled
def _exchange(matrix: NDArray[np.float64], one: int, other: int) -> None:
    """Exchange two rows, in place."""
    for j in range(matrix.shape[1]):
        matrix[one, j], matrix[other, j] = matrix[other, j], matrix[one, j]


@compiled
def _subtract(matrix: NDArray[np.float64], row: int, factor: float, other: int) -> None:
    """Subtract a multiple of another row from a row, in place."""
    for j in range(matrix.shape[1]):
        matrix[row, j] -= factor * matrix[other, j]


@compiled
def _principal(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    size = matrix.shape[0]
    vectors = np.eye(size)
    for _ in range(MOST_ROUNDS):
        turned = False
        for i in range(size):
            for j in range(i + 1, size):
                if abs(matrix[i, j]) > NEGLIGIBLE * NEGLIGIBLE * (abs(matrix[i, i]) + abs(matrix[j, j])):
                    _turn_away(matrix, vectors, i, j)
                    turned = True
        if not turned:
            break
    best = 0
    for i in range(1, size):
        if matrix[i, i] > matrix[best, best]:
            best = i
    return vectors[:, best].copy()


@compiled
def _turn_away(matrix: NDArray[np.float64], vectors: NDArray[np.float64], i: int, j: int) -> None:
    """Turn in the plane of two axes so that a symmetric matrix has 0 at (i, j), and vectors along with it, in place."""
    half = 0.5 * (matrix[j, j] - matrix[i, i]) / matrix[i, j]
    tangent = 1.0 / (abs(half) + np.sqrt(half * half + 1.0))
    if half < 0.0:
        tangent = -tangent
    cosine = 1.0 / np.sqrt(tangent * tangent + 1.0)
    sine = tangent * cosine
    for k in range(matrix.shape[0]):
        one, other = matrix[k, i], matrix[k, j]
        matrix[k, i], matrix[k, j] = cosine * one - sine * other, sine * one + cosine * other
    for k in range(matrix.shape[0]):
        one, other = matrix[i, k], matrix[j, k]
        matrix[i, k], matrix[j, k] = cosine * one - sine * other, sine * one + cosine * other
        one, other = vectors[k, i], vectors[k, j]
        vectors[k, i], vectors[k, j] = cosine * one - sine * other, sine * one + cosine * other


@compiled
def _least_squares(slopes: NDArray[np.float64], wanted: NDArray[np.float64]) -> tuple[NDArray[np.float64], bool]:
    """Make A's columns orthonormal one after another (Gram and Schmidt, modified), B's along with them, and go back."""
    size = slopes.shape[1]
    # By rows, which lie together.
    columns, basis, rest = slopes.T.copy(), slopes.T.copy(), wanted.T.copy()
    upper, shares = np.zeros((size, size)), np.zeros((size, wanted.shape[1]))
    for k in range(size):
        left = inner_product(basis[k], basis[k])
        if not left > NEGLIGIBLE * NEGLIGIBLE * inner_product(columns[k], columns[k]):
            return np.zeros_like(shares), False
        upper[k, k] = np.sqrt(left)
        for n in range(slopes.shape[0]):
            basis[k, n] /= upper[k, k]
        for j in range(k + 1, size):
            upper[k, j] = inner_product(basis[k], basis[j])
            _subtract(basis, j, upper[k, j], k)
        for j in range(wanted.shape[1]):
            shares[k, j] = inner_product(basis[k], rest[j])
            for n in range(slopes.shape[0]):
                rest[j, n] -= shares[k, j] * basis[k, n]
    for k in range(size - 1, -1, -1):
        for i in range(k + 1, size):
            _subtract(shares, k, upper[k, i], i)
        for j in range(wanted.shape[1]):
            shares[k, j] /= upper[k, k]
    return shares, True
