"""What an experiment measures of every frame in which a pose is estimated, beside error and estimate.

The pose is given as yaw, pitch and roll of the face (`geometry.gaze`), in degrees, each with its standard deviation
and, where it is known, the truth. Of each feature: its distance from the truth, and whether it is hidden. Whether the
truth lies in the central 50 % and 95 % of the posterior is written down for each angle, in the order (theta_x, theta_y,
theta_z): over many frames it should, as often as that.
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.frame import Frame
from pftrack.core.model.glossary import Term
from pftrack.core.model.plot import ERROR, PARTICLES, SAMPLE_SIZE, STEP_TIME, Plot, Reading
from pftrack.core.model.series import Series, SeriesValue
from pftrack.core.numerics.angles import wrap
from pftrack.experiments.shared.pose.state import PoseState
from pftrack.vision.geometry.gaze import gaze

__all__ = ["POSE_PLOTS", "POSE_READINGS", "POSE_TERMS", "mean_error_deg", "pose_measure", "pose_series"]

ANGLES = ("yaw", "pitch", "roll")
THETA = ("theta_x", "theta_y", "theta_z")

POSE_PLOTS = (
    Plot(
        "alpha",
        "alpha",
        "features",
        "What share of each feature's particles, 0 to 1, comes from the pose of the whole; the rest from its own past.",
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
        "truth in",
        "frequency",
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

POSE_TERMS = (
    Term(
        "alpha",
        "the share of a feature's particles, 0 to 1, that the pose of the whole proposes; the rest go on from the "
        "feature's own past. It falls where a feature does not move with the whole, or is hidden",
    ),
    Term(
        "truth in",
        "how often so far the true angles lay in the central 50 % and the central 95 % of what is believed; an honest "
        "tracker has 50 % and 95 %, less means that it is too sure, more that it is too unsure",
    ),
    Term("yaw", "the turn to the left or right, about the upright axis"),
    Term("pitch", "the turn up or down, as in a nod"),
    Term("roll", "the tilt towards a shoulder, about the line of sight"),
    Term("recognised", "how many features the tracker itself made out in this frame"),
)
"""The words of the same."""


def pose_series(features: tuple[str, ...]) -> tuple[Series, ...]:
    """Return what `pose_measure` measures of a solid whose features have these names."""
    return (
        *(
            Series(f"{angle}_deg{suffix}", f"{words}{angle}", "°")
            for angle in ANGLES
            for suffix, words in (("", ""), ("_sd", "standard deviation of the "), ("_true", "true "))
        ),
        Series("feature_visible", "visible", shape="vector", role="visible", components=features),
        Series("feature_error_px", "distance from the truth", "px", "vector", components=features),
        *(
            Series(name, f"truth in the central {share} %", shape="vector", role="flag", components=THETA)
            for name, share in (("within_50", 50), ("within_95", 95))
        ),
    )


def pose_measure(frame: Frame, state: PoseState) -> Mapping[str, SeriesValue]:
    """Return the measurements of a frame by name; without a truth, those of the estimate alone."""
    found, spread = np.rad2deg(gaze(state.estimate)), np.rad2deg(_gaze_sd(state))
    values: dict[str, SeriesValue] = {}
    for place, angle in enumerate(ANGLES):
        values[f"{angle}_deg"] = float(found[place])
        values[f"{angle}_deg_sd"] = float(spread[place])
    known = frame.target
    if known is None:
        return values
    truth = np.rad2deg(gaze(known.position))
    off = np.abs(wrap(state.estimate - known.position)) / state.sigma
    for place, angle in enumerate(ANGLES):
        values[f"{angle}_deg_true"] = float(truth[place])
    values |= {"within_50": _numbers(off <= state.widths.half), "within_95": _numbers(off <= state.widths.most)}
    landmarks = known.landmarks
    if landmarks is not None:
        values["feature_visible"] = _numbers(landmarks.visible)
        values["feature_error_px"] = _numbers(np.hypot(*(state.feature_means - landmarks.points_px).T))
    return values


def mean_error_deg(estimates: NDArray[np.float64], truths: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the mean over the axes of the absolute errors (...), degrees, of angles (..., 3), rad."""
    error: NDArray[np.float64] = np.rad2deg(np.abs(wrap(estimates - truths)).mean(axis=-1))
    return error


def _gaze_sd(state: PoseState) -> NDArray[np.float64]:
    """Return the standard deviations of yaw, pitch and roll (3,), rad; the roll's as if it were theta_z."""
    return state.sigma[[1, 0, 2]]


def _numbers(values: NDArray[np.float64] | NDArray[np.bool_]) -> tuple[float, ...]:
    return tuple(np.asarray(values, dtype=np.float64).tolist())
