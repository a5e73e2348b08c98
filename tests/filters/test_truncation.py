"""Gaussians that are cut by half-spaces."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.special import erfcx

from pftrack.core.arrays import Floats
from pftrack.filters.truncation import least_room, mills_ratio, truncate


def cut(mean: Floats, covariance: Floats, row: list[float], high: float, low: float = -np.inf) -> int:
    return truncate(mean, covariance, (np.array([row]), np.array([low]), np.array([high])))


def test_mills_ratio_is_exact() -> None:
    """The ratio of distribution and density agrees with SciPy's to 14 digits, on both sides and far out."""
    x = np.concatenate([np.linspace(-8.0, 60.0, 1501), [1e3, 1e8]])
    ours = np.array([mills_ratio(value) for value in x])
    assert ours == pytest.approx(np.sqrt(np.pi / 2.0) * erfcx(x / np.sqrt(2.0)), rel=5e-14)


@pytest.mark.parametrize("bound", [-60.0, -49.0, -3.0, -0.2, 1.0, 4.0])
def test_one_bound_leaves_the_moments_of_what_is_left(bound: float) -> None:
    """Mean and variance are those of a numeric integration, for a bound before and far beyond the mean."""
    mean, variance = np.array([0.0]), np.array([[1.0]])
    assert cut(mean, variance, [1.0], bound) == 1
    depth = 12.0 / max(1.0, -bound)
    x = bound - np.linspace(0.0, max(depth, 12.0 + bound), 200_001)
    weights = np.exp(-0.5 * (x * x - x[0] * x[0]))
    weights /= weights.sum()
    middle = float((weights * x).sum())
    assert mean[0] == pytest.approx(middle, abs=1e-3 * abs(bound) ** -1 if bound < -10 else 2e-4)
    assert variance[0, 0] == pytest.approx(float((weights * (x - middle) ** 2).sum()), rel=2e-3)


def test_a_slanting_bound_leaves_the_moments_of_what_is_left() -> None:
    """In two dimensions mean and covariance are those of a grid on this side."""
    mean, covariance = np.array([1.0, -2.0]), np.array([[4.0, 1.5], [1.5, 1.0]])
    grid = np.linspace(-9.0, 9.0, 901)
    x, y = np.meshgrid(mean[0] + 2.0 * grid, mean[1] + grid)
    off = np.stack([x - mean[0], y - mean[1]])
    density = np.exp(-0.5 * np.einsum("i...,ij,j...->...", off, np.linalg.inv(covariance), off))
    density *= x + 2.0 * y <= -3.5
    density /= density.sum()
    wanted = np.array([(density * x).sum(), (density * y).sum()])
    off = np.stack([x - wanted[0], y - wanted[1]])
    spread = np.einsum("kl,ikl,jkl->ij", density, off, off)
    cut(mean, covariance, [1.0, 2.0], -3.5)
    assert mean == pytest.approx(wanted, abs=0.01)
    assert covariance == pytest.approx(spread, abs=0.01)


def test_bounds_that_are_applied_again_go_on_shrinking() -> None:
    """N(65, 10^2) cut to [60, 80] has a deviation of 5.98, after 21 times 3.03, after 300 times 2.36 (8.1)."""
    mean, variance, deviations = np.array([65.0]), np.array([[100.0]]), []
    for _ in range(300):
        cut(mean, variance, [1.0], 80.0, 60.0)
        deviations.append(float(np.sqrt(variance[0, 0])))
    assert [deviations[0], deviations[20], deviations[-1]] == pytest.approx([5.98, 3.03, 2.36], abs=0.01)


def test_what_is_far_away_or_known_is_left_alone() -> None:
    """A bound beyond eight deviations, an infinite one, and one on what has no variance change nothing."""
    mean, covariance = np.array([0.0, 5.0]), np.array([[1.0, 0.0], [0.0, 0.0]])
    for row, high in (([1.0, 0.0], 8.5), ([1.0, 0.0], np.inf), ([0.0, 1.0], 4.0)):
        assert cut(mean, covariance, row, high) == 0
    assert mean.tolist() == [0.0, 5.0]


def test_room_is_the_distance_from_the_nearest_bound() -> None:
    """It is counted in standard deviations, and negative beyond a bound."""
    covariance = np.diag([4.0, 9.0])
    room = least_room(np.array([1.0, 1.0]), covariance, (np.eye(2), np.array([0.0, -8.0]), np.array([9.0, 10.0])))
    assert room == pytest.approx(0.5)
    beyond = least_room(np.array([-5.0]), np.eye(1), (np.eye(1), np.zeros(1), np.array([np.inf])))
    assert beyond == pytest.approx(-5.0)
    assert least_room(np.zeros(1), np.eye(1), (np.zeros((0, 1)), np.zeros(0), np.zeros(0))) == np.inf


@given(st.floats(-1e6, 1e6), st.floats(-1e6, 1e6), st.integers(0, 1000))
def test_what_is_left_is_a_gaussian_within_the_bound(bound: float, centre: float, seed: int) -> None:
    """However far beyond, the mean then lies within, and no variance becomes negative or grows."""
    root = np.random.default_rng(seed).normal(size=(3, 3))
    before = root @ root.T + 1e-3 * np.eye(3)
    mean, covariance = np.full(3, centre), before.copy()
    cut(mean, covariance, [1.0, -0.5, 2.0], bound)
    assert np.isfinite(mean).all()
    assert mean @ [1.0, -0.5, 2.0] <= bound + 1e-6 * (abs(bound) + abs(centre) + 1.0)
    values = np.linalg.eigvalsh(covariance)
    assert values.min() > -1e-9 * values.max()
    assert (covariance.diagonal() <= before.diagonal() * (1.0 + 1e-12)).all()
