"""What is measured and shown of a face model that grows: how far it has come, how sure it is, how far from the truth.

Its own series come from the tracker (`trackers.head.reports`); the distance from the true face is measured where that
is known. Turned, moved and scaled onto the true face first, since no camera tells size or origin of a face.
"""

from collections.abc import Mapping

import numpy as np

from pftrack.core.model.frame import Frame
from pftrack.core.model.glossary import Term
from pftrack.core.model.plot import Plot, Reading
from pftrack.core.model.series import Series, SeriesValue
from pftrack.experiments.head.trackers.memory import HeadMemory
from pftrack.experiments.shared.pose.state import PoseState
from pftrack.experiments.shared.pose_series import pose_measure
from pftrack.vision.structure.alignment import residuals

__all__ = ["GROWTH_PLOTS", "GROWTH_READINGS", "GROWTH_TERMS", "SHAPE_ERROR", "head_measure"]

SHAPE_ERROR = Series("shape_error_mm", "distance of the face model from the driver's face", "mm")

GROWTH_PLOTS = (
    Plot(
        "own_share",
        "share of the own face",
        "value",
        "How much of the person's own face is in the model, 0 to 1; it moves as far as the evidence says that it "
        "predicts better than the mean face.",
        series=("own_share",),
    ),
    Plot(
        "shape_error",
        "error of the face model",
        "value",
        "How far the points of the face model are from the driver's face, root mean square.",
        unit="mm",
        series=(SHAPE_ERROR.name,),
    ),
    Plot(
        "free_energy",
        "log density of features",
        "value",
        "What the own face expected of the features before it learned from them, up to a constant.",
        series=("free_energy",),
    ),
)
"""Shown beside the plots of a pose when the model grows."""

GROWTH_READINGS = (
    Reading("own face", "value", series="own_share"),
    Reading("face model sure to", "value", unit="mm", series="shape_sd_mm"),
    Reading("frames learned", "value", unit="frames", series="shape_frames"),
)

GROWTH_TERMS = (
    Term("own face", "how much of this person's own shape is in the face model, 0 to 1; 0 is the mean face"),
    Term("face model", "the points of a face in space; it may grow from the mean face to that of the person"),
    Term("frames learned", "how many frames the face model has been learned from so far"),
)


def head_measure(frame: Frame, state: PoseState) -> Mapping[str, SeriesValue]:
    """Return the measurements of the pose, and of a face model that grows its distance from the truth."""
    values = dict(pose_measure(frame, state))
    memory: HeadMemory = state.memory
    known = None if frame.target is None else frame.target.landmarks
    if memory.growth is not None and known is not None:
        apart = residuals(memory.growth.shape, known.model_mm, "similarity")
        values[SHAPE_ERROR.name] = float(np.sqrt(np.square(apart).mean()))
    return values
