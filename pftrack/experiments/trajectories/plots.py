"""What is plotted and written of the frames of trajectories, and what a run comes to."""

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.glossary import Term
from pftrack.core.model.measures import EvaluatedRun, Measure
from pftrack.core.model.plot import ERROR, INNOVATION, PARTICLES, STEP_TIME, Plot, Reading

__all__ = ["MEASURES", "PLOTS", "READINGS", "TERMS"]


def _errors(course: EvaluatedRun) -> NDArray[np.float64]:
    return course.errors


MEASURES = (
    Measure(
        "median_track_error_px",
        "Median error",
        "Median over the labelled frames of the distance of the selected track's filtered position from the truth.",
        "median",
        _errors,
        unit="px",
        better="lower",
    ),
)

PLOTS = (
    ERROR,
    Plot(
        "mismatched",
        "mismatches",
        "value",
        "Share of the tracks that are measured far from the truth; it jumps where the light does.",
        series=("mismatch_share",),
    ),
    Plot(
        "smoothed-mismatched",
        "left after smoothing",
        "value",
        "The same of the smoothed positions of the frame a lag ago.",
        series=("smoothed_mismatch_share",),
    ),
    Plot(
        "raw",
        "measurements",
        "value",
        "Root mean square error of the measurements, over all tracks; it jumps where outliers are.",
        "px",
        ("raw_rms_px",),
    ),
    Plot(
        "filtered",
        "filtered",
        "value",
        "The same of the filtered positions: of this frame, given all up to it.",
        "px",
        ("filtered_rms_px",),
    ),
    Plot(
        "smoothed",
        "smoothed",
        "value",
        "The same of the smoothed positions of the frame a lag ago.",
        "px",
        ("smoothed_rms_px",),
    ),
    Plot(
        "noise",
        "scale of the noise",
        "interval",
        "Where σ of nine tenths of the particles lies: one value, however sure, once all descend from the same one.",
        "px",
        ("noise_sd_px",),
    ),
    Plot("drive", "freedom of motion", "interval", "The same of τ.", "px", ("drive_sd_px",)),
    Plot(
        "outliers",
        "outliers",
        "value",
        "Share of the measurements that are far from the filtered position.",
        series=("outlier_share",),
    ),
    Plot(
        "roots",
        "particles at the lag",
        "value",
        "How many different particles the smoothed position rests on; the rest have no descendants any more.",
        series=("roots",),
    ),
    Plot(
        "motion",
        "motion",
        "value",
        "Root mean square distance of the smoothed positions from where tracks began; an error where nothing moves.",
        "px",
        ("false_motion_px",),
    ),
    INNOVATION,
)

READINGS = (
    Reading("estimate", "estimate"),
    Reading("error", "error"),
    Reading("sigma", "sigma"),
    Reading("tracks", "value", series="tracks"),
    Reading("outliers", "value", series="outlier_share"),
    Reading("noise σ", "interval", unit="px", series="noise_sd_px"),
    Reading("motion τ", "interval", unit="px", series="drive_sd_px"),
    PARTICLES,
    Reading("log evidence", "evidence"),
    STEP_TIME,
)

TERMS = (
    Term("tracks", "how many features are followed at once"),
    Term("outliers", "the share of the measurements that are wrong, by what is believed"),
    Term("noise σ", "the scale of the noise of a measurement, as an interval that the tracker learns"),
    Term("motion τ", "how freely a feature changes its motion, as an interval that the tracker learns"),
    Term("lag", "how many frames a smoothed position is behind the newest one, so that later frames can mend it"),
)
