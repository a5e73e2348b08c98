"""The unscented Kalman filter: nonlinear models, probed at 2 d + 1 sigma points.

A Gaussian is represented by its mean and points at +- sqrt(d + kappa) standard deviations along the columns of a square
root of its covariance. Sent through a function, their weighted mean and covariance are right to second order, without
derivatives (Julier and Uhlmann 1997). For a linear function they are exact, and this filter is then the Kalman filter.

The transform works on a batch of Gaussians at once, since the unscented particle filter has one for every particle.
"""

from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from pftrack.core.arrays import Floats, check
from pftrack.core.numerics.compiled import compiled
from pftrack.core.numerics.matrices import contiguous_copy, factorise, multiply, solve
from pftrack.core.numerics.random import Gaussian, log_density, symmetrise

Function: TypeAlias = Callable[[Floats], Floats]


def transform(
    means: Floats, covariances: Floats, function: Function, kappa: float | None = None
) -> tuple[Floats, Floats, Floats]:
    """Send Gaussians through a function.

    Args:
        means: (n, d).
        covariances: (n, d, d), or (1, d, d) shared by all; may be singular.
        function: (..., d) -> (..., m).
        kappa: Spread; d + kappa must be positive. By default max(3 - d, 0), which matches a Gaussian's kurtosis for
            d <= 3 and keeps all weights positive beyond.

    Returns:
        Means (n, m) and covariances (n, m, m) of the images, and cross covariances (n, d, m).

    Raises:
        TypeError: An argument is not an array of real numbers.
        ValueError: An array has another shape, or is not finite, or d + kappa is not positive.
    """
    check(means=(means, "n d"))
    dimension = means.shape[-1]
    check(means=(means, "n d"), covariances=(covariances, "1 d d" if len(covariances) == 1 else "n d d"))
    spread = max(3.0 - dimension, 0.0) if kappa is None else kappa
    if dimension + spread <= 0:
        raise ValueError(f"dimension + kappa must be positive, got {dimension} + {spread}")
    offsets = _sigma_points(np.ascontiguousarray(covariances, np.float64), np.sqrt(dimension + spread))
    weights = np.full(2 * dimension + 1, 0.5 / (dimension + spread))
    weights[0] = spread / (dimension + spread)
    images = contiguous_copy(function(means[:, None, :] + offsets))
    check(missing=True, means=(means, "n d"), images=(images, f"n {len(weights)} m"))
    return _weight(weights, offsets, images)


@compiled
def _sigma_points(covariances: Floats, scale: float) -> Floats:
    """Return the offsets (n, 2 d + 1, d) of the sigma points of Gaussians (n, d, d) from their means."""
    count, dimension, _ = covariances.shape
    offsets = np.zeros((count, 2 * dimension + 1, dimension))
    for n in range(count):
        root, _ = factorise(covariances[n])
        for i in range(dimension):
            for k in range(i + 1):
                offsets[n, 1 + k, i] = root[i, k] * scale
                offsets[n, 1 + dimension + k, i] = -offsets[n, 1 + k, i]
    return offsets


@compiled
def _weight(weights: Floats, offsets: Floats, images: Floats) -> tuple[Floats, Floats, Floats]:
    """Return means (n, m) and covariances (n, m, m) of images (n, s, m), and cross covariances (n, d, m) with offsets.

    Args:
        weights: (s,) of the sigma points.
        offsets: (n, s, d) or (1, s, d) of the sigma points from their means.
        images: (n, s, m) their images.
    """
    count, points, size = images.shape
    dimension = offsets.shape[2]
    means = np.zeros((count, size))
    covariances, cross = np.zeros((count, size, size)), np.zeros((count, dimension, size))
    for n in range(count):
        own = min(n, offsets.shape[0] - 1)
        for s in range(points):
            for i in range(size):
                means[n, i] += weights[s] * images[n, s, i]
        for s in range(points):
            for i in range(size):
                share = weights[s] * (images[n, s, i] - means[n, i])
                for j in range(size):
                    covariances[n, i, j] += share * (images[n, s, j] - means[n, j])
                for d in range(dimension):
                    cross[n, d, i] += offsets[own, s, d] * share
    return means, covariances, cross


