"""What one step of a particle filter gives."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

from pftrack.core.arrays import Floats
from pftrack.core.numerics.checks import check
from pftrack.filters.particles import ParticleSet

__all__ = ["LogLikelihood", "Posterior", "evaluate"]

LogLikelihood: TypeAlias = Callable[[Floats], Floats]


@dataclass(frozen=True, slots=True)
class Posterior:
    """The posterior of one frame as particles, and how it came about.

    Attributes:
        particles: The posterior. Those from the prediction sampler come first, those from the observation sampler last.
        log_evidence: log p(z_t | z_{1:t-1}), up to the constant that the likelihood leaves out; -inf if every weight
            was zero and the particles were made uniform.
        observation_count: How many particles came from the observation sampler.
        resampled: Whether the particles were resampled.
    """

    particles: ParticleSet
    log_evidence: float
    observation_count: int
    resampled: bool


def evaluate(log_likelihood: LogLikelihood, states: Floats) -> Floats:
    """Return the log likelihoods (n,) of states (n, d); NaN counts as impossible when they are normalised.

    Raises:
        TypeError: The likelihood returns something else than an array of real numbers.
        ValueError: It returns another number of values than there are states.
    """
    values = log_likelihood(states)
    try:
        fits = values.dtype.kind == "f" and values.ndim == 1 and len(values) == len(states)
    except AttributeError:
        fits = False
    if not fits:
        check(missing=True, states=(states, "N d"), log_likelihood=(values, "N"))
    return values
