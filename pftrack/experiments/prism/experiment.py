"""The turning prism: which prediction to trust when vertices hide (Bando 2007, ch. 4 section 3.3).

Eight vertices of a solid are measured, the hidden ones wildly. The solid's pose predicts where each should be, and so
does each vertex's own past; the adaptive sampling distribution learns which of the two is right, vertex by vertex.
"""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TypeAlias

import numpy as np

from pftrack.core.arrays import Bools, Floats
from pftrack.core.geometry.rotation import rotation
from pftrack.core.model.band import Calibration, Miscalibration
from pftrack.core.model.diagnostics import Diagnostics, Step
from pftrack.core.model.drawing import Drawing, Key, Layer, Links, Picture, Primitive
from pftrack.core.model.glossary import cite
from pftrack.core.model.measures import POSE_MEASURES
from pftrack.core.model.palette import COLOURS, Colour
from pftrack.core.model.preset import ExampleSweep, read_presets
from pftrack.core.model.setup import Setup
from pftrack.core.numerics.matrices import pinhole
from pftrack.experiments.experiment import Experiment, Quality
from pftrack.experiments.prism.scene import (
    EDGES,
    FACES,
    FRAMES,
    NAMES,
    PRINCIPAL_PX,
    SIZE_PX,
    VERTICES_MM,
    PrismSource,
    PrismTarget,
    visible_faces,
)
from pftrack.experiments.prism.trackers import MODEL, TRACKERS, TrackedPrismParameters
from pftrack.experiments.shared.loss_probability import Scenes, read_declaration
from pftrack.experiments.shared.pose.drawing import (
    BANDS,
    BY_PREDICTION,
    POSE_PLOTS,
    POSE_READINGS,
    POSE_TERMS,
    PUBLISHED,
    beside,
    camera,
    dashes,
    feature_clouds,
    feature_marks,
    feature_names,
    heights,
    mean_error_deg,
    model_points,
    place_points,
    pose_axes,
    pose_measure,
    pose_series,
    true_marks,
)
from pftrack.experiments.shared.pose.state import PoseState
from pftrack.experiments.shared.sketch import SECOND_RUN, at_height, caption, error_words, paper

Placed: TypeAlias = tuple[Floats, Bools]
"""Corners (8, 3) px, and which faces (6,) are seen."""

SEEN_BY = np.array([[{a, b} <= set(face) for face in FACES] for a, b in EDGES])
"""(12, 6) which edges belong to which faces."""

AXES_MM = 8.0
TICK = np.array([[-4.0, 0.0, 0.0], [4.0, 0.0, 0.0]], dtype=np.float32)
"""The ends of the mark of a measurement, px around it."""


# `docs/explanation/calibration.md` has the bands. `python -m tools.loss_probability fit prism` fits the probability of
# a loss and writes `loss_probability.json`.

FAULTS = (
    PUBLISHED,
    Miscalibration(("alpha-0",), {"pose_band": ("calibrated",)}, {"noise_px": (0, 10)}, direction="underconfident"),
    Miscalibration(("rb-pf",), ranges={"noise_px": (0, 1)}),
    Miscalibration(("pf-asd", "alpha-1", "rb-pf"), ranges={"noise_px": (20, math.inf)}),
)

CALIBRATION = Calibration(bands=BANDS, faults=FAULTS, presets=("bando", "noise"))

SCENES = Scenes(
    {
        "speed": (0.5, 4.0),
        "noise_px": (0.5, 8.0),
        "yaw_amplitude_deg": (20.0, 60.0),
        "pitch_amplitude_deg": (5.0, 40.0),
    },
    {"sample_count": (5, 10, 25, 50)},
    fitted=60,
    judged=30,
)
"""Slow and fast turns, near to what can be seen and beyond it, measured well and badly."""

LOSS_DECLARATION = read_declaration(Path(__file__).with_name("loss_probability.json"), TRACKERS, SCENES)


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


def _is_lost(errors: Floats, sizes: Floats, parameters: TrackedPrismParameters) -> object:
    del sizes
    return errors > parameters.lost_deg


EXPERIMENT = Experiment(
    id="prism",
    title="Turning prism",
    family="Poses of bodies",
    question="When a corner hides, should the tracker trust the solid or the corner's own past?",
    references=(cite("bando2007", "chapter 4, sections 1 to 3: adaptive sampling distribution"),),
    description=(
        "Eight corners of a prism are measured, the hidden ones with a hundred times the noise. Each corner's "
        "particles come from two predictions, the solid's and its own; alpha is the share of the first. It rises while "
        "a corner is hidden, and falls where the camera that is assumed is wrong. The Rao-Blackwellised filter (RB-PF) "
        "is slow: it takes as many as 25,000 particles of all corners at once."
    ),
    unit="deg",
    trackers=TRACKERS,
    frames=FRAMES,
    presets=read_presets(Path(__file__).with_name("presets.yaml")),
    layers=(
        Layer("picture"),
        Layer("particles by prediction", legend=BY_PREDICTION),
        Layer("estimate", legend=(Key("estimate", "estimate"),)),
        Layer("truth", legend=(Key("truth", "truth"),)),
        Layer("features", legend=(Key("lost", "not recognised"),)),
        Layer("model points"),
        Layer("names"),
        Layer("axes", shown=False),
        Layer("measurements"),
        SECOND_RUN,
        Layer("camera"),
    ),
    simulate=simulate,
    draw=draw,
    error=mean_error_deg,
    lost=_is_lost,
    measures=POSE_MEASURES,
    scale=float(np.rad2deg(1.0)),
    series=pose_series(NAMES),
    measure=pose_measure,
    target="prism",
    exports=(TrackedPrismParameters.guidance.export,),
    guidance=TrackedPrismParameters.guidance,
    quality=Quality(CALIBRATION, LOSS_DECLARATION),
    model=MODEL,
    plots=POSE_PLOTS,
    readings=POSE_READINGS,
    terms=POSE_TERMS,
    # Where the affine camera's error and the corners' noise decide which prediction is worth more.
    example_sweep=ExampleSweep(
        {"distance_mm": (70, 80, 100, 150, 300), "noise_px": (1, 3, 10, 20, 40)},
        trackers=("pf-asd", "alpha-1", "alpha-0"),
        trials=5,
        frames=200,
    ),
)
