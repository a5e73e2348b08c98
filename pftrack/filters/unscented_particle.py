"""The unscented particle filter: every particle is proposed by its own unscented Kalman filter.

The proposal already uses a measurement, so particles move towards it, and the weights correct for the proposal, w =
p(z | x) p(x | parent) / q(x | parent, measurement). A particle's filter begins at the particle. Its covariance is what
the process noise of one frame leaves open or, as in Bando 2007, ch. 3 section 4, eq. 3.13 (van der Merwe, Doucet, de
Freitas and Wan 2000, fig. 1), inherited: the particle's ancestors narrowed it by measurements, and the dynamics
widened it since. The gain then equals that of a parallel Kalman filter. This does not help: a particle represents one
position, so its next position is only as uncertain as the noise, and proposals further away get hardly any weight.

The first coordinates of the state are the ones that receive process noise; lagged coordinates (the previous position of
a second-order model) follow their parent exactly and are left out of the densities.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from pftrack.core.arrays import Floats, check
from pftrack.core.numerics.compiled import compiled
from pftrack.core.numerics.matrices import factorise, multiply
from pftrack.core.numerics.random import Generator, log_density
from pftrack.filters import bootstrap
from pftrack.filters.dynamics import LinearDynamics
from pftrack.filters.particles import LogLikelihood, ParticleSet, Posterior, evaluate, normalise
from pftrack.filters.resampling import Resampler, systematic
from pftrack.filters.unscented import Function, update_batch


@dataclass(frozen=True)
class UnscentedParticles(ParticleSet):
    """Particles, each with the covariance of its own filter.

    Attributes:
        covariances: (N, d, d) of the filters, whose means are the states.
    """

    covariances: Floats

    def __post_init__(self) -> None:
        """Refuse arrays that do not fit together, as for all particles."""
        super().__post_init__()
        check(missing=True, states=(self.states, "N d"), covariances=(self.covariances, "N d d"))


def step(
    particles: ParticleSet,
    dynamics: LinearDynamics,
    log_likelihood: LogLikelihood,
    rng: Generator,
    *,
    measurement: Floats | None,
    observe: Function,
    noise_covariance: Floats,
    recursive: bool = False,
    count: int | None = None,
    resample: Resampler = systematic,
) -> Posterior:
    """Advance by one observation.

    Args:
        particles: Posterior of the last frame, N particles (N, d).
        dynamics: p(x_t | x_{t-1}), whose noise drives the first k coordinates with full rank and no others.
        log_likelihood: log p(z_t | x_t) up to a constant, (n, d) -> (n,).
        rng: The frame's generator.
        measurement: A crude measurement (m,) for the proposal, or None to propose from the prediction.
        observe: h, what the measurement would be for the noisy coordinates, (..., k) -> (..., m).
        noise_covariance: R of the measurement, (m, m).
        recursive: Whether particles inherit covariances. Without inherited ones they begin at zero.
        count: Number of particles wanted; the present number by default.
        resample: How parents are drawn.

    Returns:
        The posterior, `count` particles, which are `UnscentedParticles` if they are recursive. All count as drawn by
        the prediction sampler: parents are chosen by weight alone.

    Raises:
        TypeError: The likelihood or the measurement is not an array of real numbers.
        ValueError: The noise is not of the form described, or shapes do not fit together.
    """
    if measurement is not None:
        check(measurement=(measurement, "m"), noise_covariance=(noise_covariance, "m m"))
    check(missing=True, transition=(dynamics.transition, "d d"), states=(particles.states, "N d"))
    driven = dynamics.noise.shape[1]
    if dynamics.noise[driven:].any():
        raise ValueError("the process noise must drive the first coordinates of the state only")
    count = len(particles) if count is None else count
    predicted = _hand_down(particles, dynamics) if recursive else None
    if measurement is None:
        posterior = bootstrap.step(particles, dynamics, log_likelihood, rng, count=count, resample=resample)
        return posterior if predicted is None else _keep(posterior, predicted[posterior.particles.ancestors])
    ancestors = resample(rng, particles.log_weights, count)
    means = dynamics.predict(particles.states)[ancestors]
    noise = dynamics.noise_covariance[:driven, :driven]
    # Without memory only the noisy coordinates are uncertain.
    prior = noise[None] if predicted is None else predicted[ancestors]
    proposed, covariances, _ = update_batch(
        means[:, : prior.shape[1]], prior, measurement, lambda states: observe(states[..., :driven]), noise_covariance
    )
    states = _propose(means, proposed, covariances, rng.standard_normal((driven, count)))
    log_weights = (
        evaluate(log_likelihood, states)
        + log_density(states[:, :driven], means[:, :driven], noise)
        - log_density(states[:, :driven], proposed[:, :driven], covariances[:, :driven, :driven])
    )
    log_weights, log_sum = normalise(log_weights)
    posterior = Posterior(ParticleSet(states, log_weights, ancestors), log_sum - math.log(count), 0, resampled=True)
    return posterior if predicted is None else _keep(posterior, covariances)


def _hand_down(particles: ParticleSet, dynamics: LinearDynamics) -> Floats:
    """Return the covariances (N, d, d) of the particles' filters, predicted."""
    before = (
        particles.covariances
        if isinstance(particles, UnscentedParticles)
        else np.zeros((len(particles), *dynamics.transition.shape))
    )
    return _predict(before, dynamics.transition, dynamics.noise_covariance)


def _keep(posterior: Posterior, covariances: Floats) -> Posterior:
    particles = posterior.particles
    kept = UnscentedParticles(particles.states, particles.log_weights, particles.ancestors, covariances)
    return replace(posterior, particles=kept)


@compiled
def _predict(covariances: Floats, transition: Floats, noise_covariance: Floats) -> Floats:
    """Return A P A^T + Q of covariances P (N, d, d)."""
    predicted = np.empty(covariances.shape)
    across = transition.T.copy()
    for n in range(covariances.shape[0]):
        predicted[n] = multiply(multiply(transition, covariances[n]), across) + noise_covariance
    return predicted


@compiled
def _propose(
    means: Floats,
    proposed: Floats,
    covariances: Floats,
    normals: Floats,
) -> Floats:
    """Return states (N, d): their first k coordinates drawn around the proposed ones, the others as predicted.

    Args:
        means: (N, d) of the predictions.
        proposed: (N, k) or more, means of the proposals.
        covariances: (N, k, k) or more, of the proposals.
        normals: (k, N).
    """
    driven, count = normals.shape
    states = means.copy()
    for n in range(count):
        lower, _ = factorise(covariances[n])
        for i in range(driven):
            states[n, i] = proposed[n, i]
            for j in range(i + 1):
                states[n, i] += lower[i, j] * normals[j, n]
    return states
