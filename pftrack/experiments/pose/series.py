"""What is written down of every frame in which a pose is estimated, beside error and estimate.

The pose is given as yaw, pitch and roll of the face (`geometry.gaze`), in degrees, each with its standard deviation
and, where it is known, the truth. Of each feature: alpha, whether it was recognised, its distance from the truth and
its standard deviation. Whether the truth lies in the central 50 % and 95 % of the posterior is written down for each
angle, in the order (theta_x, theta_y, theta_z): over many frames it should, as often as that.
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from pftrack.frame import Frame
from pftrack.geometry.gaze import gaze
from pftrack.geometry.rotation import wrapped
from pftrack.plot import ERROR, PARTICLES, SAMPLE_SIZE, STEP_TIME, Plot, Reading
from pftrack.runs.diagnostics import Series
from pftrack.trackers.pose.state import PoseState

__all__ = ["POSE_PLOTS", "POSE_READINGS", "mean_error_deg", "pose_series"]

HALF, MOST = 0.674490, 1.959964
"""Half widths of the central 50 % and 95 % of a Gaussian, in standard deviations."""

ANGLES = ("yaw", "pitch", "roll")

POSE_PLOTS = (
    Plot(
        "alpha",
        "alpha, 0 to 1",
        "features",
        "What share of each feature's particles comes from the pose of the whole; the rest comes from its own past.",
        series=("alpha",),
        visible="feature_visible",
        recognised="feature_recognised",
    ),
    *(
        Plot(
            angle,
            angle,
            "band",
            f"The {angle} with a band of two standard deviations, and dashed the truth where it is known.",
            unit="deg",
            series=(f"{angle}_deg",),
            sd=f"{angle}_deg_sd",
            truth=f"{angle}_deg_true",
        )
        for angle in ANGLES
    ),
    ERROR,
    Plot(
        "calibration",
        "truth in the band of",
        "share",
        "How often so far the true angles lay in the central 50 % and 95 % of the posterior: so often, if honest.",
        series=("within_50", "within_95"),
        levels=(0.5, 0.95),
        needs_truth=True,
    ),
    SAMPLE_SIZE,
)
"""The plots of a pose by features."""

POSE_READINGS = (
    *(Reading(angle, "value", unit="deg", series=f"{angle}_deg", sd=f"{angle}_deg_sd") for angle in ANGLES),
    Reading("recognised", "count", series="feature_recognised"),
    Reading("error", "error"),
    PARTICLES,
    STEP_TIME,
)
"""The readings of the same."""


def pose_series(frame: Frame, state: PoseState) -> Mapping[str, Series]:
    """Return the series of a frame by name."""
    found, spread = np.rad2deg(gaze(state.estimate)), np.rad2deg(_gaze_sd(state))
    known = frame.target
    truth = np.rad2deg(gaze(known.position)) if known else np.full(3, np.nan)
    off = np.abs(wrapped(state.estimate - known.position)) / state.sigma if known else np.full(3, np.nan)
    landmarks = known.landmarks if known else None
    apart, shown = np.full((2, len(state.feature_means)), np.nan)
    if landmarks is not None:
        apart = np.hypot(*(state.feature_means - landmarks.points_px).T)
        shown = landmarks.visible.astype(np.float64)
    series: dict[str, Series] = {}
    for place, angle in enumerate(ANGLES):
        name = f"{angle}_deg"
        series[name] = float(found[place])
        series[f"{name}_sd"] = float(spread[place])
        series[f"{name}_true"] = float(truth[place])
    return series | {
        "alpha": _numbers(state.ratios),
        "feature_recognised": _numbers(state.recognised),
        "feature_visible": _numbers(shown),
        "feature_error_px": _numbers(apart),
        "feature_sd_px": _numbers(np.sqrt(np.trace(state.feature_covariances, axis1=1, axis2=2) / 2.0)),
        "within_50": _numbers(np.where(np.isnan(off), np.nan, off <= HALF)),
        "within_95": _numbers(np.where(np.isnan(off), np.nan, off <= MOST)),
    }


def mean_error_deg(estimates: NDArray[np.float64], truths: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the mean over the axes of the absolute errors (...), degrees, of angles (..., 3), rad."""
    error: NDArray[np.float64] = np.rad2deg(np.abs(wrapped(estimates - truths)).mean(axis=-1))
    return error


def _gaze_sd(state: PoseState) -> NDArray[np.float64]:
    """Return the standard deviations of yaw, pitch and roll (3,), rad; the roll's as if it were theta_z."""
    return state.sigma[[1, 0, 2]]


def _numbers(values: NDArray[np.float64] | NDArray[np.bool_]) -> tuple[float, ...]:
    return tuple(np.asarray(values, dtype=np.float64).tolist())
