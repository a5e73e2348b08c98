"""Linear algebra and elementary functions come to the numbers of NumPy, SciPy and the C library."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pftrack.core.arrays import check
from pftrack.core.numerics import matrices
from pftrack.core.numerics.compiled import compiled
from pftrack.core.numerics.elementary import exponentials, logarithms, sines_cosines
from pftrack.core.numerics.matrices import (
    LANES,
    cholesky,
    eigenvalues,
    inner_product,
    least_squares,
    product,
    singular_values,
    total,
)

SEEDS = st.integers(0, 10_000)
SIZES = st.integers(1, 6)


@given(SEEDS, SIZES, SIZES, SIZES)
def test_products_are_those_of_numpy(seed: int, rows: int, inner: int, columns: int) -> None:
    """Products of matrices and vectors agree with NumPy's, for any layout; shapes that do not fit are refused."""
    rng = np.random.default_rng(seed)
    first, second = rng.normal(size=(inner, rows)).T, rng.normal(size=(inner, columns))
    for one, other in ((first, second), (first, second[:, 0]), (first[0], second)):
        assert np.allclose(product(one, other), one @ other)
    with pytest.raises(ValueError, match=r"\(2, 3\) and \(2, 3\)"):
        product(np.ones((2, 3)), np.ones((2, 3)))


@given(SEEDS, SIZES, SIZES)
def test_systems_are_solved(seed: int, size: int, columns: int) -> None:
    """A X is B again, also where a pivot is 0 without exchanging rows; a singular A is refused as NumPy would."""
    rng = np.random.default_rng(seed)
    matrix, wanted = rng.normal(size=(size, size)) + np.eye(size)[::-1] * 3, rng.normal(size=(size, columns))
    assert np.allclose(matrix @ matrices.solve_system(matrix, wanted), wanted)
    assert np.allclose(matrices.solve_system(np.eye(size)[::-1], wanted[:, 0]), wanted[::-1, 0])
    with pytest.raises(np.linalg.LinAlgError):
        matrices.solve_system(np.ones((2, 2)), np.ones(2))


@given(SEEDS, SIZES, SIZES)
def test_roots_multiply_to_the_covariance(seed: int, size: int, rank: int) -> None:
    """L L^T is P, of full rank and of less; of full rank L is Cholesky's; a variance of 0 gives a column of zeros."""
    factor = np.random.default_rng(seed).normal(size=(size, rank))
    covariance = factor @ factor.T
    found = cholesky(covariance)
    assert np.allclose(found @ found.T, covariance, atol=1e-6 * covariance.max())
    if rank >= size + 2:
        assert np.allclose(found, np.linalg.cholesky(covariance))
    assert np.array_equal(cholesky(np.diag([4.0, 0.0, 9.0])), np.diag([2.0, 0.0, 3.0]))


@given(SEEDS, SIZES)
def test_least_squares_are_those_of_numpy(seed: int, size: int) -> None:
    """The best fit agrees with NumPy's; columns that depend on each other determine nothing, and this is told."""
    rng = np.random.default_rng(seed)
    slopes, wanted = rng.normal(size=(size + 5, size)), rng.normal(size=(size + 5, 2))
    expected = np.linalg.lstsq(slopes, wanted, rcond=None)[0]
    found, determined = least_squares(slopes, wanted)
    assert determined
    assert np.allclose(found, expected)
    assert np.allclose(least_squares(slopes, wanted[:, 0])[0], expected[:, 0])
    assert not least_squares(np.column_stack([slopes, slopes @ rng.normal(size=size)]), wanted[:, 0])[1]


@given(SEEDS, SIZES)
def test_the_principal_direction_is_that_of_the_greatest_eigenvalue(seed: int, size: int) -> None:
    """It is a unit vector that the matrix stretches by its greatest eigenvalue."""
    half = np.random.default_rng(seed).normal(size=(size, size))
    symmetric = half + half.T
    found = matrices.principal(symmetric)
    assert np.isclose(found @ found, 1.0)
    assert np.allclose(symmetric @ found, np.linalg.eigvalsh(symmetric)[-1] * found, atol=1e-9)


SIZE = st.integers(1, 9)


@given(SIZE, SIZE, st.integers(0, 99))
def test_values_and_vectors_are_those_of_the_matrix(rows: int, columns: int, seed: int) -> None:
    """U diag(s) V^T is the matrix, U and V have orthonormal columns, and s falls."""
    matrix = np.random.default_rng(seed).normal(size=(rows, columns))
    left, values, right = singular_values(matrix)
    assert np.allclose((left * values) @ right.T, matrix, atol=1e-12)
    assert np.allclose(left.T @ left, np.eye(min(rows, columns)), atol=1e-12)
    assert np.allclose(right.T @ right, np.eye(min(rows, columns)), atol=1e-12)
    assert np.allclose(values, np.linalg.svd(matrix, compute_uv=False), atol=1e-12)


@given(SIZE, st.integers(0, 99))
def test_eigenvalues_may_have_either_sign(size: int, seed: int) -> None:
    """V diag(l) V^T is the symmetric matrix."""
    matrix = np.random.default_rng(seed).normal(size=(size, size))
    symmetric = matrix + matrix.T
    values, vectors = eigenvalues(symmetric)
    assert np.allclose((vectors * values) @ vectors.T, symmetric, atol=1e-12)
    assert np.allclose(values, np.linalg.eigvalsh(symmetric)[::-1], atol=1e-12)


