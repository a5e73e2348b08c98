"""Dynamics: how a state moves from one frame to the next, and how uncertain that is.

The models here are linear with Gaussian noise, x' = A x + d + B u with u white and of unit variance, so one type covers
them all; the functions below build the usual members. A second-order model of a position carries the two newest
positions in its state, (x_t, x_{t-1}).

A family member needs only two methods, so nonlinear models are possible: `predict`, the mean of the next state, and
`diffuse`, which adds the noise to means that may have been chosen among.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numba import TypingError

from pftrack.core.arrays import Floats, Ints, check, check_count
from pftrack.core.numerics.compiled import compiled
from pftrack.core.numerics.matrices import product
from pftrack.core.numerics.random import Gaussian, Generator
from pftrack.filters.particles import ParticleSet


class Dynamics(Protocol):
    """A transition density p(x' | x) that can be sampled in two stages."""

    def predict(self, states: Floats) -> Floats:
        """Return the means (N, d) of the next states, given states (N, d)."""

    def diffuse(self, rng: Generator, means: Floats, ancestors: Ints) -> Floats:
        """Draw next states (n, d) around the means (N, d) of the ancestors (n,) chosen."""


@dataclass(frozen=True)
class Sampled:
    """A transition density that can be sampled only as a whole.

    Attributes:
        propagate: (states (n, d), rng) -> the next states (n, d), one for each.
    """

    propagate: Callable[[Floats, Generator], Floats]

    def predict(self, states: Floats) -> Floats:
        """Return the states as they are."""
        return states

    def diffuse(self, rng: Generator, means: Floats, ancestors: Ints) -> Floats:
        """Draw next states (n, d), given those of the ancestors (n,)."""
        return self.propagate(means.T.take(ancestors, axis=1).T, rng)  # coordinates lie together, as in `diffuse`


@dataclass(frozen=True)
class LinearDynamics:
    """x' = A x + d + B u, u ~ N(0, I).

    Attributes:
        transition: A, (d, d).
        offset: d, (d,).
        noise: B, (d, k); the process noise has the covariance B B^T.
    """

    transition: Floats
    offset: Floats
    noise: Floats

    def __post_init__(self) -> None:
        """Refuse arrays that do not fit together.

        Raises:
            TypeError: An argument is not an array of real numbers.
            ValueError: An array has another shape, or is not finite.
        """
        check(transition=(self.transition, "d d"), offset=(self.offset, "d"), noise=(self.noise, "d k"))

    def predict(self, states: Floats) -> Floats:
        """Return the means (N, d) of the next states, given states (N, d), an array or lists.

        Raises:
            TypeError: The states are not real numbers.
            ValueError: They have another dimension than the model.
        """
        try:
            return predict(np.asfortranarray(states), self.transition, self.offset)
        except (ValueError, TypingError):  # a step has no time to ask beforehand
            check(transition=(self.transition, "d d"), states=(states, "N d"))
            raise

    def diffuse(self, rng: Generator, means: Floats, ancestors: Ints) -> Floats:
        """Draw next states (n, d) around the means (N, d) of the ancestors (n,) chosen.

        Raises:
            TypeError: The means or the ancestors are not an array of real numbers.
            ValueError: The means have another dimension than the model, or an ancestor is not among them.
        """
        normals = rng.standard_normal((self.noise.shape[1], len(ancestors)))
        try:
            return diffuse(means, ancestors, self.noise, normals)
        except (ValueError, TypingError):
            check(noise=(self.noise, "d k"), means=(means, "N d"), ancestors=(ancestors, "n", "whole"))
            raise

    @property
    def noise_covariance(self) -> Floats:
        """B B^T, (d, d)."""
        return product(self.noise, self.noise.T)


def random_walk(dimension: int, noise_sd: float) -> LinearDynamics:
    """Return x' = x + b u with the same b in every coordinate.

    Args:
        dimension: d.
        noise_sd: b, in the state's unit per frame.

    Raises:
        TypeError: The dimension is not a whole number.
        ValueError: The dimension is below 1, or the deviation is not finite.
    """
    check_count("the dimension", dimension)
    return LinearDynamics(np.eye(dimension), np.zeros(dimension), noise_sd * np.eye(dimension))


def constant_velocity(dimension: int, interval_s: float, acceleration_sd: float) -> LinearDynamics:
    """Return the white-acceleration model on states (positions, velocities), each of `dimension` coordinates.

    Args:
        dimension: Number of spatial coordinates; the state has twice as many.
        interval_s: Time between frames, s.
        acceleration_sd: Standard deviation of the acceleration held over a frame, unit / s^2.

    Raises:
        TypeError: The dimension is not a whole number.
        ValueError: The dimension is below 1, or another number is not finite.
    """
    check_count("the dimension", dimension)
    one, zero = np.eye(dimension), np.zeros((dimension, dimension))
    transition = np.block([[one, interval_s * one], [zero, one]])
    noise = acceleration_sd * np.vstack([0.5 * interval_s**2 * one, interval_s * one])
    return LinearDynamics(transition, np.zeros(2 * dimension), noise)


def autoregression(newer: Floats, older: Floats, offset: Floats, noise: Floats) -> LinearDynamics:
    """Return x_{t+2} = A1 x_{t+1} + A0 x_t + d + B u on states (x_{t+1}, x_t) (Bando 2007, eq. 3.10).

    Args:
        newer: A1, (d, d).
        older: A0, (d, d).
        offset: d, (d,).
        noise: B, (d, k).

    Raises:
        TypeError: An argument is not an array of real numbers.
        ValueError: An array has another shape, or is not finite.
    """
    dimension = check(newer=(newer, "d d"), older=(older, "d d"), offset=(offset, "d"), noise=(noise, "d k"))["d"]
    one, zero = np.eye(dimension), np.zeros((dimension, dimension))
    return LinearDynamics(
        np.block([[newer, older], [one, zero]]),
        np.concatenate([offset, np.zeros(dimension)]),
        np.vstack([noise, np.zeros_like(noise)]),
    )


@compiled
def predict(states: Floats, transition: Floats, offset: Floats) -> Floats:
    """Return A x + d of states (N, d); each coordinate of the result lies together in memory.

    Raises:
        ValueError: The states have another dimension than A and d.
    """
    count, dimension = states.shape
    if (
        count == 0
        or transition.shape[0] != dimension
        or transition.shape[1] != dimension
        or offset.shape[0] != dimension
    ):
        raise ValueError("expected A (d, d) and an offset (d,) for states (N, d), got other sizes or no states")
    means = np.empty((dimension, count))
    for i in range(dimension):
        means[i] = offset[i]
        for j in range(dimension):
            factor = transition[i, j]
            # Most entries of the usual models are zero.
            if factor != 0.0:
                for n in range(count):
                    means[i, n] += factor * states[n, j]
    return means.T


@compiled
def diffuse(
    means: Floats,
    ancestors: Ints,
    noise: Floats,
    normals: Floats,
) -> Floats:
    """Return the means (N, d) of the ancestors (n,) plus B u.

    Args:
        means: (N, d).
        ancestors: (n,) their indices.
        noise: B, (d, k).
        normals: u, (k, n).

    Raises:
        ValueError: The sizes do not agree, or an ancestor is not among the means.
    """
    count = ancestors.shape[0]
    dimension = means.shape[1]
    if noise.shape[0] != dimension or noise.shape[1] != normals.shape[0] or normals.shape[1] != count:
        raise ValueError("expected B (d, k) and normals (k, n) for means (N, d) and ancestors (n,), got other sizes")
    strangers = 0
    for n in range(count):
        strangers += (ancestors[n] < 0) | (ancestors[n] >= means.shape[0])
    if strangers:
        raise ValueError("expected ancestors between 0 and N - 1 for means (N, d), got others")
    states = np.empty((dimension, count))
    for i in range(dimension):
        for n in range(count):
            states[i, n] = means[ancestors[n], i]
        for j in range(normals.shape[0]):
            factor = noise[i, j]
            if factor != 0.0:
                for n in range(count):
                    states[i, n] += factor * normals[j, n]
    return states.T


# Fixed-lag smoothing: the target's position a few frames ago, given all frames since.
#
# For a Gaussian model the answer comes from augmenting the state with its own past, (x_t, ..., x_{t-L}), and filtering
# as usual: the last block is smoothed by L later observations. For particles it comes from the genealogy: each
# particle's ancestor L frames ago, weighted by the particle's weight today.
#
# Source: Bando 2007, ch. 3 section 2.3, which names the Gaussian smoother; Kitagawa 1996 for particles.


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
        dynamics: States stack `order` blocks of the variable, newest first; only the first block is new.
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
        ValueError: It is negative, or the lineage has another number of particles.
        IndexError: The lineage does not reach back so far.
    """
    check_count("age", age, 0)
    check(missing=True, log_weights=(particles.log_weights, "N"), paths=(lineage.paths, "ages N k"))
    return product(particles.weights, lineage.paths[age])
