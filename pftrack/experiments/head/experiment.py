"""A driver's head, simulated or on any recording: its pose by eleven features (Bando 2007, ch. 4 section 4).

A feature that turns away or is covered no longer looks like its template; where it should be is then known only from
the pose of the head, which is known from the other features. The adaptive sampling distribution learns for each feature
how far to trust which.

`docs/explanation/calibration.md` has the bands of the pose. `python -m tools.loss_probability fit head` fits the
probability of a loss and writes `loss_probability.json`.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from pftrack.core.arrays import Floats
from pftrack.core.geometry.rotation import rotation
from pftrack.core.model.band import Calibration, Miscalibration
from pftrack.core.model.diagnostics import Diagnostics, Step
from pftrack.core.model.drawing import (
    Arrows,
    Axes,
    Drawing,
    Ellipsoids,
    Key,
    Layer,
    Links,
    Mesh,
    Picture,
    Primitive,
    Text,
    Viewpoint,
    World,
    WorldDrawing,
)
from pftrack.core.model.glossary import cite
from pftrack.core.model.measures import POSE_MEASURES
from pftrack.core.model.palette import COLOURS, Colour
from pftrack.core.model.preset import ExampleSweep, read_presets
from pftrack.core.model.setup import Setup
from pftrack.core.model.source import Target
from pftrack.core.numerics.elementary import wrap
from pftrack.experiments.experiment import Experiment, Quality
from pftrack.experiments.head.appearance import HeadMemory
from pftrack.experiments.head.draw import (
    EXPORTS,
    GROWTH_PLOTS,
    GROWTH_READINGS,
    GROWTH_TERMS,
    MASK_OPACITY,
    MEAN_FACE,
    SHAPE_ERROR,
    UNCERTAINTY,
    PlacedHead,
    draw_grown_face,
    front,
    head_measure,
    surface_colours,
)
from pftrack.experiments.head.parameters import HeadTrackerParameters
from pftrack.experiments.head.recording import (
    FINDER,
    POSES,
    FaceBox,
    FacePoints,
    RecordedHeadParameters,
    suits,
    wire,
)
from pftrack.experiments.head.scene import HeadSource
from pftrack.experiments.head.scene_parameters import HeadSceneParameters
from pftrack.experiments.head.trackers import TRACKERS
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
    draw_with_rim,
    feature_clouds,
    feature_marks,
    feature_names,
    mean_error_deg,
    model_points,
    pose_axes,
    pose_series,
    true_marks,
)
from pftrack.experiments.shared.pose.state import PoseState
from pftrack.experiments.shared.sketch import SECOND_RUN, caption, dots, error_words
from pftrack.experiments.video import Video
from pftrack.vision.geometry.face import FEATURES, LINKS, TITLES, FaceModel, gaze

FAULTS = (
    PUBLISHED,
    Miscalibration(("rb-pf",)),
)

CALIBRATION = Calibration(bands=BANDS, faults=FAULTS, presets=("personal", "mean"), scene="person", frames=60)

SCENES = Scenes(
    {
        "person": (0, 9999),
        "speed": (0.5, 4.0),
        "amplitude": (0.7, 1.5),
        "sun_strength": (0.0, 0.8),
        "image_noise_sd": (0.0, 20.0),
        "pillar_width_px": (0.0, 80.0),
        "pillar_offset_px": (-150.0, 150.0),
    },
    {
        "sample_count": (5, 10, 20, 50),
        "templates": ("relief", "flat"),
        "sunglasses": (False, False, True),
        "image_width_px": (320,),
    },
    frames=80,
    fitted=70,
    judged=40,
    trackers=("pf-asd",),
)
"""Drivers of all faces, who turn slowly and fast, with sunglasses and without, past a pillar, with few particles and
more. The Rao-Blackwellised filter is slow, and is left out."""

SIGNALS = ("correlation", "track_sd_px", "feature_sd_px")
"""How well features fit their templates, and how widely they are spread."""

LOSS_DECLARATION = read_declaration(Path(__file__).with_name("loss_probability.json"), TRACKERS, SCENES, SIGNALS)

PRESETS = read_presets(Path(__file__).with_name("presets.yaml"))
"""The first is the default; those of Bando 2007 come last."""

# The world of the head, in mm in the head's own frame and at rest while the picture's head turns, shows what the
# tracker assumes of the head, where in it each feature is seen in this frame, and from where the camera looks at it. A
# feature is known across the camera's line of sight only, so its uncertainty is a disc that faces the camera, at the
# depth of the model's point.

RADIUS_MM = 130.0
POINT_MM = 4.5
AXES_MM = 50.0
NAMES_AT = 1.15
"""Where the name of an axis stands, in lengths of the axis."""
ARROW_MM = (62.0, 98.0)
"""How far from the head's origin the arrow towards the camera begins and ends: clear of the face."""
NAME_ABOVE_MM = 11.0
"""How far above the end of the arrow its name stands."""
TRUE_ARROW_MM = (62.0, 90.0)
LARGEST_SD_MM = RADIUS_MM / 2.0
"""Of where a feature is seen: two of a larger one reach beyond the world, and would hide all of it."""

