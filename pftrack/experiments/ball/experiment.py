"""Switching particle filters on a ball behind an occluder, among look-alikes (Bando 2007, ch. 3).

Bando's question: when the target is hidden, is it better to trust the prediction, the observation, or to switch between
them? The scene is simulated, or any recording with a box that the user has drawn around the target.
"""

from collections.abc import Sequence
from functools import partial
from pathlib import Path

import numpy as np

from pftrack.core.model.drawing import COLOURS, Drawing, Polyline
from pftrack.core.model.marks import Box
from pftrack.core.model.measures import PICTURE_MEASURES
from pftrack.core.model.parameters import revise
from pftrack.core.model.setup import Setup
from pftrack.core.model.source import FrameSequence, Truth
from pftrack.core.model.tracker import Diagnostics, Step
from pftrack.experiments.ball import model
from pftrack.experiments.ball.scene import BallSceneParameters, BallSource, look_beside, suits
from pftrack.experiments.declared import read_words
from pftrack.experiments.experiment import Experiment, Judge, Measured, Video
from pftrack.experiments.shared import sketch
from pftrack.experiments.shared.recording import RecordingParameters, RecordingSource
from pftrack.experiments.shared.reports import JudgedByBox
from pftrack.filters.dynamics import smooth
from pftrack.vision.likelihoods import chromaticity

FOLDER = Path(__file__).parent


class SimulatedBallParameters(model.ScoringParameters, model.BallTrackerParameters, BallSceneParameters):
    """The simulated scene and its trackers."""


class RecordedBallParameters(JudgedByBox, RecordingParameters, model.BallTrackerParameters):
    """A recording with an overlay, and its trackers."""


def simulate() -> Setup:
    """Wire the simulated scene with Bando's values."""
    return Setup(BallSource, SimulatedBallParameters())


def wire(sequence: FrameSequence, mark: Box, start: int, truth: Truth | None) -> Setup:
    """Wire a recording: the colour is fitted to the box, and lengths are scaled to it.

    Real targets turn and stop, so velocity is kept for a few frames only; otherwise the particles of a hidden target
    fly out of the picture and do not see it return. Real backgrounds differ more from the target than Bando's
    grey does, so the background level is lower. Both are starting values: every parameter is live.

    Args:
        sequence: The pictures.
        mark: A box around the target in the picture `start`.
        start: Number of the picture to start at.
        truth: True boxes by number of the picture, where they are known.

    Raises:
        ValueError: The box is black.
    """
    box = mark.corner_and_size
    colour = chromaticity.fit(sequence.picture(start), box)
    radius = min(max(box[2], box[3]) / 2, 200.0)
    parameters = revise(
        RecordedBallParameters(),
        {
            "sample_count": 2000,
            "velocity_retention": 0.8,
            "background_level": 0.02,
            "gamma_px": radius,
            "gamma_min_px": 0.8 * radius,
            "gamma_max_px": 4 * radius,
            "process_noise_px": max(0.4 * radius, 0.5),
            "large_process_noise_px": max(radius, 1.0),
            "diffusion_scale": 2.0,  # the built-in motion was learned from its own ball
            "colour_model": "chromaticity",
            "target_red_share": colour.mean[0],
            "target_green_share": colour.mean[1],
            "red_spread": colour.spread[0],
            "green_spread": colour.spread[1],
            "distracter_colour": chromaticity.median_colour(sequence.picture(start), box),
        },
    )

    source = RecordingSource(sequence, box, start, truth.at if truth else None)
    look = partial(look_beside, size_px=box[2:])
    return Setup(lambda _seed, _parameters: source, parameters, success="inside_share", beside=look)


def draw(step: Step, past: Sequence[Diagnostics], other: Diagnostics | None = None) -> Drawing:
    """Draw a point that is followed, the region of success, and the path so far, true, estimated and smoothed."""
    state, row, target = step.state, step.diagnostics, step.frame.target
    path = past[max(row.frame - sketch.PAST_FRAMES, 0) : row.frame + 1]
    height, width, _ = step.frame.picture.shape
    primitives = sketch.draw_point(step, other, step.parameters.gamma_px)
    if target is not None:
        primitives["gate"] = sketch.success_region(target, step.parameters)
    primitives |= sketch.paths(path, np.array([past_row.estimate for past_row in path]), (width, height))
    known = [past_row for past_row in path if past_row.truth]
    if known:
        depths = sketch.behind(row.frame - np.array([past_row.frame for past_row in known]), max(width, height))
        truths = sketch.at_height(np.array([past_row.truth for past_row in known]), depths)
        primitives["true space-time"] = Polyline(truths, COLOURS["truth"], 3.0, sketch.THROUGH_TIME)
    if state.lineage is not None and state.particles is not None:
        lineage, last = state.lineage, len(state.lineage.paths)
        recalled = np.array([smooth(lineage, state.particles, age) for age in range(last)])
        primitives["smoothed"] = Polyline(sketch.at_height(recalled, 2.0), COLOURS["second"], 2.0, "smoothed path")
    return Drawing(width, height, primitives, _caption(step), grip=sketch.at_height(state.estimate, 2.0))


def _caption(step: Step) -> str:
    row = step.diagnostics
    learned = (
        step.tracker in model.GUIDED_TRACKERS and f"learned from {model.GUIDANCE.parse(step.parameters.learned).origin}"
    )
    samples = row.vector("samples")
    drawn = "{:g} by prediction, {:g} by observation".format(*samples) if samples is not None else ""
    return sketch.caption(row, step.tracker_title, learned or "", drawn, sketch.error_words(row, " px"))


EXPERIMENT = Experiment(
    **read_words(FOLDER, model.TRACKERS, measured=Measured(measures=PICTURE_MEASURES)),
    id="ball",
    model=model.COLOURED,
    simulate=simulate,
    video=Video(
        wire,
        recorded=lambda _kind: RecordedBallParameters(),
        marks=(Box,),
        wanted="a box around the target, which is tracked by its colour",
        suits=suits,
        clip_title="Colour blob",
        clip_about=("sample_count", "gamma_px", "process_noise_px", "background_level", "colour_model"),
    ),
    draw=draw,
    judge=Judge(sketch.distance, "px", lambda errors, sizes, parameters: errors > parameters.lost_radii * sizes / 2),
    exports=(model.GUIDANCE.export,),
    guidance=model.GUIDANCE,
)
