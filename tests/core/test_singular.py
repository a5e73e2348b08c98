import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pftrack.core.numerics.matrices import eigenvalues, singular_values

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
