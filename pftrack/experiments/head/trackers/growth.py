"""What a tracked frame teaches of the person's own face (`structure.growing`).

The features' positions and variances are what the growing model learns from. But templates of the first frame slip:
the nose's follows the cheeks beside it as the head turns, and what they slip to lasts as long as the pose does. Taken
as it stands, a track says of the face what is not so: fed with the particles' own variances the model ended 13 mm from
the truth where the mean face is off by 3 (six simulated drivers, 210 to 212 and Bando's). How far a feature is
off shows in its correlation with its template: 1 px at 0.95, 2 at 0.85, 4 at 0.75, 8 at 0.6. So

- the variance of a position is v / (1 - kappa), as in `trackers.pose.calibrated`, plus that of the slip, whose standard
  deviation grows tenfold with each quarter by which the correlation falls;
- errors that last for frames are counted as often as they are new: all variances are those of `PERSISTENCE` frames;
- a feature that is not recognised teaches nothing, and nor does a doubtful frame, or one in which features may
  be hidden (`trackers.pose.hypotheses`): what a cover teaches is not the face.

What is learned is used in the next frame.
"""

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pftrack.core.numerics.elementary import exponential
from pftrack.experiments.head.trackers.parameters import HeadTrackerParameters
from pftrack.experiments.head.trackers.templates import EYE_DISTANCE_PX
from pftrack.experiments.shared.pose.calibrated import seen_moments
from pftrack.experiments.shared.pose.state import PoseState
from pftrack.vision.geometry.face_model import FaceModel, spread_mm2
from pftrack.vision.structure import growing
from pftrack.vision.structure.growing import Growing

__all__ = ["begin", "learn", "position_variances", "widen_motion"]

PERSISTENCE = 5.0
"""For so many frames an error of a template lasts."""

SLIP_PX = 1.0
"""Standard deviation of the slip of a template that fits, for a face of Bando's size."""

SLIP_DECADES = 4.0
"""By so many powers of ten it grows as the correlation falls from 1 to 0."""

FEWEST_FEATURES = 4
"""A camera has six numbers, so three points say nothing of the shape."""

LN_10 = 2.302585092994046


def begin(start: FaceModel, focal_px: float, parameters: HeadTrackerParameters) -> Growing:
    """Begin with a face, which may be off as people are from their mean."""
    return growing.begin(start.points_mm, spread_mm2(), _settings(focal_px, parameters))


def widen_motion(growth: Growing) -> Growing:
    """Return what is known of the face, for a head that may have moved anywhere since it was last seen."""
    return replace(growth, own=replace(growth.own, camera=None), mean_camera=None)


def learn(
    growth: Growing,
    state: PoseState,
    correlations: NDArray[np.float64],
    eye_distance_px: float,
    parameters: HeadTrackerParameters,
) -> Growing:
    """Return what is known after a frame in which the face was tracked.

    Args:
        growth: What was known.
        state: The frame's features.
        correlations: (F,) with their templates.
        eye_distance_px: At first sight.
        parameters: In force.
    """
    settings = _settings(state.solid.focal_px, parameters)
    growth = growth if growth.settings == settings else replace(growth, settings=settings)
    variances = position_variances(state, correlations, eye_distance_px, parameters.sd_floor_px)
    if np.isfinite(variances[:, 0]).sum() < FEWEST_FEATURES:
        return growth
    means, *_ = seen_moments(state.belief)
    return growing.step(growth, means - state.solid.principal_px, variances)


def position_variances(
    state: PoseState, correlations: NDArray[np.float64], eye_distance_px: float, sd_floor_px: float
) -> NDArray[np.float64]:
    """Return variances (F, 2) px^2 of the features' positions, infinite where a feature is not recognised."""
    means, own, few = seen_moments(state.belief)
    told = np.maximum(own, sd_floor_px**2)
    slip_px = SLIP_PX * eye_distance_px / EYE_DISTANCE_PX
    slip = slip_px**2 * exponential(2.0 * SLIP_DECADES * LN_10 * (1.0 - np.clip(correlations, 0.0, 1.0)))
    variances: NDArray[np.float64] = PERSISTENCE * (told * few[:, None] + slip[:, None])
    # A sum is finite if all of its terms are.
    known = np.isfinite(variances + means + correlations[:, None]).all(axis=1)
    return np.where((state.recognised & known)[:, None], variances, math.inf)


def _settings(focal_px: float, parameters: HeadTrackerParameters) -> growing.Settings:
    return growing.Settings(float(focal_px), parameters.model_memory, frozen=parameters.model_frozen)
