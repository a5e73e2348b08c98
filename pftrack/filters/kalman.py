"""The Kalman filter: the exact posterior of a linear model with Gaussian noise.

Source: document 1, ch. 2, eqs. 2.8 and 2.9. The covariance is updated in Joseph's form, which keeps it symmetric and
positive whatever the rounding.
"""

import numpy as np
from numpy.typing import NDArray

from pftrack.dynamics import LinearDynamics
from pftrack.gaussian import Gaussian, log_density, symmetrised
from pftrack.matrices import product, solved

__all__ = ["predict", "update"]


def predict(posterior: Gaussian, dynamics: LinearDynamics) -> Gaussian:
    """Return p(x_t | z_{1:t-1}) from p(x_{t-1} | z_{1:t-1}), both over (d,)."""
    transition = dynamics.transition
    mean = product(transition, posterior.mean) + dynamics.offset
    moved = product(product(transition, posterior.covariance), transition.T)
    covariance = moved + dynamics.noise_covariance
    return Gaussian(mean, symmetrised(covariance))


def update(
    prior: Gaussian,
    measurement: NDArray[np.float64],
    observation: NDArray[np.float64],
    noise_covariance: NDArray[np.float64],
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
        numpy.linalg.LinAlgError: The innovation covariance is singular.
    """
    return condition(prior, measurement, product(observation, prior.mean), observation, noise_covariance)


def condition(
    prior: Gaussian,
    measurement: NDArray[np.float64],
    predicted: NDArray[np.float64],
    jacobian: NDArray[np.float64],
    noise_covariance: NDArray[np.float64],
) -> tuple[Gaussian, float]:
    """Condition on a measurement that is linear around the prior's mean; see `update` and `extended.update`.

    Args:
        prior: p(x), over (d,).
        measurement: z, (m,).
        predicted: Its prediction from the prior's mean, (m,).
        jacobian: dz/dx there, (m, d).
        noise_covariance: R, (m, m).
    """
    cross = product(prior.covariance, jacobian.T)
    innovation_covariance = symmetrised(product(jacobian, cross) + noise_covariance)
    gain = solved(innovation_covariance, cross.T).T
    mean = prior.mean + product(gain, measurement - predicted)
    kept = np.eye(len(mean)) - product(gain, jacobian)
    covariance = product(product(kept, prior.covariance), kept.T) + product(product(gain, noise_covariance), gain.T)
    log_evidence = float(log_density(measurement, predicted, innovation_covariance))
    return Gaussian(mean, symmetrised(covariance)), log_evidence
