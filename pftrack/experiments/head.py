"""A driver's head, simulated or on any recording: its pose by eleven features (document 1, ch. 4 section 4).

A feature that turns away or is covered no longer looks like its template; where it should be is then known only from
the pose of the head, which is known from the other features. The adaptive sampling distribution learns for each feature
how far to trust which.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from pftrack.diagnostics import Diagnostics, Series
from pftrack.drawing import COLOURS, Drawing, Picture, Primitive
from pftrack.experiments.experiment import Experiment, Preset, Setup, Step
from pftrack.experiments.head_recording import on_video
from pftrack.experiments.head_sketch import head_surface, look
from pftrack.experiments.head_start import FINDER
from pftrack.experiments.pose_series import POSE_PLOTS, POSE_READINGS, mean_error_deg, pose_series
from pftrack.experiments.pose_sketch import feature_clouds, feature_marks, pose_axes, true_marks
from pftrack.frame import Frame
from pftrack.geometry.face_model import FEATURES
from pftrack.geometry.gaze import gaze
from pftrack.geometry.rotation import wrapped
from pftrack.sources.head import HeadSceneParameters, HeadSource
from pftrack.sources.truth import POSES
from pftrack.trackers.head import TRACKERS
from pftrack.trackers.head_memory import HeadMemory
from pftrack.trackers.head_parameters import HeadTrackerParameters
from pftrack.trackers.pose_state import PoseState

__all__ = ["EXPERIMENT", "SimulatedHeadParameters"]


class SimulatedHeadParameters(HeadTrackerParameters, HeadSceneParameters):
    """The simulated driver and its trackers."""


def simulate() -> Setup:
    """Wire the simulated driver with the document's values."""
    return Setup(HeadSource, SimulatedHeadParameters(), {"kind": "simulated"})


def draw(step: Step, past: Sequence[Diagnostics]) -> Drawing:
    """Draw a frame: picture, particles, features, the head over the face, where it looks and truly looks."""
    del past
    image, state = step.frame.image_rgb, step.state
    memory: HeadMemory = state.memory
    if image is None:
        raise ValueError("a head is drawn on a picture, got a frame without one")
    height, width, _ = image.shape
    mark = max(width, height) / 200.0
    primitives: dict[str, Primitive] = {"picture": Picture(image)}
    colour = COLOURS["lost"] if memory.lost else COLOURS["estimate"]
    primitives |= head_surface(state, memory, colour)
    if not memory.lost:
        primitives |= feature_clouds(state, mark)
        primitives |= feature_marks(state, FEATURES, mark)
    target = step.frame.target
    if target is not None:
        if target.landmarks is not None:
            primitives |= true_marks(target.landmarks, mark)
        primitives["true look"] = look(state, memory, target.position, COLOURS["truth"], "truth")
    primitives["look"] = look(state, memory, state.estimate, colour, "viewing direction")
    primitives |= pose_axes(state, memory.turn @ memory.model["nose"], 0.35 * memory.box[2])
    return Drawing(width, height, primitives, _caption(step))


def _caption(step: Step) -> str:
    row, memory = step.diagnostics, step.state.memory
    yaw, pitch, roll = np.rad2deg(gaze(step.state.estimate))
    parts = [f"frame {row.frame}"]
    if memory.lost:
        parts.append(f"no face for {memory.lost_frames} frames")
    else:
        parts.append(f"yaw {round(yaw)}°, pitch {round(pitch)}°, roll {round(roll)}°")
    if row.error is not None:
        parts.append(f"error {row.error:.1f}°" + (", lost" if row.lost else ""))
    return " · ".join([*parts, TRACKERS[step.tracker].title])


def series(frame: Frame, state: PoseState) -> Mapping[str, Series]:
    """Return the series of a pose, and how well the features are recognised, and whether there is a face."""
    memory: HeadMemory = state.memory
    return {
        **pose_series(frame, state),
        "correlation": tuple(memory.correlations.tolist()),
        "face": 0.0 if memory.lost else 1.0,
    }


def report(rows: Sequence[Diagnostics]) -> Mapping[str, Any]:
    """Say of a whole run how the head turned, how often it was tracked, and how far from the truth, if that is known.

    The errors are those of yaw, pitch and roll after both the estimate and the truth have been taken relative to the
    first frame whose truth is known. A frame counts as tracked if there is a face and it is not known to be lost.
    """
    found = {name: [row.series[f"{name}_deg"] for row in rows] for name in ("yaw", "pitch", "roll")}
    said: dict[str, Any] = {f"{name}_deg": values for name, values in found.items()}
    said["tracked_share"] = float(np.mean([row.series["face"] == 1.0 and not row.lost for row in rows]))
    labelled = np.array([row.truth is not None for row in rows])
    said["mean_abs_error_deg"] = None
    if labelled.any():
        errors = {}
        for name, values in found.items():
            truth = np.array([row.series[f"{name}_deg_true"] for row in rows])
            off = (np.array(values) - truth)[labelled]
            errors[name] = float(np.abs(np.rad2deg(wrapped(np.deg2rad(off - off[0])))).mean())
        said["mean_abs_error_deg"] = errors
    return said


def _lost(errors: Any, sizes: Any, parameters: Any) -> Any:  # noqa: ANN401 - one or many, on either model
    del sizes
    return errors > parameters.lost_deg


EXPERIMENT = Experiment(
    id="head",
    title="Pose of a head",
    question="Which way does the driver look, and can one be sure when half of the face is hidden?",
    document="Adaptive sampling distribution, document 1, chapter 4",
    description=(
        "Eleven features of a face are tracked by templates of the first frame; the pose of the head comes from all of "
        "them. Each feature's particles come from two predictions, the head's and its own past, and alpha is the share "
        "of the first. On a recording the face is found by itself; its focal length is not known and taken to be the "
        "picture's width. The Rao-Blackwellised filter (RB-PF) is slow: it compares templates for thousands of "
        "particles of all features at once."
    ),
    unit="deg",
    trackers=TRACKERS,
    default_tracker="pf-asd",
    frames=900,
    presets=(
        Preset("works", "works", "pf-asd"),
        Preset("personal", "works: the driver's own face model", "pf-asd", {"face_model": "personal"}),
        Preset("sunglasses", "works: sunglasses", "pf-asd", {"sunglasses": True}),
        Preset("faster", "works: a faster head", "pf-asd", {"speed": 2}),
        Preset("solid", "breaks: a faster head, solid only", "alpha-1", {"speed": 2}),
        Preset("features", "worse: a faster head, features only", "alpha-0", {"speed": 2}),
        Preset("few", "breaks: too few particles", "pf-asd", {"sample_count": 8}),
    ),
    layers={
        "picture": True,
        "head": True,
        "particles by prediction": True,
        "features": True,
        "names": False,
        "viewing direction": True,
        "axes": True,
        "truth": True,
    },
    simulate=simulate,
    draw=draw,
    error=mean_error_deg,
    lost=_lost,
    on_video=on_video,
    finder=FINDER,
    truth=POSES,
    scale=float(np.rad2deg(1.0)),
    series=series,
    report=report,
    features=FEATURES,
    target="face",
    plots=POSE_PLOTS,
    readings=POSE_READINGS,
)
