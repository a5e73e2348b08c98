"""What is believed of a hand after a frame, and what the trackers report of it."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Floats
from pftrack.core.model.series import Hypotheses, Reduction, Series, SeriesValue
from pftrack.experiments.hand.shape import FINGERS, HandShape, joints
from pftrack.experiments.shared import reports
from pftrack.filters.beam import Beam
from pftrack.filters.particles import ParticleSet


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

    beam: Beam[Floats]
    origins: Floats
    shape: HandShape
    scale: float
    wrist_offset: Floats
    fit: Floats
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
    def pose(self) -> Floats:
        """(25,) the most probable pose."""
        return self.beam.members[self.beam.best]

    @cached_property
    def tips(self) -> Floats:
        """(K, 15) column, row and height above the wrist of the five finger tips of every pose, px."""
        places = [joints(pose, self.scale, self.shape)[:, 3].ravel() for pose in self.beam.members]
        return np.array(places)

    @property
    def estimate(self) -> Floats:
        """(15,) the finger tips of the most probable pose, px: a mean of several poses would be none of them."""
        best: Floats = self.tips[self.beam.best]
        return best

    @property
    def sigma(self) -> Floats:
        """(15,) how far the tips of the kept poses are from these, root of the weighted mean square, px."""
        squares = np.square(self.tips - self.estimate)
        found: Floats = np.sqrt((self.beam.weights[:, None] * squares).sum(axis=0))
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


_BENT = ("spread", "f1", "f2", "f3")
POSE = ("wrist u", "wrist v", "a", "b", "c", *(f"{finger} {angle}" for finger in FINGERS for angle in _BENT))
"""Names of a pose's numbers, px and rad."""

TILT, TILT_SD_RAD = 3, 0.1
"""The palm's angle b in a pose, out of the picture's plane; and the standard deviation of its change that is usual."""

SERIES = (
    Series("hands", "hands that are kept", shape="hypotheses", components=POSE),
    Series("palm", "angles of the palm", "°", "vector", components=("a", "b", "c")),
    Series("palm_sd", "deviation of the kept palms", "°", "vector", components=("a", "b", "c")),
    Series("flexion", "mean bend of each finger's joints", "°", "vector", components=FINGERS),
    Series(
        "difference",
        "difference from the silhouette",
        "%",
        role="misfit",
        reductions=(Reduction("difference", "difference from the silhouette", "mean"),),
    ),
    Series("mirror_gap", "from the mirror image, in deviations of the tilt", role="mirror_gap"),
    Series("protrusions", "protrusions"),
    Series("tried", "palms or particles tried"),
    Series("searching", "waiting for a hand", role="flag", reductions=(Reduction("waited", "frames waited", "count"),)),
)
"""What both report."""

PARTICLES = reports.CLOUD


def measure(state: HandState) -> Mapping[str, SeriesValue]:
    """Report the kept hands, the best one's angles, and how it fits."""
    beam = state.beam
    poses, weights = np.array(beam.members), beam.weights
    palms = np.rad2deg(poses[:, 2:5])
    sd = np.sqrt((weights[:, None] * np.square(palms - palms[beam.best])).sum(axis=0))
    flexion = np.rad2deg(state.pose[5:].reshape(5, 4)[:, 1:].mean(axis=1))
    hands = Hypotheses(
        tuple(map(tuple, poses.tolist())), tuple((weights / weights.sum()).tolist()), tuple(beam.parents.tolist())
    )
    return {
        "hands": hands,
        "palm": tuple(palms[beam.best].tolist()),
        "palm_sd": tuple(sd.tolist()),
        "flexion": tuple(flexion.tolist()),
        "difference": 100.0 * float(state.fit[beam.best]),
        # Turned out of the picture's plane the other way, a hand has nearly the same silhouette.
        "mirror_gap": float(2.0 * abs(state.pose[TILT]) / TILT_SD_RAD),
        "protrusions": float(state.protrusions),
        "tried": float(state.tried),
        "searching": float(state.searching),
    }


def measure_particles(state: HandState) -> Mapping[str, SeriesValue]:
    """Report the same, and the particles where there are any."""
    if state.particles is None:
        return measure(state)
    return {**measure(state), **reports.cloud(state.particles, resampled=True)}
