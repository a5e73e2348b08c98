"""The model of the head in a world of its own: in mm in the head's own frame, at rest while the picture's head turns.

It shows what the tracker assumes of the head, where in it each feature is seen in this frame, and from where the camera
looks at it. A feature is known across the camera's line of sight only, so its uncertainty is a disc that faces the
camera, at the depth of the model's point.
"""

import numpy as np
from numpy.typing import NDArray

from pftrack.core.geometry.rotation import rotation
from pftrack.core.model.drawing import (
    COLOURS,
    Arrows,
    Axes,
    Colour,
    Ellipsoids,
    Links,
    Mesh,
    Points,
    Primitive,
    Text,
    WorldDrawing,
)
from pftrack.core.model.frame import Target
from pftrack.core.model.world import Viewpoint, World
from pftrack.experiments.head.own_face import draw_grown_face
from pftrack.experiments.head.sketch import front
from pftrack.experiments.head.trackers.memory import HeadMemory
from pftrack.experiments.shared.pose.state import PoseState
from pftrack.vision.geometry.face_model import LINKS, FaceModel

__all__ = ["HEAD_WORLD", "head_world"]

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
    colours = np.tile(np.array(colour, np.uint8), (len(points), 1))
    pairs = [(model.names.index(one), model.names.index(other)) for one, other in LINKS]
    return {
        "surface": Mesh(vertices, shape.triangles, colour, 0.22, "head"),
        "lines": Links(vertices[shape.edges], COLOURS["hidden"], 0.5, "head"),
        "face": Links(points[np.array(pairs)], colour, 1.5, "model points"),
        "points": Points(points, colours, POINT_MM, "model points"),
    }


def _axes() -> dict[str, Primitive]:
    colour = COLOURS["hidden"]
    axes = np.eye(3, dtype=np.float32)
    drawn: dict[str, Primitive] = {"axes": Axes(np.zeros(3, np.float32), axes, AXES_MM, colour, 1.5, "axes")}
    for name, axis in zip("xyz", axes, strict=True):
        drawn[f"axis {name}"] = Text(np.float32(NAMES_AT * AXES_MM) * axis, name, colour, "axes", anchor="middle")
    return drawn


def _features(state: PoseState, turn: NDArray[np.float64]) -> Ellipsoids:
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


def _arrow(
    state: PoseState, turn: NDArray[np.float64], reach_mm: tuple[float, float], colour: str, layer: str
) -> Arrows:
    """Draw an arrow from before the face towards the camera, for a head that is turned so."""
    way = _to_camera(state) @ turn
    ends = np.outer(reach_mm, way / np.linalg.norm(way))
    return Arrows(ends[None].astype(np.float32), COLOURS[colour], 3.0, layer)


def _to_camera(state: PoseState) -> NDArray[np.float64]:
    """Return the direction (3,) to the camera, in the camera's frame: an affine one sees along parallels."""
    place = state.belief.place_mm
    if place is not None:
        return -place
    along: NDArray[np.float64] = np.cross(state.solid.reference[0, :3], state.solid.reference[1, :3])
    return -along if along[2] > 0.0 else along
