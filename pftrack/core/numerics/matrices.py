"""Small matrices, sums and cameras, with the same bits on every processor.

NumPy leaves products, roots and systems of equations to a BLAS that chooses its code, and with it the order of its
sums, by the processor. The matrices of a filter are small; for them a compiled loop in plain order is also faster than
a library call.

Names with a leading verb are for compiled loops and take contiguous two-dimensional arrays; `product`, `solve_system`,
`cholesky` and `least_squares` are the same for the interpreter, and take arrays of any layout.
"""

from collections.abc import Callable, Sequence
from typing import Any, TypeAlias, cast

import numpy as np
from llvmlite import ir
from numba.core import cgutils
from numba.extending import intrinsic
from numpy.typing import ArrayLike, NDArray

from pftrack.core.arrays import Floats
from pftrack.core.numerics.compiled import compiled

# A sum of floating-point numbers depends on its order. A compiler that must keep the order of a loop adds one number
# after the other, four times slower than it could; one that may choose chooses by the processor. These two sums define
# the order: the terms are distributed over sixteen lanes in turn, each lane adds its terms from the first to the last,
# and the lanes are added in halves (the first eight to the last eight, then four to four, and so on). The remaining
# terms, fewer than sixteen, are summed one after the other and added last. Sixteen lanes are four vectors of AVX2,
# which keep its adders busy.
#
# They work inside compiled loops only, on contiguous arrays.

LANES = 16

Numbers: TypeAlias = Floats | NDArray[np.float32]


def _type_product(typing_context: Any, first: Any, second: Any) -> tuple[Any, Any]:  # noqa: ANN401 - numba's types
    del typing_context
    return first.dtype(first, second), _generate


def _type_total(typing_context: Any, values: Any) -> tuple[Any, Any]:  # noqa: ANN401 - numba's types
    del typing_context
    return values.dtype(values), _generate


def _generate(context: Any, builder: Any, signature: Any, arguments: Sequence[Any]) -> Any:  # noqa: ANN401 - numba's
    """Write the sum of the products of one or two arrays in LLVM's language."""
    arrays = [
        context.make_array(kind)(context, builder, value) for kind, value in zip(signature.args, arguments, strict=True)
    ]
    number = context.get_data_type(signature.return_type)
    lanes = ir.VectorType(number, LANES)
    size = arrays[0].nitems
    whole = builder.and_(size, ir.Constant(size.type, -LANES))

    def add_terms(kind: Any, begin: Any, end: Any, step: int) -> Any:  # noqa: ANN401 - values of LLVM
        """Add up terms of a kind, one number or sixteen, from begin to end."""
        zero = [0.0] * LANES if kind is lanes else 0.0
        place = cgutils.alloca_once_value(builder, ir.Constant(kind, zero))  # type: ignore[no-untyped-call] # numba has none
        with cgutils.for_range_slice(builder, begin, end, ir.Constant(size.type, step)) as (index, _):
            term = None
            for array in arrays:
                address = builder.bitcast(builder.gep(array.data, [index]), kind.as_pointer())
                factor = builder.load(address, align=context.get_abi_sizeof(number))
                term = factor if term is None else builder.fmul(term, factor)
            builder.store(builder.fadd(builder.load(place), term), place)
        return builder.load(place)

    sums = add_terms(lanes, ir.Constant(size.type, 0), whole, LANES)
    half = LANES
    while half > 1:
        half //= 2
        low, high = (
            builder.shuffle_vector(sums, ir.Constant(sums.type, ir.Undefined), _indices(begin, half))
            for begin in (0, half)
        )
        sums = builder.fadd(low, high)
    rest = add_terms(number, whole, size, 1)
    return builder.fadd(builder.extract_element(sums, ir.Constant(ir.IntType(32), 0)), rest)


def _indices(begin: int, count: int) -> Any:  # noqa: ANN401 - a value of LLVM
    return ir.Constant(ir.VectorType(ir.IntType(32), count), list(range(begin, begin + count)))


inner_product = cast("Callable[[Numbers, Numbers], float]", intrinsic(_type_product))
"""sum_n a_n b_n of arrays (n,) of the same type and size."""

total = cast("Callable[[Numbers], float]", intrinsic(_type_total))
"""sum_n a_n of an array (n,)."""

