"""Fixed-lag smoothing: where was the target a few frames ago, given what has been seen since?

For a Gaussian model the answer comes from augmenting the state with its own past, (x_t, ..., x_{t-L}), and filtering as
usual: the last block is smoothed by L later observations. For particles it comes from the genealogy: each particle's
ancestor L frames ago, weighted by the particle's weight today.

Source: Bando 2007, ch. 3 section 2.3, which names the Gaussian smoother; Kitagawa 1996 for particles.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pftrack.dynamics import LinearDynamics
from pftrack.numerics.gaussian import Gaussian
from pftrack.numerics.matrices import product
from pftrack.particles import ParticleSet

__all__ = ["Lineage", "augment", "augment_dynamics", "begin_lineage", "block", "extend_lineage", "smooth"]


def augment(posterior: Gaussian, lag: int) -> Gaussian:
    """Return the Gaussian of (x, x, ..., x), lag + 1 times the same variable (d,): a past that equals the present."""
    size = lag + 1
    return Gaussian(np.tile(posterior.mean, size), np.tile(posterior.covariance, (size, size)))


def augment_dynamics(dynamics: LinearDynamics, order: int, lag: int) -> LinearDynamics:
    """Return the dynamics of (x_t, ..., x_{t-lag}) from those of (x_t, ..., x_{t-order+1}).

    Args:
        dynamics: On states that stack `order` blocks of the variable, newest first, of which only the first is new.
        order: 1 for a first-order model, 2 for a second-order autoregression.
        lag: L, at least order - 1.

    Raises:
        ValueError: The lag is too short.
    """
    if lag < order - 1:
        raise ValueError(f"the lag must be at least {order - 1} for a model of order {order}, got {lag}")
    dimension = len(dynamics.offset) // order
    size = dimension * (lag + 1)
    transition = np.eye(size, k=-dimension)
    transition[:dimension] = 0.0
    transition[:dimension, : dimension * order] = dynamics.transition[:dimension]
    offset = np.zeros(size)
    offset[:dimension] = dynamics.offset[:dimension]
    noise = np.zeros((size, dynamics.noise.shape[1]))
    noise[:dimension] = dynamics.noise[:dimension]
    return LinearDynamics(transition, offset, noise)


def block(posterior: Gaussian, age: int, dimension: int, count: int = 1) -> Gaussian:
    """Return the joint of `count` consecutive blocks of an augmented Gaussian, the newest of them `age` frames old."""
    part = slice(age * dimension, (age + count) * dimension)
    return Gaussian(posterior.mean[part], posterior.covariance[part, part])


@dataclass(frozen=True, slots=True)
class Lineage:
    """The pasts of the particles of one frame.

    Attributes:
        paths: (ages, N, k) tracked coordinates of each particle's ancestors; age 0 is the particle itself.
    """

    paths: NDArray[np.float64]


def begin_lineage(particles: ParticleSet, tracked: int) -> Lineage:
    """Start with no past; the first `tracked` coordinates of the states are followed."""
    return Lineage(particles.states[None, :, :tracked].copy())


def extend_lineage(lineage: Lineage, particles: ParticleSet, lag: int) -> Lineage:
    """Follow the particles' ancestors by one frame, forgetting what is older than `lag` frames."""
    newest = particles.states[None, :, : lineage.paths.shape[2]]
    return Lineage(np.concatenate([newest, lineage.paths[:lag, particles.ancestors]]))


def smooth(lineage: Lineage, particles: ParticleSet, age: int) -> NDArray[np.float64]:
    """Return E[x_{t-age} | z_{1:t}], (k,).

    Raises:
        IndexError: The lineage does not reach back so far.
    """
    return product(particles.weights, lineage.paths[age])