HEAD_WORLD = World(
    "head",
    "Head model",
    "mm",
    RADIUS_MM,
    middle=(0.0, 8.0, 20.0),
    up=(0.0, -1.0, 0.0),
    front=(0.0, 0.0, -1.0),
    viewpoints=(
        Viewpoint("3-d", "3-D", -35.0, 15.0),
        Viewpoint("front", "Front", 0.0, 0.0),
        Viewpoint("side", "Side", -80.0, 0.0),
        Viewpoint("top", "Top", 0.0, 90.0),
    ),
)


def head_world(state: PoseState, target: Target | None) -> WorldDrawing:
    """Draw the head's model, where its features are seen, and the way to the camera; the true way where it is known."""
    memory: HeadMemory = state.memory
    colour = COLOURS["lost" if memory.lost else "estimate"]
    turn = rotation(state.estimate) @ memory.turn
    drawn: dict[str, Primitive] = {**_surface(memory.model, colour), **_axes()}
    if memory.growth is not None and not memory.lost:
        drawn |= draw_grown_face(memory.growth, memory.model)
    if not memory.lost:
        drawn["features"] = _features(state, turn)
    if target is not None:
        drawn["true camera"] = _arrow(state, rotation(target.position) @ memory.turn, TRUE_ARROW_MM, "truth", "truth")
    drawn["camera"] = arrow = _arrow(state, turn, ARROW_MM, "camera", "camera")
    name_at = arrow.segments[0, 1] + np.float32(NAME_ABOVE_MM) * np.array(HEAD_WORLD.up, np.float32)
    drawn["camera name"] = Text(name_at, "camera", COLOURS["camera"], "camera", anchor="middle")
    return WorldDrawing(HEAD_WORLD, drawn)


def _surface(model: FaceModel, colour: Colour) -> dict[str, Primitive]:
    shape = front(model)
    vertices = shape.vertices_mm.astype(np.float32)
    points = model.points_mm.astype(np.float32)
    pairs = [(model.names.index(one), model.names.index(other)) for one, other in LINKS]
    return {
        "surface": Mesh(vertices, shape.triangles, colour, 0.22, "head"),
        "lines": Links(vertices[shape.edges], COLOURS["hidden"], 0.5, "head"),
        "face": Links(points[np.array(pairs)], colour, 1.5, "model points"),
        "points": dots(points, colour, POINT_MM, "model points"),
    }


def _axes() -> dict[str, Primitive]:
    colour = COLOURS["hidden"]
    axes = np.eye(3, dtype=np.float32)
    drawn: dict[str, Primitive] = {"axes": Axes(np.zeros(3, np.float32), axes, AXES_MM, colour, 1.5, "axes")}
    for name, axis in zip("xyz", axes, strict=True):
        drawn[f"axis {name}"] = Text(np.float32(NAMES_AT * AXES_MM) * axis, name, colour, "axes", anchor="middle")
    return drawn


