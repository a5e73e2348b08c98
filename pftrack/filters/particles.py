"""Particle sets: a distribution as a cloud of weighted hypotheses; and the result of one step of a particle filter.

A particle set approximates a distribution by N states and weights that sum to one. Weights are kept as logarithms,
since the likelihood of even a short signal underflows (raw weights of ten particles fail at dimension 5 on the cosine
of Bando 2007, ch. 2 section 3.2), and an impossible value (NaN) becomes a weight of zero in one place, `normalise`.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self, TypeAlias

import numpy as np

from pftrack.core.arrays import Floats, Ints, check
from pftrack.core.numerics.compiled import compiled
from pftrack.core.numerics.elementary import exponentials
from pftrack.core.numerics.matrices import inner_product, total

_FLOAT, _INDEX = np.dtype(np.float64).num, np.dtype(np.int64).num


@dataclass(frozen=True)
class ParticleSet:
    """N weighted states, immutable.

    Attributes:
        states: (N, d) states in the units of the model.
        log_weights: (N,) logarithms of weights that sum to one.
        ancestors: (N,) index of each particle's parent in the previous set.
    """

    states: Floats
    log_weights: Floats
    ancestors: Ints

    def __post_init__(self) -> None:
        """Refuse arrays that do not fit together, and states that are not finite.

        Raises:
            TypeError: An argument is not an array of real numbers.
            ValueError: There are no particles, the numbers of states, weights and ancestors differ, or a state holds
                NaN or infinity.
        """
        states, weights, ancestors = self.states, self.log_weights, self.ancestors
        try:
            fits = 0 < len(states) == len(weights) == len(ancestors)
            fits = fits and states.ndim == 2 and weights.ndim == ancestors.ndim == 1
            fits = fits and states.dtype.num == weights.dtype.num == _FLOAT and ancestors.dtype.num == _INDEX
            # A sum of squares is finite only if all are; it takes a fifth of the time of looking at each.
            flat = states.ravel("K")
            fits = fits and math.isfinite(flat.dot(flat))
        except (AttributeError, TypeError):
            fits = False
        if not fits:
            check(missing=True, states=(states, "N d"), log_weights=(weights, "N"), ancestors=(ancestors, "N", "whole"))
            check(states=(states, "N d"))

    @classmethod
    def uniform(cls, states: Floats) -> "ParticleSet":
        """Return the states (N, d) with equal weights, each its own ancestor.

        Raises:
            TypeError: The states are not an array of real numbers.
            ValueError: They are not (N, d) and finite, or there are none.
        """
        count = check(states=(states, "N d"))["N"]
        return cls(states, np.full(count, -math.log(count)), np.arange(count))

    def __len__(self) -> int:
        """Return the number of particles N."""
        return len(self.log_weights)

    def shifted(self, shift: Floats, particle: int | None = None) -> Self:
        """Return the set with one particle, or all of them, shifted by a difference of states (d,)."""
        states = self.states.copy(order="K")
        states[slice(None) if particle is None else particle] += shift
        return replace(self, states=states)

    def arrays(self) -> Mapping[str, Floats]:
        """Return states and log weights by name, for a file."""
        return {"states": self.states, "log_weights": self.log_weights}

    @cached_property
    def weights(self) -> Floats:
        """(N,) normalised weights."""
        return exponentials(self.log_weights)

    @cached_property
    def moments(self) -> tuple[Floats, Floats]:
        """Weighted mean (d,) and covariance (d, d).

        The covariance is sum_n w_n (x_n - mean)(x_n - mean)^T, without the divisor N - 1 that Bando 2007 prints (eq.
        3.5, an erratum: the weights are normalised already).
        """
        return moments(np.asfortranarray(self.states), self.weights)

    @property
    def mean(self) -> Floats:
        """(d,) weighted mean (Bando 2007, eq. 3.3)."""
        return self.moments[0]

    @property
    def covariance(self) -> Floats:
        """(d, d) weighted covariance."""
        return self.moments[1]

    @cached_property
    def effective_sample_size(self) -> float:
        """1 / sum_n w_n^2, between 1 and N."""
        return float(1.0 / np.square(self.weights).sum())

    @property
    def mode(self) -> Floats:
        """(d,) the state of greatest weight; the first among equals."""
        best: Floats = self.states[int(np.argmax(self.log_weights))]
        return best

    @cached_property
    def unique_ancestors(self) -> int:
        """Number of different parents of the particles."""
        return int(count_unique(self.ancestors))


LogLikelihood: TypeAlias = Callable[[Floats], Floats]


@dataclass(frozen=True, slots=True)
class Posterior:
    """The posterior of one frame as particles, and how it came about.

    Attributes:
        particles: The posterior. Those from the prediction sampler come first, those from the observation sampler last.
        log_evidence: log p(z_t | z_{1:t-1}), up to the constant that the likelihood leaves out; -inf if every weight
            was zero and the particles were made uniform.
        observation_count: Number of particles from the observation sampler.
        resampled: Whether the particles were resampled.
    """

    particles: ParticleSet
    log_evidence: float
    observation_count: int
    resampled: bool


def evaluate(log_likelihood: LogLikelihood, states: Floats) -> Floats:
    """Return the log likelihoods (n,) of states (n, d); NaN counts as impossible when they are normalised.

    Raises:
        TypeError: The likelihood does not return an array of real numbers.
        ValueError: It returns a number of values other than that of the states.
    """
    values = log_likelihood(states)
    try:
        fits = values.dtype.kind == "f" and values.ndim == 1 and len(values) == len(states)
    except AttributeError:
        fits = False
    if not fits:
        check(missing=True, states=(states, "N d"), log_likelihood=(values, "N"))
    return values


@compiled
def normalise(log_weights: Floats) -> tuple[Floats, float]:
    """Scale weights so that they sum to one.

    NaN counts as a weight of zero, and so does +inf, which is not a valid likelihood. If every weight is zero, nothing
    is
    known: the result is uniform and the log of the sum is -inf.

    Args:
        log_weights: (N,) logarithms of unnormalised weights.

    Returns:
        (N,) logarithms of normalised weights, and the logarithm of the sum of the weights given.

    Raises:
        ValueError: There are no weights.
    """
    count = log_weights.shape[0]
    if count == 0:
        raise ValueError("expected at least one log weight, got none")
    top = -np.inf
    for n in range(count):
        if top < log_weights[n] < np.inf:
            top = log_weights[n]
    if top == -np.inf:
        return np.full(count, -np.log(count)), -np.inf
    scaled = np.empty(count)
    for n in range(count):
        scaled[n] = log_weights[n] - top if log_weights[n] < np.inf else -np.inf
    log_sum = np.log(total(exponentials(scaled)))
    for n in range(count):
        scaled[n] -= log_sum
    return scaled, top + log_sum


@compiled
def moments(states: Floats, weights: Floats) -> tuple[Floats, Floats]:
    """Return the weighted mean (d,) and covariance (d, d) of states (N, d), given weights (N,) that sum to one.

    Raises:
        ValueError: The number of weights differs from that of the states.
    """
    count, dimension = states.shape
    if weights.shape[0] != count:
        raise ValueError("expected a weight for each of the states (N, d), got another number of weights")
    mean = np.empty(dimension)
    covariance = np.empty((dimension, dimension))
    deviations = np.empty((dimension, count))
    weighted = np.empty(count)
    for i in range(dimension):
        for n in range(count):
            deviations[i, n] = states[n, i]
        mean[i] = inner_product(weights, deviations[i])
        for n in range(count):
            deviations[i, n] -= mean[i]
    for i in range(dimension):
        for n in range(count):
            weighted[n] = weights[n] * deviations[i, n]
        for j in range(i, dimension):
            covariance[i, j] = inner_product(weighted, deviations[j])
            covariance[j, i] = covariance[i, j]
    return mean, covariance


@compiled
def count_unique(ancestors: Ints) -> int:
    """Return the number of different values, 0 or more, among (n,)."""
    most = 0
    for ancestor in ancestors:
        most = max(most, ancestor)
    seen = np.zeros(most + 1, dtype=np.bool_)
    unique = 0
    for ancestor in ancestors:
        if not seen[ancestor]:
            seen[ancestor] = True
            unique += 1
    return unique
