"""What trackers of a head report beyond those of any solid: of the templates, and of a face model that grows."""

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.series import Series, SeriesValue
from pftrack.experiments.head.trackers.growth import position_variances
from pftrack.experiments.head.trackers.memory import HeadMemory
from pftrack.experiments.shared.pose.methods import Method
from pftrack.experiments.shared.pose.reports import measurement, report
from pftrack.experiments.shared.pose.state import PoseState
from pftrack.vision.geometry.face_model import FEATURES

__all__ = ["head_measurement", "head_series"]

CORRELATION = Series(
    "correlation", "correlation with its template", shape="vector", role="likeness", components=FEATURES
)
TEMPLATE_LIKENESS = Series(
    "template_likeness",
    "template's likeness to the first one",
    shape="vector",
    role="model_likeness",
    components=FEATURES,
)

TRACK_SD = Series(
    "track_sd_px",
    "standard deviation as a track, its template's slips included",
    "px",
    "vector",
    components=FEATURES,
)

GROWTH = (
    Series("own_share", "share of the person's own face in the model"),
    Series("own_probability", "probability that the own face predicts better than the mean"),
    Series("own_advantage", "log density by the own face less that by the mean face"),
    Series("free_energy", "log density of the features by the own face"),
    Series("shape_sd_mm", "standard deviation of the model's points", "mm"),
    Series("shape_frames", "frames that the model has learned from", "frames"),
)


def head_series(method: Method) -> tuple[Series, ...]:
    """Return what a tracker of a head reports."""
    return (*report(method, FEATURES), CORRELATION, TEMPLATE_LIKENESS, TRACK_SD, *GROWTH)


def head_measurement(method: Method) -> Callable[[PoseState], Mapping[str, SeriesValue]]:
    """Return a function that measures these series of a state; those of a growing model only where there is one."""
    layers = measurement(report(method, FEATURES))

    def measure(state: PoseState) -> Mapping[str, SeriesValue]:
        memory: HeadMemory = state.memory
        values = {
            **layers(state),
            CORRELATION.name: tuple(memory.correlations.tolist()),
            TEMPLATE_LIKENESS.name: tuple(memory.template_likeness.tolist()),
            TRACK_SD.name: tuple(_track_sd(state, memory).tolist()),
        }
        growth = memory.growth
        if growth is None:
            return values
        variances = np.trace(growth.covariances, axis1=1, axis2=2)
        return values | {
            "own_share": growth.weight,
            "own_probability": growth.probability,
            "own_advantage": growth.advantage,
            "free_energy": growth.free_energy,
            "shape_sd_mm": float(np.sqrt(variances.mean())),
            "shape_frames": float(growth.own.frames),
        }

    return measure


def _track_sd(state: PoseState, memory: HeadMemory) -> NDArray[np.float64]:
    """Return how far each feature's position may be off by all that a face learns from it, (F,) px; NaN if unknown."""
    variances = position_variances(state, memory.correlations, memory.sight.eye_distance_px, 0.0).mean(axis=1)
    return np.sqrt(np.where(np.isfinite(variances), variances, np.nan))
