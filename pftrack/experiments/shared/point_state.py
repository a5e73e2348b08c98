"""The state of trackers that follow one point, or one signal: a posterior over a vector, by particles or a Gaussian."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pftrack.core.numerics.gaussian import Gaussian
from pftrack.filters.fixed_lag import Lineage
from pftrack.filters.kalman import NormalisedInnovation
from pftrack.filters.learning.online_em import Learner
from pftrack.filters.particles import ParticleSet

__all__ = ["PointState"]


@dataclass(frozen=True, slots=True)
class PointState:
    """The posterior of one frame, immutable.

    Attributes:
        posterior: Mean and covariance of the whole state (d,), of which the first `tracked` coordinates are the
            estimate.
        tracked: How many coordinates are the estimate.
        particles: The posterior as particles, or None for a Gaussian filter.
        observation_count: How many of the particles, the last ones, came from the observation sampler.
        log_evidence: log p(z_t | z_{1:t-1}) up to the constant that the likelihood leaves out.
        resampled: Whether the particles were resampled in this frame.
        switched: Whether another sampler, or another process noise, was used than in the frame before.
        alert: Whether the tracker trusts the observation more, or doubts the prediction more, than in calm times; None
            before the first step.
        learner: What has been learned of the dynamics, if it is to be learned.
        lineage: The particles' pasts, if the path is to be smoothed.
        reference: The exact posterior beside the approximate one, where it is known.
        innovation: How far off the measurement of the frame was, of a Gaussian filter that had one.
        repeatable: Whether every step of a filter from a file came to the same when it was computed again.
    """

    posterior: Gaussian
    tracked: int
    particles: ParticleSet | None = None
    observation_count: int = 0
    log_evidence: float = 0.0
    resampled: bool = False
    switched: bool = False
    alert: bool | None = None
    learner: Learner | None = None
    lineage: Lineage | None = None
    reference: Gaussian | None = None
    innovation: NormalisedInnovation | None = None
    repeatable: bool = True

    @property
    def estimate(self) -> NDArray[np.float64]:
        """(tracked,) posterior mean."""
        return self.posterior.mean[: self.tracked]

    @property
    def sigma(self) -> NDArray[np.float64]:
        """(tracked,) posterior standard deviations."""
        return self.posterior.standard_deviations[: self.tracked]

    @property
    def nbytes(self) -> int:
        """About how much memory it takes, bytes."""
        size = 1024
        if self.particles is not None:
            size += self.particles.nbytes
        if self.lineage is not None:
            size += self.lineage.paths.nbytes
        return size

    def arrays(self) -> Mapping[str, NDArray[np.float64]]:
        """Return states and log weights of the particles; empty without."""
        if self.particles is None:
            return {}
        return {"states": self.particles.states, "log_weights": self.particles.log_weights}
