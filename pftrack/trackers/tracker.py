"""What a tracker is, and the state that it hands from frame to frame."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pftrack.filters.fixed_lag import Lineage
from pftrack.frame import Frame, Target
from pftrack.gaussian import Gaussian
from pftrack.learning.online_em import Learner
from pftrack.particles import ParticleSet
from pftrack.random import Stream

__all__ = ["Fold", "TrackState", "Tracker"]


@dataclass(frozen=True, slots=True)
class TrackState:
    """The posterior of one frame, immutable.

    Attributes:
        posterior: Mean and covariance of the whole state (d,), of which the first `tracked` coordinates are the
            estimate.
        tracked: How many coordinates are the estimate.
        particles: The posterior as particles, or None for a Gaussian filter.
        observation_count: How many of the particles, the last ones, came from the observation sampler.
        log_evidence: log p(z_t | z_{1:t-1}) up to the constant that the likelihood leaves out.
        resampled: Whether parents were drawn anew in this frame.
        switched: Whether another sampler, or another process noise, was used than in the frame before.
        alert: Whether the tracker trusts the observation more, or doubts the prediction more, than in calm times; None
            before the first step.
        learner: What has been learned of the dynamics, if it is to be learned.
        lineage: The particles' pasts, if the path is to be smoothed.
        reference: The exact posterior beside the approximate one, where it is known.
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

    @property
    def estimate(self) -> NDArray[np.float64]:
        """(tracked,) posterior mean."""
        return self.posterior.mean[: self.tracked]

    @property
    def sigma(self) -> NDArray[np.float64]:
        """(tracked,) posterior standard deviations."""
        return self.posterior.standard_deviations[: self.tracked]


@dataclass(frozen=True, slots=True)
class Fold:
    """What comes of L frames taken at once.

    Attributes:
        state: Of the last frame.
        estimates: (L, tracked) posterior means.
        observation_shares: (L,) share of the particles that came from the observation sampler.
        switches: How often the sampler or the process noise changed.
    """

    state: TrackState
    estimates: NDArray[np.float64]
    observation_shares: NDArray[np.float64]
    switches: int


@dataclass(frozen=True)
class Tracker:
    """A named way of tracking.

    Attributes:
        id: Name in commands, addresses and files.
        title: Name on the screen.
        description: One sentence on how it works.
        start: (target, size of the picture in px, parameters, rng) -> state of frame 0.
        step: (state, frame, parameters, rng) -> state of that frame.
        fold: (state, pictures (L, height, width, 3), parameters, seed, index of the first) -> what comes of them, the
            same as of L steps but faster; None if these parameters do not allow it.
    """

    id: str
    title: str
    description: str
    start: Callable[[Target, tuple[int, int], Any, Stream], TrackState]
    step: Callable[[TrackState, Frame, Any, Stream], TrackState]
    fold: Callable[[TrackState, NDArray[np.uint8], Any, int, int], Fold | None] | None = None
