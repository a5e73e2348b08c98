"""A fish that bends as it turns, followed by guided diffusion (Mitsugami et al. 2009).

A filter that perturbs every number of its state independently spends most particles on motions that no fish makes.
Their method learns offline how motion and shape change together, and guides the particles by that, so fewer particles
suffice.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from pftrack.core.arrays import Floats
from pftrack.core.model import drawing
from pftrack.core.model.measures import PICTURE_MEASURES
from pftrack.core.model.series import SeriesValue
from pftrack.core.model.setup import Setup
from pftrack.core.model.source import Frame, Target
from pftrack.core.model.tracker import Diagnostics, Step
from pftrack.experiments.declared import read_words, read_worlds
from pftrack.experiments.experiment import Experiment, Judge, Measured, Video
from pftrack.experiments.fish import scene
from pftrack.experiments.fish.model import (
    CAP_PX,
    GOLDFISH,
    QUARTERS,
    Edges,
    FishShape,
    FishState,
    body_points,
    find_edges,
    shape,
    tail_line,
)
from pftrack.experiments.fish.parameters import FISH, GUIDANCE, FishTrackerParameters
from pftrack.experiments.fish.trackers import TRACKERS
from pftrack.experiments.shared import sketch
from pftrack.filters.learning.charts import changes
from pftrack.filters.learning.diffusion import Diffusion

# The drawing of a frame, and two worlds of the learned motion.
#
# The picture shows its edges, some particles as whole fish, the estimate, the truth and the path. The first world shows
# a fish at rest, head upwards, and as a ghost how it moves and bends within a frame along one of the modes, the
# eigenvectors of the learned covariance (Mitsugami et al. 2009, eq. 15). The second is the scatter of turn against bend
# of all particles since the frame before, in units of the learned standard deviations, with the learned covariance as
# an ellipsoid at two of them, and the changes of the estimate. Its third axis is the acceleration across the body.

FEW, MANY = 10, 200
"""How many particles are drawn as whole fish: as in the paper's figures 8 and 9, or nearly all."""

OUTLINE_POINTS = 24
TRAIL_FRAMES = 45
LINES_IN_LENGTH, LINE_WIDTHS_PX = 13.0, (0.7, 3.0)
"""Widths of lines in the half length of a fish, and bounds of their width."""


def fish(pose: Floats, shape: FishShape, colour: drawing.Colour, layer: str, name: str) -> dict[str, drawing.Primitive]:
    """Draw a pose (4,) as an ellipse with a tail, and a stroke to the head."""
    ahead = np.array([np.cos(pose[2]), np.sin(pose[2])])
    axes = np.stack([shape.half_length * ahead, shape.half_width * np.array([-ahead[1], ahead[0]])])
    centre = sketch.at_height(pose[:2], 2.0)
    width = float(np.clip(shape.half_length / LINES_IN_LENGTH, *LINE_WIDTHS_PX))
    head = pose[:2] + shape.half_length * ahead
    stroke = sketch.at_height(np.vstack([head - 0.3 * shape.half_length * ahead, head]), 2.0)
    return {
        f"{name} body": drawing.Ellipse(centre, axes.astype(np.float32), colour, width, layer),
        f"{name} tail": drawing.Polyline(sketch.at_height(tail_line(pose, shape), 2.0), colour, width, layer),
        f"{name} head": drawing.Polyline(stroke, colour, width, layer),
    }


def draw_particles(state: FishState, shape: FishShape, width: int) -> dict[str, drawing.Primitive]:
    """Draw all particles as points at their centres, and some of them as whole fish."""
    states = state.particles.states
    poses = states[:, [0, 1, 4, 5]]
    clouds = sketch.particle_clouds(poses[:, :2], state.particles, 0, width / 200.0)
    return {
        "many": outlines(_some(poses, MANY), shape, drawing.COLOURS["prediction"], 0.5, "many particles"),
        "few": outlines(_some(poses, FEW), shape, drawing.COLOURS["prediction"], 1.0, "ten particles"),
        "centres": clouds["weights"],
    }


