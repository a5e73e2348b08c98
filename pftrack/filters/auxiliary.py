"""The auxiliary particle filter: the observation influences the choice of parents.

Each particle is judged in advance by the likelihood g at a representative point, the mean of its prediction. Parents
drawn by weight times g (the *observation sampler*) lie where the new picture shows something; parents drawn by weight
alone (the *prediction sampler*) are those of the bootstrap filter. One step here serves both and any mixture of them.

The decisive choice is the weight of a particle from the observation sampler; Bando 2007 does not specify it. There are
three rules (docs/methods/filters.md):

- `corrected`: likelihood / g, the rule of Pitt and Shephard (1999). The posterior is the Bayesian one; in a mixture
  each group is put on the common scale by the mean of g over the last posterior.
- `balanced`: the same target, with the balance heuristic over the mixture of both samplers; lower variance.
- `sharpened`: the likelihood alone, which reproduces Bando 2007. The likelihood then enters twice, at the
  representative point and at the particle. This is **not** a valid importance sampler of the posterior but a heuristic
  that trusts the observation more than the model does; its sigma is too small, and its log evidence is not valid.
"""

import math
from typing import Literal, TypeAlias

import numpy as np

from pftrack.core.arrays import Floats, check_count
from pftrack.core.numerics.compiled import compiled
from pftrack.core.numerics.elementary import exponentials, logarithms
from pftrack.core.numerics.random import Generator
from pftrack.filters.dynamics import Dynamics
from pftrack.filters.particles import LogLikelihood, ParticleSet, Posterior, evaluate, normalise
from pftrack.filters.resampling import Resampler, systematic

WeightRule: TypeAlias = Literal["sharpened", "corrected", "balanced"]


def step(
    particles: ParticleSet,
    dynamics: Dynamics,
    log_likelihood: LogLikelihood,
    rng: Generator,
    *,
    weights: WeightRule,
    prediction_count: int,
    observation_count: int,
    resample: Resampler = systematic,
) -> Posterior:
    """Advance by one observation with particles from both samplers (Bando 2007, ch. 3 sections 1 and 2.1).

    Args:
        particles: Posterior of the last frame, N particles (N, d).
        dynamics: p(x_t | x_{t-1}).
        log_likelihood: log p(z_t | x_t) up to a constant, (n, d) -> (n,).
        rng: The frame's generator.
        weights: The weight rule for particles of the observation sampler.
        prediction_count: Particles to draw by the prediction sampler.
        observation_count: Particles to draw by the observation sampler.
        resample: How parents are drawn.

    Returns:
        The posterior, prediction_count + observation_count particles in that order. If g is zero for every particle,
        the observation carries no information, and all particles come from the prediction sampler.

    Raises:
        TypeError: The likelihood does not return an array, or a count is not a whole number.
        ValueError: The dynamics are of another dimension than the particles, the likelihood returns a number of values
            other than that of the particles, or no particles are to be drawn.
    """
    check_count("prediction_count", prediction_count, 0)
    check_count("observation_count", observation_count, 0 if prediction_count else 1)
    means = dynamics.predict(particles.states)
    log_g = evaluate(log_likelihood, means) if observation_count else np.zeros(0)
    first_stage, log_mean_g = normalise(particles.log_weights + log_g) if observation_count else (log_g, 0.0)
    if log_mean_g == -np.inf:
        prediction_count, observation_count = prediction_count + observation_count, 0
    groups = []
    if prediction_count:
        groups.append(resample(rng, particles.log_weights, prediction_count))
    if observation_count:
        groups.append(resample(rng, first_stage, observation_count))
    ancestors = groups[0] if len(groups) == 1 else np.concatenate(groups)
    states = dynamics.diffuse(rng, means, ancestors)
    log_weights = evaluate(log_likelihood, states)
    if observation_count and weights != "sharpened":
        log_weights = log_weights + correction(log_g[ancestors], log_mean_g, prediction_count, weights == "balanced")
    log_weights, log_sum = normalise(log_weights)
    log_evidence = log_sum - math.log(len(ancestors))
    return Posterior(ParticleSet(states, log_weights, ancestors), log_evidence, observation_count, resampled=True)


@compiled
def correction(log_g_parent: Floats, log_mean_g: float, prediction_count: int, balanced: bool) -> Floats:
    """Return what to add to the log likelihood so that both groups target the posterior (docs/methods/filters.md).

    Args:
        log_g_parent: (N,) log g of each particle's parent; those of the prediction sampler come first.
        log_mean_g: Logarithm of the mean of g over the last posterior.
        prediction_count: Number of particles from the prediction sampler.
        balanced: By the balance heuristic, or each group by its own sampler.

    Raises:
        ValueError: The number from the prediction sampler exceeds the number of particles.
    """
    count = log_g_parent.shape[0]
    if not 0 <= prediction_count <= count:
        raise ValueError("expected between 0 and N particles of the prediction sampler, got another number")
    relative = np.empty(count)
    for n in range(count):
        relative[n] = log_g_parent[n] - log_mean_g
    if balanced:
        share = 1.0 - prediction_count / count
        mixed = exponentials(relative)
        for n in range(count):
            mixed[n] = (1.0 - share) + share * mixed[n]
        mixed = logarithms(mixed)
        for n in range(count):
            relative[n] = -mixed[n]
        return relative
    for n in range(count):
        relative[n] = 0.0 if n < prediction_count else -relative[n]
    return relative


# The last posterior decides how many particles each sampler provides. While the target is in view it is narrow and the
# prediction can be trusted. When it widens, whether because the target is hidden or because the dynamics are wrong, the
# observation should count more. The switching particle filters of Bando 2007 compare the posterior standard deviation
# with thresholds; they differ in how hard the switch is.


@compiled
def exceeds(sigma: Floats, gamma: float) -> bool:
    """Return whether any posterior standard deviation (d,) exceeds the threshold gamma, in the same unit."""
    for deviation in sigma:  # noqa: SIM110 - `any` of a generator cannot be compiled
        if deviation > gamma:
            return True
    return False


@compiled
def hard(sigma: Floats, gamma: float, count: int) -> int:
    """All particles from the observation sampler if any sigma exceeds gamma, else none.

    This is the rule of the h-SPF (Bando 2007, ch. 3 section 2.1).

    Args:
        sigma: (d,) posterior standard deviations of the last frame.
        gamma: Threshold, in the unit of sigma; Bando uses the target's radius.
        count: N.
    """
    return count if exceeds(sigma, gamma) else 0


@compiled
def soft(sigma: Floats, gamma_min: float, gamma_max: float, count: int) -> int:
    """A share that rises linearly from none at gamma_min to all at gamma_max (s-SPF; Bando 2007, eqs. 3.6 and 3.7).

    The largest sigma decides; the number is rounded to the nearest, halves to even.

    Args:
        sigma: (d,) posterior standard deviations of the last frame.
        gamma_min: Below this none are drawn by observation.
        gamma_max: Above this all are; not less than gamma_min. If both are equal, the switch is hard.
        count: N.

    Raises:
        ValueError: The sigmas are empty, or one is NaN.
    """
    widest = 0.0
    for axis in range(sigma.shape[0]):
        widest = max(widest, sigma[axis])
        if np.isnan(sigma[axis]):
            widest = np.nan
            break
    if sigma.shape[0] == 0 or np.isnan(widest):
        raise ValueError("expected posterior standard deviations (d,), got none or NaN")
    if gamma_max <= gamma_min:
        return count if widest > gamma_max else 0
    return int(np.rint(count * min(max((widest - gamma_min) / (gamma_max - gamma_min), 0.0), 1.0)))
