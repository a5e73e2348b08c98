"""Offspring: how many copies each of six particles gets, by a comb or by darts, and how much that scatters."""

from typing import Literal, TypeAlias

import numpy as np

from pftrack.core.arrays import Floats, Ints
from pftrack.core.numerics.random import Purpose, Stream
from pftrack.filters.resampling import RESAMPLERS, systematic_parents

Scheme: TypeAlias = Literal["systematic", "stratified", "multinomial"]

WEIGHTS: Floats = np.array([0.37, 0.23, 0.17, 0.12, 0.07, 0.04])
LOG_WEIGHTS: Floats = np.log(WEIGHTS)
REPEATS_FRAME = 1
"""Frame of the random numbers of repeats, which are others than those of the figure."""


def marks(scheme: Scheme, count: int, offset: float, seed: int) -> Floats:
    """Return where teeth or darts (count,) meet the weights, laid end to end and scaled to `count`, ascending.

    Args:
        scheme: By one comb, by a dart in each of `count` equal pieces, or by darts anywhere.
        count: How many are drawn.
        offset: Of the comb, in [0, 1) of what lies between its teeth.
        seed: Of the darts.
    """
    numbers = Stream(seed, 0, Purpose.TRACK).random(count)
    match scheme:
        case "systematic":
            return np.asarray(np.arange(count) + offset)
        case "stratified":
            return np.asarray(np.arange(count) + numbers)
        case "multinomial":
            return np.asarray(np.sort(numbers) * count)


def copies(scheme: Scheme, count: int, offset: float, seed: int) -> Ints:
    """Return how many copies of each particle those teeth or darts make; arguments as for `marks`."""
    if scheme == "systematic":
        return _count(systematic_parents(WEIGHTS, offset, count))
    return _count(RESAMPLERS[scheme](Stream(seed, 0, Purpose.TRACK), LOG_WEIGHTS, count))


def sample_copies(scheme: Scheme, count: int, repeats: int, seed: int) -> Floats:
    """Return the copies of each particle in many redraws, (repeats, particles)."""
    rng, resample = Stream(seed, REPEATS_FRAME, Purpose.TRACK), RESAMPLERS[scheme]
    return np.array([_count(resample(rng, LOG_WEIGHTS, count)) for _ in range(repeats)], dtype=np.float64)


def exact_variance(scheme: Scheme, count: int) -> float:
    """Return the sum, over the particles, of the variances of their numbers of copies.

    A dart that falls anywhere in a stretch hits a particle with the share that it has of the stretch, so that each dart
    adds share (1 - share). A comb gives each the whole part of what it expects, and one more with the probability of
    the rest.
    """
    expected = count * WEIGHTS
    if scheme == "multinomial":
        return float((expected * (1.0 - WEIGHTS)).sum())
    if scheme == "systematic":
        rest = expected - np.floor(expected + 1e-9)
        return float((rest * (1.0 - rest)).sum())
    ends = np.cumsum(expected)
    pieces = np.arange(count)[:, None]
    shares = np.minimum(ends, pieces + 1) - np.maximum(ends - expected, pieces)
    shares = np.clip(shares, 0.0, 1.0)
    return float((shares * (1.0 - shares)).sum())


def _count(parents: Ints) -> Ints:
    return np.bincount(parents, minlength=len(WEIGHTS))
