"""What a tracker is, and what its states offer to whoever runs, records and watches it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from pftrack.frame import Frame, Target
from pftrack.random import Stream

__all__ = ["Fold", "TrackState", "Tracker"]


class TrackState(Protocol):
    """The posterior of one frame, immutable; each family of trackers has its own."""

    @property
    def estimate(self) -> NDArray[np.float64]:
        """(d,) posterior mean of what the target's `position` is."""

    @property
    def sigma(self) -> NDArray[np.float64]:
        """(d,) posterior standard deviations."""

    @property
    def reference_mean(self) -> NDArray[np.float64] | None:
        """(d,) mean of the exact posterior, where it is known beside an approximate one."""

    @property
    def log_evidence(self) -> float:
        """Log p(z_t | z_{1:t-1}) up to the constant that the likelihood leaves out."""

    @property
    def resampled(self) -> bool:
        """Whether parents were drawn anew in this frame."""

    @property
    def switched(self) -> bool:
        """Whether another sampler, or another process noise, was used than in the frame before."""

    @property
    def searching(self) -> bool:
        """Whether the tracker itself has lost the target, and looks for it rather than follows it."""

    @property
    def prediction_count(self) -> int:
        """How many particles came from a prediction."""

    @property
    def observation_count(self) -> int:
        """How many came from the observation."""

    @property
    def effective_sample_size(self) -> float:
        """1 / sum w^2; 0 without particles."""

    @property
    def unique_ancestors(self) -> int:
        """How many different parents the particles have."""

    @property
    def nbytes(self) -> int:
        """About how much memory it takes, bytes."""

    def arrays(self) -> Mapping[str, NDArray[Any]]:
        """Return the particles by name, for a file; empty without particles."""


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
        start: (target, frame 0, parameters, rng) -> state of frame 0.
        step: (state, frame, parameters, rng) -> state of that frame.
        fold: (state, pictures (L, height, width, 3), parameters, seed, index of the first) -> what comes of them, the
            same as of L steps but faster; None if these parameters do not allow it.
    """

    id: str
    title: str
    description: str
    start: Callable[[Target, Frame, Any, Stream], TrackState]
    step: Callable[[Any, Frame, Any, Stream], TrackState]
    fold: Callable[[Any, NDArray[np.uint8], Any, int, int], Fold | None] | None = None
