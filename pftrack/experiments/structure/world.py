"""The shape in a world of its own, in sizes of the body: as it is believed to be, and the true one as a ghost with it.

Where the truth is known the shape is turned and moved onto it, but never mirrored: a shape whose depth is the wrong way
round is to be seen as that. The camera goes round the body, which is at rest.
"""

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.drawing import COLOURS, Arrows, Ellipsoids, Links, Mesh, Points, Primitive, Text, WorldDrawing
from pftrack.core.model.frame import Target
from pftrack.core.model.world import Viewpoint, World
from pftrack.experiments.structure.trackers.state import StructureState
from pftrack.experiments.structure.truth import align_similarity, true_shape

__all__ = ["SHAPE_WORLD", "shape_world"]

RADIUS = 2.4
CAMERA_AT, CAMERA_TO = 2.3, 1.9
POINT = 0.07
FLOOR, NAME_AT, MOST_NAMES = 1.5, 1.12, 40
SURE, UNSURE = 0.05, 0.5
"""Standard deviations of a point, in sizes of the body, between which the surface fades."""
MOST_OPAQUE = 0.45
LARGEST_SD = 1e6
"""Of a point, in sizes of the body: a larger ellipsoid is not drawn, and might not be a number of 32 bits."""

SHAPE_WORLD = World(
    "shape",
    "Shape",
    "body size",
    RADIUS,
    up=(0.0, -1.0, 0.0),
    front=(0.0, 0.0, -1.0),
    viewpoints=(
        Viewpoint("3-d", "3-D", -35.0, 20.0),
        Viewpoint("front", "Front", 0.0, 0.0),
        Viewpoint("side", "Side", -80.0, 0.0),
        Viewpoint("top", "Top", 0.0, 90.0),
    ),
)


def shape_world(
    state: StructureState, target: Target | None, second: NDArray[np.float64] | None = None
) -> WorldDrawing:
    """Draw the shape, how sure each point is, the true shape where it is known, and from where it is seen.

    Args:
        state: Of the frame.
        target: The truth, where it is known.
        second: (n, 3) shape of a second run.
    """
    placed, body, true = state.placed, state.body, true_shape(target)
    points, covariances, turn = placed.points, placed.covariances, placed.camera[:, :3]
    if true is not None and placed.known:
        lay = align_similarity(points, true)
        points, turn = lay(points), turn @ lay.rotation.T
        covariances = lay.scale**2 * (lay.rotation @ covariances @ lay.rotation.T)
    near = np.linalg.norm(points, axis=1) < RADIUS
    drawn: dict[str, Primitive] = {}
    if true is not None:
        drawn["true edges"] = Links(_segments(true, body.edges), COLOURS["truth"], 1.0, "truth")
        drawn["true points"] = Points(true.astype(np.float32), _colour(len(true), "truth"), 0.5 * POINT, "truth")
    sd = np.sqrt(np.trace(covariances, axis1=1, axis2=2) / 3.0)
    faces = body.triangles[near[body.triangles].all(axis=1)] if len(body.triangles) else body.triangles
    if placed.known:
        sureness = np.clip((UNSURE - sd) / (UNSURE - SURE), 0.0, 1.0)
        opacity = (MOST_OPAQUE * sureness).astype(np.float32)
        held = np.where(near[:, None], points, 0.0).astype(np.float32)
        drawn["surface"] = Mesh(held, faces.astype(np.int32), _colour(len(points), "estimate"), opacity, "surface")
    drawn["edges"] = Links(_segments(points, body.edges), COLOURS["estimate"], 2.0, "shape")
    drawn["points"] = Points(points[near].astype(np.float32), _colour(int(near.sum()), "estimate"), POINT, "shape")
    bounded = near & (sd < LARGEST_SD)
    drawn["uncertainty"] = Ellipsoids(
        points[bounded].astype(np.float32),
        covariances[bounded].astype(np.float32),
        _colour(int(bounded.sum()), "observation"),
        0.25,
        "uncertainty",
    )
    if not len(body.edges):
        drawn |= _scatter(points, near, body.names)
    if second is not None:
        other = align_similarity(second, points)(second)
        drawn["second edges"] = Links(_segments(other, body.edges), COLOURS["second"], 1.5, "second run")
        inside = other[np.linalg.norm(other, axis=1) < RADIUS].astype(np.float32)
        drawn["second points"] = Points(inside, _colour(len(inside), "second"), 0.7 * POINT, "second run")
    way = -turn[2]
    ends = np.outer((CAMERA_AT, CAMERA_TO), way)[None].astype(np.float32)
    drawn["camera"] = Arrows(ends, COLOURS["camera"], 2.0, "camera")
    return WorldDrawing(SHAPE_WORLD, drawn)


def _scatter(points: NDArray[np.float64], near: NDArray[np.bool_], names: tuple[str, ...]) -> dict[str, Primitive]:
    """Draw what gives depth to points with nothing between them: stems down to a floor, and their names."""
    feet = points * np.array([1.0, 0.0, 1.0]) + np.array([0.0, FLOOR, 0.0])
    inside = near & (np.linalg.norm(feet, axis=1) < RADIUS)
    stems = np.stack([points, feet], axis=1)[inside].astype(np.float32)
    drawn: dict[str, Primitive] = {"stems": Links(stems, COLOURS["hidden"], 0.5, "shape")}
    for number in np.flatnonzero(near)[:MOST_NAMES]:
        place = points[number].astype(np.float32) * np.float32(NAME_AT)
        if np.linalg.norm(place) < RADIUS:
            drawn[f"name {names[number]}"] = Text(place, names[number], COLOURS["camera"], "names", anchor="middle")
    return drawn


def _segments(points: NDArray[np.float64], edges: NDArray[np.int64]) -> NDArray[np.float32]:
    """Return the edges (m, 2, 3) whose ends are both within the world."""
    ends = points[edges].astype(np.float32).reshape(-1, 2, 3)
    within: NDArray[np.float32] = ends[(np.linalg.norm(ends, axis=2) < RADIUS).all(axis=1)]
    return within


def _colour(count: int, colour: str) -> NDArray[np.uint8]:
    return np.tile(np.array(COLOURS[colour], np.uint8), (count, 1))
