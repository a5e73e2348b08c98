"""What the trackers of a hand report of their belief."""

from collections.abc import Mapping

import numpy as np

from pftrack.core.model.series import Hypotheses, Reduction, Series, SeriesValue
from pftrack.experiments.hand.shape import FINGERS
from pftrack.experiments.hand.trackers.state import HandState
from pftrack.experiments.shared import reports

__all__ = ["PARTICLES", "SERIES", "measure", "measure_particles"]

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
