"""Fixed-lag smoothing: where was the target a few frames ago, given what has been seen since?

For a Gaussian model the answer comes from augmenting the state with its own past, (x_t, ..., x_{t-L}), and filtering as
usual: the last block is smoothed by L later observations. For particles it comes from the genealogy: each particle's
ancestor L frames ago, weighted by the particle's weight today.

Source: Bando 2007, ch. 3 section 2.3, which names the Gaussian smoother; Kitagawa 1996 for particles.
"""

from dataclasses import dataclass

import numpy as np

from pftrack.core.arrays import Floats
from pftrack.core.numerics.checks import check, check_count
from pftrack.core.numerics.matrices import product
from pftrack.core.numerics.random import Gaussian
from pftrack.filters.dynamics import LinearDynamics
from pftrack.filters.particles import ParticleSet


def augment(posterior: Gaussian, lag: int) -> Gaussian:
    """Return the Gaussian of (x, x, ..., x), lag + 1 times the same variable (d,): a past that equals the present.

    Raises:
        TypeError: Mean or covariance is not an array of real numbers, or the lag is not a whole number.
        ValueError: They have other shapes, or are not finite, or the lag is negative.
    """
    check_count("lag", lag, 0)
    check(mean=(posterior.mean, "d"), covariance=(posterior.covariance, "d d"))
    size = lag + 1
    return Gaussian(np.tile(posterior.mean, size), np.tile(posterior.covariance, (size, size)))


def augment_dynamics(dynamics: LinearDynamics, order: int, lag: int) -> LinearDynamics:
    """Return the dynamics of (x_t, ..., x_{t-lag}) from those of (x_t, ..., x_{t-order+1}).

    Args:
        dynamics: On states that stack `order` blocks of the variable, newest first, of which only the first is new.
        order: 1 for a first-order model, 2 for a second-order autoregression.
        lag: L, at least order - 1.

    Raises:
        TypeError: Order or lag is not a whole number.
        ValueError: The order does not divide the state, or the lag is too short.
    """
    check_count("order", order)
    check_count("lag", lag, 0)
    if len(dynamics.offset) % order:
        raise ValueError(
            f"a model of order {order} needs states of {order} blocks, got {len(dynamics.offset)} components"
        )
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
    """Return the joint of `count` consecutive blocks of an augmented Gaussian, the newest of them `age` frames old.

    Raises:
        TypeError: Age, dimension or count is not a whole number.
        ValueError: The Gaussian has fewer components.
    """
    check_count("age", age, 0)
    check_count("the dimension", dimension)
    check_count("count", count)
    part = slice(age * dimension, (age + count) * dimension)
    if part.stop > len(posterior.mean):
        raise ValueError(f"blocks {age} to {age + count - 1} need {part.stop} components, got {len(posterior.mean)}")
    return Gaussian(posterior.mean[part], posterior.covariance[part, part])


@dataclass(frozen=True, slots=True)
class Lineage:
    """The pasts of the particles of one frame.

    Attributes:
        paths: (ages, N, k) tracked coordinates of each particle's ancestors; age 0 is the particle itself.
    """

    paths: Floats


def begin_lineage(particles: ParticleSet, tracked: int) -> Lineage:
    """Start with no past; the first `tracked` coordinates of the states are followed.

    Raises:
        TypeError: The number is not a whole one.
        ValueError: The states have fewer coordinates.
    """
    check_count("tracked", tracked)
    if tracked > particles.states.shape[1]:
        raise ValueError(f"the states have {particles.states.shape[1]} coordinates, got {tracked} to follow")
    return Lineage(particles.states[None, :, :tracked].copy())


def extend_lineage(lineage: Lineage, particles: ParticleSet, lag: int) -> Lineage:
    """Follow the particles' ancestors by one frame, forgetting what is older than `lag` frames.

    Raises:
        TypeError: The lag is not a whole number.
        ValueError: It is negative, the states have fewer coordinates than the lineage, or an ancestor is not in it.
    """
    check_count("lag", lag, 0)
    _, before, tracked = lineage.paths.shape
    newest = particles.states[None, :, :tracked]
    if newest.shape[2] != tracked or not 0 <= particles.ancestors.min() <= particles.ancestors.max() < before:
        raise ValueError(
            f"the lineage follows {tracked} coordinates of {before} particles, got states {particles.states.shape} "
            f"and ancestors {particles.ancestors.min()} to {particles.ancestors.max()}"
        )
    return Lineage(np.concatenate([newest, lineage.paths[:lag, particles.ancestors]]))


def smooth(lineage: Lineage, particles: ParticleSet, age: int) -> Floats:
    """Return E[x_{t-age} | z_{1:t}], (k,).

    Raises:
        TypeError: The age is not a whole number.
        ValueError: It is negative, or the lineage is of another number of particles.
        IndexError: The lineage does not reach back so far.
    """
    check_count("age", age, 0)
    check(missing=True, log_weights=(particles.log_weights, "N"), paths=(lineage.paths, "ages N k"))
    return product(particles.weights, lineage.paths[age])
