"""A driver's head, simulated or on any recording: its pose by eleven features (Bando 2007, ch. 4 section 4).

A feature that turns away or is covered no longer looks like its template; where it should be is then known only from
the pose of the head, which is known from the other features. The adaptive sampling distribution learns for each feature
how far to trust which.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.diagnostics import Diagnostics
from pftrack.core.model.drawing import COLOURS, Drawing, Picture, Primitive
from pftrack.core.model.frame import Target
from pftrack.core.model.layer import Key, Layer
from pftrack.core.model.measures import POSE_MEASURES
from pftrack.core.model.references import BANDO, Citation
from pftrack.core.numerics.angles import wrap
from pftrack.experiments.experiment import ExampleSweep, Experiment, Setup, Step
from pftrack.experiments.head.calibration import CALIBRATION
from pftrack.experiments.head.exports import EXPORTS
from pftrack.experiments.head.growth import GROWTH_PLOTS, GROWTH_READINGS, GROWTH_TERMS, SHAPE_ERROR, head_measure
from pftrack.experiments.head.loss_probability import LOSS_DECLARATION
from pftrack.experiments.head.marks import FaceBox, FacePoints
from pftrack.experiments.head.own_face import MASK_OPACITY, MEAN_FACE, UNCERTAINTY, surface_colours
from pftrack.experiments.head.presets import PRESETS
from pftrack.experiments.head.recording import RecordedHeadParameters, on_video
from pftrack.experiments.head.scene import HeadSceneParameters, HeadSource
from pftrack.experiments.head.sketch import PlacedHead
from pftrack.experiments.head.start import FINDER
from pftrack.experiments.head.suitability import suits
from pftrack.experiments.head.trackers.memory import HeadMemory
from pftrack.experiments.head.trackers.parameters import HeadTrackerParameters
from pftrack.experiments.head.trackers.step import TRACKERS
from pftrack.experiments.head.truth import POSES
from pftrack.experiments.head.world import HEAD_WORLD, head_world
from pftrack.experiments.shared.pose.state import PoseState
from pftrack.experiments.shared.pose_series import POSE_PLOTS, POSE_READINGS, POSE_TERMS, mean_error_deg, pose_series
from pftrack.experiments.shared.pose_sketch import (
    BY_PREDICTION,
    beside,
    camera,
    draw_with_rim,
    feature_clouds,
    feature_marks,
    feature_names,
    model_points,
    pose_axes,
    true_marks,
)
from pftrack.experiments.shared.sketch import SECOND_RUN, error_words
from pftrack.vision.geometry.face_model import FEATURES, TITLES
from pftrack.vision.geometry.gaze import gaze

__all__ = ["EXPERIMENT", "SimulatedHeadParameters"]

AXES_MM = 50.0
SAID_FOR_S = 1.0
"""For how long it is said that a face was found again."""


class SimulatedHeadParameters(HeadTrackerParameters, HeadSceneParameters):
    """The simulated driver and its trackers."""


def simulate() -> Setup:
    """Wire the simulated driver, whose camera and features' size are known."""
    return Setup(HeadSource, SimulatedHeadParameters())