def predict(
    posterior: Gaussian, transition: Function, noise_covariance: Floats, kappa: float | None = None
) -> Gaussian:
    """Return p(x_t | z_{1:t-1}) for x_t = f(x_{t-1}) + noise of covariance Q (d, d); f maps (..., d) -> (..., d).

    Raises:
        TypeError: An argument is not an array of real numbers.
        ValueError: An array has another shape, or is not finite.
    """
    check(
        mean=(posterior.mean, "d"),
        covariance=(posterior.covariance, "d d"),
        noise_covariance=(noise_covariance, "d d"),
    )
    means, covariances, _ = transform(posterior.mean[None], posterior.covariance[None], transition, kappa)
    return Gaussian(means[0], symmetrise(covariances[0] + noise_covariance))


def update(
    prior: Gaussian,
    measurement: Floats,
    observe: Function,
    noise_covariance: Floats,
    kappa: float | None = None,
) -> tuple[Gaussian, float]:
    """Condition on z = h(x) + v, v ~ N(0, R).

    Args:
        prior: p(x), over (d,).
        measurement: z, (m,).
        observe: h, (..., d) -> (..., m).
        noise_covariance: R, (m, m).
        kappa: See `transform`.

    Returns:
        The approximate p(x | z) and log p(z).

    Raises:
        TypeError: An argument is not an array of real numbers.
        ValueError: An array has another shape, or is not finite.
        numpy.linalg.LinAlgError: The innovation covariance is singular.
    """
    check(mean=(prior.mean, "d"), covariance=(prior.covariance, "d d"))
    means, covariances, log_evidences = update_batch(
        prior.mean[None], prior.covariance[None], measurement, observe, noise_covariance, kappa
    )
    return Gaussian(means[0], covariances[0]), float(log_evidences[0])


def update_batch(
    means: Floats,
    covariances: Floats,
    measurement: Floats,
    observe: Function,
    noise_covariance: Floats,
    kappa: float | None = None,
) -> tuple[Floats, Floats, Floats]:
    """Condition n Gaussians on the same measurement: means (n, d) and covariances (n, d, d), or (1, d, d) for all.

    The other arguments are those of `update`.

    Returns:
        Means (n, d), covariances (n, d, d) and log p(z), (n,).

    Raises:
        TypeError: An argument is not an array of real numbers.
        ValueError: An array has another shape, or is not finite.
        numpy.linalg.LinAlgError: The innovation covariance is singular.
    """
    check(measurement=(measurement, "m"), noise_covariance=(noise_covariance, "m m"))
    predicted, spreads, cross = transform(means, covariances, observe, kappa)
    check(missing=True, measurement=(measurement, "m"), observe=(predicted, "n m"))
    innovation_covariances = symmetrise(spreads + noise_covariance)
    known, spread, innovations = map(contiguous_copy, (means, covariances, measurement - predicted))
    updated, remaining, regular = _condition(known, spread, innovations, innovation_covariances, cross)
    if not regular:
        raise np.linalg.LinAlgError("Singular matrix")
    return updated, symmetrise(remaining), log_density(measurement, predicted, innovation_covariances)


@compiled
def _condition(
    means: Floats, covariances: Floats, innovations: Floats, innovation_covariances: Floats, cross: Floats
) -> tuple[Floats, Floats, bool]:
    """Return means (n, d) and covariances (n, d, d) of the posteriors, and whether there are any."""
    count, dimension = means.shape
    updated, remaining = means.copy(), np.empty((count, dimension, dimension))
    for n in range(count):
        own = min(n, covariances.shape[0] - 1)
        # The gain, transposed, and what it takes off the covariance: K S K^T, where S K^T is the cross covariance.
        gain, regular = solve(innovation_covariances[n], cross[n].T.copy())
        if not regular:
            return updated, remaining, False
        known = multiply(cross[n], gain)
        for i in range(dimension):
            for k in range(gain.shape[0]):
                updated[n, i] += gain[k, i] * innovations[n, k]
            for j in range(dimension):
                remaining[n, i, j] = covariances[own, i, j] - known[i, j]
    return updated, remaining, True
