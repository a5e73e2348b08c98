"""The extended Kalman filter: nonlinear models, linearised where the mean is."""

from collections.abc import Callable

from pftrack.core.arrays import Floats, check
from pftrack.core.numerics.matrices import product
from pftrack.core.numerics.random import Gaussian, symmetrise
from pftrack.filters.kalman import condition


def predict(
    posterior: Gaussian,
    transition: Callable[[Floats], Floats],
    jacobian: Callable[[Floats], Floats],
    noise_covariance: Floats,
) -> Gaussian:
    """Return p(x_t | z_{1:t-1}) for x_t = f(x_{t-1}) + noise.

    Args:
        posterior: p(x_{t-1} | z_{1:t-1}), over (d,).
        transition: f, (d,) -> (d,).
        jacobian: df/dx, (d,) -> (d, d).
        noise_covariance: Q, (d, d).

    Raises:
        TypeError: An argument is not an array of real numbers.
        ValueError: An array has another shape, or is not finite.
    """
    check(mean=(posterior.mean, "d"), covariance=(posterior.covariance, "d d"))
    slope, moved = jacobian(posterior.mean), transition(posterior.mean)
    check(
        mean=(posterior.mean, "d"),
        transition=(moved, "d"),
        jacobian=(slope, "d d"),
        noise_covariance=(noise_covariance, "d d"),
    )
    covariance = product(product(slope, posterior.covariance), slope.T) + noise_covariance
    return Gaussian(moved, symmetrise(covariance))


def update(
    prior: Gaussian,
    measurement: Floats,
    observe: Callable[[Floats], Floats],
    jacobian: Callable[[Floats], Floats],
    noise_covariance: Floats,
) -> tuple[Gaussian, float]:
    """Condition on z = h(x) + v, v ~ N(0, R), by linearising h at the prior's mean.

    Args:
        prior: p(x), over (d,).
        measurement: z, (m,).
        observe: h, (d,) -> (m,).
        jacobian: dh/dx, (d,) -> (m, d).
        noise_covariance: R, (m, m).

    Returns:
        The approximate p(x | z) and log p(z).

    Raises:
        TypeError: An argument is not an array of real numbers.
        ValueError: An array has another shape, or is not finite.
        numpy.linalg.LinAlgError: The innovation covariance is singular.
    """
    check(mean=(prior.mean, "d"), covariance=(prior.covariance, "d d"))
    return condition(prior, measurement, observe(prior.mean), jacobian(prior.mean), noise_covariance)
