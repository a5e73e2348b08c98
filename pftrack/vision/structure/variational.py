"""Factorization by variational Bayes: each position counts by its own noise (Bando 2007, ch. 4 section 5.2).

`factorize` of `factorization` lets every position count alike. Here each has a variance, and what is hidden has a large
or an infinite one; no column need be deleted. Shape and motion have Gaussian priors, and their posterior is taken as a
product of Gaussians, one a point and one a row of motion, which are improved in turn (`passes`). Each pass raises the
free energy, a lower bound on the log evidence of the tracks.

The result is affine: `metric` makes it a shape in px. The covariances are those of a product of independent beliefs.
They do not know of a map of shape and motion together, which no track can tell, and are too small for what is common to
all points; that a whole direction of the shape has not been seen is told by `strengths` instead.
"""

from dataclasses import dataclass, replace
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from pftrack.core.numerics.matrices import product, solve_system
from pftrack.core.numerics.random import Generator
from pftrack.core.numerics.singular import singular_values
from pftrack.vision.structure.factorization import Camera, metric_transform
from pftrack.vision.structure.passes import free_energy, moments, posterior_points, posterior_rows
from pftrack.vision.structure.tracks import Tracks

__all__ = [
    "GAMMA",
    "Initial",
    "Variational",
    "fit",
    "initial_motion",
    "iterate",
    "metric",
    "strengths_of",
    "transform_covariances",
]

Initial: TypeAlias = Literal["svd", "zero", "random"]

GAMMA = 1e-4
"""Precision of the prior of the motion's entries, 1/px^2."""

ITERATIONS = 10
FIRST_VARIANCE = 1e-6
"""Of the rows of a motion that is given at the beginning."""


@dataclass(frozen=True, eq=False)
class Variational:
    """The posterior of shape and motion.

    Attributes:
        shape: (n, 3) means of the points; about unit variance, known up to an affine map.
        shape_covariances: (n, 3, 3); the prior's, the identity, for a point that was never seen.
        motion: (2 T, 4) means of the rows (m, t), px.
        motion_covariances: (2 T, 4, 4) px^2.
        free_energies: (iterations,) after each, never falling.
        strengths: (3,) how far the directions of the shape stand out from the noise, the greatest first: what is
            explained by each, relative to what noise alone would explain. A third one near 1 or below says that the
            depth was not seen: there was too little rotation, or the points lie in one plane.
    """

    shape: NDArray[np.float64]
    shape_covariances: NDArray[np.float64]
    motion: NDArray[np.float64]
    motion_covariances: NDArray[np.float64]
    free_energies: NDArray[np.float64]
    strengths: NDArray[np.float64]


def fit(
    tracks: Tracks,
    *,
    iterations: int = ITERATIONS,
    initial: Initial = "svd",
    gamma: float = GAMMA,
    rng: Generator | None = None,
) -> Variational:
    """Factor tracks, with their variances.

    Args:
        tracks: Positions and variances.
        iterations: Passes over shape and motion, at least one.
        initial: The motion to begin with: by singular values of the weighted tracks; none; or random.
        gamma: Precision of the prior of the motion, 1/px^2.
        rng: For a random one.

    Raises:
        ValueError: There are no iterations, gamma is not above 0, or a random beginning has no generator.
    """
    if iterations < 1 or not gamma > 0.0:
        raise ValueError(f"expected at least one iteration and gamma above 0, got {iterations} and {gamma:g}")
    rows, precisions = tracks.matrix, tracks.precisions
    motion, covariances = initial_motion(rows, precisions, initial, gamma, rng)
    return iterate(rows, precisions, motion, covariances, iterations, gamma)


def iterate(
    rows: NDArray[np.float64],
    precisions: NDArray[np.float64],
    motion: NDArray[np.float64],
    covariances: NDArray[np.float64],
    iterations: int,
    gamma: float,
    first: int = 0,
) -> Variational:
    """Return the posterior after passes from a given motion; arguments as in `passes`."""
    energies = np.empty(iterations)
    for iteration in range(iterations):
        shape, spread = posterior_points(rows, precisions, motion, covariances)
        motion, covariances, logs = posterior_rows(rows, precisions, moments(shape, spread), gamma, first)
        energies[iteration] = free_energy(rows, precisions, shape, spread, motion, covariances, logs, gamma, first)
    return Variational(shape, spread, motion, covariances, energies, strengths_of(precisions, shape, motion))


def initial_motion(
    rows: NDArray[np.float64],
    precisions: NDArray[np.float64],
    initial: Initial,
    gamma: float,
    rng: Generator | None = None,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return means (D, 4) and covariances (D, 4, 4) of a motion to begin with."""
    height = len(rows)
    if initial == "zero":
        # The first three rows have the means of their prior, without which no direction would differ from another.
        motion = np.zeros((height, 4))
        motion[:4] = np.eye(4)[: min(height, 4)]
        return motion, np.broadcast_to(np.eye(4) / gamma, (height, 4, 4)).copy()
    totals = precisions.sum(axis=1)
    means = np.divide((precisions * rows).sum(axis=1), totals, out=np.zeros(height), where=totals > 0.0)
    motion = np.column_stack([np.zeros((height, 3)), means])
    if initial == "random":
        if rng is None:
            raise ValueError("a random beginning needs a generator")
        motion[:, :3] = rng.standard_normal((height, 3))
    else:
        greatest = float(precisions.max())
        weights = np.sqrt(precisions / greatest) if greatest > 0.0 else np.zeros_like(precisions)
        left, strengths, _ = singular_values(weights * (rows - means[:, None]))
        motion[:, :3] = left[:, :3] * strengths[:3] / np.sqrt(rows.shape[1])
    return motion, np.broadcast_to(FIRST_VARIANCE * np.eye(4), (height, 4, 4)).copy()


def metric(
    found: Variational, camera: Camera = "orthographic", depth_sign: tuple[int, int, int] | None = None
) -> Variational:
    """Return the posterior after the map that makes the cameras orthographic; the shape is then in px.

    Args:
        found: A posterior.
        camera: As for `factorization.metric_upgrade`.
        depth_sign: The same.

    Raises:
        ValueError: The cameras do not determine the map.
    """
    transform = np.eye(4)
    transform[:3, :3] = metric_transform(found.motion[:, :3], found.shape, camera, depth_sign)
    inverse = solve_system(transform, np.eye(4))[:3, :3].copy()
    return replace(
        found,
        shape=product(found.shape, inverse.T),
        shape_covariances=transform_covariances(found.shape_covariances, inverse),
        motion=product(found.motion, transform),
        motion_covariances=transform_covariances(found.motion_covariances, transform.T),
    )


def transform_covariances(covariances: NDArray[np.float64], matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return A P A^T of covariances (n, d, d)."""
    return np.array([product(product(matrix, one), matrix.T) for one in covariances])


def strengths_of(
    precisions: NDArray[np.float64], shape: NDArray[np.float64], motion: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the singular values of the whitened fit relative to the greatest one of noise alone."""
    height, count = precisions.shape
    whitened = np.sqrt(precisions) * product(motion[:, :3], (shape - shape.mean(axis=0)).T)
    # Noise of unit variance in a matrix of this size has sqrt(D) + sqrt(n) as its greatest singular value.
    return np.asarray(singular_values(whitened)[1][:3] / (np.sqrt(height) + np.sqrt(count)))
