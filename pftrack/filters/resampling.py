"""Resampling: drawing parents in proportion to their weights.

A resampler is a function `(rng, log_weights, count) -> ancestors` that draws `count` indices, each index n on average
`count * w_n` times. The four here differ in how much the actual numbers scatter around that average:

- `multinomial`: independent draws, the textbook definition and the noisiest;
- `stratified`: one draw in each of `count` equal strata of the cumulative weight;
- `systematic`: the same with one common offset; each index occurs floor or ceil of its expectation times; the default;
- `residual`: the integer parts without noise, the fractions by multinomial draws.

All return indices in ascending order. `decide` resamples only when the effective sample size has fallen below a share
of N.

Source: Bando 2007, ch. 2 section 3.1 (resampling in every frame); Douc, Cappe and Moulines 2005 for the comparison.
"""

from collections.abc import Callable
from typing import TypeAlias

import numpy as np
from numba import TypingError

from pftrack.core.arrays import Floats, Ints, check, check_count
from pftrack.core.numerics.compiled import compiled
from pftrack.core.numerics.elementary import exponentials
from pftrack.core.numerics.matrices import total
from pftrack.core.numerics.random import Generator, uniforms
from pftrack.filters.particles import ParticleSet

Resampler: TypeAlias = Callable[[Generator, Floats, int], Ints]


def systematic(rng: Generator, log_weights: Floats, count: int) -> Ints:
    """Draw (count,) parents with one uniform offset for all strata.

    Args:
        rng: Source of uniform numbers.
        log_weights: (N,) logarithms of weights, up to a common constant; not all -inf.
        count: Number to draw.

    Raises:
        TypeError: The weights are not an array of real numbers, or the count is not a whole number.
        ValueError: The weights are not (N,), hold NaN or are all -inf, or the count is below 1.
    """
    return systematic_parents(_weights(log_weights, count), rng.random(), count)


def stratified(rng: Generator, log_weights: Floats, count: int) -> Ints:
    """Draw (count,) parents with an independent uniform number in each stratum; arguments as for `systematic`."""
    return _stratified(_weights(log_weights, count), rng.random(count))


def multinomial(rng: Generator, log_weights: Floats, count: int) -> Ints:
    """Draw (count,) parents independently; arguments as for `systematic`."""
    return _multinomial(_weights(log_weights, count), rng.random(count))


def residual(rng: Generator, log_weights: Floats, count: int) -> Ints:
    """Draw floor(count * w_n) copies of each parent, the rest by fractions; arguments as for `systematic`."""
    return _residual(_weights(log_weights, count), rng.random(count))


RESAMPLERS: dict[str, Resampler] = {
    "systematic": systematic,
    "stratified": stratified,
    "residual": residual,
    "multinomial": multinomial,
}


@compiled
def parents(kind: int, log_weights: Floats, count: int, seed: int, frame: int, purpose: int, draw: int) -> Ints:
    """Draw (count,) parents inside a compiled loop, with the numbers that a `Stream` gives in its draw `draw`.

    Args:
        kind: Place of the resampler in `RESAMPLERS`.
        log_weights: (N,) logarithms of weights, up to a common constant; not all -inf.
        count: Number to draw.
        seed: Seed of the run.
        frame: Index of the frame.
        purpose: Purpose of the numbers.
        draw: Number of the draw.
    """
    weights = _relative(log_weights)
    if kind == 0:
        return systematic_parents(weights, uniforms(seed, frame, purpose, draw, 1)[0], count)
    numbers = uniforms(seed, frame, purpose, draw, count)
    if kind == 1:
        return _stratified(weights, numbers)
    if kind == 2:
        return _residual(weights, numbers)
    return _multinomial(weights, numbers)


