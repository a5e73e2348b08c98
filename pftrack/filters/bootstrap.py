"""The bootstrap filter: sample from the dynamics, weigh by the likelihood.

The same algorithm is known as sampling importance resampling (SIR; Gordon, Salmond and Smith 1993) and Condensation
(Isard and Blake 1998). Its particles follow the prediction and ignore the new observation: simple, consistent, and
wasteful when the prediction is poor. Source: Bando 2007, ch. 2 section 3.1, eqs. 2.11 to 2.13, and ch. 3 section 1.
"""

import math

import numpy as np

from pftrack.core.numerics.random import Generator
from pftrack.filters.dynamics import Dynamics
from pftrack.filters.particles import LogLikelihood, ParticleSet, Posterior, evaluate, normalise
from pftrack.filters.resampling import Resampler, decide, systematic


def step(
    particles: ParticleSet,
    dynamics: Dynamics,
    log_likelihood: LogLikelihood,
    rng: Generator,
    *,
    count: int | None = None,
    resample: Resampler = systematic,
    threshold: float = 1.0,
) -> Posterior:
    """Advance by one observation: resample, propagate, weigh, normalise.

    Args:
        particles: Posterior of the last frame, N particles (N, d).
        dynamics: p(x_t | x_{t-1}).
        log_likelihood: log p(z_t | x_t) up to a constant, (n, d) -> (n,).
        rng: The frame's generator.
        count: Number of particles wanted; the present number by default.
        resample: How parents are drawn.
        threshold: Resample only if the effective sample size is below this share of N; 1 resamples always.

    Returns:
        The posterior of this frame, `count` particles.

    Raises:
        TypeError: The likelihood does not return an array.
        ValueError: The dynamics are of another dimension than the particles, or the likelihood returns a number of
            values other than that of the particles.
    """
    count = len(particles) if count is None else count
    ancestors = decide(resample, threshold, rng, particles, count)
    means = dynamics.predict(particles.states)
    if ancestors is None:
        kept = np.arange(count)
        states = dynamics.diffuse(rng, means, kept)
        log_weights, log_evidence = normalise(particles.log_weights + evaluate(log_likelihood, states))
        return Posterior(ParticleSet(states, log_weights, kept), log_evidence, 0, resampled=False)
    states = dynamics.diffuse(rng, means, ancestors)
    log_weights, log_sum = normalise(evaluate(log_likelihood, states))
    return Posterior(ParticleSet(states, log_weights, ancestors), log_sum - math.log(count), 0, resampled=True)
