"""What is believed of a hand after a frame."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pftrack.experiments.hand.shape import HandShape, joints
from pftrack.filters.beam import Beam
from pftrack.filters.particles import ParticleSet

__all__ = ["HandState"]


@dataclass(frozen=True, eq=False)
class HandState:
    """The posterior of one frame, immutable; both trackers carry the same, so that they take over from each other.

    Attributes:
        beam: Poses (25,) with weights and parents, the best first.
        origins: (K, 25) the pose that each one's parent had in the frame before, of which motion is predicted.
        shape: Of the hand that is looked for.
        scale: Length of its palm axis, px.
        wrist_offset: (2,) how far the wrist that is seen is from that of the model, along x and y of the forearm, px.
        fit: (K,) share of the silhouette's area by which each pose's silhouette differs from it; NaN if not compared.
        protrusions: How many were seen.
        tried: How many palms were looked at.
        finding: What is wrong with the silhouette, a sentence; empty if nothing is.
        waited: For how many frames that has been so.
        misfits: In how many frames in a row no hand has fitted.
        lost: Whether only an open hand tells where the hand is.
        searching: Whether the hand is lost, and looked for as an open one.
        particles: (N, 25) of the particle filter; None where a beam is all there is.
        log_evidence: Up to the constant that the likelihood leaves out.
    """

    beam: Beam[NDArray[np.float64]]
    origins: NDArray[np.float64]
    shape: HandShape
    scale: float
    wrist_offset: NDArray[np.float64]
    fit: NDArray[np.float64]
    protrusions: int = 0
    tried: int = 0
    finding: str = ""
    waited: int = 0
    misfits: int = 0
    lost: bool = False
    searching: bool = False
    particles: ParticleSet | None = None
    log_evidence: float = 0.0

    @property
    def pose(self) -> NDArray[np.float64]:
        """(25,) the most probable pose."""
        return self.beam.members[self.beam.best]

    @cached_property
    def tips(self) -> NDArray[np.float64]:
        """(K, 15) column, row and height above the wrist of the five finger tips of every pose, px."""
        places = [joints(pose, self.scale, self.shape)[:, 3].ravel() for pose in self.beam.members]
        return np.array(places)

    @property
    def estimate(self) -> NDArray[np.float64]:
        """(15,) the finger tips of the most probable pose, px: a mean of several poses would be none of them."""
        best: NDArray[np.float64] = self.tips[self.beam.best]
        return best

    @property
    def sigma(self) -> NDArray[np.float64]:
        """(15,) how far the tips of the kept poses are from these, root of the weighted mean square, px."""
        squares = np.square(self.tips - self.estimate)
        found: NDArray[np.float64] = np.sqrt((self.beam.weights[:, None] * squares).sum(axis=0))
        return found

    @property
    def nbytes(self) -> int:
        """About how much memory it takes, bytes."""
        own = 1024 + len(self.beam) * (3 * 25 + 20) * 8
        return own if self.particles is None else own + self.particles.states.nbytes

    def arrays(self) -> Mapping[str, NDArray[Any]]:
        """Return poses, log weights and parents of the beam, and the particles' if there are any."""
        found: dict[str, NDArray[Any]] = {
            "poses": np.array(self.beam.members),
            "log_weights": self.beam.log_weights,
            "parents": self.beam.parents,
        }
        if self.particles is not None:
            found |= {"particles": self.particles.states, "particle_log_weights": self.particles.log_weights}
        return found
