"""A hand whose pose comes from its silhouette alone, by a beam of hypotheses (Shimada 1997, chapter 2).

Fingers disappear behind the palm within a frame or two, so nothing can be followed from picture to picture. Hands are
made by a model instead and compared with the silhouette, and since which of them is right may show only later, several
are kept.

`docs/explanation/calibration.md` has the bands of finger tips. `python -m tools.loss_probability fit hand` fits the
probability of a loss and writes `loss_probability.json`.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from pftrack.core.arrays import Floats
from pftrack.core.model.band import Calibration, Miscalibration
from pftrack.core.model.diagnostics import Diagnostics, Step
from pftrack.core.model.drawing import Drawing, Key, Layer, Picture, Primitive
from pftrack.core.model.glossary import Term, cite
from pftrack.core.model.plot import ERROR, SAMPLE_SIZE, STEP_TIME, Plot, Reading
from pftrack.core.model.preset import ExampleSweep, read_presets
from pftrack.core.model.series import SeriesValue
from pftrack.core.model.setup import Setup
from pftrack.core.model.source import Frame, Target
from pftrack.experiments.experiment import Experiment, Quality
from pftrack.experiments.hand import draw as sketch
from pftrack.experiments.hand import recording
from pftrack.experiments.hand.draw import HAND_WORLD, hand_world
from pftrack.experiments.hand.parameters import HandTrackerParameters
from pftrack.experiments.hand.recording import FINDER, HandTips, RecordedHandParameters, suits, wire
from pftrack.experiments.hand.scene import HandSceneParameters, HandSource, HandTarget
from pftrack.experiments.hand.state import HandState
from pftrack.experiments.hand.trackers import TRACKERS, features
from pftrack.experiments.shared.loss_probability import Scenes, read_declaration
from pftrack.experiments.shared.sketch import SECOND_RUN, caption
from pftrack.experiments.video import Video

FAULTS = (Miscalibration(("beam", "particles")),)

CALIBRATION = Calibration(faults=FAULTS, presets=("wrist", "bend"))

SCENES = Scenes(
    {"speed": (0.5, 3.0), "turn_deg": (-30.0, 30.0), "proportions": (0.0, 0.1), "edge_noise_px": (0.0, 2.0)},
    {"motion": ("wrist", "bend", "occlusion"), "occlusion_width_px": (0.0, 0.0, 20.0, 40.0)},
    frames=30,
    fitted=140,
    judged=80,
)
"""All motions, slow and fast, of hands of several proportions, some behind a pillar."""

LOSS_DECLARATION = read_declaration(Path(__file__).with_name("loss_probability.json"), TRACKERS, SCENES)

SCENE = ("motion",)

PRESETS = read_presets(Path(__file__).with_name("presets.yaml"))

LOST_PALMS = 0.65
"""Mean distance of the tips in space from which on a hand counts as lost, palm axes."""


class SimulatedHandParameters(HandTrackerParameters, HandSceneParameters):
    """The simulated hand and its trackers."""


def simulate() -> Setup:
    """Wire the simulated hand."""
    return Setup(HandSource, SimulatedHandParameters())


def draw(step: Step, past: Sequence[Diagnostics], other: Diagnostics | None = None) -> Drawing:
    """Draw a frame: what is seen, the hand that is chosen, the others as ghosts; the hand in space beside it."""
    del past
    image, state = step.frame.picture, step.state
    height, width, _ = image.shape
    shown = min(step.parameters.shown_hypothesis, len(state.beam)) - 1
    primitives: dict[str, Primitive] = {"picture": Picture(image)}
    primitives |= sketch.draw_silhouette(features(step.frame, step.parameters))
    primitives |= sketch.ghosts(state, shown, (width, height))
    primitives |= sketch.hand(state, shown, (width, height))
    if isinstance(step.frame.target, HandTarget):
        primitives |= sketch.truth(step.frame.target)
    if other is not None:
        primitives |= sketch.second_run(other.estimate, 0.1 * state.scale)
    return Drawing(width, height, primitives, _caption(step, shown), (hand_world(state, shown, step.frame.target),))


def measure(frame: Frame, state: HandState) -> Mapping[str, SeriesValue]:
    """Return how near to the truth a frame's hands are, where that is known, and what there is to say of it."""
    return {**recording.measure(frame, state), **recording.flags(state)}


def _caption(step: Step, shown: int) -> str:
    row, state = step.diagnostics, step.state
    parts = [step.tracker_title]
    count = len(state.beam)
    if state.searching:
        parts.append("waiting; grey: the hand seen last")
    elif count > 1:
        parts.append(f"hand {shown + 1} of {count}, {100 * state.beam.weights[shown]:.0f} %")
    if row.error is not None and isinstance(step.frame.target, HandTarget):
        tips, target = state.tips[shown], step.frame.target
        off = float(_distance(tips, target.position))
        parts.append(f"tips off by {off:.0f} px" + (", lost (by truth)" if _too_far(tips, target) else ""))
    return caption(row, *parts, recording.describe(state))