def outlines(poses: Floats, shape: FishShape, colour: drawing.Colour, width: float, layer: str) -> drawing.Links:
    """Draw poses (n, 4) as outlines with tails, all in one primitive."""
    around = body_points(poses, shape, OUTLINE_POINTS)
    segments = np.concatenate(
        [np.stack([around, np.roll(around, -1, axis=1)], axis=2), tail_line(poses, shape)[:, None]], axis=1
    )
    return sketch.lines(segments.reshape(-1, 2, 2), colour, width, layer, height=1.0)


def draw_edges(edges: Edges) -> dict[str, drawing.Primitive]:
    """Draw the distance image, dark near the edges, and the edges themselves."""
    rows, columns = np.nonzero(edges.edges)
    return {
        "distances": drawing.Picture(_TABLE[edges.distances[1:-1, 1:-1]], "distance image"),
        "edges": sketch.dots(np.column_stack([columns, rows]), drawing.COLOURS["lost"], 1.5, "edges", height=1.0),
    }


def draw_truth(target: Target | None) -> dict[str, drawing.Primitive]:
    """Draw the true fish, or a circle where only its place is known."""
    if isinstance(target, scene.FishTarget):
        return fish(target.pose, target.shape, drawing.COLOURS["truth"], "truth", "true")
    if target is not None:
        return {"true place": sketch.circle(target.position, target.size / 2.0, drawing.COLOURS["truth"], "truth")}
    return {}


def draw_path(past: Sequence[Diagnostics], frame: int, size: tuple[int, int]) -> dict[str, drawing.Primitive]:
    """Draw where the estimate was in the last three seconds."""
    rows = past[max(frame - TRAIL_FRAMES, 0) : frame + 1]
    places = np.array([row.estimate for row in rows]).reshape(-1, 2)
    return sketch.paths(rows, places, size, "path")


def _some(poses: Floats, count: int) -> Floats:
    """Return an even choice of particles, which are sorted by parents."""
    if len(poses) <= count:
        return poses
    return poses[np.linspace(0, len(poses) - 1, count).astype(np.int64)]