def _features(state: PoseState, turn: Floats) -> Ellipsoids:
    """Draw where the features are seen, at the depths of the model's points, with two standard deviations."""
    memory: HeadMemory = state.memory
    model = memory.model.points_mm
    mm_per_px = (model @ turn[2] + state.translation_mm[2]) / state.solid.focal_px
    off = np.zeros_like(model)
    off[:, :2] = mm_per_px[:, None] * (state.feature_means - state.project(state.solid.points_mm))
    spread = np.zeros((len(model), 3, 3))
    spread[:, :2, :2] = mm_per_px[:, None, None] ** 2 * state.feature_covariances
    centres = model + off @ turn
    near = np.linalg.norm(centres - HEAD_WORLD.middle, axis=1) < RADIUS_MM
    near &= np.sqrt(np.trace(spread, axis1=1, axis2=2)) < LARGEST_SD_MM
    colours = np.where(state.recognised[:, None], COLOURS["observation"], COLOURS["lost"]).astype(np.uint8)
    return Ellipsoids(
        centres[near].astype(np.float32),
        (turn.T @ spread @ turn)[near].astype(np.float32),
        colours[near],
        0.35,
        "features",
    )


def _arrow(state: PoseState, turn: Floats, reach_mm: tuple[float, float], colour: str, layer: str) -> Arrows:
    """Draw an arrow from before the face towards the camera, for a head that is turned so."""
    way = _to_camera(state) @ turn
    ends = np.outer(reach_mm, way / np.linalg.norm(way))
    return Arrows(ends[None].astype(np.float32), COLOURS[colour], 3.0, layer)


def _to_camera(state: PoseState) -> Floats:
    """Return the direction (3,) to the camera, in the camera's frame: an affine one sees along parallels."""
    place = state.belief.place_mm
    if place is not None:
        return -place
    along: Floats = np.cross(state.solid.reference[0, :3], state.solid.reference[1, :3])
    return -along if along[2] > 0.0 else along


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
    image, state = step.frame.picture, step.state
    memory: HeadMemory = state.memory
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


def _apart(state: PoseState, target: Target) -> Floats:
    """Return how far the true head is from the believed one in the picture, (2,) px, where that is known."""
    if target.landmarks is None:
        return np.zeros(2)
    off = target.landmarks.points_px - state.project(state.solid.points_mm, target.position)
    mean: Floats = off.mean(axis=0)
    return mean


def _caption(step: Step, past: Sequence[Diagnostics]) -> str:
    row, memory = step.diagnostics, step.state.memory
    yaw, pitch, roll = np.rad2deg(gaze(step.state.estimate))
    parts = []
    if memory.lost:
        frames = f"{memory.lost_frames} frame" + ("s" if memory.lost_frames > 1 else "")
        parts.append(f"no face for {frames}, looking for it")
    else:
        parts.append(f"yaw {round(yaw)}°, pitch {round(pitch)}°, roll {round(roll)}°")
        if _is_found_again(row, past):
            parts.append("face found again")
    return caption(row, *parts, error_words(row, "°"), step.tracker_title)


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
    references=(cite("bando2007", "chapter 4, section 4: head pose of a driver in a car"),),
    description=(
        "Eleven features of a face are tracked by templates of the first frame, laid onto the surface of a head; the "
        "pose of the head comes from all of them. Each feature's particles come from two predictions, the head's and "
        "its own past, and alpha is the share of the first. On a recording the face is found by itself; its focal "
        "length is not known and taken to be the picture's width. The Rao-Blackwellised filter (RB-PF) is slow: it "
        "compares templates for thousands of particles of all features at once."
    ),
    unit="deg",
    trackers=TRACKERS,
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
    video=Video(
        wire,
        recorded=lambda _kind: RecordedHeadParameters(),
        marks=(FacePoints, FaceBox),
        wanted="features of a face, or a box around it",
        advice="Left and right are the person's own.",
        finder=FINDER,
        suits=suits,
        truth=POSES,
        clip_about=("sample_count", "face_model", "hidden_weight", "template_renewal", "pose_band", "find_again"),
    ),
    scale=float(np.rad2deg(1.0)),
    series=(*pose_series(FEATURES), SHAPE_ERROR),
    measure=head_measure,
    report=report,
    target="face",
    quality=Quality(CALIBRATION, LOSS_DECLARATION),
    plots=tuple(
        replace(plot, row_titles=tuple(TITLES[name] for name in FEATURES)) if plot.kind == "features" else plot
        for plot in (*POSE_PLOTS, *GROWTH_PLOTS)
    ),
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