def decide(resample: Resampler, threshold: float, rng: Generator, particles: ParticleSet, count: int) -> Ints | None:
    """Return the ancestors (count,), or None if the particles should keep their weights.

    Args:
        resample: The resampler to use.
        threshold: Share of N, 0..1; at 1 it resamples always, at 0 only when the number of particles changes.
        rng: Source of uniform numbers.
        particles: The particles.
        count: Number of parents to draw.
    """
    if threshold < 1 and count == len(particles) and particles.effective_sample_size >= threshold * count:
        return None
    return resample(rng, particles.log_weights, count)


def _weights(log_weights: Floats, count: int) -> Floats:
    """Return the weights (N,) relative to the greatest, if `count` parents can be drawn by them."""
    if type(count) is not int or count < 1:
        check_count("count", count)
    try:
        return _relative(log_weights)
    except (ValueError, TypingError, NotImplementedError):  # a step has no time to ask beforehand
        check(missing=True, log_weights=(log_weights, "N"))
        raise


@compiled
def _relative(log_weights: Floats) -> Floats:
    """Return the weights (N,) relative to the greatest."""
    top, unknown = -np.inf, 0
    for n in range(log_weights.shape[0]):
        top = max(top, log_weights[n])
        unknown += np.isnan(log_weights[n])
    if unknown or not -np.inf < top < np.inf:
        raise ValueError("expected log_weights (N,) with one above -inf and neither NaN nor +inf, got others")
    relative = np.empty(log_weights.shape[0])
    for n in range(log_weights.shape[0]):
        relative[n] = log_weights[n] - top
    return exponentials(relative)


@compiled
def systematic_parents(weights: Floats, offset: float, count: int) -> Ints:
    """Draw (count,) parents by weights (N,), not all 0, with one offset in [0, 1) for all strata.

    Raises:
        ValueError: No weight is above 0, or one is NaN.
    """
    size = weights.shape[0]
    spacing = total(weights) / count
    if not spacing > 0.0:
        raise ValueError("expected weights (N,) with one above 0 and no NaN, got others")
    # Rounding must not carry the last draws past the last particle that has any weight.
    last = size - 1
    while weights[last] == 0.0:
        last -= 1
    ancestors = np.empty(count, dtype=np.int64)
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
def _stratified(weights: Floats, numbers: Floats) -> Ints:
    count = numbers.shape[0]
    quantiles = np.empty(count)
    for i in range(count):
        quantiles[i] = (i + numbers[i]) / count
    return _inverse(weights, quantiles)


@compiled
def _multinomial(weights: Floats, numbers: Floats) -> Ints:
    return _inverse(weights, np.sort(numbers))


@compiled
def _residual(weights: Floats, numbers: Floats) -> Ints:
    count = numbers.shape[0]
    size = weights.shape[0]
    scale = count / total(weights)
    copies, fractions = np.empty(size, np.int64), np.empty(size)
    certain = 0
    for n in range(size):
        expected = weights[n] * scale
        copies[n] = int(np.floor(expected))
        fractions[n] = expected - copies[n]
        certain += copies[n]
    if certain < count:
        for ancestor in _multinomial(fractions, numbers[: count - certain]):
            copies[ancestor] += 1
    ancestors = np.empty(count, np.int64)
    drawn = 0
    for n in range(size):
        for _ in range(copies[n]):
            ancestors[drawn] = n
            drawn += 1
    return ancestors


@compiled
def _inverse(weights: Floats, quantiles: Floats) -> Ints:
    size = weights.shape[0]
    cumulative = np.empty(size)
    whole, last = 0.0, 0
    for n in range(size):
        # Rounding must not carry the last draws past the last particle that has any weight.
        if whole + weights[n] > whole:
            last = n
        whole += weights[n]
        cumulative[n] = whole
    ancestors = np.empty(quantiles.shape[0], np.int64)
    parent = 0
    for i in range(quantiles.shape[0]):
        wanted = quantiles[i] * whole
        while cumulative[parent] <= wanted and parent < last:
            parent += 1
        ancestors[i] = parent
    return ancestors
