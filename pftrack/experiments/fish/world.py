"""Two worlds of what was learned: the modes as a fish that moves along them, and the changes that particles draw.

The first shows a fish at rest, head upwards, and as a ghost how it moves and bends within a frame along one of the
modes, the eigenvectors of the learned covariance (eq. 15). The second is the scatter of turn against bend of all
particles since the frame before, in units of the learned standard deviations, with the learned covariance as an
ellipsoid at two of them, and the changes of the estimate. Its third axis is the acceleration across the body.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.diagnostics import Diagnostics
from pftrack.core.model.drawing import (
    COLOURS,
    Arrows,
    Colour,
    Ellipsoids,
    Links,
    Points,
    Polyline,
    Primitive,
    Text,
    WorldDrawing,
)
from pftrack.core.model.world import Viewpoint, World
from pftrack.experiments.fish.shape import GOLDFISH, body_points, tail_line
from pftrack.experiments.fish.sketch import OUTLINE_POINTS, outlines
from pftrack.experiments.fish.trackers.learned import FISH, GUIDANCE
from pftrack.experiments.fish.trackers.motion import shape
from pftrack.experiments.fish.trackers.parameters import FishTrackerParameters
from pftrack.experiments.fish.trackers.state import FishState
from pftrack.filters.learning.charts import changes
from pftrack.filters.learning.diffusion import Diffusion

__all__ = ["CHANGES_WORLD", "MODES_WORLD", "changes_world", "modes_world"]

MODES_WORLD = World(
    "modes",
    "Learned mode",
    "px",
    115.0,
    middle=(0.0, 15.0, 0.0),
    up=(0.0, -1.0, 0.0),
    front=(0.0, 0.0, -1.0),
    viewpoints=(Viewpoint("above", "Above", 0.0, 0.0), Viewpoint("3-d", "3-D", -35.0, 20.0)),
)

CHANGES_WORLD = World(
    "changes",
    "Turn against bend",
    "sd",
    5.0,
    up=(0.0, 1.0, 0.0),
    front=(0.0, 0.0, 1.0),
    viewpoints=(
        Viewpoint("front", "Front", 0.0, 0.0),
        Viewpoint("side", "Side", 90.0, 0.0),
        Viewpoint("3-d", "3-D", -35.0, 20.0),
    ),
)

UP = -0.5 * np.pi
SWAY_FRAMES = 30.0
FAN = (-2.0, -1.0, 1.0, 2.0)
LABEL_AT, SAID_FROM = -80.0, 0.3
"""Where the label of a mode stands, px, and from which share on it says a component."""
ARROW = 6.0
"""Lengths of the arrow of an acceleration, frames^2."""
SEEN = 4.8
"""Changes farther than this from 0 are not drawn, sd."""
MOST_PARTICLES, REMEMBERED = 600, 45
AXIS_SD = 4.4
NAMES = (("turn", (1.0, 0.0, 0.0)), ("bend", (0.0, 1.0, 0.0)), ("across", (0.0, 0.0, 1.0)))


def modes_world(parameters: FishTrackerParameters, frame: int) -> WorldDrawing:
    """Draw the mode that is chosen: the fish at rest, a fan along the mode, and the ghost."""
    diffusion = _learned_diffusion(parameters)
    sway = np.cos(2.0 * np.pi * frame / SWAY_FRAMES) if parameters.mode_sways else 1.0
    along = float(parameters.along_mode * sway)
    change = _change(diffusion, parameters.shown_mode, along)
    rest = np.array([0.0, 0.0, UP, 0.0])
    fan = np.array([_move(rest, _change(diffusion, parameters.shown_mode, share)) for share in FAN])
    ghost = _move(rest, change)
    drawn: dict[str, Primitive] = {
        "fan": outlines(fan, GOLDFISH, COLOURS["hidden"], 1.0, "learned motion"),
        "rest": outlines(rest[None], GOLDFISH, COLOURS["truth"], 1.5, "learned motion"),
        **_ghost(ghost, COLOURS["prediction"]),
    }
    push = ARROW * (ghost[:2] - rest[:2])
    ends = np.array([[[0.0, 0.0, 0.0], [*push, 0.0]]], np.float32)
    drawn["push"] = Arrows(ends if np.hypot(*push) > 1.0 else ends[:0], COLOURS["prediction"], 2.0, "learned motion")
    said = (
        f"{round(change[0]):+d} px ahead",
        f"{round(change[1]):+d} px aside",
        f"turn {round(np.rad2deg(change[2])):+d}°",
        f"bend {round(np.rad2deg(change[3])):+d}°",
    )
    weight = np.abs(diffusion.modes[:, parameters.shown_mode - 1])
    label = ", ".join(said[i] for i in range(4) if weight[i] > SAID_FROM)
    place = np.array([0.0, LABEL_AT, 0.0], np.float32)
    drawn["label"] = Text(place, label, COLOURS["camera"], "learned motion", anchor="middle")
    return WorldDrawing(MODES_WORLD, drawn)


def changes_world(
    state: FishState, parameters: FishTrackerParameters, past: Sequence[Diagnostics], frame: int
) -> WorldDrawing:
    """Draw the changes of all particles and of the estimate beside what was learned."""
    diffusion = _learned_diffusion(parameters)
    length = shape(parameters).half_length / GOLDFISH.half_length
    sd = diffusion.sd[[2, 3, 1]] * np.array([1.0, 1.0, length])
    drawn: dict[str, Primitive] = {"axes": _axes()}
    for name, way in NAMES[:2]:  # the third one's would stand in the middle of the view from the front
        place = (0.85 * AXIS_SD * np.array(way)).astype(np.float32)
        drawn[f"name {name}"] = Text(place, name, COLOURS["camera"], "axes", anchor="middle")
    covariance = diffusion.correlation[np.ix_([2, 3, 1], [2, 3, 1])] * parameters.diffusion_scale**2
    drawn["learned"] = Ellipsoids(
        np.zeros((1, 3), np.float32),
        np.asarray(covariance[None], np.float32),
        _colour(1, "observation"),
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
    return WorldDrawing(CHANGES_WORLD, drawn)


def _learned_diffusion(parameters: FishTrackerParameters) -> Diffusion:
    learned = GUIDANCE.parse(parameters.learned)
    return learned.diffusion(parameters.motion_reading, correlated=parameters.correlated_changes)


def _change(diffusion: Diffusion, mode: int, along: float) -> NDArray[np.float64]:
    """Return the changes (4,) at so many standard deviations along a mode, counted from 1."""
    change: NDArray[np.float64] = along * np.sqrt(diffusion.eigenvalues[mode - 1]) * diffusion.modes[:, mode - 1]
    return change


def _move(pose: NDArray[np.float64], change: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a pose at rest (4,) after a frame with these changes: turned, bent, and moved in its new direction."""
    theta = pose[2] + change[2]
    cosine, sine = np.cos(theta), np.sin(theta)
    x, y = pose[0] + cosine * change[0] - sine * change[1], pose[1] + sine * change[0] + cosine * change[1]
    return np.array([x, y, theta, pose[3] + change[3]])


def _ghost(pose: NDArray[np.float64], colour: Colour) -> dict[str, Primitive]:
    around = body_points(pose, GOLDFISH, OUTLINE_POINTS)
    body = np.zeros((OUTLINE_POINTS + 1, 3), np.float32)
    body[:, :2] = np.vstack([around, around[:1]])
    tail = np.zeros((2, 3), np.float32)
    tail[:, :2] = tail_line(pose, GOLDFISH)
    return {
        "ghost body": Polyline(body, colour, 3.0, "learned motion"),
        "ghost tail": Polyline(tail, colour, 3.0, "learned motion"),
    }


def _points(places: NDArray[np.float64], colour: str, size: float, layer: str) -> Points:
    near = places[(np.square(places).sum(axis=1) < SEEN**2)].astype(np.float32)
    return Points(near, _colour(len(near), colour), size, layer)


def _axes() -> Links:
    ends = [[[-AXIS_SD * way for way in ways], [AXIS_SD * way for way in ways]] for _, ways in NAMES]
    return Links(np.array(ends, np.float32), COLOURS["hidden"], 1.0, "axes")


def _colour(count: int, colour: str) -> NDArray[np.uint8]:
    return np.tile(np.array(COLOURS[colour], np.uint8), (count, 1))
