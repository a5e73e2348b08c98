"""What one step of a particle filter gives."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from pftrack.particles import ParticleSet

__all__ = ["LogLikelihood", "Posterior"]

LogLikelihood: TypeAlias = Callable[[NDArray[np.float64]], NDArray[np.float64]]


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
