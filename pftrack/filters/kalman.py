"""The Kalman filter: the exact posterior of a linear model with Gaussian noise.

Source: Bando 2007, ch. 2, eqs. 2.8 and 2.9. The covariance is updated in Joseph's form, which keeps it symmetric and
positive whatever the rounding.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import TypingError

from pftrack.core.arrays import Floats, check
from pftrack.core.model.model import LinearTransition
from pftrack.core.numerics.compiled import compiled
from pftrack.core.numerics.matrices import contiguous_copy, multiply, product, solve, solve_system
from pftrack.core.numerics.random import Gaussian, log_densities


class NormalisedInnovation(NamedTuple):
    """The deviation of a measurement from its prediction.

    Attributes:
        squared: Its squared length in standard deviations.
        freedom: Number of measured values. If the model holds, the square is a chi-square variable of as many degrees
            of freedom (Bar-Shalom, Li, Kirubarajan 2001, section 5.4).
    """

    squared: float
    freedom: int


@dataclass(frozen=True, slots=True)
class Innovation:
    """The part of a measurement that was not predicted.

    Attributes:
        values: (m,) the measurement less its prediction.
        covariance: (m, m) its predicted covariance.
        gain: (d, m) change of the mean per unit of each value.
        normalised: Its length.
    """

    values: Floats
    covariance: Floats
    gain: Floats
    normalised: NormalisedInnovation


def predict(posterior: Gaussian, dynamics: LinearTransition) -> Gaussian:
    """Return p(x_t | z_{1:t-1}) from p(x_{t-1} | z_{1:t-1}), both over (d,).

    Raises:
        TypeError: Mean or covariance is not an array of real numbers.
        ValueError: The dynamics are of another dimension, or numbers are not finite.
    """
    known = posterior.mean, posterior.covariance, dynamics.transition, dynamics.offset, dynamics.noise
    try:
        return Gaussian(*_predict(*map(contiguous_copy, known)))
    except (AttributeError, TypeError, ValueError, TypingError):  # a step has no time to ask beforehand
        mean, covariance, transition, offset, noise = known
        check(transition=(transition, "d d"), mean=(mean, "d"), covariance=(covariance, "d d"))
        check(mean=(mean, "d"), offset=(offset, "d"), noise=(noise, "d k"))
        raise


def update(
    prior: Gaussian,
    measurement: Floats,
    observation: Floats,
    noise_covariance: Floats,
) -> tuple[Gaussian, float]:
    """Condition on z = C x + v, v ~ N(0, R).

    Args:
        prior: p(x), over (d,).
        measurement: z, (m,).
        observation: C, (m, d).
        noise_covariance: R, (m, m), such that C P C^T + R is positive definite.

    Returns:
        p(x | z) and log p(z).

    Raises:
        TypeError: An argument is not an array of real numbers.
        ValueError: An array has another shape, or is not finite.
        numpy.linalg.LinAlgError: The innovation covariance is singular.
    """
    try:
        predicted = product(observation, prior.mean)
    except (TypeError, ValueError):
        _check(prior, measurement, observation, noise_covariance)
        raise
    return condition(prior, measurement, predicted, observation, noise_covariance)


def innovate(
    prior: Gaussian,
    measurement: Floats,
    observation: Floats,
    noise_covariance: Floats,
) -> Innovation:
    """Return the innovation of a measurement; arguments and errors as for `update`."""
    _check(prior, measurement, observation, noise_covariance)
    values = measurement - product(observation, prior.mean)
    cross = product(observation, prior.covariance)
    covariance = product(cross, observation.T) + noise_covariance
    solved = solve_system(covariance, np.column_stack([cross, values]))
    gain, squared = solved[:, :-1].T, float(product(values, solved[:, -1]))
    return Innovation(values, covariance, gain, NormalisedInnovation(squared, len(values)))


def condition(
    prior: Gaussian,
    measurement: Floats,
    predicted: Floats,
    jacobian: Floats,
    noise_covariance: Floats,
) -> tuple[Gaussian, float]:
    """Condition on a measurement that is linear around the prior's mean; see `update` and `extended.update`.

    Args:
        prior: p(x), over (d,).
        measurement: z, (m,).
        predicted: Its prediction from the prior's mean, (m,).
        jacobian: dz/dx there, (m, d).
        noise_covariance: R, (m, m).

    Raises:
        TypeError: An argument is not an array of real numbers.
        ValueError: An array has another shape, or is not finite.
        numpy.linalg.LinAlgError: The innovation covariance is singular.
    """
    try:
        known = prior.mean, prior.covariance, measurement - predicted, jacobian, noise_covariance
        mean, covariance, log_evidence, regular = condition_on_innovation(*map(contiguous_copy, known))
        fits = len(measurement) == len(predicted) and math.isfinite(log_evidence + mean.dot(mean))
    except (AttributeError, TypeError, ValueError, TypingError):
        _check(prior, measurement, jacobian, noise_covariance, predicted)
        raise
    if not (fits and regular):  # a step has no time to ask beforehand
        _check(prior, measurement, jacobian, noise_covariance, predicted)
    if not regular:
        raise np.linalg.LinAlgError("Singular matrix")
    return Gaussian(mean, covariance), log_evidence


def _check(
    prior: Gaussian,
    measurement: Floats,
    slope: Floats,
    noise_covariance: Floats,
    predicted: Floats | None = None,
) -> None:
    """Refuse a measurement, its derivative or its noise that does not fit the prior."""
    check(
        mean=(prior.mean, "d"),
        covariance=(prior.covariance, "d d"),
        measurement=(measurement, "m"),
        predicted=(measurement if predicted is None else predicted, "m"),
        observation=(slope, "m d"),
        noise_covariance=(noise_covariance, "m m"),
    )


@compiled
def _predict(
    mean: Floats,
    covariance: Floats,
    transition: Floats,
    offset: Floats,
    noise: Floats,
) -> tuple[Floats, Floats]:
    """Return A m + d and A P A^T + B B^T; the sizes must agree, and the result be finite."""
    size = mean.shape[0]
    square = covariance.shape == (size, size) and transition.shape == (size, size)
    if not (square and mean.ndim == 1 and offset.shape[0] == noise.shape[0] == size):
        raise ValueError("expected a covariance (d, d), A (d, d), d (d,) and B (d, k), got other sizes")
    moved = multiply(transition, mean.reshape(size, 1)).reshape(size)
    spread = multiply(multiply(transition, covariance), transition.T.copy())
    added = multiply(noise, noise.T.copy())
    finite = True
    for i in range(size):
        moved[i] += offset[i]
        finite &= math.isfinite(moved[i])
        for j in range(i + 1):
            spread[i, j] = 0.5 * (spread[i, j] + added[i, j] + spread[j, i] + added[j, i])
            spread[j, i] = spread[i, j]
            finite &= math.isfinite(spread[i, j])
    if not finite:
        raise ValueError("expected finite numbers, got NaN or infinity")
    return moved, spread


@compiled
def condition_on_innovation(
    mean: Floats,
    covariance: Floats,
    innovation: Floats,
    jacobian: Floats,
    noise: Floats,
) -> tuple[Floats, Floats, float, bool]:
    """Return mean, covariance and log p(z), given z less its prediction, and whether its covariance is regular.

    For compiled loops; `condition` is the same for the interpreter.

    Args:
        mean: (d,) of the prior.
        covariance: (d, d) of the prior.
        innovation: (m,) the measurement less its prediction.
        jacobian: dz/dx, (m, d).
        noise: R, (m, m).

    Raises:
        ValueError: The sizes do not agree.
    """
    size, count = mean.shape[0], innovation.shape[0]
    square = covariance.shape == (size, size) and noise.shape == (count, count)
    if not (square and mean.ndim == innovation.ndim == 1 and jacobian.shape == (count, size)):
        raise ValueError("expected a covariance (d, d), a slope (m, d) and a noise (m, m), got other sizes")
    cross = multiply(jacobian, covariance)
    spread = multiply(cross, jacobian.T.copy())
    for i in range(count):
        for j in range(i + 1):
            spread[i, j] = 0.5 * (spread[i, j] + noise[i, j] + spread[j, i] + noise[j, i])
            spread[j, i] = spread[i, j]
    gain, regular = solve(spread, cross)
    densities, positive = log_densities(innovation.reshape(1, count), spread.reshape(1, count, count))
    if not (regular and positive):
        return mean, covariance, 0.0, False
    gain = gain.T.copy()
    updated = multiply(gain, innovation.reshape(count, 1)).reshape(size)
    kept = multiply(gain, jacobian)
    for i in range(size):
        updated[i] += mean[i]
        for j in range(size):
            kept[i, j] = (1.0 if i == j else 0.0) - kept[i, j]
    known = multiply(multiply(kept, covariance), kept.T.copy())
    added = multiply(multiply(gain, noise), gain.T.copy())
    for i in range(size):
        for j in range(i + 1):
            known[i, j] = 0.5 * (known[i, j] + added[i, j] + known[j, i] + added[j, i])
            known[j, i] = known[i, j]
    return updated, known, densities[0], True
