"""Pieces of drawings of a head: its surface with some of its lines, and where it looks."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from pftrack.drawing import Colour, Links, Mesh, Polyline, Primitive
from pftrack.experiments.pose_sketch import dashes
from pftrack.geometry.face_model import FaceModel
from pftrack.geometry.head_surface import HeadMesh, head_mesh
from pftrack.geometry.rotation import rotation
from pftrack.trackers.head_memory import HeadMemory
from pftrack.trackers.pose_state import PoseState

__all__ = ["head_surface", "look"]

LONGITUDES, LATITUDES = 25, 29
LINE_EVERY = 6
"""Of the surface's lines every so-many-th is drawn."""

DEEPEST_MM = 60.0
"""Of the head only what is in front of this is drawn: the rest is hair, and behind the picture."""

LOOK_MM = 110.0
"""Length of the line that shows where the head looks."""


@dataclass(frozen=True, eq=False)
class Front:
    """The front of a head.

    Attributes:
        vertices_mm: (n, 3).
        normals: (n, 3) outwards.
        triangles: (m, 3) places of vertices.
        edges: (k, 2) places of the ends of the lines that are drawn.
    """

    vertices_mm: NDArray[np.float64]
    normals: NDArray[np.float64]
    triangles: NDArray[np.int32]
    edges: NDArray[np.int64]


def head_surface(state: PoseState, memory: HeadMemory, colour: Colour) -> dict[str, Primitive]:
    """Draw the head of the estimated pose: its surface, and lines on it, dashed where they are on the far side."""
    front = _front(memory.model)
    places = state.drawn(front.vertices_mm @ memory.turn.T).astype(np.float32)
    towards = -(front.normals @ memory.turn.T @ rotation(state.pose.mean).T)[:, 2]
    near = towards[front.edges].mean(axis=1) > 0.0
    lines = places[front.edges]
    return {
        "head": Mesh(places, front.triangles, colour, 0.25, "head"),
        "head lines": Links(lines[near], colour, 1.0, "head"),
        "hidden head lines": dashes(lines[~near], colour, 1.0, "head", length=2.0),
    }


def look(state: PoseState, memory: HeadMemory, theta: NDArray[np.float64], colour: Colour, layer: str) -> Polyline:
    """Draw where a head of this pose looks, from the tip of the estimated nose: straight out of frame 0's picture."""
    tip = state.drawn((memory.turn @ memory.model["nose"])[None])[0]
    ahead = rotation(theta) @ np.array([0.0, 0.0, -LOOK_MM])
    # Drawings count height towards the viewer, the camera counts depth away from them.
    end = tip + state.solid.scale * ahead * np.array([1.0, 1.0, -1.0])
    return Polyline(np.stack([tip, end]).astype(np.float32), colour, 3.0, layer)


@lru_cache(maxsize=8)
def _front(model: FaceModel) -> Front:
    mesh: HeadMesh = head_mesh(model, LONGITUDES, LATITUDES)
    ahead = mesh.vertices_mm[:, 2] < DEEPEST_MM
    used, triangles = np.unique(mesh.triangles[ahead[mesh.triangles].all(axis=1)], return_inverse=True)
    grid = np.arange(LONGITUDES * LATITUDES).reshape(LATITUDES, LONGITUDES)
    along = np.stack([grid[:, :-1], grid[:, 1:]], axis=-1)[LINE_EVERY // 2 :: LINE_EVERY].reshape(-1, 2)
    down = np.stack([grid[:-1], grid[1:]], axis=-1)[:, ::LINE_EVERY].reshape(-1, 2)
    edges = np.concatenate([along, down])
    kept = edges[np.isin(edges, used).all(axis=1)]
    return Front(
        mesh.vertices_mm[used],
        mesh.normals[used],
        triangles.reshape(-1, 3).astype(np.int32),
        np.searchsorted(used, kept),
    )
