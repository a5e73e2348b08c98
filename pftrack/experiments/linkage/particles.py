"""The particle filter of a chain: `sampled` with parameters, from a state to the next, and new lengths and noises."""

from dataclasses import replace

import numpy as np

from pftrack.core.arrays import Floats, Ints
from pftrack.core.model.source import Frame
from pftrack.core.numerics.elementary import exponentials
from pftrack.core.numerics.matrices import cholesky, contiguous_copy, product
from pftrack.core.numerics.random import Stream
from pftrack.experiments.linkage.gaussians import chains, constraints, from_moments, noise, state_of
from pftrack.experiments.linkage.linearised import whiten
from pftrack.experiments.linkage.model import PLANE_STATES, Chain, read_observation, reference_attitude
from pftrack.experiments.linkage.parameters import LinkageTrackerParameters
from pftrack.experiments.linkage.sampled import (
    Chains,
    LengthParticles,
    Settings,
    advance,
    begin,
    draw_states,
    given,
    keep,
    log_factors,
    resample,
    start_chains,
)
from pftrack.experiments.linkage.shape import LINKS
from pftrack.experiments.linkage.state import Events, LinkageState
from pftrack.filters.beam import Beam
from pftrack.filters.particles import moments, normalise

# Resample-move (Gilks and Berzuini 2001): for some particles a Markov kernel that leaves the posterior as it is
# proposes other lengths and noises, filters all frames so far with them (`Chains`), and takes them with Metropolis and
# Hastings' probability. In each frame it is the turn of so many that their frames are about `BUDGET`; which ones does
# not depend on what they are.
#
# With m and L L' the mean and covariance of the particles, the kernel proposes
#
#     x* = m + a (x - m) + s L e,  e ~ N(0, I),
#
# with a and s drawn from `KERNELS`: with a^2 + s^2 near 1 it nearly keeps N(m, L L') as it is (Neal 1999), so that only
# what differs from this Gaussian can be refused; with a = 1 it is a random walk, which finds what the particles miss.

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
    before, chains = _filter_again(particles, known, particles.origins, settings, chances)
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


def _filter_again(
    particles: LengthParticles, values: Floats, origins: Ints, settings: Settings, chances: Floats
) -> tuple[Chains, Chains]:
    """Return chains with other values (K, ...) before the last frame of the history, and after it."""
    known = given(values, settings)
    begun = start_chains(particles.base, values, origins)
    before, _ = advance(begun, known, particles.history[:-1], chances[:-1])
    return before, advance(before, known, particles.history[-1:], chances[-1:])[0]


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


def _move(particles: LengthParticles, chosen: Ints, settings: Settings, rng: Stream, portion: float) -> LengthParticles:
    """Propose others for the chosen particles (K,)."""
    frames, turns = len(particles.history), len(chosen)
    mean, covariance = moments(np.asfortranarray(particles.values), particles.weights)
    root = cholesky(covariance)
    present, origins = particles.values[chosen], particles.origins[chosen]
    kernels = KERNELS[(len(KERNELS) * rng.random(turns)).astype(np.int64)]
    kept, wide = kernels[:, :1], kernels[:, 1:]
    whitened = _whiten_rows(root, present - mean)
    other = kept * whitened + wide * rng.standard_normal(whitened.shape)
    proposed = mean + product(other, root.T)
    # log q(x | x*) - log q(x* | x)
    returning = 0.5 * ((1.0 - kept * kept) / (wide * wide) * (np.square(other) - np.square(whitened))).sum(axis=1)
    before, chains = _filter_again(particles, proposed, origins, settings, rng.random((frames, turns)))
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


def _temper(before: Floats, after: Floats, portion: float) -> Floats:
    """Return log evidences (N,) with a portion of the last observation; -inf where either is."""
    known = (before > -np.inf) & (after > -np.inf)
    found = np.full(len(before), -np.inf)
    found[known] = before[known] + portion * (after[known] - before[known])
    return found


def _log_prior(base: Beam[Chain], values: Floats, origins: Ints, settings: Settings) -> Floats:
    """Return log densities (N,), up to a constant of each origin."""
    densities = np.zeros(len(values))
    for k in np.unique(origins).tolist():
        chosen, chain = np.flatnonzero(origins == k), base.members[k]
        root = cholesky(chain.covariance[-LINKS:, -LINKS:])
        off = _whiten_rows(root, values[chosen, :LINKS] - chain.mean[-LINKS:])
        densities[chosen] = -0.5 * np.square(off).sum(axis=1)
    densities[~keep(values[:, :LINKS], settings.bounds)] = -np.inf
    if settings.unknown:
        factors = values[:, LINKS:]
        least, greatest = log_factors(factors.shape[1] - 1)
        inside = (least <= factors) & (factors <= greatest)
        densities[~inside.all(axis=1)] = -np.inf
    return densities


def _whiten_rows(root: Floats, off: Floats) -> Floats:
    """Return L^-1 x of each of some rows (N, n)."""
    return contiguous_copy(whiten(contiguous_copy(root), contiguous_copy(off.T)).T)


FEW = 0.5
"""Effective sample size, relative to the number of particles, below which they are resampled."""

LEAST_LEFT = 0.3
"""The same that a portion of an observation should leave."""
HALVINGS = 20
MOST_PORTIONS = 8