def _distance(estimates: Floats, truths: Floats) -> Any:  # noqa: ANN401 - one or many
    """Return the mean distance of the five tips (..., 15) in space, px."""
    off = (estimates - truths).reshape(*np.shape(estimates)[:-1], 5, 3)
    return np.sqrt(np.square(off).sum(axis=-1)).mean(axis=-1)


def is_missed(state: HandState, target: Target) -> bool:
    """Return whether the tips are too far from the true ones in space, for a hand of this size."""
    if not isinstance(target, HandTarget):
        return False
    return _too_far(state.estimate, target)


def _too_far(tips: Floats, target: HandTarget) -> bool:
    return not _distance(tips, target.position) <= LOST_PALMS * target.scale


EXPERIMENT = Experiment(
    id="hand",
    title="Pose of a hand",
    family="Poses of bodies",
    question="What does a hand do whose silhouette is all that one sees?",
    references=(cite("shimada1997", "chapter 2"),),
    description=(
        "A hand of sixteen parts and 23 angles is followed by its silhouette. Palms and fingers are tried around what "
        "is expected, and the best hands that differ are kept, each with the one it comes from: what is ambiguous now "
        "is often decided a few frames later. A particle filter with the same likelihood is there to compare."
    ),
    unit="px",
    trackers=TRACKERS,
    frames=30,
    presets=PRESETS,
    layers=(
        Layer("picture"),
        Layer("silhouette", legend=(Key("observation", "silhouette"),)),
        Layer("protrusions", legend=(Key("second", "protrusions and wrist"),)),
        Layer("other hands", legend=(Key("prediction", "other hands, by weight"),)),
        Layer("hand", legend=(Key("estimate", "hand"),)),
        Layer("fingers", shown=False),
        Layer("truth", legend=(Key("truth", "truth"),)),
        SECOND_RUN,
    ),
    worlds=(HAND_WORLD,),
    quality=Quality(CALIBRATION, LOSS_DECLARATION),
    simulate=simulate,
    draw=draw,
    error=_distance,
    missed=is_missed,
    video=Video(
        wire,
        recorded=lambda _kind: RecordedHandParameters(),
        marks=(HandTips,),
        wanted="the tips of the fingers",
        advice=(
            "Film the whole hand with all five fingers spread, the palm towards the camera and the arm leaving the "
            "picture on one side. A plain background works best, much darker or lighter than the skin or of another "
            "colour. Before a patterned one the camera has to stand still, and the hand to move or to come in later."
        ),
        finder=FINDER,
        suits=suits,
        truth=None,
    ),
    series=(*recording.SERIES, *recording.SILHOUETTE_SERIES),
    measure=measure,
    report=recording.report,
    target="hand",
    plots=(
        ERROR,
        Plot(
            "hands",
            "kept hands",
            "tree",
            "The hands that are kept, the best in the first row, and from which of the frame before each comes.",
            series=("hands",),
            shown="shown_hypothesis",
        ),
        Plot(
            "right",
            "right so far",
            "frequency",
            "How often the best hand was right up to each frame, and how often any that is kept was.",
            series=("best_right", "any_right"),
            levels=(1.0, 1.0),
            needs_truth=True,
        ),
        Plot(
            "tilt",
            "tilt",
            "hypotheses",
            "Angle b by which each kept hand is turned about the forearm, and the true one.",
            "rad",
            ("hands",),
            component=3,
            truth="true_tilt",
        ),
        Plot(
            "difference",
            "silhouette that differs",
            "value",
            "Share of the silhouette's area by which that of the best hand differs from it.",
            "%",
            ("difference",),
        ),
        SAMPLE_SIZE,
    ),
    readings=(
        Reading("error", "error"),
        Reading("silhouette differs", "value", "%", "difference"),
        Reading("protrusions", "value", "", "protrusions"),
        Reading("log evidence", "evidence"),
        STEP_TIME,
    ),
    terms=(
        Term("silhouette", "the outline of the hand in the picture, filled"),
        Term("protrusions", "how many fingers stick out of the silhouette"),
        Term("kept hands", "how many poses of the hand are kept at once, the most probable ones"),
    ),
    example_sweep=ExampleSweep(
        {"edge_noise_px": (0.0, 0.6, 1.2, 2.0, 3.0), "beam_width": (1, 2, 4, 8)},
        trackers=("beam",),
        trials=2,
        frames=24,
    ),
    warm_frames=3,
)
