"""The turning prism: which prediction to trust when vertices hide (Bando 2007, ch. 4 section 3.3).

Eight vertices of a solid are measured, the hidden ones wildly. The solid's pose predicts where each should be, and so
does each vertex's own past; the adaptive sampling distribution learns which of the two is right, vertex by vertex.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import TypeAlias

import numpy as np

from pftrack.core.arrays import Bools, Floats
from pftrack.core.geometry import rotation
from pftrack.core.model.drawing import COLOURS, Colour, Drawing, Links, Picture, Primitive
from pftrack.core.model.measures import POSE_MEASURES
from pftrack.core.model.setup import Setup
from pftrack.core.model.tracker import Diagnostics, Step
from pftrack.core.numerics.matrices import pinhole
from pftrack.experiments.declared import read_quality, read_words
from pftrack.experiments.experiment import Experiment
from pftrack.experiments.prism.scene import (
    EDGES,
    FACES,
    NAMES,
    PRINCIPAL_PX,
    SIZE_PX,
    VERTICES_MM,
    PrismSource,
    PrismTarget,
    visible_faces,
)
from pftrack.experiments.prism.trackers import MODEL, TRACKERS, TrackedPrismParameters
from pftrack.experiments.shared.pose import SHOWN_OF_POSES
from pftrack.experiments.shared.pose.drawing import (
    beside,
    camera,
    dashes,
    feature_clouds,
    feature_marks,
    feature_names,
    heights,
    is_lost,
    mean_error_deg,
    model_points,
    place_points,
    pose_axes,
    pose_measure,
    pose_series,
    true_marks,
)
from pftrack.experiments.shared.pose.state import PoseState
from pftrack.experiments.shared.sketch import at_height, caption, error_words, paper

FOLDER = Path(__file__).parent

WORDS = read_words(FOLDER, TRACKERS, SHOWN_OF_POSES) | {"series": pose_series(NAMES)}

Placed: TypeAlias = tuple[Floats, Bools]
"""Corners (8, 3) px, and which faces (6,) are seen."""

SEEN_BY = np.array([[{a, b} <= set(face) for face in FACES] for a, b in EDGES])
"""(12, 6) which edges belong to which faces."""

AXES_MM = 8.0
TICK = np.array([[-4.0, 0.0, 0.0], [4.0, 0.0, 0.0]], dtype=np.float32)
"""The ends of the mark of a measurement, px around it."""


# `docs/explanation/calibration.md` has the bands. `python -m tools.loss_probability fit prism` fits the probability of
# a loss and writes `loss_probability.json`.


def simulate() -> Setup:
    """Wire the prism with Bando's values."""
    return Setup(PrismSource, TrackedPrismParameters())


def draw(step: Step, past: Sequence[Diagnostics], other: Diagnostics | None = None) -> Drawing:
    """Draw a frame: the solid as estimated, as another run has it and as it is, hidden edges dashed; its features.

    The solid of a second run is drawn in its pose, but where this one is: a row holds only the pose.
    """
    del past
    frame, state, row = step.frame, step.state, step.diagnostics
    width, height = SIZE_PX
    primitives: dict[str, Primitive] = {"picture": Picture(paper(*SIZE_PX))}
    if frame.measurements is not None:
        points = at_height(frame.measurements.points_px, 1.0)
        primitives["measurements"] = Links(points[:, None] + TICK, COLOURS["hidden"], 2.0, "measurements")
    primitives |= feature_clouds(state, 3.0)
    primitives |= _edges("estimated", _place_solid(state, state.estimate), COLOURS["estimate"], 3.0, "estimate")
    if other is not None:
        theta = np.array(other.estimate) / EXPERIMENT.scale
        primitives |= _edges("second", _place_solid(state, theta), COLOURS["second"], 1.5, "second run")
    target = frame.target
    if isinstance(target, PrismTarget):
        primitives |= _edges("true", _true(state, target), COLOURS["truth"], 1.0, "truth")
    primitives |= model_points(state, 4.0)
    primitives |= feature_marks(state, NAMES)
    primitives |= feature_names(state, NAMES, beside(state.project(VERTICES_MM), VERTICES_MM[:, :2], height))
    if target is not None and target.landmarks is not None:
        primitives |= true_marks(target.landmarks, 3.0)
    primitives |= pose_axes(state, np.zeros(3), AXES_MM)
    primitives |= camera(state, SIZE_PX)
    return Drawing(width, height, primitives, caption(row, step.tracker_title, error_words(row, "°")))


def _place_solid(state: PoseState, theta: Floats) -> Placed:
    """Return the solid where it is believed to be, at these angles."""
    return place_points(state, VERTICES_MM, theta), visible_faces(theta, state.translation_mm)


def _true(state: PoseState, target: PrismTarget) -> Placed:
    """Return the solid where it is, over the same picture."""
    corners = VERTICES_MM @ rotation(target.position).T + target.translation_mm
    pixels = pinhole(corners, state.solid.focal_px) + PRINCIPAL_PX
    seen = visible_faces(target.position, target.translation_mm)
    return np.column_stack([pixels, heights(state, corners[:, 2])]), seen


def _edges(name: str, placed: Placed, colour: Colour, width: float, layer: str) -> dict[str, Primitive]:
    """Draw a prism's edges, those between two hidden faces dashed."""
    corners, seen = placed
    edges = corners[np.array(EDGES)].astype(np.float32)
    front = (SEEN_BY & seen).any(axis=1)
    return {
        f"{name} edges": Links(edges[front], colour, width, layer),
        f"{name} hidden edges": dashes(edges[~front], colour, width, layer),
    }


EXPERIMENT = Experiment(
    **WORDS,
    id="prism",
    simulate=simulate,
    draw=draw,
    error=mean_error_deg,
    lost=is_lost,
    measures=POSE_MEASURES,
    scale=float(np.rad2deg(1.0)),
    measure=pose_measure,
    exports=(TrackedPrismParameters.guidance.export,),
    guidance=TrackedPrismParameters.guidance,
    quality=read_quality(FOLDER, TRACKERS),
    model=MODEL,
)
