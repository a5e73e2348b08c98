"""The particle filter of a chain: `sampled` with parameters, from a state to the next."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pftrack.filters.beam import Beam
from pftrack.geometry.linkage import Constraints
from pftrack.model.frame import Frame
from pftrack.numerics.matrices import cholesky, contiguous_copy, product
from pftrack.numerics.random import Stream
from pftrack.particles import ParticleSet, normalise
from pftrack.resampling import systematic
from pftrack.trackers.linkage.chain import PLANE_STATES, Chain, reference_attitude
from pftrack.trackers.linkage.gaussians import constraints, look, noise, state_of
from pftrack.trackers.linkage.handover import chains, from_moments
from pftrack.trackers.linkage.linearised import predict
from pftrack.trackers.linkage.parameters import LinkageTrackerParameters
from pftrack.trackers.linkage.sampled import forbid, in_reference, move, propose
from pftrack.trackers.linkage.state import Events, LinkageState

__all__ = ["step"]

FEW = 0.01
"""Effective sample size, relative to the number of particles, below which an observation is taken in portions."""

PORTIONS = (0.0001, 0.0009, 0.009, 0.09, 0.9)
"""Of the precision of an observation; they sum to 1."""

KEPT_BETWEEN = 0.5
"""How much of its distance from the mean a particle keeps from portion to portion. Little: what is seen in space has
eight coordinates, and in so many a cloud without a wide stir hardly reaches what is left of it by the next portion."""


class Cloud(NamedTuple):
    """From where particles are drawn.

    Attributes:
        centres: (N, n) mean of each.
        points: (N, n) where the observation of each is linearised.
        root: (n, n) root of the covariance about the means.
        attitude: (4,) that omega is relative to.
        ancestors: (N,) in the belief before; -1 where that had no particles.
    """

    centres: NDArray[np.float64]
    points: NDArray[np.float64]
    root: NDArray[np.float64]
    attitude: NDArray[np.float64]
    ancestors: NDArray[np.int64]


class Weighed(NamedTuple):
    """What came of an observation: particles, log p(z), its distance from the nearest, and how many broke a bound."""

    particles: ParticleSet
    log_evidence: float
    distance: float
    broken: int


@dataclass(frozen=True)
class Weighing:
    """How particles are weighed.

    Attributes:
        seen: (m,) observation, px, NaN where there is none.
        variance: Of each coordinate, px^2.
        bounds: On the coordinates of a state.
        reference: (4,) attitude that omega is relative to among particles.
        parameters: In force.
        rng: Random numbers of the frame.
    """

    seen: NDArray[np.float64]
    variance: float
    bounds: Constraints
    reference: NDArray[np.float64]
    parameters: LinkageTrackerParameters
    rng: Stream


def step(state: LinkageState, frame: Frame, parameters: LinkageTrackerParameters, rng: Stream) -> LinkageState:
    """Take one frame, after that of any tracker."""
    weighing = Weighing(
        look(frame, state.origin_px, in_space=state.in_space),
        float(parameters.observation_variance_px2),
        constraints(parameters, state.in_space),
        reference_attitude(state.reference),
        parameters,
        rng,
    )
    if isinstance(state.belief, ParticleSet):
        clouds = [_following(state.belief, weighing, _keeping(parameters), moving=True)]
    else:
        clouds = _from_gaussians(chains(state, parameters), weighing)
    found = _weigh(clouds, weighing)
    outlier = found.distance > parameters.outlier_limit_sd
    if not outlier and found.particles.effective_sample_size < FEW * len(found.particles):
        found = _in_portions(clouds, weighing)
    if outlier or found.broken == len(found.particles):
        outlier = True
        found = _weigh(clouds, replace(weighing, seen=np.full_like(weighing.seen, np.nan)))
    return _state(state, found.particles, found.log_evidence, Events(truncated=found.broken, outlier=outlier))


def _in_portions(clouds: Sequence[Cloud], weighing: Weighing) -> Weighed:
    """Take an observation bit by bit, and stir the particles after each."""
    log_evidence = 0.0
    origins = np.concatenate([cloud.ancestors for cloud in clouds])
    for portion in PORTIONS:
        found = _weigh(clouds, replace(weighing, variance=weighing.variance / portion))
        log_evidence += found.log_evidence
        if portion != PORTIONS[0]:
            origins = origins[found.particles.ancestors]
        clouds = [_following(found.particles, weighing, KEPT_BETWEEN, moving=False)]
    # Each portion has a density of its own variance; what their product has too much of is no evidence.
    seen = int(np.count_nonzero(~np.isnan(weighing.seen)))
    excess = sum(math.log(weighing.variance / portion) for portion in PORTIONS) - math.log(weighing.variance)
    particles = replace(found.particles, ancestors=origins)
    return found._replace(particles=particles, log_evidence=log_evidence + 0.5 * seen * excess)


def _weigh(clouds: Sequence[Cloud], weighing: Weighing) -> Weighed:
    """Draw particles, given what is seen, and weigh them."""
    states, log_weights, distances = [], [], []
    for cloud in clouds:
        normals = weighing.rng.standard_normal((len(cloud.centres), cloud.centres.shape[1] + len(weighing.seen)))
        drawn, densities, distance = propose(*cloud[:4], weighing.seen, weighing.variance, normals)
        states.append(in_reference(drawn, cloud.attitude, weighing.reference))
        log_weights.append(densities)
        distances.append(distance.min())
    whole, weights = np.concatenate(states), np.concatenate(log_weights)
    broken = forbid(weights, whole, *weighing.bounds)
    normalised, log_sum = normalise(weights)
    ancestors = np.concatenate([cloud.ancestors for cloud in clouds])
    particles = ParticleSet(np.asfortranarray(whole), normalised, ancestors)
    evidence = 0.0 if broken == len(whole) else log_sum - math.log(len(whole))
    return Weighed(particles, evidence, float(min(distances)), broken)


def _keeping(parameters: LinkageTrackerParameters) -> float:
    """Return how much of its distance from the mean a particle keeps from frame to frame (Liu and West 2001)."""
    discount = float(parameters.stir_discount)
    return (3.0 * discount - 1.0) / (2.0 * discount)


def _following(particles: ParticleSet, weighing: Weighing, keeping: float, *, moving: bool) -> Cloud:
    """Return from where particles are drawn, given those of the frame before or of the same."""
    mean, covariance = particles.moments
    ancestors = systematic(weighing.rng, particles.log_weights, weighing.parameters.sample_count)
    centres = move(np.ascontiguousarray(particles.states[ancestors]), mean, keeping, moving)
    spread = (1.0 - keeping * keeping) * covariance
    if moving:
        _, spread = predict(mean, spread, noise(weighing.parameters, len(mean) > PLANE_STATES))
    return Cloud(centres, centres, cholesky(spread), weighing.reference, ancestors)


def _from_gaussians(beam: Beam[Chain], weighing: Weighing) -> list[Cloud]:
    """Return from where particles are drawn, given Gaussians of the frame before."""
    members = systematic(weighing.rng, beam.log_weights, weighing.parameters.sample_count)
    clouds = []
    for place in np.unique(members).tolist():
        chain, count = beam.members[place], int(np.count_nonzero(members == place))
        acceleration = noise(weighing.parameters, len(chain.mean) > PLANE_STATES)
        mean, covariance = predict(contiguous_copy(chain.mean), contiguous_copy(chain.covariance), acceleration)
        spread = cholesky(covariance)
        points = mean + product(weighing.rng.standard_normal((count, len(mean))), spread.T)
        clouds.append(Cloud(np.tile(mean, (count, 1)), points, spread, chain.attitude, np.full(count, -1)))
    return clouds


def _state(state: LinkageState, particles: ParticleSet, log_evidence: float, events: Events) -> LinkageState:
    """Return the state of particles: the estimate is their mean, the box two standard deviations about it."""
    mean, covariance = particles.moments
    whole = Beam.of(from_moments(mean, covariance, reference_attitude(state.reference)))
    return replace(state_of(whole, state.reference, state.origin_px, log_evidence, events), belief=particles)