@pytest.mark.parametrize("shape", [(6, 4), (4, 6)])
def test_what_is_missing_is_zero(shape: tuple[int, int]) -> None:
    """A matrix of rank two has two singular values, and one of zeros has none."""
    rng = np.random.default_rng(0)
    matrix = rng.normal(size=(shape[0], 2)) @ rng.normal(size=(2, shape[1]))
    left, values, right = singular_values(matrix)
    assert values[2:] == pytest.approx(0.0, abs=1e-14)
    assert np.allclose((left * values) @ right.T, matrix, atol=1e-13)
    assert not any(part.any() for part in (singular_values(np.zeros(shape))[1], eigenvalues(np.zeros((3, 3)))[0]))


def test_small_values_are_as_exact_as_large_ones() -> None:
    """Columns of lengths that differ by twelve powers of ten keep theirs to the last digits."""
    lengths = 10.0 ** -np.arange(0.0, 16.0, 4.0)
    basis, _ = np.linalg.qr(np.random.default_rng(1).normal(size=(8, 4)))
    assert singular_values(basis * lengths)[1] == pytest.approx(lengths, rel=1e-12)


@compiled
def both(first: np.ndarray, second: np.ndarray) -> tuple[float, float]:
    return inner_product(first, second), total(first)


def in_order(terms: np.ndarray) -> float:
    """The sum as the module's docstring has it, one addition after the other."""
    whole = len(terms) // LANES * LANES
    lanes = np.zeros(LANES, terms.dtype)
    for row in terms[:whole].reshape(-1, LANES):
        lanes = lanes + row
    while len(lanes) > 1:
        lanes = lanes[: len(lanes) // 2] + lanes[len(lanes) // 2 :]
    rest = terms.dtype.type(0)
    for term in terms[whole:]:
        rest = rest + term
    return float(lanes[0] + rest)


@pytest.mark.parametrize("kind", [np.float64, np.float32])
@pytest.mark.parametrize("count", [0, 1, 15, 16, 17, 64, 100, 801])
def test_the_order_is_the_one_that_is_defined(count: int, kind: type) -> None:
    """Sums are those of the defined order to the bit, in double and in single precision, of any length."""
    rng = np.random.default_rng(count)
    first, second = (rng.normal(size=(2, count)) * 10.0 ** rng.integers(-3, 4, (2, count))).astype(kind)
    assert both(first, second) == (in_order(first * second), in_order(first))


INF = float("inf")


@given(st.lists(st.floats(-708, 708), min_size=1), st.lists(st.floats(2.0**-1022, 1.7e308), min_size=1))
def test_exponentials_and_logarithms_are_exact_to_the_last_place(exponents: list[float], values: list[float]) -> None:
    """Every result is within one unit in the last place of the library's."""
    for ours, theirs, given_values in ((exponentials, np.exp, exponents), (logarithms, np.log, values)):
        expected = theirs(np.array(given_values))
        assert (np.abs(ours(np.array(given_values)) - expected) <= np.spacing(np.abs(expected))).all()


def test_the_edges_of_exponentials_and_logarithms() -> None:
    """The impossible weighs nothing, what would overflow is finite, tiny weights fade out, e^0 and ln 1 are exact."""
    results = exponentials(np.array([-INF, np.nan, -746.0, 0.0, 710.0, INF]))
    assert results[:4].tolist() == [0.0, 0.0, 0.0, 1.0]
    assert np.isfinite(results).all()
    values = np.array([-744.0, -740.0, -720.0, -709.0])
    assert np.allclose(exponentials(values), np.exp(values), rtol=0, atol=5e-324)
    assert logarithms(np.array([0.0, 5e-324, 1.0])).tolist() == [np.log(2.0**-1022)] * 2 + [0.0]


# Sines and cosines of whole arrays are those of the C library to the last place.


@given(st.floats(-1e6, 1e6))
def test_they_agree_with_the_library(angle: float) -> None:
    """Any angle up to a million radians has the library's sine and cosine, and each quarter has its own signs."""
    sines, cosines = sines_cosines(np.array([angle]))
    both = [np.sin(angle), np.cos(angle)]
    assert [sines[0], cosines[0]] == pytest.approx(both, abs=3e-10 if abs(angle) > 1e3 else 1e-15)
    quarters = sines_cosines(0.5 * np.pi * np.arange(-4.0, 4.0))
    assert np.allclose(quarters, [[0, 1, 0, -1, 0, 1, 0, -1], [1, 0, -1, 0, 1, 0, -1, 0]], atol=1e-15)


@pytest.mark.parametrize("value", [1e200, np.nan, np.inf, -np.inf])
def test_numbers_whose_squares_overflow_are_finite(value: float) -> None:
    """Only NaN and infinity are refused, however an array lies in memory."""
    array = np.zeros((3, 4))
    array[1, 2] = value
    for view in (array, array.T, array[1:, ::2]):
        if np.isfinite(value):
            assert check(values=(view, "n m")) == dict(zip("nm", view.shape, strict=True))
        else:
            with pytest.raises(ValueError, match="values must be finite"):
                check(values=(view, "n m"))
