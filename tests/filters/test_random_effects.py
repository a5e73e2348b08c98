"""The variance that measurements have beyond their own, and what a fit is then worth."""

import numpy as np
import pytest

from pftrack.filters.agreement import excess_variance, fit_covariance, fit_gain

JACOBIAN = np.random.default_rng(1).standard_normal((16, 5))
ALL = np.ones(16)


def test_numbers_that_fit_exactly_have_no_excess() -> None:
    """What the unknowns explain leaves no residual, and no variance is made of it."""
    assert excess_variance(JACOBIAN @ np.arange(5.0), JACOBIAN, np.full(16, 0.25), ALL) == 0.0


def test_the_weighted_residuals_of_the_fit_have_their_expected_sum() -> None:
    """At the excess that is found the squared residuals, weighted, add up to measurements less unknowns."""
    rng = np.random.default_rng(2)
    residuals, variances = 5.0 * rng.standard_normal(16), rng.uniform(0.1, 4.0, 16)
    excess = excess_variance(residuals, JACOBIAN, variances, ALL)
    weights = 1.0 / (variances + excess)
    roots = np.sqrt(weights)
    fitted = np.linalg.lstsq(roots[:, None] * JACOBIAN, roots * residuals, rcond=None)[0]
    assert excess > 0.0
    assert (weights * (residuals - JACOBIAN @ fitted) ** 2).sum() == pytest.approx(11.0, rel=1e-5)


def test_what_is_missing_is_not_counted_as_fitting() -> None:
    """The excess of ten measurements is the same with six more that nobody has seen and that fit by themselves."""
    rng = np.random.default_rng(5)
    residuals, variances = 5.0 * rng.standard_normal(16), rng.uniform(0.1, 4.0, 16)
    missing = np.arange(16) >= 10
    alone = excess_variance(residuals[:10], JACOBIAN[:10].copy(), variances[:10], ALL[:10])
    variances[missing], shown = 1e9, np.where(missing, 0.0, 1.0)
    assert excess_variance(residuals, JACOBIAN, variances, shown) == pytest.approx(alone, rel=1e-4)
    shown[5:10] = 0.0
    assert np.isnan(excess_variance(residuals, JACOBIAN, variances, shown))


def test_too_few_numbers_tell_no_excess() -> None:
    """With as many unknowns as measurements every error is explained."""
    assert np.isnan(excess_variance(np.ones(5), JACOBIAN[:5].copy(), np.ones(5), np.ones(5)))


def test_the_covariance_is_that_of_the_fit() -> None:
    """With the weights of the variances it is (J^T W J)^-1; doubled variances double it."""
    variances = np.random.default_rng(4).uniform(0.1, 4.0, 16)
    gain, regular = fit_gain(JACOBIAN, 1.0 / variances)
    covariance = fit_covariance(gain, variances)
    assert regular
    assert covariance == pytest.approx(np.linalg.inv(JACOBIAN.T @ (JACOBIAN / variances[:, None])), rel=1e-9)
    assert fit_covariance(gain, 2.0 * variances) == pytest.approx(2.0 * covariance)
