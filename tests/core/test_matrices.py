"""Linear algebra and elementary functions come to the numbers of NumPy, SciPy and the C library."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pftrack.core.arrays import check
from pftrack.core.numerics import matrices
from pftrack.core.numerics.compiled import compiled
from pftrack.core.numerics.elementary import exponentials, logarithms, sines_cosines

SEEDS = st.integers(0, 10_000)
SIZES = st.integers(1, 6)


@given(SEEDS, SIZES, SIZES, SIZES)
def test_products_and_solutions_are_those_of_numpy(seed: int, rows: int, size: int, columns: int) -> None:
    """Products, solutions of systems and least squares agree with NumPy's, for any layout; so do Cholesky's roots.

    What does not fit or is singular is refused as NumPy would, and columns that depend on each other are reported.
    """
    rng = np.random.default_rng(seed)
    first, second = rng.normal(size=(size, rows)).T, rng.normal(size=(size, columns))
    for one, other in ((first, second), (first, second[:, 0]), (first[0], second)):
        assert np.allclose(matrices.product(one, other), one @ other)
    with pytest.raises(ValueError, match=r"\(2, 3\) and \(2, 3\)"):
        matrices.product(np.ones((2, 3)), np.ones((2, 3)))

    matrix = rng.normal(size=(size, size)) + np.eye(size)[::-1] * 3  # a pivot may be 0 without exchanging rows
    assert np.allclose(matrix @ matrices.solve_system(matrix, second), second)
    assert np.allclose(matrices.solve_system(np.eye(size)[::-1], second[:, 0]), second[::-1, 0])
    with pytest.raises(np.linalg.LinAlgError):
        matrices.solve_system(np.ones((2, 2)), np.ones(2))

    slopes, wanted = rng.normal(size=(size + 5, size)), rng.normal(size=(size + 5, 2))
    for each in (wanted, wanted[:, 0]):
        assert np.allclose(matrices.least_squares(slopes, each)[0], np.linalg.lstsq(slopes, each, rcond=None)[0])
    assert matrices.least_squares(slopes, wanted)[1]
    assert not matrices.least_squares(np.column_stack([slopes, slopes @ rng.normal(size=size)]), wanted[:, 0])[1]

    covariance = first @ first.T  # of any rank
    root = matrices.cholesky(covariance)
    assert np.allclose(root @ root.T, covariance, atol=1e-6 * covariance.max())
    if size >= rows + 2:
        assert np.allclose(root, np.linalg.cholesky(covariance))
    assert np.array_equal(matrices.cholesky(np.diag([4.0, 0.0, 9.0])), np.diag([2.0, 0.0, 3.0]))


@given(st.integers(1, 9), st.integers(1, 9), SEEDS)
def test_values_and_vectors_are_those_of_the_matrix(rows: int, columns: int, seed: int) -> None:
    """U diag(s) V^T is the matrix with orthonormal U and V and falling s, and V diag(l) V^T the symmetric one.

    The principal direction is a unit vector that the matrix stretches by its greatest eigenvalue.
    """
    matrix = np.random.default_rng(seed).normal(size=(rows, columns))
    left, values, right = matrices.singular_values(matrix)
    assert np.allclose((left * values) @ right.T, matrix, atol=1e-12)
    for basis in (left, right):
        assert np.allclose(basis.T @ basis, np.eye(min(rows, columns)), atol=1e-12)
    assert np.allclose(values, np.linalg.svd(matrix, compute_uv=False), atol=1e-12)

    symmetric = np.random.default_rng(seed).normal(size=(rows, rows))
    symmetric += symmetric.T
    expected = np.linalg.eigvalsh(symmetric)[::-1]
    values, vectors = matrices.eigenvalues(symmetric)
    assert np.allclose((vectors * values) @ vectors.T, symmetric, atol=1e-12)
    assert np.allclose(values, expected, atol=1e-12)
    found = matrices.principal(symmetric)
    assert np.isclose(found @ found, 1.0)
    assert np.allclose(symmetric @ found, expected[0] * found, atol=1e-9)


@compiled
def both(first: np.ndarray, second: np.ndarray) -> tuple[float, float]:
    return matrices.inner_product(first, second), matrices.total(first)


def test_small_values_are_as_exact_as_large_ones() -> None:
    """Columns of lengths that differ by twelve powers of ten keep theirs to the last digits."""
    lengths = 10.0 ** -np.arange(0.0, 16.0, 4.0)
    basis, _ = np.linalg.qr(np.random.default_rng(1).normal(size=(8, 4)))
    assert matrices.singular_values(basis * lengths)[1] == pytest.approx(lengths, rel=1e-12)


def in_order(terms: np.ndarray) -> float:
    """The sum as the module's docstring has it, one addition after the other."""
    whole = len(terms) // matrices.LANES * matrices.LANES
    lanes = np.zeros(matrices.LANES, terms.dtype)
    for row in terms[:whole].reshape(-1, matrices.LANES):
        lanes = lanes + row
    while len(lanes) > 1:
        lanes = lanes[: len(lanes) // 2] + lanes[len(lanes) // 2 :]
    rest = terms.dtype.type(0)
    for term in terms[whole:]:
        rest = rest + term
    return float(lanes[0] + rest)


@pytest.mark.parametrize("kind", [np.float64, np.float32])
@pytest.mark.parametrize("count", [0, 1, 15, 16, 17, 801])
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