def draw(step: Step, past: Sequence[Diagnostics], other: Diagnostics | None = None) -> Drawing:
    """Draw a frame: picture, head, particles, features, where the head looks; the head in its true pose, in another's.

    Beside it stands the model of the head, in a world of its own.

    The head of a second run is drawn in its pose, but where this one is: a row holds only the pose.
    """
    image, state = step.frame.image_rgb, step.state
    memory: HeadMemory = state.memory
    if image is None:
        raise ValueError("a head is drawn on a picture, got a frame without one")
    height, width, _ = image.shape
    mark = max(width, height) / 250.0
    primitives: dict[str, Primitive] = {"picture": Picture(image)}
    head = PlacedHead(state, state.estimate)
    if memory.lost:
        primitives |= head.surface(COLOURS["lost"], 0.1)
        primitives |= head.lines("head", COLOURS["lost"], 1.0, "head")
    else:
        growth = memory.growth
        if growth is None:
            primitives |= head.surface(COLOURS["estimate"], 0.18)
        else:
            primitives |= head.surface(surface_colours(growth, memory.model), MASK_OPACITY, UNCERTAINTY.name)
        primitives |= head.lines("head", COLOURS["estimate"], 2.0, "head")
    if other is not None:
        second = PlacedHead(state, np.array(other.estimate) / EXPERIMENT.scale)
        primitives |= second.lines("second", COLOURS["second"], 1.5, "second run", few=True)
        primitives["second look"] = second.look(COLOURS["second"], 2.0, "second run")
    if not memory.lost:
        primitives |= feature_clouds(state, mark)
        primitives |= model_points(state, mark)
        primitives |= feature_marks(state, FEATURES)
        names = beside(state.feature_means, memory.model.points_mm[:, :2], height)
        primitives |= feature_names(state, FEATURES, names, TITLES)
        primitives["look"] = head.look(COLOURS["estimate"], 3.0, "viewing direction")
        primitives |= pose_axes(state, memory.turn @ memory.model["nose"], AXES_MM)
    if step.frame.target is not None:
        primitives |= _truth(state, step.frame.target, mark)
    primitives |= camera(state, (width, height))
    return Drawing(width, height, primitives, _caption(step, past), (head_world(state, step.frame.target),))


def _truth(state: PoseState, target: Target, size: float) -> dict[str, Primitive]:
    """Draw the head in its true pose, and its features where they truly are."""
    head = PlacedHead(state, target.position, _apart(state, target))
    lines = {**head.lines("true", COLOURS["truth"], 1.0, "truth", few=True)}
    lines["true look"] = head.look(COLOURS["truth"], 1.0, "truth")
    drawn: dict[str, Primitive] = {}
    for name, line in lines.items():
        drawn |= draw_with_rim(name, line)
    return drawn if target.landmarks is None else drawn | true_marks(target.landmarks, size)


def _apart(state: PoseState, target: Target) -> NDArray[np.float64]:
    """Return how far the true head is from the believed one in the picture, (2,) px, where that is known."""
    if target.landmarks is None:
        return np.zeros(2)
    off = target.landmarks.points_px - state.project(state.solid.points_mm, target.position)
    mean: NDArray[np.float64] = off.mean(axis=0)
    return mean


def _caption(step: Step, past: Sequence[Diagnostics]) -> str:
    row, memory = step.diagnostics, step.state.memory
    yaw, pitch, roll = np.rad2deg(gaze(step.state.estimate))
    parts = [f"frame {row.frame}"]
    if memory.lost:
        frames = f"{memory.lost_frames} frame" + ("s" if memory.lost_frames > 1 else "")
        parts.append(f"no face for {frames}, looking for it")
    else:
        parts.append(f"yaw {round(yaw)}°, pitch {round(pitch)}°, roll {round(roll)}°")
        if _is_found_again(row, past):
            parts.append("face found again")
    return " · ".join(filter(None, [*parts, error_words(row, "°"), step.tracker_title]))


def _is_found_again(row: Diagnostics, past: Sequence[Diagnostics]) -> bool:
    """Whether there is a face that was lost a moment ago, and is not lost by the truth, which has the last word."""
    if row.lost:
        return False
    for before in reversed(past[: row.frame]):
        if row.time_s - before.time_s > SAID_FOR_S:
            return False
        if before.searching:
            return True
    return False


