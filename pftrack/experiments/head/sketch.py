"""Pieces of drawings of a head: its surface with some of its lines, and where it looks."""

from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from pftrack.core.geometry.rotation import rotation
from pftrack.core.model.drawing import Colour, Links, Mesh
from pftrack.experiments.head.trackers.memory import HeadMemory
from pftrack.experiments.shared.pose.state import PoseState
from pftrack.experiments.shared.pose_placing import place_points
from pftrack.experiments.shared.pose_sketch import dashes
from pftrack.vision.geometry.face_model import FaceModel
from pftrack.vision.geometry.head_surface import grid_triangles, head_mesh

__all__ = ["Front", "PlacedHead", "front"]

LONGITUDES, LATITUDES = 27, 33
CUT_COLUMNS, CUT_ROWS = 5, 4
"""Of the head only what is within about 70 degrees of straight ahead is drawn: the rest is hair."""

LINE_EVERY = 4
"""Of the surface's lines every so-many-th is drawn, and its border."""

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
        few_edges: Those of the border and of the middle lines.
    """

    vertices_mm: NDArray[np.float64]
    normals: NDArray[np.float64]
    triangles: NDArray[np.int32]
    edges: NDArray[np.int64]
    few_edges: NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class PlacedHead:
    """A head over its picture: where it is believed to be, in that pose or in another one.

    Attributes:
        state: Where it is believed to be.
        theta: (3,) angles in which to draw it, rad.
        shift_px: (2,) where else in the picture to draw it.
    """

    state: PoseState
    theta: NDArray[np.float64]
    shift_px: NDArray[np.float64] = field(default_factory=lambda: np.zeros(2))

    def surface(self, colour: Colour | NDArray[np.uint8], opacity: float, layer: str = "head") -> dict[str, Mesh]:
        """Draw its surface, in one colour or in one for each vertex."""
        shape = front(self._memory.model)
        return {"head": Mesh(self._draw(shape.vertices_mm), shape.triangles, colour, opacity, layer)}

    def lines(self, name: str, colour: Colour, width: float, layer: str, *, few: bool = False) -> dict[str, Links]:
        """Draw lines on it, broken on its far side; or a few only, for a ghost."""
        shape = front(self._memory.model)
        edges = shape.few_edges if few else shape.edges
        places = self._draw(shape.vertices_mm)[edges]
        towards = shape.normals @ -(rotation(self.theta) @ self._memory.turn)[2]
        near = towards[edges].mean(axis=1) > 0.0
        return {
            f"hidden {name} lines": dashes(places[~near], colour, width, layer, length=2.0),
            f"{name} lines": Links(places[near], colour, width, layer),
        }

    def look(self, colour: Colour, width: float, layer: str) -> Links:
        """Draw where it looks, from the tip of its nose: straight out of frame 0's picture."""
        ahead = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, -LOOK_MM]]) @ self._memory.turn
        return Links(self._draw(self._memory.model["nose"] + ahead)[None], colour, width, layer)

    @property
    def _memory(self) -> HeadMemory:
        memory: HeadMemory = self.state.memory
        return memory

    def _draw(self, points_mm: NDArray[np.float64]) -> NDArray[np.float32]:
        """Return where points (n, 3) of the model are drawn, (n, 3) px."""
        places = place_points(self.state, points_mm @ self._memory.turn.T, self.theta)
        places[:, :2] += self.shift_px
        return places.astype(np.float32)


@lru_cache(maxsize=8)
def front(model: FaceModel) -> Front:
    """Return the front of the head of a face model."""
    mesh = head_mesh(model, LONGITUDES, LATITUDES)
    whole = np.arange(LONGITUDES * LATITUDES).reshape(LATITUDES, LONGITUDES)
    rows, columns = slice(CUT_ROWS, LATITUDES - CUT_ROWS), slice(CUT_COLUMNS, LONGITUDES - CUT_COLUMNS)
    kept = whole[rows, columns]
    height, width = kept.shape
    return Front(
        mesh.vertices_mm[kept.ravel()],
        mesh.normals[kept.ravel()],
        grid_triangles(width, height),
        _grid_lines(height, width, LINE_EVERY, LINE_EVERY),
        _grid_lines(height, width, height // 2, width // 2),
    )


def _grid_lines(height: int, width: int, every_row: int, every_column: int) -> NDArray[np.int64]:
    """Return the edges (k, 2) along every so-many-th row and column of a grid of vertices."""
    places = np.arange(height * width).reshape(height, width)
    along = np.stack([places[::every_row, :-1], places[::every_row, 1:]], axis=-1)
    down = np.stack([places[:-1, ::every_column], places[1:, ::every_column]], axis=-1)
    return np.concatenate([along.reshape(-1, 2), down.reshape(-1, 2)])
