"""A fish that bends as it turns, followed by guided diffusion (Mitsugami et al. 2009).

A filter that perturbs every number of its state by itself spends most particles on motions that no fish makes. Their
method learns offline how motion and shape change together, and guides the particles by that: fewer do as well.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from pftrack.core.model.diagnostics import Diagnostics, Step
from pftrack.core.model.drawing import Drawing, Key, Layer, Picture, Primitive
from pftrack.core.model.glossary import Term, cite
from pftrack.core.model.measures import PICTURE_MEASURES
from pftrack.core.model.palette import COLOURS
from pftrack.core.model.plot import ERROR, PARTICLES, SAMPLE_SIZE, SIGMA, STEP_TIME, Plot, Reading
from pftrack.core.model.preset import ExampleSweep, read_presets
from pftrack.core.model.series import Series, SeriesValue
from pftrack.core.model.setup import Setup
from pftrack.core.model.source import Frame, Target
from pftrack.experiments.experiment import Experiment, Quality
from pftrack.experiments.fish.draw import (
    CHANGES_WORLD,
    MODES_WORLD,
    changes_world,
    draw_edges,
    draw_particles,
    draw_path,
    draw_truth,
    fish,
    modes_world,
)
from pftrack.experiments.fish.model import FishState, find_edges, shape
from pftrack.experiments.fish.parameters import GUIDANCE, FishTrackerParameters
from pftrack.experiments.fish.quality import CALIBRATION, LOSS_DECLARATION
from pftrack.experiments.fish.recording import FishBody, RecordedFishParameters, suits, wire
from pftrack.experiments.fish.scene import FishSceneParameters, FishSource, FishTarget
from pftrack.experiments.fish.swimming import FRAMES
from pftrack.experiments.fish.trackers import TRACKERS
from pftrack.experiments.shared.sketch import SECOND_RUN, caption, distance, error_words
from pftrack.experiments.video import Video

SERIES = (
    Series("heading_error", "error of the heading", "°"),
    Series("bend_error", "error of the bend", "°"),
    Series("true_heading", "true heading", "°"),
    Series("true_bend", "true bend", "°"),
)

PLOTS = (
    ERROR,
    Plot("bend", "bend of the tail", "band", "How the tail bends.", "°", ("bend",), "bend_sd", "true_bend"),
    Plot(
        "heading",
        "heading",
        "band",
        "Where the head points, within half a turn.",
        "°",
        ("heading",),
        "heading_sd",
        "true_heading",
    ),
    Plot(
        "heading_error",
        "error of the heading",
        "value",
        "How far the heading is off; near 180 the model has turned head to tail.",
        "°",
        ("heading_error",),
        needs_truth=True,
    ),
    Plot(
        "bend_error", "error of the bend", "value", "How far the bend is off.", "°", ("bend_error",), needs_truth=True
    ),
    Plot(
        "d_max",
        "farthest point from an edge",
        "value",
        "How far the worst point of the best particle's outline is from an edge.",
        "px",
        ("d_max",),
    ),
    SAMPLE_SIZE,
    SIGMA,
)

READINGS = (
    Reading("estimate", "estimate"),
    Reading("error", "error"),
    Reading("heading", "value", "°", "heading", "heading_sd"),
    Reading("bend", "value", "°", "bend", "bend_sd"),
    Reading("farthest point", "value", "px", "d_max"),
    PARTICLES,
    Reading("log evidence", "evidence"),
    STEP_TIME,
)

TERMS = (
    Term("heading", "the direction in which the head of the fish points"),
    Term("bend", "how far the tail is bent, as an angle"),
    Term("farthest point", "of the drawn fish, the distance of its worst point from an edge in the picture"),
)


class SimulatedFishParameters(FishTrackerParameters, FishSceneParameters):
    """The simulated tank and its trackers."""


def simulate() -> Setup:
    """Wire the simulated tank."""
    return Setup(FishSource, SimulatedFishParameters())


def measure(frame: Frame, state: FishState) -> Mapping[str, SeriesValue]:
    """Compare heading and bend with the truth, where it is a fish's; the true heading is within half a turn of ours."""
    target = frame.target
    if not isinstance(target, FishTarget):
        return {}
    heading, bend = _wrap(state.mean[4] - target.theta), state.mean[5] - target.phi
    return {
        "heading_error": float(np.rad2deg(abs(heading))),
        "bend_error": float(np.rad2deg(abs(_wrap(bend)))),
        "true_heading": float(np.rad2deg(state.mean[4] - heading)),
        "true_bend": float(np.rad2deg(target.phi)),
    }


