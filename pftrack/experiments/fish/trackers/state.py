"""What is believed of a fish after a frame."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pftrack.filters.particles import ParticleSet

__all__ = ["COORDINATES", "UNITS", "FishState"]

COORDINATES = ("a", "b", "along", "across", "theta", "phi")
"""Of a particle: place in px, velocity along and across the body in px/frame, heading and bend in rad."""

UNITS = ("px", "px", "px/frame", "px/frame", "rad", "rad")
"""Of them."""


@dataclass(frozen=True, slots=True)
class FishState:
    """The posterior of one frame, immutable; all trackers carry the same, so that they take over from each other.

    Attributes:
        particles: (N, 6) states, see `COORDINATES`.
        changes: (N, 3) since each one's parent: gain of the velocity across the body, px/frame, turn and bend, rad.
        mean: (6,) of the posterior; the mean heading is on the circle, within half a turn of 0.
        spread: (4,) standard deviations of the pose, px and rad.
        distance: d_max of the particle with the greatest weight, px.
        log_evidence: Up to the constant that the likelihood leaves out.
    """

    particles: ParticleSet
    changes: NDArray[np.float64]
    mean: NDArray[np.float64]
    spread: NDArray[np.float64]
    distance: float
    log_evidence: float = 0.0

    @property
    def estimate(self) -> NDArray[np.float64]:
        """(2,) posterior mean of the centre of the body, px."""
        return self.mean[:2]

    @property
    def sigma(self) -> NDArray[np.float64]:
        """(2,) posterior standard deviations of the same, px."""
        return self.spread[:2]

    @property
    def pose(self) -> NDArray[np.float64]:
        """(4,) posterior mean (a, b, theta, phi), px and rad."""
        return self.mean[[0, 1, 4, 5]]

    @property
    def nbytes(self) -> int:
        """About how much memory it takes, bytes."""
        particles = self.particles
        arrays = (particles.states, particles.ancestors, self.changes)
        return 1024 + 2 * particles.log_weights.nbytes + sum(array.nbytes for array in arrays)

    def arrays(self) -> Mapping[str, NDArray[np.float64]]:
        """Return states and log weights of the particles."""
        return {"states": self.particles.states, "log_weights": self.particles.log_weights}
