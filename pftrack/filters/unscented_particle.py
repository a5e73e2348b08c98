"""The unscented particle filter: every particle proposed from an unscented update of its own prediction.

The proposal already looks at a measurement, so particles move towards it, and the weights take the proposal back out:
w = p(z | x) p(x | parent) / q(x | parent, measurement). Source: Bando 2007, ch. 3 section 4, eq. 3.13; van der Merwe,
Doucet, de Freitas and Wan 2000.

The first coordinates of the state are the ones that receive process noise; lagged coordinates (the previous position of
a second-order model) follow their parent exactly and are left out of the densities.
"""

import math

import numpy as np
from numpy.typing import NDArray

from pftrack.dynamics import LinearDynamics
from pftrack.filters import bootstrap
from pftrack.filters.posterior import LogLikelihood, Posterior
from pftrack.filters.unscented import Function, update_batch
from pftrack.numerics.compiled import compiled
from pftrack.numerics.gaussian import log_density
from pftrack.numerics.matrices import factorise
from pftrack.numerics.random import Generator
from pftrack.particles import ParticleSet, normalise
from pftrack.resampling import Resampler, systematic

__all__ = ["step"]


def step(
    particles: ParticleSet,
    dynamics: LinearDynamics,
    log_likelihood: LogLikelihood,
    rng: Generator,
    *,
    measurement: NDArray[np.float64] | None,
    observe: Function,
    noise_covariance: NDArray[np.float64],
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
        count: Number of particles wanted; as many as there are if not given.
        resample: How parents are drawn.

    Returns:
        The posterior, `count` particles. All count as drawn by the prediction sampler: parents are chosen by weight
        alone.

    Raises:
        ValueError: The noise is not of the form described.
    """
    if measurement is None:
        return bootstrap.step(particles, dynamics, log_likelihood, rng, count=count, resample=resample)
    driven = dynamics.noise.shape[1]
    if dynamics.noise[driven:].any():
        raise ValueError("the process noise must drive the first coordinates of the state only")
    count = count or len(particles)
    ancestors = resample(rng, particles.log_weights, count)
    means = dynamics.predict(particles.states)[ancestors]
    prior_covariance = dynamics.noise_covariance[:driven, :driven]
    proposed, covariances, _ = update_batch(means[:, :driven], prior_covariance, measurement, observe, noise_covariance)
    states = _propose(means, proposed, covariances, rng.standard_normal((driven, count)))
    log_weights = (
        log_likelihood(states)
        + log_density(states[:, :driven], means[:, :driven], prior_covariance)
        - log_density(states[:, :driven], proposed, covariances)
    )
    log_weights, log_sum = normalise(log_weights)
    return Posterior(ParticleSet(states, log_weights, ancestors), log_sum - math.log(count), 0, resampled=True)


@compiled
def _propose(
    means: NDArray[np.float64],
    proposed: NDArray[np.float64],
    covariances: NDArray[np.float64],
    normals: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return states (N, d): their first k coordinates drawn around those proposed, the others as they are expected.

    Args:
        means: (N, d) of the predictions.
        proposed: (N, k) means of the proposals.
        covariances: (N, k, k) of the proposals.
        normals: (k, N).
    """
    count, driven = proposed.shape
    states = means.copy()
    for n in range(count):
        lower, _ = factorise(covariances[n])
        for i in range(driven):
            states[n, i] = proposed[n, i]
            for j in range(i + 1):
                states[n, i] += lower[i, j] * normals[j, n]
    return states