_TABLE = np.array(drawing.VIRIDIS, np.uint8)[
    np.minimum(np.arange(256) * len(drawing.VIRIDIS) // (QUARTERS * CAP_PX), len(drawing.VIRIDIS) - 1)
]
"""Colour of each distance."""

MODES_WORLD, CHANGES_WORLD = read_worlds(Path(__file__).parent)


UP = -0.5 * np.pi
SWAY_FRAMES = 30.0
FAN = (-2.0, -1.0, 1.0, 2.0)
LABEL_AT, SAID_FROM = -80.0, 0.3
"""Position of a mode's label, px, and the least share of a component that it lists."""
ARROW = 6.0
"""Lengths of the arrow of an acceleration, frames^2."""
SEEN = 4.8
"""Changes farther than this from 0 are not drawn, sd."""
MOST_PARTICLES, REMEMBERED = 600, 45
AXIS_SD = 4.4
NAMES = (("turn", (1.0, 0.0, 0.0)), ("bend", (0.0, 1.0, 0.0)), ("across", (0.0, 0.0, 1.0)))


def modes_world(parameters: FishTrackerParameters, frame: int) -> drawing.WorldDrawing:
    """Draw the mode that is chosen: the fish at rest, a fan along the mode, and the ghost."""
    diffusion = _learned_diffusion(parameters)
    sway = np.cos(2.0 * np.pi * frame / SWAY_FRAMES) if parameters.mode_sways else 1.0
    along = float(parameters.along_mode * sway)
    change = _change(diffusion, parameters.shown_mode, along)
    rest = np.array([0.0, 0.0, UP, 0.0])
    fan = np.array([_move(rest, _change(diffusion, parameters.shown_mode, share)) for share in FAN])
    ghost = _move(rest, change)
    drawn: dict[str, drawing.Primitive] = {
        "fan": outlines(fan, GOLDFISH, drawing.COLOURS["hidden"], 1.0, "learned motion"),
        "rest": outlines(rest[None], GOLDFISH, drawing.COLOURS["truth"], 1.5, "learned motion"),
        **_ghost(ghost, drawing.COLOURS["prediction"]),
    }
    push = ARROW * (ghost[:2] - rest[:2])
    ends = np.array([[[0.0, 0.0, 0.0], [*push, 0.0]]], np.float32)
    drawn["push"] = drawing.Arrows(
        ends if np.hypot(*push) > 1.0 else ends[:0], drawing.COLOURS["prediction"], 2.0, "learned motion"
    )
    said = (
        f"{round(change[0]):+d} px ahead",
        f"{round(change[1]):+d} px aside",
        f"turn {round(np.rad2deg(change[2])):+d}°",
        f"bend {round(np.rad2deg(change[3])):+d}°",
    )
    weight = np.abs(diffusion.modes[:, parameters.shown_mode - 1])
    label = ", ".join(said[i] for i in range(4) if weight[i] > SAID_FROM)
    place = np.array([0.0, LABEL_AT, 0.0], np.float32)
    drawn["label"] = drawing.Text(place, label, drawing.COLOURS["camera"], "learned motion", anchor="middle")
    return drawing.WorldDrawing(MODES_WORLD, drawn)


def changes_world(
    state: FishState, parameters: FishTrackerParameters, past: Sequence[Diagnostics], frame: int
) -> drawing.WorldDrawing:
    """Draw the changes of all particles and of the estimate with the learned covariance."""
    diffusion = _learned_diffusion(parameters)
    length = shape(parameters).half_length / GOLDFISH.half_length
    sd = diffusion.sd[[2, 3, 1]] * np.array([1.0, 1.0, length])
    drawn: dict[str, drawing.Primitive] = {"axes": _axes()}
    for name, way in NAMES[:2]:  # the third one's would stand in the middle of the view from the front
        place = (0.85 * AXIS_SD * np.array(way)).astype(np.float32)
        drawn[f"name {name}"] = drawing.Text(place, name, drawing.COLOURS["camera"], "axes", anchor="middle")
    covariance = diffusion.correlation[np.ix_([2, 3, 1], [2, 3, 1])] * parameters.diffusion_scale**2
    drawn["learned"] = drawing.Ellipsoids(
        np.zeros((1, 3), np.float32),
        np.asarray(covariance[None], np.float32),
        sketch.colours(1, drawing.COLOURS["observation"]),
        0.25,
        "learned motion",
    )
    cloud = state.changes[:, [1, 2, 0]] / sd
    step = max(1, len(cloud) // MOST_PARTICLES)
    drawn["particles"] = _points(cloud[::step], "prediction", 0.09, "drawn changes")
    bodies = [row.vector("body") for row in past[max(frame - REMEMBERED, 0) : frame + 1]]
    known = np.array([body for body in bodies if body is not None]).reshape(-1, 4)
    made = changes(known, FISH, parameters.motion_reading)[:, [2, 3, 1]] / sd if len(known) > 2 else np.zeros((0, 3))
    drawn["path"] = _points(made[:-1], "estimate", 0.12, "path")
    drawn["estimate"] = _points(made[-1:], "estimate", 0.3, "estimate")
    return drawing.WorldDrawing(CHANGES_WORLD, drawn)


def _learned_diffusion(parameters: FishTrackerParameters) -> Diffusion:
    learned = GUIDANCE.parse(parameters.learned)
    return learned.diffusion(parameters.motion_reading, correlated=parameters.correlated_changes)


def _change(diffusion: Diffusion, mode: int, along: float) -> Floats:
    """Return the changes (4,) at a number of standard deviations along a mode, counted from 1."""
    change: Floats = along * np.sqrt(diffusion.eigenvalues[mode - 1]) * diffusion.modes[:, mode - 1]
    return change


def _move(pose: Floats, change: Floats) -> Floats:
    """Return a pose at rest (4,) after a frame with these changes: turned, bent, and moved in its new direction."""
    theta = pose[2] + change[2]
    cosine, sine = np.cos(theta), np.sin(theta)
    x, y = pose[0] + cosine * change[0] - sine * change[1], pose[1] + sine * change[0] + cosine * change[1]
    return np.array([x, y, theta, pose[3] + change[3]])


def _ghost(pose: Floats, colour: drawing.Colour) -> dict[str, drawing.Primitive]:
    around = body_points(pose, GOLDFISH, OUTLINE_POINTS)
    body = np.zeros((OUTLINE_POINTS + 1, 3), np.float32)
    body[:, :2] = np.vstack([around, around[:1]])
    tail = np.zeros((2, 3), np.float32)
    tail[:, :2] = tail_line(pose, GOLDFISH)
    return {
        "ghost body": drawing.Polyline(body, colour, 3.0, "learned motion"),
        "ghost tail": drawing.Polyline(tail, colour, 3.0, "learned motion"),
    }


def _points(places: Floats, colour: str, size: float, layer: str) -> drawing.Points:
    return sketch.dots(places[np.square(places).sum(axis=1) < SEEN**2], drawing.COLOURS[colour], size, layer)


def _axes() -> drawing.Links:
    ends = [[[-AXIS_SD * way for way in ways], [AXIS_SD * way for way in ways]] for _, ways in NAMES]
    return drawing.Links(np.array(ends, np.float32), drawing.COLOURS["hidden"], 1.0, "axes")


FOLDER = Path(__file__).parent


class SimulatedFishParameters(FishTrackerParameters, scene.FishSceneParameters):
    """The simulated tank and its trackers."""


def simulate() -> Setup:
    """Wire the simulated tank."""
    return Setup(scene.FishSource, SimulatedFishParameters())


def measure(frame: Frame, state: FishState) -> Mapping[str, SeriesValue]:
    """Compare heading and bend with the truth, where it is a fish's; the true heading is within half a turn of ours."""
    target = frame.target
    if not isinstance(target, scene.FishTarget):
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
    return isinstance(target, scene.FishTarget) and not target.holds(state.estimate)


def draw(step: Step, past: Sequence[Diagnostics], other: Diagnostics | None = None) -> drawing.Drawing:
    """Draw a frame, the learned modes, and the changes that particles draw."""
    image, state, row, parameters = step.frame.picture, step.state, step.diagnostics, step.parameters
    height, width, _ = image.shape
    body = shape(parameters)
    primitives: dict[str, drawing.Primitive] = {"picture": drawing.Picture(image)}
    primitives |= draw_edges(find_edges(step.frame, parameters))
    primitives |= draw_particles(state, body, width)
    primitives |= draw_truth(step.frame.target)
    second = None if other is None else other.vector("body")
    if second is not None:
        primitives |= fish(np.array(second), body, drawing.COLOURS["second"], "second run", "second")
    primitives |= fish(state.pose, body, drawing.COLOURS["estimate"], "estimate", "estimated")
    primitives |= draw_path(past, row.frame, (width, height))
    worlds = (modes_world(parameters, row.frame), changes_world(state, parameters, past, row.frame))
    grip = sketch.at_height(state.estimate, 2.0)
    return drawing.Drawing(width, height, primitives, _caption(step), worlds, grip=grip)


def _caption(step: Step) -> str:
    row = step.diagnostics
    particles = f"{len(step.state.particles)} particles"
    return sketch.caption(row, step.tracker_title, particles, sketch.error_words(row, " px", "outside the fish"))


def _wrap(angle: float) -> float:
    return float(np.remainder(angle + np.pi, 2.0 * np.pi) - np.pi)


EXPERIMENT = Experiment(
    **read_words(FOLDER, TRACKERS, measured=Measured(measure=measure, measures=PICTURE_MEASURES)),
    id="fish",
    simulate=simulate,
    video=Video(
        scene.wire,
        recorded=lambda _kind: scene.RecordedFishParameters(),
        marks=(scene.FishBody,),
        wanted="a body: head, root and tip of the tail, and half width",
        advice="Mark the whole body in a picture in which it is nearly straight.",
        suits=scene.suits,
        clip_title="Fish by its outline",
    ),
    draw=draw,
    judge=Judge(sketch.distance, "px", missed=is_missed),
    guidance=GUIDANCE,
    exports=(GUIDANCE.export,),
)