NEGLIGIBLE = 1e-13
"""Relative remainder of a column that is rounding rather than an independent direction."""

ROUNDING = 1e-14
"""Relative remainder of a variance that is only rounding."""

MOST_ROUNDS = 30
"""Jacobi's method takes five or six for matrices of this size."""


def product(first: ArrayLike, second: ArrayLike) -> Floats:
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


def solve_system(matrix: ArrayLike, wanted: ArrayLike) -> Floats:
    """Return X of A X = B, given A (n, n) and B (n, m) or (n,).

    Raises:
        numpy.linalg.LinAlgError: A is singular.
    """
    right = contiguous_copy(wanted)
    found, regular = solve(contiguous_copy(matrix), right if right.ndim == 2 else right[:, None])
    if not regular:
        raise np.linalg.LinAlgError("Singular matrix")
    return found.reshape(right.shape)


def cholesky(covariance: ArrayLike) -> Floats:
    """Return L, lower triangular, of L L^T = P (n, n), which may be singular; a pivot below 0 counts as 0."""
    return factorise(contiguous_copy(covariance))[0]


def least_squares(slopes: ArrayLike, wanted: ArrayLike) -> tuple[Floats, bool]:
    """Return X (k, m) or (k,) of the least sum of squares of A X - B, and whether A determines it.

    Args:
        slopes: A, (n, k) with n >= k.
        wanted: B, (n, m) or (n,).
    """
    right = contiguous_copy(wanted)
    found, determined = _least_squares(contiguous_copy(slopes), right if right.ndim == 2 else right[:, None])
    return found.reshape((found.shape[0], *right.shape[1:])), bool(determined)


def principal(symmetric: Floats) -> Floats:
    """Return the eigenvector (n,) of the greatest eigenvalue of a symmetric matrix (n, n), of either sign.

    Jacobi's method: rotations remove each entry off the diagonal, round after round, until all vanish.
    """
    return _principal(contiguous_copy(symmetric))


def contiguous_copy(array: ArrayLike) -> Floats:
    """Return a writable contiguous copy; numba would compile again for any other layout.

    Raises:
        TypeError: It does not hold real numbers.
    """
    return np.asarray(array).astype(np.float64, order="C", casting="same_kind")


