"""The particle filter of a chain, whose particles are constants: lengths, and the noises of motion and observation.

If resampling only selects among particles, soon a single value of every constant remains. So the particles *are*
lengths and noises, and the pose of each is filtered given them (`Chains`): an iterated batch importance sampler (Chopin
2002; with a filter inside, SMC squared, Chopin, Jacob and Papaspiliopoulos 2013). A frame multiplies each weight by the
particle filter's own predictive density of the observation. New particles are made by resample-move (`move`).

The smoothness of a chain's motion and the accuracy of its observation are known to an order of magnitude at best. They
matter: where a link is nearly parallel to the image, its image hardly depends on its angle. A filter that expects too
much motion or noise takes the lack of both for a sign of that pose, and becomes confident of a wrong length. So each
angle's acceleration, and the variance of observations, has its own factor, log-uniform from `LEAST_FACTOR` to
`GREATEST_FACTOR` times the parameters, unless the parameters are used exactly.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from typing_extensions import override

from pftrack.core.arrays import Bools, Floats, Ints
from pftrack.core.geometry import compose, quaternion, vector
from pftrack.core.model.source import Frame
from pftrack.core.numerics.compiled import compiled
from pftrack.core.numerics.elementary import exponentials
from pftrack.core.numerics.matrices import cholesky, contiguous_copy, factorise, product
from pftrack.core.numerics.random import Stream
from pftrack.experiments.linkage.gaussians import chains, constraints, from_moments, noise, state_of
from pftrack.experiments.linkage.linearised import predict, see, whiten
from pftrack.experiments.linkage.model import (
    LINKS,
    PLANE_STATES,
    Chain,
    Constraints,
    observed_rows,
    read_observation,
    recentre,
    reference_attitude,
)
from pftrack.experiments.linkage.state import Events, LinkageState, LinkageTrackerParameters
from pftrack.filters.beam import Beam
from pftrack.filters.kalman import condition_on_innovation
from pftrack.filters.particles import ParticleSet, moments, normalise
from pftrack.filters.resampling import systematic
from pftrack.filters.truncation import log_share

# Given the lengths, what is seen determines the pose but for the side on which a link leans. One of these sides is
# drawn in each frame, so that one Gaussian is enough, and the evidence is unbiased (a particle filter of one particle;
# Andrieu, Doucet and Holenstein 2010).
#
# A bound on joints is a probability: what the Gaussian has within it. The chain moves little from frame to frame, so a
# Gaussian within a bound in one frame gives hardly any new information on it in the next. Therefore only the least
# probability over all frames counts, and nothing is cut off.


class Chains(NamedTuple):
    """N chains, each with its own lengths.

    Attributes:
        means: (N, n) of pose, velocity and lengths.
        covariances: (N, n, n), with zeros for lengths.
        attitudes: (N, 4).
        evidences: (N,) log p(y_1..t) of each, bounds included.
        shares: (N,) logarithm of the least probability of the bounds so far.
    """

    means: Floats
    covariances: Floats
    attitudes: Floats
    evidences: Floats
    shares: Floats


class Given(NamedTuple):
    """What is known of N chains.

    Attributes:
        noises: (N, p) standard deviations of the accelerations of the pose.
        variances: (N,) of an observed coordinate, px^2.
        rows: (k, n) constraints lo <= A x <= hi.
        low: (k,).
        high: (k,).
    """

    noises: Floats
    variances: Floats
    rows: Floats
    low: Floats
    high: Floats


@compiled
def advance(chains: Chains, given: Given, history: Floats, chances: Floats) -> tuple[Chains, Floats]:
    """Take some frames.

    Args:
        chains: Chains of the frame before them.
        given: Noises and bounds.
        history: (T, m, 3) observations, see `read_observation`.
        chances: (T, N) uniform numbers by which sides are drawn.

    Returns:
        The chains, and how far the last observation was from what each predicted, (N,) standard deviations.
    """
    following = Chains(
        chains.means.copy(),
        chains.covariances.copy(),
        chains.attitudes.copy(),
        chains.evidences.copy(),
        chains.shares.copy(),
    )
    distances = np.zeros(chains.evidences.shape[0])
    for t in range(history.shape[0]):
        rows = observed_rows(history[t])
        for n in range(distances.shape[0]):
            distances[n] = _step(following, n, given, history[t], rows, chances[t, n])
    return following, distances


@compiled
def _step(chains: Chains, n: int, given: Given, seen: Floats, rows: Ints, chance: float) -> float:
    """Take a frame with one chain, in place, and return how far what was seen was from what was predicted."""
    bounds = Constraints(given.rows, given.low, given.high)
    mean, covariance = predict(chains.means[n], chains.covariances[n], given.noises[n])
    attitude, distance = chains.attitudes[n].copy(), 0.0
    if rows.shape[0] > 0:
        mean, covariance, gained, distance = see(
            mean, covariance, attitude, given.variances[n], bounds, seen, rows, chance
        )
        chains.evidences[n] += gained
    share = log_share(mean, covariance, (given.rows, given.low, given.high))
    if share < chains.shares[n]:
        chains.evidences[n] += share - chains.shares[n]
        chains.shares[n] = share
    chains.attitudes[n] = recentre(mean, covariance, attitude)
    chains.means[n] = mean
    chains.covariances[n] = covariance
    return distance


LEAST_FACTOR, LEAST_VARIANCE, GREATEST_FACTOR = 0.003, 0.05, 2.0
DRAWS = 64
"""Draws of lengths within their bounds, for each particle."""
EXACT = 1e-9
"""Variance of a length that is given, px^2."""
GROUPS = {3: np.array([0, 1, 2]), 7: np.array([0, 0, 0, 1, 1, 2, 3])}
"""Which of the factors an acceleration has: each joint its own, in space the attitude one and the root one."""


@dataclass(frozen=True)
class Settings:
    """Settings of motion and observation.

    Attributes:
        noise: (p,) standard deviations of the accelerations.
        variance: Variance of an observed coordinate, px^2.
        bounds: On the coordinates of a state.
        unknown: Whether noise and variance have unknown factors.
    """

    noise: Floats
    variance: float
    bounds: Constraints
    unknown: bool

    @property
    def key(self) -> bytes:
        """The same if and only if all is."""
        numbers = [np.array([self.variance, float(self.unknown)]), self.noise, *self.bounds]
        return b"".join(one.tobytes() for one in numbers)


@dataclass(frozen=True)
class LengthParticles(ParticleSet):
    """Particles, each with a chain of its own; `states` are draws of these.

    Attributes:
        values: (N, 3 + g + 1) lengths, px, and logarithms of factors of accelerations and of the variance.
        chains: Their filters.
        origins: (N,) index of the Gaussian that each began with.
        base: Gaussians of the beginning.
        earlier: (N,) log p(y_1..t-1) of each.
        history: (T, m, 3) what was seen since, see `observation`.
        key: Key of the settings of filtering.
    """

    values: Floats
    chains: Chains
    origins: Ints
    base: Beam[Chain]
    earlier: Floats
    history: Floats
    key: bytes

    @override
    def arrays(self) -> Mapping[str, NDArray[Any]]:
        """Return states, log weights, lengths and factors, and the filters' means and covariances."""
        return {
            **super().arrays(),
            "static_values": self.values,
            "means": self.chains.means,
            "covariances": self.chains.covariances,
        }


