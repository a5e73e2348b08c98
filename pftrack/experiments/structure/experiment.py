"""The shape of a rigid body that turns, from where its points are seen in each frame (Bando 2007, ch. 4 section 5).

What a tracker sees are tracks, positions of points with the variances of their noise, and no picture. Which shape they
belong to is found frame by frame: by singular values, for which a hidden point counts as much as one that is seen; by
variational Bayes, which knows the noise of each; and by the project's own recursion. `docs/explanation/calibration.md`
has the bands of the shape's points.
"""

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from pftrack.core.arrays import Floats
from pftrack.core.model.band import HALF, MOST, Calibration, FlagBand, Miscalibration
from pftrack.core.model.diagnostics import Diagnostics, Step
from pftrack.core.model.drawing import Drawing, Key, Layer, Picture, Primitive
from pftrack.core.model.glossary import Term, cite
from pftrack.core.model.measures import EvaluatedRun, Measure
from pftrack.core.model.parameters import ParameterError
from pftrack.core.model.plot import ERROR, STEP_TIME, Plot, Reading
from pftrack.core.model.preset import ExampleSweep, read_presets
from pftrack.core.model.setup import Setup
from pftrack.core.model.source import FrameSequence, Truth
from pftrack.experiments.experiment import Experiment, Quality
from pftrack.experiments.shared.sketch import SECOND_RUN, caption, paper
from pftrack.experiments.structure.draw import (
    SERIES,
    SHAPE_WORLD,
    SHARE,
    draw_measurements,
    measure,
    second_in_picture,
    shape_errors,
    shape_in_picture,
    shape_world,
    true_in_picture,
)
from pftrack.experiments.structure.methods import StructureTrackerParameters
from pftrack.experiments.structure.scene import FRAMES, BodyTarget, TracksSceneParameters, TracksSource, named_body
from pftrack.experiments.structure.trackers import TRACKERS, StructureState
from pftrack.experiments.video import Video
from pftrack.sources.tracks.sequence import RecordedTracks, TrackSequence
from pftrack.vision.structure.tracks import FEWEST_POINTS

FAULTS = (
    Miscalibration(("informed", "online", "svd")),
    Miscalibration(("growing",), {"tracked_body": ("prism",)}, {"unseen_noise_px": (100, math.inf)}),
    Miscalibration(
        ("growing",), {"tracked_body": ("prism",)}, {"unseen_noise_px": (0, 30)}, direction="underconfident"
    ),
    Miscalibration(("growing",), {"tracked_body": ("face",)}, direction="underconfident"),
)

CALIBRATION = Calibration(
    bands=(FlagBand("points", {HALF: "within_50", MOST: "within_95"}),),
    faults=FAULTS,
    presets=("person", "burst"),
    scene="body_seed",
)

EQUATION = "Bando, Adaptive sampling method for real-time state estimation in the real world, 2007"
"""Whose the shape error is, eq. 4.19."""

MOST_POINTS = 100
"""Whose common covariance is found in a frame's time."""

FOUND_PERCENT = 5.0
"""Up to this shape error a shape counts as found."""

DEPTH_SEEN = 1.5
"""How far the third direction must stand out from the noise for a shape not to be flat."""


class SimulatedTracksParameters(StructureTrackerParameters, TracksSceneParameters):
    """The simulated body and its trackers."""


def simulate() -> Setup:
    """Wire the simulated body with Bando's values."""
    return Setup(TracksSource, SimulatedTracksParameters(), success=WITHIN.name)


def wire(sequence: FrameSequence, _mark: None, start: int, _truth: Truth | None) -> Setup:
    """Wire a table of tracks, of which nothing needs to be marked and no truth is known.

    Raises:
        ParameterError: They are no tracks, or of too few or too many points.
    """
    if not isinstance(sequence, TrackSequence):
        raise ParameterError("footage", sequence.index.kind, "tracks of a body's points")
    if not FEWEST_POINTS <= len(sequence.names) <= MOST_POINTS:
        bound = f"the tracks of {FEWEST_POINTS} to {MOST_POINTS} points, of which a shape can be made"
        raise ParameterError("footage", len(sequence.names), bound)
    source = RecordedTracks(sequence, named_body(sequence), start)
    return Setup(lambda _seed, _parameters: source, StructureTrackerParameters(), success=WITHIN.name)


def draw(step: Step, past: Sequence[Diagnostics], other: Diagnostics | None = None) -> Drawing:
    """Draw a frame: what is measured, the shape and the truth over it; and the shape in its own world.

    The shape of a second run is laid on this one's and seen as that is: a row holds only the shape.
    """
    del past
    frame, state = step.frame, step.state
    width, height = (round(float(side)) for side in 2.0 * state.principal_px)
    primitives: dict[str, Primitive] = {"picture": Picture(paper(width, height))}
    primitives |= draw_measurements(state, height)
    if isinstance(frame.target, BodyTarget):
        primitives |= true_in_picture(frame.target, height)
    second = None if other is None else np.array(other.estimate).reshape(-1, 3) / SHARE
    if second is not None:
        primitives |= second_in_picture(state, second, height)
    if state.placed.known:
        primitives |= shape_in_picture(state, height)
    return Drawing(width, height, primitives, _caption(step), (shape_world(state, frame.target, second),))


def _caption(step: Step) -> str:
    row, state = step.diagnostics, step.state
    error = "" if row.error is None else f"shape error {row.error:.1f} %"
    return caption(row, step.tracker_title, error, *_remarks(state, row))