def is_missed(state: FishState, target: Target) -> bool:
    """Return whether the estimate lies outside the fish's silhouette, where that is known."""
    if not np.isfinite(state.estimate).all():
        return True
    return isinstance(target, FishTarget) and not target.holds(state.estimate)


def draw(step: Step, past: Sequence[Diagnostics], other: Diagnostics | None = None) -> Drawing:
    """Draw a frame, the learned modes, and the changes that particles draw."""
    image, state, row, parameters = step.frame.picture, step.state, step.diagnostics, step.parameters
    height, width, _ = image.shape
    body = shape(parameters)
    primitives: dict[str, Primitive] = {"picture": Picture(image)}
    primitives |= draw_edges(find_edges(step.frame, parameters))
    primitives |= draw_particles(state, body, width)
    primitives |= draw_truth(step.frame.target)
    second = None if other is None else other.vector("body")
    if second is not None:
        primitives |= fish(np.array(second), body, COLOURS["second"], "second run", "second")
    primitives |= fish(state.pose, body, COLOURS["estimate"], "estimate", "estimated")
    primitives |= draw_path(past, row.frame)
    worlds = (modes_world(parameters, row.frame), changes_world(state, parameters, past, row.frame))
    return Drawing(width, height, primitives, _caption(step), worlds)


def _caption(step: Step) -> str:
    row = step.diagnostics
    particles = f"{len(step.state.particles)} particles"
    return caption(row, step.tracker_title, particles, error_words(row, " px", "outside the fish"))


def _wrap(angle: float) -> float:
    return float(np.remainder(angle + np.pi, 2.0 * np.pi) - np.pi)


EXPERIMENT = Experiment(
    id="fish",
    title="Fish that bends",
    family="Places in a picture",
    question="How many particles does it take to follow a goldfish through a sharp turn?",
    references=(cite("mitsugami2009"),),
    description=(
        "Goldfish swim in a tank, seen from above, and bend as they turn. The ordinary filter moves place, heading and "
        "bend by steps of their own, so that most of its particles do what no fish does. The guided one has learned "
        "how they change together in the fish's own frame."
    ),
    unit="px",
    trackers=TRACKERS,
    default_tracker="guided",
    frames=FRAMES,
    presets=read_presets(Path(__file__).with_name("presets.yaml")),
    layers=(
        Layer("picture"),
        Layer("distance image", shown=False),
        Layer("edges", shown=False),
        Layer("many particles", shown=False),
        Layer("ten particles", legend=(Key("prediction", "some particles"),)),
        Layer("particles by weight", shown=False),
        Layer("truth", legend=(Key("truth", "truth"),)),
        Layer("estimate", legend=(Key("estimate", "estimate"),)),
        Layer("path"),
        SECOND_RUN,
        Layer("learned motion", legend=(Key("observation", "learned changes"),)),
        Layer("drawn changes"),
        Layer("axes"),
    ),
    worlds=(MODES_WORLD, CHANGES_WORLD),
    simulate=simulate,
    video=Video(
        wire,
        recorded=lambda _kind: RecordedFishParameters(),
        marks=(FishBody,),
        wanted="a body: head, root and tip of the tail, and half width",
        advice="Mark the whole body in a picture in which it is nearly straight.",
        suits=suits,
        clip_title="Fish by its outline",
    ),
    draw=draw,
    error=distance,
    missed=is_missed,
    series=SERIES,
    measure=measure,
    measures=PICTURE_MEASURES,
    quality=Quality(CALIBRATION, LOSS_DECLARATION),
    target="fish",
    plots=PLOTS,
    readings=READINGS,
    terms=TERMS,
    example_sweep=ExampleSweep(
        {"sample_count": (50, 100, 200, 500, 1000), "tank_number": (200, 202, 204, 206, 208)},
        trackers=("guided", "ordinary"),
        trials=4,
        frames=FRAMES,
    ),
    guidance=GUIDANCE,
    exports=(GUIDANCE.export,),
)