def begin(base: Beam[Chain], settings: Settings, count: int, observed: int, rng: Stream) -> LengthParticles:
    """Draw particles from Gaussians, with lengths within their bounds.

    Args:
        base: The Gaussians.
        settings: In force.
        count: Number to draw.
        observed: Numbers that are observed in a frame, m.
        rng: Random numbers of the frame.
    """
    origins = systematic(rng, base.log_weights, count)
    groups = int(GROUPS[len(settings.noise)].max()) + 1
    normals, chances = rng.standard_normal((DRAWS, count, LINKS)), rng.random((count, groups + 1))
    values = np.zeros((count, LINKS + groups + 1))
    for k in np.unique(origins).tolist():
        chosen = np.flatnonzero(origins == k)
        values[chosen, :LINKS] = _lengths(base.members[k], settings.bounds, normals[:, chosen])
    if settings.unknown:
        least, greatest = log_factors(groups)
        values[:, LINKS:] = least + (greatest - least) * chances
    chains = start_chains(base, values, origins)
    weights = np.full(count, -math.log(count))
    parents = np.full(count, -1)
    history = np.empty((0, observed, 3))
    return LengthParticles(
        chains.means, weights, parents, values, chains, origins, base, np.zeros(count), history, settings.key
    )


def log_factors(groups: int) -> tuple[Floats, float]:
    """Return logarithms of the least (g + 1,) and the greatest of the factors."""
    return np.array([*[math.log(LEAST_FACTOR)] * groups, math.log(LEAST_VARIANCE)]), math.log(GREATEST_FACTOR)


def _lengths(chain: Chain, bounds: Constraints, normals: Floats) -> Floats:
    """Return lengths (N, 3) of a Gaussian, the first of several draws (D, N, 3) that keep their bounds.

    Otherwise it is that of another particle or, without one, the nearest within the range of each.
    """
    mean = chain.mean[-LINKS:]
    root = cholesky(chain.covariance[-LINKS:, -LINKS:])
    draws = mean + product(normals.reshape(-1, LINKS), root.T).reshape(normals.shape)
    rows, low, high = bounds.of(lengths=True)
    rows = rows[:, -LINKS:]
    allowed = keep(draws, bounds)
    found = draws[np.argmax(allowed, axis=0), np.arange(draws.shape[1])]
    good = np.flatnonzero(allowed.any(axis=0))
    for place, n in enumerate(np.flatnonzero(~allowed.any(axis=0)).tolist()):
        if len(good):
            found[n] = found[good[place % len(good)]]
            continue
        for k in range(len(rows)):
            if np.count_nonzero(rows[k]) == 1:
                link = int(np.argmax(rows[k] != 0.0))
                found[n, link] = min(max(found[n, link], low[k]), high[k])
    return np.asarray(found)