def _remarks(state: StructureState, row: Diagnostics) -> list[str]:
    """Say what a person should know who looks at the shape."""
    never = int(np.count_nonzero(state.seen.counts == 0))
    said = [f"{never} never seen"] if never else []
    if state.belief.strength <= DEPTH_SEEN or not state.placed.known:
        said.append("depth not seen yet")
    elif row.number("mirrored") == 1.0:
        said.append("mirror image")
    return said


def _within(course: EvaluatedRun) -> Floats:
    known = ~np.isnan(course.errors)
    return np.where(known, course.errors <= FOUND_PERCENT, np.nan)


def _errors(course: EvaluatedRun) -> Floats:
    return course.errors


WITHIN = Measure(
    "shape_within_5_percent",
    "Shape within 5 % of the truth",
    "Share of the labelled frames whose shape error is at most 5 % of the body's size.",
    "share",
    _within,
    source=EQUATION,
)

MEASURES = (
    WITHIN,
    Measure(
        "frames_to_shape",
        "Frames before the shape is found",
        "Frames before the first labelled one whose shape error is at most 5 %; all frames of the run if none is.",
        "until",
        _within,
        unit="frames",
        better="lower",
        source=EQUATION,
    ),
    Measure(
        "median_shape_error",
        "Median shape error",
        "Median over the labelled frames of the shape error.",
        "median",
        _errors,
        unit="%",
        better="lower",
        source=EQUATION,
    ),
)

PLOTS = (
    ERROR,
    Plot(
        "metric",
        "error as a solid",
        "value",
        "What of the shape is wrong when it may be turned and scaled, but neither skewed nor mirrored.",
        unit="%",
        series=("metric_error",),
    ),
    Plot(
        "depth",
        "depth over its noise",
        "value",
        "How far the least seen direction of the shape stands out from the noise; near 1 it is nothing but noise.",
        series=("depth_strength",),
    ),
    Plot(
        "energy",
        "free energy",
        "value",
        "The lower bound on the log evidence of the window, by which Bando chooses what to publish.",
        series=("free_energy",),
    ),
    Plot(
        "own",
        "weight of the own shape",
        "value",
        "How much of the shape is the body's own; the rest is the mean of other bodies.",
        series=("own_weight",),
    ),
    Plot(
        "pose",
        "pose error",
        "value",
        "By how much the body is believed to be turned otherwise than it is.",
        unit="°",
        series=("turn_error_deg",),
    ),
)

EXPERIMENT = Experiment(
    id="structure",
    title="Shape from motion",
    family="Shapes from motion",
    question="How much must a body turn, and be seen, before its shape is known?",
    references=(
        cite("bando2007", "chapter 4, section 5: factorization with noise, batch and online"),
        cite("tomasi1992"),
    ),
    description=(
        "Points of a rigid body are tracked while it turns, some of them hidden or missing. From where they are seen, "
        "and how far that is to be trusted, its shape is found while one watches, with how sure each point is. What no "
        "frame shows, such as the depth of a body that does not turn, stays unknown."
    ),
    unit="%",
    trackers=TRACKERS,
    frames=FRAMES,
    presets=read_presets(Path(__file__).with_name("presets.yaml")),
    layers=(
        Layer("picture"),
        Layer("trails", shown=True),
        Layer(
            "noise", title="Measurement noise", legend=(Key("observation", "measured, with two standard deviations"),)
        ),
        Layer("points", legend=(Key("hidden", "hidden, where the shape has it"),)),
        Layer("shape", legend=(Key("estimate", "estimate"),)),
        Layer("surface"),
        Layer("names", shown=False),
        Layer("uncertainty"),
        Layer("truth", legend=(Key("truth", "truth"),)),
        Layer("camera", legend=(Key("camera", "from where it is seen"),)),
        SECOND_RUN,
    ),
    worlds=(SHAPE_WORLD,),
    # The window of the online methods is full by then, and has slid on.
    warm_frames=92,
    simulate=simulate,
    video=Video(
        wire,
        footage=("tracks",),
        recorded=lambda _kind: StructureTrackerParameters(),
        wanted="left out: all points are followed",
        advice="All points of the table are followed; nothing needs to be marked.",
        truth=None,
    ),
    draw=draw,
    error=shape_errors,
    measures=MEASURES,
    scale=SHARE,
    series=SERIES,
    quality=Quality(CALIBRATION),
    measure=measure,
    target="body",
    plots=PLOTS,
    readings=(
        Reading("shape error", "error"),
        Reading("as a solid", "value", unit="%", series="metric_error"),
        Reading("depth", "value", series="depth_strength"),
        Reading("own shape", "value", series="own_weight"),
        Reading("measured", "count", series="measured"),
        Reading("yaw", "value", unit="°", series="yaw_deg"),
        Reading("pitch", "value", unit="°", series="pitch_deg"),
        Reading("log evidence", "evidence"),
        STEP_TIME,
    ),
    terms=(
        Term("shape error", "how far the points are from the true body, in percent of its size"),
        Term("as a solid", "the error of the shape once its own proportions are kept: turned, moved and scaled only"),
        Term("depth", "how deep the body is beside the noise; below about 1 its depth is not known"),
        Term("own shape", "how much the points' own shape counts beside what was assumed, 0 to 1"),
        Term("measured", "how many of the points were measured in this frame"),
        Term("yaw", "the turn about the upright axis"),
        Term("pitch", "the turn up or down"),
        Term("free energy", "how well the model explains what was measured, as a bound that learning raises"),
    ),
    # Where what is hidden, and how wildly it is measured, decides which method is worth its cost.
    example_sweep=ExampleSweep(
        {"unseen_noise_px": (2, 10, 30, 100), "missing_share": (0, 0.2, 0.4, 0.6)},
        trackers=("growing", "informed", "online", "svd"),
        trials=3,
        frames=180,
    ),
)
