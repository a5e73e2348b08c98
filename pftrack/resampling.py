"""Resampling: drawing parents in proportion to their weights.

A resampler is a function `(rng, log_weights, count) -> ancestors` that draws `count` indices, each index n on average
`count * w_n` times. The four here differ in how much the actual numbers scatter around that average:

- `multinomial`: independent draws, the textbook definition and the noisiest;
- `stratified`: one draw in each of `count` equal strata of the cumulative weight;
- `systematic`: the same with one common offset; each index comes floor or ceil of its expectation; the default;
- `residual`: the whole parts without any noise, the fractions by multinomial draws.

All return indices in ascending order. `adaptive` wraps a decision around them: resample only when the effective sample
size has fallen below a share of N.

Source: document 1, sections 3 and 5.1 (systematic, every frame); Douc, Cappe and Moulines 2005 for the comparison.
"""

from collections.abc import Callable
from functools import partial
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from pftrack.compiled import compiled
from pftrack.particles import ParticleSet

__all__ = ["RESAMPLERS", "Resampler", "adaptive", "multinomial", "residual", "stratified", "systematic"]

Resampler: TypeAlias = Callable[[np.random.Generator, NDArray[np.float64], int], NDArray[np.int64]]


def systematic(rng: np.random.Generator, log_weights: NDArray[np.float64], count: int) -> NDArray[np.int64]:
    """Draw (count,) parents with one uniform offset for all strata.

    Args:
        rng: Source of one uniform number.
        log_weights: (N,) logarithms of weights, up to a common constant; not all -inf.
        count: How many to draw.
    """
    return _systematic(_relative(log_weights), rng.random(), count)


def stratified(rng: np.random.Generator, log_weights: NDArray[np.float64], count: int) -> NDArray[np.int64]:
    """Draw (count,) parents with an independent uniform number in each stratum; arguments as for `systematic`."""
    return _inverse(_relative(log_weights), (np.arange(count) + rng.random(count)) / count)


def multinomial(rng: np.random.Generator, log_weights: NDArray[np.float64], count: int) -> NDArray[np.int64]:
    """Draw (count,) parents independently; arguments as for `systematic`."""
    return _inverse(_relative(log_weights), np.sort(rng.random(count)))


def residual(rng: np.random.Generator, log_weights: NDArray[np.float64], count: int) -> NDArray[np.int64]:
    """Draw floor(count * w_n) copies of each parent, the rest by fractions; arguments as for `systematic`."""
    weights = _relative(log_weights)
    expected = count * weights / weights.sum()
    whole = np.floor(expected).astype(np.int64)
    certain = np.repeat(np.arange(len(weights)), whole)
    missing = count - len(certain)
    if missing == 0:
        return certain
    with np.errstate(divide="ignore"):
        fractions = np.log(expected - whole)
    return np.sort(np.concatenate([certain, multinomial(rng, fractions, missing)]))


RESAMPLERS: dict[str, Resampler] = {
    "systematic": systematic,
    "stratified": stratified,
    "residual": residual,
    "multinomial": multinomial,
}


def adaptive(
    resample: Resampler, threshold: float
) -> Callable[[np.random.Generator, ParticleSet, int], NDArray[np.int64] | None]:
    """Wrap a resampler so that it acts only when it must.

    Args:
        resample: The resampler to use.
        threshold: Share of N, 0..1; at 1 it resamples always, at 0 only when the number of particles changes.

    Returns:
        A function of generator, particles and the number wanted that gives the ancestors, or None when the particles
        should keep their weights.
    """
    return partial(_decide, resample, threshold)


def _decide(
    resample: Resampler, threshold: float, rng: np.random.Generator, particles: ParticleSet, count: int
) -> NDArray[np.int64] | None:
    if count == len(particles) and threshold < 1 and particles.effective_sample_size >= threshold * count:
        return None
    return resample(rng, particles.log_weights, count)


def _relative(log_weights: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the weights (N,) relative to the greatest."""
    weights: NDArray[np.float64] = np.exp(log_weights - log_weights.max())
    return weights


@compiled
def _systematic(weights: NDArray[np.float64], offset: float, count: int) -> NDArray[np.int64]:
    size = weights.shape[0]
    total = 0.0
    for n in range(size):
        total += weights[n]
    # Rounding must not carry the last draws past the last particle that has any weight.
    last = size - 1
    while weights[last] == 0.0:
        last -= 1
    ancestors = np.empty(count, dtype=np.int64)
    spacing = total / count
    parent = 0
    reached = weights[0]
    for i in range(count):
        wanted = (i + offset) * spacing
        while reached <= wanted and parent < last:
            parent += 1
            reached += weights[parent]
        ancestors[i] = parent
    return ancestors


@compiled
def _inverse(weights: NDArray[np.float64], quantiles: NDArray[np.float64]) -> NDArray[np.int64]:
    cumulative = np.cumsum(weights)
    total = cumulative[-1]
    last = np.searchsorted(cumulative, total)
    ancestors = np.empty(quantiles.shape[0], dtype=np.int64)
    parent = 0
    for i in range(quantiles.shape[0]):
        wanted = quantiles[i] * total
        while cumulative[parent] <= wanted and parent < last:
            parent += 1
        ancestors[i] = parent
    return ancestors
