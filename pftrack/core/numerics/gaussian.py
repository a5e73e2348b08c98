"""Gaussian distributions: the value that Kalman filters carry, and the density that weights need."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pftrack.core.numerics.compiled import compiled
from pftrack.core.numerics.matrices import cholesky, factorise, product, substitute
from pftrack.core.numerics.random import Generator

__all__ = ["Gaussian", "log_densities", "log_density", "symmetrise"]


@dataclass(frozen=True)
class Gaussian:
    """N(mean, covariance).

    Attributes:
        mean: (d,).
        covariance: (d, d), symmetric, not negative.
    """

    mean: NDArray[np.float64]
    covariance: NDArray[np.float64]

    @cached_property
    def standard_deviations(self) -> NDArray[np.float64]:
        """(d,) square roots of the variances."""
        deviations: NDArray[np.float64] = np.sqrt(self.covariance.diagonal())
        return deviations

    def sample(self, rng: Generator, count: int) -> NDArray[np.float64]:
        """Draw (count, d) samples; the covariance may be singular."""
        normals = rng.standard_normal((count, len(self.mean)))
        samples: NDArray[np.float64] = self.mean + product(normals, cholesky(self.covariance).T)
        return samples


def log_density(
    points: NDArray[np.float64], means: NDArray[np.float64], covariance: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return log N(x | m, P).

    Args:
        points: (..., d).
        means: (..., d), broadcast against the points.
        covariance: (d, d) or (..., d, d), positive definite.

    Raises:
        numpy.linalg.LinAlgError: The covariance is not positive definite.
    """
    differences = np.subtract(points, means)
    dimension = differences.shape[-1]
    shape = differences.shape[:-1]
    one = np.ndim(covariance) == 2
    spread = covariance if one else np.broadcast_to(covariance, (*shape, dimension, dimension))
    densities, positive = log_densities(
        np.ascontiguousarray(differences.reshape(-1, dimension), np.float64),
        np.array(spread, np.float64).reshape(-1, dimension, dimension),
    )
    if not positive:
        raise np.linalg.LinAlgError("Matrix is not positive definite")
    return densities.reshape(shape)


@compiled
def log_densities(
    differences: NDArray[np.float64], covariances: NDArray[np.float64]
) -> tuple[NDArray[np.float64], bool]:
    """Return log N(x | 0, P), (n,), of points (n, d), and whether all covariances are positive definite.

    Args:
        differences: (n, d) of the points from their means.
        covariances: (n, d, d), or (1, d, d) for all of them.
    """
    count, dimension = differences.shape
    densities = np.empty(count)
    lower = np.empty((dimension, dimension))
    constant = 0.0
    for n in range(count):
        if n < covariances.shape[0]:
            lower, positive = factorise(covariances[n])
            if not positive:
                return densities, False
            constant = dimension * np.log(2.0 * np.pi)
            for i in range(dimension):
                constant += 2.0 * np.log(lower[i, i])
        whitened = substitute(lower, differences[n].copy().reshape(dimension, 1))
        square = 0.0
        for i in range(dimension):
            square += whitened[i, 0] * whitened[i, 0]
        densities[n] = -0.5 * (square + constant)
    return densities, True


def symmetrise(covariance: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the symmetric part of (..., d, d), which rounding must not lose."""
    return 0.5 * (covariance + np.swapaxes(covariance, -1, -2))
