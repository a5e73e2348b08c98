"""The particle filter of a chain: `sampled` with parameters, from a state to the next."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.frame import Frame
from pftrack.core.numerics.elementary import exponentials
from pftrack.core.numerics.matrices import product
from pftrack.core.numerics.random import Stream
from pftrack.experiments.linkage.shape import LINKS
from pftrack.experiments.linkage.trackers.chain import reference_attitude
from pftrack.experiments.linkage.trackers.conditional import advance
from pftrack.experiments.linkage.trackers.gaussians import constraints, noise, state_of
from pftrack.experiments.linkage.trackers.handover import chains, from_moments
from pftrack.experiments.linkage.trackers.observation import read_observation
from pftrack.experiments.linkage.trackers.parameters import LinkageTrackerParameters
from pftrack.experiments.linkage.trackers.rejuvenation import filtered, move
from pftrack.experiments.linkage.trackers.sampled import LengthParticles, Settings, begin, draw_states, given, resample
from pftrack.experiments.linkage.trackers.state import Events, LinkageState
from pftrack.filters.beam import Beam
from pftrack.filters.particles import normalise

__all__ = ["quantiles", "step"]

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
    before: LengthParticles, settings: Settings, seen: NDArray[np.float64], limit: float, rng: Stream
) -> tuple[LengthParticles, float, bool]:
    """Return particles that have seen a frame, log p(y) without its power of 2 pi, and whether it was left out."""
    chances, known = rng.random(len(before)), given(before.values, settings)
    following, distances = advance(before.chains, known, seen, chances)
    outlier = bool(distances.min() > limit) or not np.any(following.evidences > -np.inf)
    if outlier:
        seen = np.full_like(seen, np.nan)
        following, _ = advance(before.chains, known, seen, chances)
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


def _take_portion(particles: LengthParticles, taken: float) -> tuple[float, NDArray[np.float64], float]:
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


def quantiles(values: NDArray[np.float64], weights: NDArray[np.float64], share: float) -> NDArray[np.float64]:
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