def report(rows: Sequence[Diagnostics]) -> Mapping[str, Any]:
    """Say of a whole run how the head turned, how often it was tracked, and how far from the truth, if that is known.

    The errors are those of yaw, pitch and roll after both the estimate and the truth have been taken relative to the
    first frame whose truth is known. A frame counts as tracked if there is a face and it is not known to be lost.
    """
    found = {name: [row.number(f"{name}_deg") for row in rows] for name in ("yaw", "pitch", "roll")}
    said: dict[str, Any] = {f"{name}_deg": values for name, values in found.items()}
    said["tracked_share"] = float(np.mean([not row.is_lost for row in rows]))
    labelled = np.array([row.truth is not None for row in rows])
    said["mean_abs_error_deg"] = None
    if labelled.any():
        errors = {}
        for name, values in found.items():
            truth = np.array([row.number(f"{name}_deg_true") for row in rows])
            off = (np.array(values) - truth)[labelled]
            errors[name] = float(np.abs(np.rad2deg(wrap(np.deg2rad(off - off[0])))).mean())
        said["mean_abs_error_deg"] = errors
    return said


def _is_lost(errors: Any, sizes: Any, parameters: Any) -> Any:  # noqa: ANN401 - one or many, on either model
    del sizes
    return errors > parameters.lost_deg


EXPERIMENT = Experiment(
    id="head",
    title="Pose of a head",
    family="Poses of bodies",
    question="Which way does the driver look, and can one be sure when half of the face is hidden?",
    references=(Citation(BANDO, "chapter 4, section 4: head pose of a driver in a car"),),
    description=(
        "Eleven features of a face are tracked by templates of the first frame, laid onto the surface of a head; the "
        "pose of the head comes from all of them. Each feature's particles come from two predictions, the head's and "
        "its own past, and alpha is the share of the first. On a recording the face is found by itself; its focal "
        "length is not known and taken to be the picture's width. The Rao-Blackwellised filter (RB-PF) is slow: it "
        "compares templates for thousands of particles of all features at once."
    ),
    unit="deg",
    trackers=TRACKERS,
    default_tracker="pf-asd",
    frames=900,
    presets=PRESETS,
    layers=(
        Layer("picture"),
        Layer("head", legend=(Key("estimate", "estimate"),)),
        UNCERTAINTY,
        MEAN_FACE,
        Layer("particles by prediction", legend=BY_PREDICTION),
        Layer("features", legend=(Key("lost", "not recognised"),)),
        Layer("model points"),
        Layer("names", shown=False),
        Layer("viewing direction"),
        Layer("axes"),
        Layer("truth", legend=(Key("truth", "truth"),)),
        SECOND_RUN,
        Layer("camera"),
    ),
    worlds=(HEAD_WORLD,),
    exports=(*EXPORTS, SimulatedHeadParameters.guidance.export),
    guidance=SimulatedHeadParameters.guidance,
    simulate=simulate,
    draw=draw,
    error=mean_error_deg,
    lost=_is_lost,
    measures=POSE_MEASURES,
    on_video=on_video,
    recorded=lambda _kind: RecordedHeadParameters(),
    marks=(FacePoints, FaceBox),
    advice="Left and right are the person's own.",
    finder=FINDER,
    suits=suits,
    truth=POSES,
    scale=float(np.rad2deg(1.0)),
    series=(*pose_series(FEATURES), SHAPE_ERROR),
    measure=head_measure,
    report=report,
    target="face",
    calibration=CALIBRATION,
    loss_probability=LOSS_DECLARATION,
    plots=tuple(
        replace(plot, row_titles=tuple(TITLES[name] for name in FEATURES)) if plot.kind == "features" else plot
        for plot in (*POSE_PLOTS, *GROWTH_PLOTS)
    ),
    clip_about=("sample_count", "face_model", "hidden_weight", "template_renewal", "pose_band", "find_again"),
    readings=(*POSE_READINGS, *GROWTH_READINGS),
    terms=(*POSE_TERMS, *GROWTH_TERMS),
    # How fast may the driver turn, with how few particles?
    example_sweep=ExampleSweep(
        {"speed": (0.5, 1, 2, 3, 4), "sample_count": (10, 20, 50, 200)},
        trackers=("pf-asd", "alpha-1", "alpha-0"),
        trials=2,
        frames=200,
    ),
)
