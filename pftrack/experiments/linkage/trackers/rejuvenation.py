"""New lengths and noises for particles of a chain, by a Markov kernel that leaves their posterior as it is.

Resample-move (Gilks and Berzuini 2001): for some particles the kernel proposes others, filters all frames so far with
them (`conditional`), and takes them with Metropolis and Hastings' probability. In each frame it is the turn of so many
that their frames are about `BUDGET`; which ones does not depend on what they are.

With m and L L' the mean and covariance of the particles, the kernel proposes

    x* = m + a (x - m) + s L e,  e ~ N(0, I),

with a and s drawn from `KERNELS`: with a^2 + s^2 near 1 it nearly keeps N(m, L L') as it is (Neal 1999), so that only
what differs from this Gaussian can be refused; with a = 1 it is a random walk, which finds what the particles miss.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pftrack.core.numerics.compiled import compiled
from pftrack.core.numerics.elementary import exponentials
from pftrack.core.numerics.matrices import cholesky, contiguous_copy, product
from pftrack.core.numerics.random import Stream
from pftrack.experiments.linkage.shape import LINKS
from pftrack.experiments.linkage.trackers.chain import PLANE_STATES, Chain
from pftrack.experiments.linkage.trackers.conditional import Chains, advance, filter_again
from pftrack.experiments.linkage.trackers.sampled import (
    LengthParticles,
    Settings,
    given,
    keep,
    log_factors,
    start_chains,
)
from pftrack.filters.beam import Beam
from pftrack.filters.particles import moments, normalise

__all__ = ["filtered", "move"]

BUDGET, BUDGET_IN_SPACE = 4000, 2500
"""Frames that are filtered again in each frame, all particles that are moved in it taken together."""
FIRST_FRAMES, MORE_AT_FIRST = 8, 3
"""So many times the budget in the first frames, in which almost everything is learned."""
KERNELS = np.array([(0.3, 0.95), (0.7, 0.7), (1.0, 0.4), (1.0, 1.0)])
"""a and s of the kernel, one of these for each proposal."""


def filtered(particles: LengthParticles, settings: Settings, rng: Stream) -> LengthParticles:
    """Return particles as they would be, had these settings been in force from the beginning."""
    chances = rng.random((len(particles.history), len(particles)))
    known = particles.values if settings.unknown else particles.values * (np.arange(particles.values.shape[1]) < LINKS)
    begun = start_chains(particles.base, known, particles.origins)
    noises = given(known, settings)
    before = filter_again(begun, noises, particles.history[:-1], chances[:-1])
    chains, _ = advance(before, noises, particles.history[-1], chances[-1])
    possible = (chains.evidences > -np.inf) & keep(known[:, :LINKS], settings.bounds)
    gained = np.where(possible, chains.evidences - particles.chains.evidences, -np.inf)
    log_weights, log_sum = normalise(particles.log_weights + gained)
    if not log_sum > -np.inf:  # nothing is left
        return replace(particles, key=settings.key)
    return replace(
        particles,
        log_weights=log_weights,
        values=known,
        chains=chains,
        earlier=before.evidences,
        key=settings.key,
    )


def move(particles: LengthParticles, settings: Settings, rng: Stream, portion: float = 1.0) -> LengthParticles:
    """Propose other lengths and noises for some particles, and take those that fit all frames so far.

    Args:
        particles: What was seen last is in their history.
        settings: That they were filtered with.
        rng: Random numbers of the frame.
        portion: Power of the last observation's density among those of all; 1 but while it is taken in portions.
    """
    count, frames = len(particles), len(particles.history)
    budget = BUDGET if particles.chains.means.shape[1] == PLANE_STATES else BUDGET_IN_SPACE
    if frames <= FIRST_FRAMES:
        budget *= MORE_AT_FIRST
    turns = min(max(budget // frames, 1), count)
    for sweep in range(max(budget // (frames * count), 1)):
        chosen = (frames + sweep + np.arange(turns) * (count // turns)) % count
        particles = _move(particles, chosen, settings, rng, portion)
    return particles


def _move(
    particles: LengthParticles, chosen: NDArray[np.int64], settings: Settings, rng: Stream, portion: float
) -> LengthParticles:
    """Propose others for the chosen particles (K,)."""
    frames, turns = len(particles.history), len(chosen)
    mean, covariance = moments(np.asfortranarray(particles.values), particles.weights)
    root = cholesky(covariance)
    present, origins = particles.values[chosen], particles.origins[chosen]
    kernels = KERNELS[(len(KERNELS) * rng.random(turns)).astype(np.int64)]
    kept, wide = kernels[:, :1], kernels[:, 1:]
    whitened = _whiten(root, present - mean)
    other = kept * whitened + wide * rng.standard_normal(whitened.shape)
    proposed = mean + product(other, root.T)
    # log q(x | x*) - log q(x* | x)
    returning = 0.5 * ((1.0 - kept * kept) / (wide * wide) * (np.square(other) - np.square(whitened))).sum(axis=1)
    known, chances = given(proposed, settings), rng.random((frames, turns))
    before = filter_again(start_chains(particles.base, proposed, origins), known, particles.history[:-1], chances[:-1])
    chains, _ = advance(before, known, particles.history[-1], chances[-1])
    densities = _log_prior(particles.base, proposed, origins, settings)
    densities += _temper(before.evidences, chains.evidences, portion) + returning
    present_densities = _log_prior(particles.base, present, origins, settings)
    present_densities += _temper(particles.earlier[chosen], particles.chains.evidences[chosen], portion)
    possible = densities > -np.inf
    gained = np.where(possible, densities - np.where(possible, present_densities, 0.0), -np.inf)
    taken = np.flatnonzero(rng.random(turns) < exponentials(np.minimum(gained, 0.0)))
    places = chosen[taken]
    values, earlier = particles.values.copy(), particles.earlier.copy()
    values[places], earlier[places] = proposed[taken], before.evidences[taken]
    filters = Chains(*(one.copy() for one in particles.chains))
    for one, new in zip(filters, chains, strict=True):
        one[places] = new[taken]
    return replace(particles, values=values, chains=filters, earlier=earlier)


def _temper(before: NDArray[np.float64], after: NDArray[np.float64], portion: float) -> NDArray[np.float64]:
    """Return log evidences (N,) with a portion of the last observation; -inf where either is."""
    known = (before > -np.inf) & (after > -np.inf)
    found = np.full(len(before), -np.inf)
    found[known] = before[known] + portion * (after[known] - before[known])
    return found


def _log_prior(
    base: Beam[Chain], values: NDArray[np.float64], origins: NDArray[np.int64], settings: Settings
) -> NDArray[np.float64]:
    """Return log densities (N,), up to a constant of each origin."""
    densities = np.zeros(len(values))
    for k in np.unique(origins).tolist():
        chosen, chain = np.flatnonzero(origins == k), base.members[k]
        root = cholesky(chain.covariance[-LINKS:, -LINKS:])
        off = _whiten(root, values[chosen, :LINKS] - chain.mean[-LINKS:])
        densities[chosen] = -0.5 * np.square(off).sum(axis=1)
    densities[~keep(values[:, :LINKS], settings.bounds)] = -np.inf
    if settings.unknown:
        factors = values[:, LINKS:]
        least, greatest = log_factors(factors.shape[1] - 1)
        inside = (least <= factors) & (factors <= greatest)
        densities[~inside.all(axis=1)] = -np.inf
    return densities


def _whiten(root: NDArray[np.float64], off: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (N, n) of which L x is what is given; 0 in a direction without spread."""
    return _substitute(contiguous_copy(root), contiguous_copy(off))


@compiled
def _substitute(root: NDArray[np.float64], off: NDArray[np.float64]) -> NDArray[np.float64]:
    found = np.zeros(off.shape)
    for n in range(off.shape[0]):
        for i in range(off.shape[1]):
            if root[i, i] > 0.0:
                rest = off[n, i]
                for k in range(i):
                    rest -= root[i, k] * found[n, k]
                found[n, i] = rest / root[i, i]
    return found