BAND = (0.025, 0.975)
"""Shares below the ends of the range of a length."""


def step(state: LinkageState, frame: Frame, parameters: LinkageTrackerParameters, rng: Stream) -> LinkageState:
    """Take one frame, after that of any tracker."""
    seen = read_observation(frame, state.origin_px, in_space=state.in_space)
    settings = Settings(
        noise(parameters, state.in_space),
        float(parameters.observation_variance_px2),
        constraints(parameters, state.in_space),
        parameters.noise_unknown,
    )
    count = parameters.sample_count
    before = state.belief
    if not isinstance(before, LengthParticles):
        before = begin(chains(state, parameters), settings, count, len(seen), rng)
    elif before.key != settings.key:
        before = filtered(before, settings, rng)
    else:
        before = replace(before, ancestors=np.arange(len(before)))
    if len(before) != count:
        before = resample(before, count, rng)
    particles, log_evidence, outlier = _see(before, settings, seen, parameters.outlier_limit_sd, rng)
    reference = reference_attitude(state.reference)
    states = draw_states(particles.chains, reference, rng.standard_normal(particles.chains.means.shape))
    particles = replace(particles, states=np.asfortranarray(states))
    beyond = _count_beyond(particles, settings)
    return _state(state, particles, log_evidence, Events(truncated=beyond, outlier=outlier))


def _see(
    before: LengthParticles, settings: Settings, seen: Floats, limit: float, rng: Stream
) -> tuple[LengthParticles, float, bool]:
    """Return particles that have seen a frame, log p(y) without its power of 2 pi, and whether it was left out."""
    chances, known = rng.random(len(before)), given(before.values, settings)
    following, distances = advance(before.chains, known, seen[None], chances[None])
    outlier = bool(distances.min() > limit) or not np.any(following.evidences > -np.inf)
    if outlier:
        seen = np.full_like(seen, np.nan)
        following, _ = advance(before.chains, known, seen[None], chances[None])
    particles = replace(
        before,
        chains=following,
        earlier=before.chains.evidences,
        history=np.concatenate([before.history, seen[None]]),
    )
    if not np.any(following.evidences > -np.inf):
        return before, 0.0, True
    log_evidence, portion = 0.0, 0.0
    for _ in range(MOST_PORTIONS):
        portion, log_weights, log_sum = _take_portion(particles, portion)
        log_evidence += log_sum
        particles = replace(particles, log_weights=log_weights)
        if portion < 1.0 or particles.effective_sample_size < FEW * len(particles):
            parents = particles.ancestors
            particles = resample(particles, len(particles), rng)
            particles = replace(particles, ancestors=parents[particles.ancestors])
        particles = move(particles, settings, rng, portion)
        if portion >= 1.0:
            break
    return particles, 0.0 if outlier else log_evidence, outlier


def _take_portion(particles: LengthParticles, taken: float) -> tuple[float, Floats, float]:
    """Return how much of the last observation can be taken, the log weights (N,) then, and log p of that portion.

    It is all of it, if so many particles are left as should be, and else the portion that leaves as many.
    """
    gained = np.full(len(particles), -np.inf)
    known = particles.chains.evidences > -np.inf
    gained[known] = particles.chains.evidences[known] - particles.earlier[known]
    least, most, portion = taken, 1.0, 1.0
    for place in range(HALVINGS):
        weights, log_sum = normalise(particles.log_weights + (portion - taken) * gained)
        size = 1.0 / np.square(exponentials(weights)).sum()
        if place == 0 and size >= LEAST_LEFT * len(particles):
            break
        least, most = (portion, most) if size >= LEAST_LEFT * len(particles) else (least, portion)
        portion = 0.5 * (least + most)
    return portion, weights, log_sum


def _count_beyond(particles: LengthParticles, settings: Settings) -> int:
    """Return how many particles have the middle of their pose beyond a bound."""
    along = product(particles.chains.means, settings.bounds.rows.T)
    return int(np.count_nonzero(((along < settings.bounds.low) | (along > settings.bounds.high)).any(axis=1)))


def quantiles(values: Floats, weights: Floats, share: float) -> Floats:
    """Return the values (d,) that a share of the weights (N,) of values (N, d) lies below."""
    found = np.empty(values.shape[1])
    for i in range(values.shape[1]):
        order = np.argsort(values[:, i], kind="stable")
        below = np.cumsum(weights[order])
        found[i] = values[order[min(int(np.searchsorted(below, share * below[-1])), len(order) - 1)], i]
    return found


def _state(state: LinkageState, particles: LengthParticles, log_evidence: float, events: Events) -> LinkageState:
    """Return the state of particles: the estimate is their mean, the box two standard deviations about it.

    Lengths are not Gaussian: their box is the middle 95 % of them.
    """
    mean, covariance = particles.moments
    whole = Beam.of(from_moments(mean, covariance, reference_attitude(state.reference)))
    following = state_of(whole, state.reference, state.origin_px, log_evidence, events)
    low, high = following.low.copy(), following.high.copy()
    low[-LINKS:], high[-LINKS:] = (quantiles(particles.values[:, :LINKS], particles.weights, share) for share in BAND)
    return replace(following, belief=particles, low=low, high=high)
