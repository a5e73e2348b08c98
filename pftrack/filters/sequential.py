"""The Kalman filter one number at a time, for compiled loops.

A measurement of m numbers with independent noise can be used one number after another: each is a scalar update, a gain
and an outer product. The result equals conditioning on all at once, without solving a system of equations. A triangular
transform first makes dependent numbers independent. So small filters take microseconds, and a number that is already
certain is skipped instead of making a matrix singular.

The caller linearises the model: `condition` takes the residuals z - h(m) and the derivative of h at the prior's mean m,
and suits the Kalman filter (Bando 2007, ch. 4, eq. 4.4) and the extended one alike.
"""

import numpy as np

from pftrack.core.arrays import Floats
from pftrack.core.numerics.compiled import compiled

SMALLEST_PIVOT = 1e-12
"""Least share of a number's variance that remains when the numbers before it are known."""


@compiled
def predict_second_order(mean: Floats, covariance: Floats, noise_sd: Floats) -> tuple[Floats, Floats]:
    """Return the prediction of q_t = 2 q_{t-1} - q_{t-2} + b u on states (q_t, q_{t-1}) (Bando 2007, ch. 4, eq. 4.5).

    Args:
        mean: (2 d,), the d newest values first.
        covariance: (2 d, 2 d).
        noise_sd: b, (d,).

    Raises:
        ValueError: The sizes do not agree.
    """
    size = noise_sd.shape[0]
    if mean.shape[0] != 2 * size or covariance.shape != (2 * size, 2 * size):
        raise ValueError("expected a mean (2 d,) and a covariance (2 d, 2 d) for noises (d,), got other sizes")
    predicted = np.empty(2 * size)
    spread = np.empty((2 * size, 2 * size))
    for i in range(size):
        predicted[i] = 2.0 * mean[i] - mean[size + i]
        predicted[size + i] = mean[i]
        for j in range(size):
            newer, older = covariance[i, j], covariance[size + i, size + j]
            newest = 4.0 * newer - 2.0 * (covariance[i, size + j] + covariance[size + i, j]) + older
            spread[i, j] = newest + noise_sd[i] ** 2 if i == j else newest
            spread[i, size + j] = 2.0 * newer - covariance[size + i, j]
            spread[size + j, i] = spread[i, size + j]
            spread[size + i, size + j] = newer
    return predicted, spread


@compiled
def condition(
    mean: Floats,
    covariance: Floats,
    residuals: Floats,
    jacobian: Floats,
    variances: Floats,
) -> tuple[Floats, Floats, float]:
    """Condition on m numbers with independent noise.

    Args:
        mean: (d,) of the prior.
        covariance: (d, d) of the prior.
        residuals: (m,) measurements less their predictions from the prior's mean.
        jacobian: (m, d) derivatives of the predictions by the state.
        variances: (m,) of the noise; a number whose noise and prediction are both certain is left out.

    Returns:
        Mean (d,) and covariance (d, d) of the posterior, and the log density of the measurements.

    Raises:
        ValueError: The sizes do not agree.
    """
    size, count = mean.shape[0], residuals.shape[0]
    if covariance.shape != (size, size) or jacobian.shape != (count, size) or variances.shape[0] != count:
        raise ValueError("expected a covariance (d, d), a slope (m, d) and variances (m,), got other sizes")
    change = np.zeros(size)
    spread = covariance.copy()
    cross = np.empty(size)
    log_evidence = 0.0
    for n in range(residuals.shape[0]):
        innovation, variance = residuals[n], variances[n]
        for i in range(size):
            total = 0.0
            for j in range(size):
                if jacobian[n, j] != 0.0:
                    total += spread[i, j] * jacobian[n, j]
            cross[i] = total
        for j in range(size):
            innovation -= jacobian[n, j] * change[j]
            variance += jacobian[n, j] * cross[j]
        if not variance > 0.0:
            continue
        log_evidence -= 0.5 * (innovation * innovation / variance + np.log(2.0 * np.pi * variance))
        for i in range(size):
            gain = cross[i] / variance
            change[i] += gain * innovation
            for j in range(i + 1):
                spread[i, j] -= gain * cross[j]
                spread[j, i] = spread[i, j]
    return mean + change, spread, log_evidence


@compiled
def decorrelate(residuals: Floats, jacobian: Floats, covariance: Floats) -> tuple[Floats, Floats, Floats]:
    """Make the noise of a measurement independent, by R = L D L^T with L unit lower triangular.

    Args:
        residuals: (m,).
        jacobian: (m, d).
        covariance: R, (m, m), of the noise.

    Returns:
        L^-1 residuals, L^-1 jacobian, and the diagonal of D, as `condition` takes them.

    Raises:
        ValueError: The sizes do not agree.
    """
    count = residuals.shape[0]
    if jacobian.shape[0] != count or covariance.shape != (count, count):
        raise ValueError("expected a slope (m, d) and a covariance (m, m) for residuals (m,), got other sizes")
    lower = np.zeros((count, count))
    variances = np.empty(count)
    independent, slopes = residuals.copy(), jacobian.copy()
    for i in range(count):
        pivot = covariance[i, i]
        for k in range(i):
            total = covariance[i, k]
            for j in range(k):
                total -= lower[i, j] * variances[j] * lower[k, j]
            lower[i, k] = total / variances[k] if variances[k] > 0.0 else 0.0
            pivot -= lower[i, k] ** 2 * variances[k]
            independent[i] -= lower[i, k] * independent[k]
            for d in range(slopes.shape[1]):
                slopes[i, d] -= lower[i, k] * slopes[k, d]
        variances[i] = max(pivot, SMALLEST_PIVOT * covariance[i, i])
    return independent, slopes, variances
