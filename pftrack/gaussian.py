"""Gaussian distributions: the value that Kalman filters carry, and the density that weights need."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pftrack.random import Generator

__all__ = ["Gaussian", "log_density", "symmetrised"]


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
        values, vectors = np.linalg.eigh(self.covariance)
        root = vectors * np.sqrt(np.clip(values, 0.0, None))
        samples: NDArray[np.float64] = self.mean + rng.standard_normal((count, len(self.mean))) @ root.T
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
    root = np.linalg.cholesky(covariance)
    whitened = np.linalg.solve(root, (points - means)[..., None])[..., 0]
    log_determinant = 2.0 * np.log(np.diagonal(root, axis1=-2, axis2=-1)).sum(-1)
    dimension = points.shape[-1]
    density: NDArray[np.float64] = -0.5 * ((whitened**2).sum(-1) + log_determinant + dimension * np.log(2.0 * np.pi))
    return density


def symmetrised(covariance: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the symmetric part of (..., d, d), which rounding must not lose."""
    return 0.5 * (covariance + np.swapaxes(covariance, -1, -2))
