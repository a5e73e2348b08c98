"""The chain in depth, which no picture shows: all hypotheses, how far each extends, and the truth.

The root is in the middle, what the camera sees runs across, and depth away from it; looked at from above, a chain in
the plane lies flat. Lengths are shares of the longest chain that the bounds allow, so that a large one fits in as well.
Around each link of a hypothesis lies a sector, which its tip may not leave: the range of directions by that of lengths.
The curve within is the ellipsoid's shadow.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.drawing import (
    COLOURS,
    Arrows,
    Colour,
    Links,
    Mesh,
    Points,
    Polyline,
    Primitive,
    Text,
    WorldDrawing,
)
from pftrack.core.model.world import Viewpoint, World
from pftrack.experiments.linkage.beliefs import ShownHypothesis, chain_of, list_hypotheses, particles, turn_of
from pftrack.experiments.linkage.scene.truth import LinkageTarget, places
from pftrack.experiments.linkage.shape import LINKS
from pftrack.experiments.linkage.trackers.parameters import LinkageTrackerParameters
from pftrack.experiments.linkage.trackers.state import LinkageState

__all__ = ["DEPTH_WORLD", "depth_world", "pale"]

DEPTH_WORLD = World(
    "depth",
    "From above",
    "reach",
    0.9,
    up=(0.0, -1.0, 0.0),
    front=(0.0, 0.0, -1.0),
    viewpoints=(
        Viewpoint("top", "Top", 0.0, 90.0),
        Viewpoint("front", "Front", 0.0, 0.0),
        Viewpoint("3-d", "3-D", -35.0, 35.0),
    ),
)

MOST_SHOWN = 8
STEPS = 24
"""Corners along an arc."""
JOINT, PARTICLE, AXIS_AT, CAMERA_AT = 0.04, 0.02, 0.8, 0.8
PALEST = 0.6
"""How much of the paper's white is in the colour of a hypothesis that weighs nothing."""


def pale(colour: Colour, weight: float) -> Colour:
    """Return the colour of a hypothesis: the paler the less it weighs."""
    share = PALEST * (1.0 - min(max(weight, 0.0), 1.0))
    red, green, blue = (round(level + share * (255 - level)) for level in colour)
    return red, green, blue


def depth_world(
    state: LinkageState,
    target: object,
    parameters: LinkageTrackerParameters,
    second: NDArray[np.float64] | None = None,
) -> WorldDrawing:
    """Draw the hypotheses with their sectors, the estimate, the truth if it is known, and a second run's estimate."""
    reach = float(sum(parameters.bounds.length_high))
    estimate = chain_of(state.mean, state)
    middle = estimate[0]
    ends = np.array([[[-AXIS_AT, 0.0, 0.0], [AXIS_AT, 0.0, 0.0]], [[0.0, 0.0, -AXIS_AT], [0.0, 0.0, AXIS_AT]]])
    way = np.array([[[0.0, 0.0, -CAMERA_AT], [0.0, 0.0, -0.8 * CAMERA_AT]]], np.float32)
    drawn: dict[str, Primitive] = {
        "axes": Links(ends.astype(np.float32), COLOURS["hidden"], 1.0, "axes"),
        "camera": Arrows(way, COLOURS["camera"], 2.0, "axes"),
        "name camera": Text(_at(0.06, 0.0, -0.8 * CAMERA_AT), "camera", COLOURS["camera"], "axes"),
        "name across": Text(_at(AXIS_AT, 0.0, -0.07), "image", COLOURS["camera"], "axes", "end"),
    }
    for number, one in enumerate(list_hypotheses(state)[:MOST_SHOWN]):
        joints = (chain_of(one.position, state) - middle) / reach
        drawn |= _extent(f"{number}", one, joints, turn_of(one.position, state), reach)
        colour = pale(COLOURS["prediction"], one.weight)
        drawn[f"hypothesis {number}"] = Links(_segments(joints), colour, 1.5 + 2.0 * one.weight, "hypotheses")
    if len(cloud := particles(state)):
        joints = np.concatenate([chain_of(one, state)[1:] - middle for one in cloud]) / reach
        drawn["particles"] = _dots(joints, COLOURS["prediction"], "particles", PARTICLE)
    if isinstance(target, LinkageTarget):
        true = (places(target) - middle) / reach
        drawn["truth"] = Links(_segments(true), COLOURS["truth"], 2.0, "truth")
        drawn["true joints"] = _dots(true, COLOURS["truth"], "truth")
    if second is not None:
        other = (chain_of(second, state) - middle) / reach
        drawn["second"] = Links(_segments(other), COLOURS["second"], 2.0, "second run")
    drawn["estimate"] = Links(_segments((estimate - middle) / reach), COLOURS["estimate"], 3.0, "estimate")
    drawn["joints"] = _dots((estimate - middle) / reach, COLOURS["estimate"], "estimate")
    return WorldDrawing(DEPTH_WORLD, drawn)