@compiled
def multiply(first: Floats, second: Floats) -> Floats:
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
def factorise(covariance: Floats) -> tuple[Floats, bool]:
    """Return L (n, n) of L L^T = P by Cholesky's method, and whether P is positive definite.

    A pivot that is 0 up to rounding, or NaN, has a column of zeros: a direction without spread.
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
def substitute(lower: Floats, wanted: Floats) -> Floats:
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
def solve(matrix: Floats, wanted: Floats) -> tuple[Floats, bool]:
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
def _exchange(matrix: Floats, one: int, other: int) -> None:
    """Exchange two rows, in place."""
    for j in range(matrix.shape[1]):
        matrix[one, j], matrix[other, j] = matrix[other, j], matrix[one, j]


@compiled
def _subtract(matrix: Floats, row: int, factor: float, other: int) -> None:
    """Subtract a multiple of another row from a row, in place."""
    for j in range(matrix.shape[1]):
        matrix[row, j] -= factor * matrix[other, j]


@compiled
def _principal(matrix: Floats) -> Floats:
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
def _turn_away(matrix: Floats, vectors: Floats, i: int, j: int) -> None:
    """Rotate a symmetric matrix in the plane of two axes to get 0 at (i, j), and vectors with it, in place."""
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
def _least_squares(slopes: Floats, wanted: Floats) -> tuple[Floats, bool]:
    """Make A's columns orthonormal one after another (Gram and Schmidt, modified), B's along with them, and go back."""
    size = slopes.shape[1]
    # By rows, which are contiguous.
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


# NumPy leaves singular values and eigenvalues to LAPACK, whose code depends on the processor. Here they are found by
# rotations in the plane of two columns, one pair after another, until all columns are at right angles (one-sided
# Jacobi; Hestenes 1958). Small singular values are exactly as precise as large ones, since the matrix is never
# multiplied by its transpose.

RIGHT_ANGLE = 1e-15
"""The cosine of two columns below which they are at right angles."""

MOST_SWEEPS = 60
"""Six to ten are enough for the matrices that are met here."""


def singular_values(matrix: ArrayLike) -> tuple[Floats, Floats, Floats]:
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


def eigenvalues(symmetric: ArrayLike) -> tuple[Floats, Floats]:
    """Return the eigenvalues (n,) of a symmetric matrix (n, n), the greatest first, and the eigenvectors as columns.

    They are the singular values of the matrix less a multiple of the identity that makes it positive.
    """
    array = contiguous_copy(symmetric)
    # No eigenvalue is larger than the largest sum of a row (Gershgorin).
    bound = float(np.abs(array).sum(axis=1).max(initial=0.0))
    _, values, vectors = singular_values(array + bound * np.eye(len(array)))
    return values - bound, vectors


@compiled
def orthogonalise(rows: Floats) -> tuple[Floats, Floats]:
    """Return T A and T, a rotation (n, n) of the rows of A (n, m) after which they are at right angles."""
    count, size = rows.shape
    turned = rows.copy()
    turn = np.eye(count)
    for _ in range(MOST_SWEEPS):
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


# A *pinhole* of focal length f, in px, sees the point (X, Y, Z) of its own frame at (f X/Z, f Y/Z) from its principal
# point. It describes real cameras, but is not linear. An *affine camera* is the linear map x = P (X; 1) with a 2 x 4
# matrix P whose first three columns are in px/mm and whose last is in px: exact for an object that is far away compared
# with its depth, and wrong by the perspective otherwise. A rigid object that turns by R and does not change its
# distance has P = P_0 diag(R, 1) (Bando 2007, Appendix D, eq. A.31, corrected: docs/methods/adaptive.md).
#
# Points that come closer to the pinhole than `NEAREST_MM`, or lie behind it, are projected as if they were at that
# distance, so a filter on a wrong track gets large numbers but no infinite ones.

NEAREST_MM = 1.0


@compiled
def pinhole(points_mm: Floats, focal_px: float) -> Floats:
    """Project points (n, 3) of the camera's frame to (n, 2) px from the principal point (Bando 2007, Appendix E)."""
    count = points_mm.shape[0]
    pixels = np.empty((count, 2))
    for n in range(count):
        scale = focal_px / max(points_mm[n, 2], NEAREST_MM)
        pixels[n, 0] = scale * points_mm[n, 0]
        pixels[n, 1] = scale * points_mm[n, 1]
    return pixels


@compiled
def pinhole_jacobian(points_mm: Floats, focal_px: float) -> Floats:
    """Return the derivative (n, 2, 3), px/mm, of `pinhole` by the points (n, 3) in mm."""
    count = points_mm.shape[0]
    slopes = np.zeros((count, 2, 3))
    for n in range(count):
        depth = max(points_mm[n, 2], NEAREST_MM)
        scale = focal_px / depth
        slopes[n, 0, 0] = scale
        slopes[n, 1, 1] = scale
        slopes[n, 0, 2] = -scale * points_mm[n, 0] / depth
        slopes[n, 1, 2] = -scale * points_mm[n, 1] / depth
    return slopes


def affine_projection(camera: Floats, points_mm: Floats) -> Floats:
    """Project points (n, 3) by an affine camera (2, 4) to (n, 2) px."""
    pixels: Floats = product(points_mm, camera[:, :3].T) + camera[:, 3]
    return pixels


def affine_fit(points_mm: Floats, pixels: Floats) -> Floats:
    """Return the affine camera (2, 4) that projects points onto pixels with the least sum of squared distances.

    Args:
        points_mm: (n, 3) in the object's frame; at least four, not all in one plane.
        pixels: (n, 2) where they are seen.

    Raises:
        ValueError: The shapes differ, a value is not finite, or the points do not determine a camera.
    """
    if points_mm.ndim != 2 or points_mm.shape[1] != 3 or pixels.shape != (len(points_mm), 2):
        raise ValueError(f"expected (n, 3) points and (n, 2) pixels, got {points_mm.shape} and {pixels.shape}")
    if not (np.isfinite(points_mm).all() and np.isfinite(pixels).all()):
        raise ValueError("expected finite points and pixels, got some that are not")
    extended = np.column_stack([points_mm, np.ones(len(points_mm))])
    fitted, determined = least_squares(extended, pixels)
    if not determined:
        raise ValueError("expected four points that do not lie in one plane, got fewer")
    return np.ascontiguousarray(fitted.T)
