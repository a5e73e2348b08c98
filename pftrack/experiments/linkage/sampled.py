"""Particles of what does not change about a chain: its lengths, and how it moves and is seen.

A particle filter whose particles are only chosen among one another soon has a single value left of whatever never
changes. So lengths and noises are what particles *are*, and the pose of each is filtered given them (`Chains`): an
iterated batch importance sampler (Chopin 2002; with a filter inside, SMC squared, Chopin, Jacob and Papaspiliopoulos
2013). A frame multiplies each weight by what the particle's own filter had expected of the observation. New ones are
made by resample-move (`particles`).

How smoothly a chain moves, and how exactly it is seen, is known to an order of magnitude at best. It matters: where a
link is nearly parallel to the image, what is seen hardly depends on its angle, so that a filter which expects more
motion or noise than there is takes the lack of both for a sign of that pose, and becomes sure of a wrong length. So
each angle's acceleration, and the variance of observations, has a factor of its own, log-uniform from `LEAST_FACTOR` to
`GREATEST_FACTOR` of what the parameters say, unless these are to be taken as they are.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Bools, Floats, Ints
from pftrack.core.geometry.rotation import compose, quaternion, vector
from pftrack.core.numerics.compiled import compiled
from pftrack.core.numerics.elementary import exponentials
from pftrack.core.numerics.matrices import cholesky, contiguous_copy, factorise, product
from pftrack.core.numerics.random import Stream
from pftrack.experiments.linkage.linearised import predict, see
from pftrack.experiments.linkage.model import PLANE_STATES, Chain, observed_rows, recentre
from pftrack.experiments.linkage.shape import LINKS, Constraints
from pftrack.filters.beam import Beam
from pftrack.filters.kalman import condition_on_innovation
from pftrack.filters.particles import ParticleSet
from pftrack.filters.resampling import systematic
from pftrack.filters.truncation import log_share

# Given the lengths, what is seen determines the pose but for the side on which a link leans. One of these sides is
# drawn in each frame, so that one Gaussian is enough, and the evidence is unbiased (a particle filter of one particle;
# Andrieu, Doucet and Holenstein 2010).
#
# A bound on joints is a probability: what the Gaussian has within it. The chain moves little from frame to frame, so
# that a Gaussian which has been within a bound in one frame says hardly anything new about it in the next. Of all
# frames the least probability is therefore the one that counts, and nothing is cut off.


class Chains(NamedTuple):
    """N chains, each with lengths of its own.

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
        chains: Of the frame before them.
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
    share = log_share(mean, covariance, given.rows, given.low, given.high)
    if share < chains.shares[n]:
        chains.evidences[n] += share - chains.shares[n]
        chains.shares[n] = share
    chains.attitudes[n] = recentre(mean, covariance, attitude)
    chains.means[n] = mean
    chains.covariances[n] = covariance
    return distance


LEAST_FACTOR, LEAST_VARIANCE, GREATEST_FACTOR = 0.003, 0.05, 2.0
DRAWS = 64
"""Of lengths within their bounds, for each particle."""
EXACT = 1e-9
"""Variance of a length that is given, px^2."""
GROUPS = {3: np.array([0, 1, 2]), 7: np.array([0, 0, 0, 1, 1, 2, 3])}
"""Which of the factors an acceleration has: each joint its own, in space the attitude one and the root one."""


@dataclass(frozen=True)
class Settings:
    """What the parameters say of motion and observation.

    Attributes:
        noise: (p,) standard deviations of the accelerations.
        variance: Of an observed coordinate, px^2.
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
        key: Of the settings that the chains were filtered with.
    """

    values: Floats
    chains: Chains
    origins: Ints
    base: Beam[Chain]
    earlier: Floats
    history: Floats
    key: bytes

    @property
    def nbytes(self) -> int:
        """About how much memory it takes, bytes."""
        return super().nbytes + sum(one.nbytes for one in (*self.chains, self.values, self.history, self.origins))

    def arrays(self) -> Mapping[str, NDArray[Any]]:
        """Return what a file holds beside the states and weights."""
        return {"static_values": self.values, "means": self.chains.means, "covariances": self.chains.covariances}


def begin(base: Beam[Chain], settings: Settings, count: int, observed: int, rng: Stream) -> LengthParticles:
    """Draw particles from Gaussians, of which lengths keep their bounds.

    Args:
        base: The Gaussians.
        settings: In force.
        count: How many to draw.
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

    Where none does, it is that of another particle, or, if there is no such one, the nearest within the range of each.
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
    told = np.zeros((LINKS, size))
    for link in range(LINKS):
        told[link, size - LINKS + link] = 1.0
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