def keep(lengths: Floats, bounds: Constraints) -> Bools:
    """Return which lengths (..., 3) keep their bounds."""
    rows, low, high = bounds.of(lengths=True)
    along = (lengths[..., None, :] * rows[:, -LINKS:]).sum(axis=-1)
    return np.asarray(((low <= along) & (along <= high)).all(axis=-1))


def start_chains(base: Beam[Chain], values: Floats, origins: Ints) -> Chains:
    """Return Gaussians of the beginning, each given the lengths of a particle."""
    count, size = len(values), len(base.members[0].mean)
    means, covariances = np.empty((count, size)), np.empty((count, size, size))
    attitudes = np.empty((count, 4))
    for k in np.unique(origins).tolist():
        chosen, chain = np.flatnonzero(origins == k), base.members[k]
        means[chosen], covariances[chosen] = _given_lengths(
            contiguous_copy(chain.mean), contiguous_copy(chain.covariance), contiguous_copy(values[chosen, :LINKS])
        )
        attitudes[chosen] = chain.attitude
    return Chains(means, covariances, attitudes, np.zeros(count), np.zeros(count))


@compiled
def _given_lengths(mean: Floats, covariance: Floats, lengths: Floats) -> tuple[Floats, Floats]:
    """Return means (N, n) and covariance (n, n) of a Gaussian, given its lengths (N, 3)."""
    count, size = lengths.shape[0], mean.shape[0]
    told = np.eye(LINKS, size, size - LINKS)
    means, spread = np.empty((count, size)), covariance
    for n in range(count):
        off = lengths[n] - mean[size - LINKS :]
        means[n], spread, _, _ = condition_on_innovation(mean, covariance, off, told, EXACT * np.eye(LINKS))
        means[n, size - LINKS :] = lengths[n]
    spread = spread.copy()
    spread[size - LINKS :, :] = 0.0
    spread[:, size - LINKS :] = 0.0
    return means, spread


def given(values: Floats, settings: Settings) -> Given:
    """Return what the filters of particles with these values are given."""
    groups = GROUPS[len(settings.noise)]
    factors = exponentials(values[:, LINKS:].ravel()).reshape(len(values), -1)
    noises = np.ascontiguousarray(settings.noise * factors[:, groups])
    joints = settings.bounds.of(lengths=False)
    return Given(noises, np.ascontiguousarray(settings.variance * factors[:, -1]), *joints)


def resample(particles: LengthParticles, count: int, rng: Stream) -> LengthParticles:
    """Return as many particles of equal weight as are wanted."""
    ancestors = systematic(rng, particles.log_weights, count)
    return replace(
        particles,
        states=particles.states[ancestors],
        log_weights=np.full(count, -math.log(count)),
        ancestors=ancestors,
        values=particles.values[ancestors],
        chains=Chains(*(one[ancestors] for one in particles.chains)),
        origins=particles.origins[ancestors],
        earlier=particles.earlier[ancestors],
    )


@compiled
def draw_states(chains: Chains, reference: Floats, normals: Floats) -> Floats:
    """Return a draw of each chain (N, n), with omega relative to the reference attitude (4,)."""
    count, size = chains.means.shape
    drawn = chains.means.copy()
    inverse = np.array([reference[0], -reference[1], -reference[2], -reference[3]])
    for n in range(count):
        root, _ = factorise(chains.covariances[n])
        for i in range(size - LINKS):
            for j in range(i + 1):
                drawn[n, i] += root[i, j] * normals[n, j]
        if size != PLANE_STATES:
            turn = compose(compose(inverse, chains.attitudes[n].copy()), quaternion(drawn[n, :LINKS].copy()))
            drawn[n, :LINKS] = vector(turn)
    return drawn


# Resample-move (Gilks and Berzuini 2001): for some particles a Markov kernel that leaves the posterior as it is
# proposes other lengths and noises, filters all frames so far with them (`Chains`), and takes them with Metropolis and
# Hastings' probability. Each frame moves as many particles as give about `BUDGET` filtered frames; the choice does not
# depend on their values.
#
# With m and L L' the mean and covariance of the particles, the kernel proposes
#
#     x* = m + a (x - m) + s L e,  e ~ N(0, I),
#
# with a and s drawn from `KERNELS`: with a^2 + s^2 near 1 it nearly preserves N(m, L L') (Neal 1999), so proposals are
# refused only for deviations from this Gaussian; with a = 1 it is a random walk, which reaches regions without
# particles.

BUDGET, BUDGET_IN_SPACE = 4000, 2500
"""Frames that are filtered again in each frame, all particles that are moved in it taken together."""
FIRST_FRAMES, MORE_AT_FIRST = 8, 3
"""Multiple of the budget in the first frames, in which almost everything is learned."""
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
        particles: Particles with the last observation in their history.
        settings: Their settings of filtering.
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
    """Return the usable portion of the last observation, the log weights (N,) then, and log p of that portion.

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
    """Return the number of particles with the middle of their pose beyond a bound."""
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
