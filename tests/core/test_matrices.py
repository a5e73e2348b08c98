import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pftrack.core.numerics.matrices import cholesky, least_squares, principal, product, solve_system

SEEDS = st.integers(0, 10_000)
SIZES = st.integers(1, 6)


@given(SEEDS, SIZES, SIZES, SIZES)
def test_products_are_those_of_numpy(seed: int, rows: int, inner: int, columns: int) -> None:
    """Products of matrices and vectors agree with NumPy's, for any layout in memory."""
    rng = np.random.default_rng(seed)
    first, second = rng.normal(size=(inner, rows)).T, rng.normal(size=(inner, columns))
    assert np.allclose(product(first, second), first @ second)
    assert np.allclose(product(first, second[:, 0]), first @ second[:, 0])
    assert np.allclose(product(first[0], second), first[0] @ second)


def test_shapes_that_do_not_fit_are_refused() -> None:
    """A product of shapes that do not fit says which they are."""
    with pytest.raises(ValueError, match=r"\(2, 3\) and \(2, 3\)"):
        product(np.ones((2, 3)), np.ones((2, 3)))


@given(SEEDS, SIZES, SIZES)
def test_systems_are_solved(seed: int, size: int, columns: int) -> None:
    """A X is B again, also where a pivot is 0 without exchanging rows."""
    rng = np.random.default_rng(seed)
    matrix, wanted = rng.normal(size=(size, size)) + np.eye(size)[::-1] * 3, rng.normal(size=(size, columns))
    assert np.allclose(matrix @ solve_system(matrix, wanted), wanted)
    swap = np.eye(size)[::-1]
    assert np.allclose(solve_system(swap, wanted[:, 0]), wanted[::-1, 0])


def test_a_singular_system_is_refused() -> None:
    """A matrix without an inverse raises as NumPy's would."""
    with pytest.raises(np.linalg.LinAlgError):
        solve_system(np.ones((2, 2)), np.ones(2))


@given(SEEDS, SIZES, SIZES)
def test_roots_multiply_to_the_covariance(seed: int, size: int, rank: int) -> None:
    """L L^T is P, of full rank and of less; of full rank L is Cholesky's."""
    factor = np.random.default_rng(seed).normal(size=(size, rank))
    covariance = factor @ factor.T
    found = cholesky(covariance)
    assert np.allclose(found @ found.T, covariance, atol=1e-6 * covariance.max())
    if rank >= size + 2:
        assert np.allclose(found, np.linalg.cholesky(covariance))


def test_a_certain_direction_has_no_root() -> None:
    """A variance of 0 gives a column of zeros, and a diagonal its square roots."""
    assert np.array_equal(cholesky(np.diag([4.0, 0.0, 9.0])), np.diag([2.0, 0.0, 3.0]))


@given(SEEDS, SIZES)
def test_least_squares_are_those_of_numpy(seed: int, size: int) -> None:
    """The best fit agrees with NumPy's, of one column and of several."""
    rng = np.random.default_rng(seed)
    slopes, wanted = rng.normal(size=(size + 5, size)), rng.normal(size=(size + 5, 2))
    expected = np.linalg.lstsq(slopes, wanted, rcond=None)[0]
    found, determined = least_squares(slopes, wanted)
    assert determined
    assert np.allclose(found, expected)
    assert np.allclose(least_squares(slopes, wanted[:, 0])[0], expected[:, 0])


def test_what_is_not_determined_is_told() -> None:
    """Columns that depend on each other determine nothing."""
    slopes = np.random.default_rng(1).normal(size=(9, 3))
    slopes[:, 2] = slopes[:, 0] - 2.0 * slopes[:, 1]
    assert not least_squares(slopes, np.ones(9))[1]


@given(SEEDS, SIZES)
def test_the_principal_direction_is_that_of_the_greatest_eigenvalue(seed: int, size: int) -> None:
    """It is a unit vector that the matrix stretches by its greatest eigenvalue."""
    half = np.random.default_rng(seed).normal(size=(size, size))
    symmetric = half + half.T
    found = principal(symmetric)
    assert np.isclose(found @ found, 1.0)
    assert np.allclose(symmetric @ found, np.linalg.eigvalsh(symmetric)[-1] * found, atol=1e-9)