def _extent(
    name: str, one: ShownHypothesis, joints: NDArray[np.float64], turn: NDArray[np.float64], reach: float
) -> dict[str, Primitive]:
    """Draw sectors of directions by lengths, and the ellipsoid's shadow in each."""
    drawn: dict[str, Primitive] = {}
    colour, opacity = pale(COLOURS["prediction"], one.weight), 0.15 + 0.25 * one.weight
    for link in range(LINKS):
        low, high = (np.array([ends[link], ends[LINKS + link]]) for ends in (one.low, one.high))
        high[0] = min(high[0], low[0] + 2.0 * np.pi)
        angles = np.linspace(low[0], high[0], STEPS)
        rims = [_place(angles, max(float(r), 0.0) / reach, turn) + joints[link] for r in (low[1], high[1])]
        vertices = np.concatenate(rims)
        if not _near(vertices):
            continue
        drawn[f"box {name} {link + 1}"] = Mesh(vertices.astype(np.float32), BAND, colour, opacity, "guide boxes")
        if one.shape is not None:
            curve = _shadow(one, link)
            along = joints[link] + _place(curve[:, 0], np.maximum(curve[:, 1], 0.0) / reach, turn)
            if _near(along):
                drawn[f"ellipsoid {name} {link + 1}"] = Polyline(along.astype(np.float32), colour, 1.5, "ellipsoids")
    return drawn


def _shadow(one: ShownHypothesis, link: int) -> NDArray[np.float64]:
    """Return points (2 STEPS, 2), direction and length of a link, on the border of the ellipsoid's projection."""
    if one.shape is None:
        return np.zeros((0, 2))
    rows = [link, LINKS + link]
    values, vectors = np.linalg.eigh(one.shape[np.ix_(rows, rows)])
    turns = np.linspace(0.0, 2.0 * np.pi, 2 * STEPS)
    round_ = np.stack([np.cos(turns), np.sin(turns)], axis=1) * np.sqrt(np.maximum(values, 0.0))
    return np.asarray(one.middle[rows] + round_ @ vectors.T)


def _place(angles: NDArray[np.float64], radius: NDArray[np.float64] | float, turn: NDArray[np.float64]) -> Any:  # noqa: ANN401
    flat = np.stack([radius * np.cos(angles), radius * np.sin(angles), np.zeros_like(angles)], axis=1)
    return flat @ turn.T


def _near(points: NDArray[np.float64]) -> bool:
    return bool(_within(points).all())


def _within(points: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Whether points (..., 3) are in the world."""
    return np.asarray(np.sqrt(np.square(points).sum(axis=-1)) < DEPTH_WORLD.radius)


def _segments(joints: NDArray[np.float64]) -> NDArray[np.float32]:
    """Return the links (n, 2, 3) of a chain (4, 3) that are near enough to be drawn."""
    ends = np.stack([joints[:-1], joints[1:]], axis=1)
    near = _within(ends).all(axis=1)
    return np.asarray(ends[near], np.float32)


def _dots(joints: NDArray[np.float64], colour: Colour, layer: str, size: float = JOINT) -> Points:
    near = joints[_within(joints)].astype(np.float32)
    return Points(near, np.tile(np.array(colour, np.uint8), (len(near), 1)), size, layer)


def _at(*place: float) -> NDArray[np.float32]:
    return np.array(place, np.float32)


def _band() -> NDArray[np.int32]:
    """Return the triangles (m, 3) between two rows of STEPS corners each."""
    first = np.arange(STEPS - 1)
    corners = np.stack([first, first + 1, first + STEPS, first + STEPS, first + 1, first + STEPS + 1], axis=1)
    return corners.reshape(-1, 3).astype(np.int32)


BAND = _band()
