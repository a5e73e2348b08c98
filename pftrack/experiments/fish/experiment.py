"""A fish that bends as it turns, followed by guided diffusion (Mitsugami et al. 2009).

A filter that perturbs every number of its state by itself spends most particles on motions that no fish makes. Their
method learns offline how motion and shape change together, and guides the particles by that: fewer do as well.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from pftrack.core.model.drawing import COLOURS, Drawing, Picture, Primitive
from pftrack.core.model.measures import PICTURE_MEASURES
from pftrack.core.model.series import SeriesValue
from pftrack.core.model.setup import Setup
from pftrack.core.model.source import Frame, Target
from pftrack.core.model.tracker import Diagnostics, Step
from pftrack.experiments.declared import read_quality, read_words
from pftrack.experiments.experiment import Experiment
from pftrack.experiments.fish.draw import (
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
from pftrack.experiments.fish.recording import FishBody, RecordedFishParameters, suits, wire
from pftrack.experiments.fish.scene import FishSceneParameters, FishSource, FishTarget
from pftrack.experiments.fish.trackers import TRACKERS
from pftrack.experiments.shared.sketch import caption, distance, error_words
from pftrack.experiments.video import Video

FOLDER = Path(__file__).parent


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
    **read_words(FOLDER, TRACKERS),
    id="fish",
    quality=read_quality(FOLDER, TRACKERS),
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
    measure=measure,
    measures=PICTURE_MEASURES,
    guidance=GUIDANCE,
    exports=(GUIDANCE.export,),
)
