"""Pieces of drawings of a head, and what is measured and shown of a face model that grows.

The distance of a growing model from the true face is measured where that is known. Turned, moved and scaled onto the
true face first, since no camera tells size or origin of a face.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Floats, Ints
from pftrack.core.geometry.rotation import rotation
from pftrack.core.model.drawing import Links, Mesh
from pftrack.core.model.glossary import Term
from pftrack.core.model.palette import Colour
from pftrack.core.model.plot import Plot, Reading
from pftrack.core.model.series import Series, SeriesValue
from pftrack.core.model.source import Frame
from pftrack.experiments.head.appearance import HeadMemory
from pftrack.experiments.shared.pose.drawing import dashes, place_points, pose_measure
from pftrack.experiments.shared.pose.state import PoseState
from pftrack.vision.geometry.face import FaceModel, grid_triangles, head_mesh
from pftrack.vision.structure.tracks import residuals

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

    vertices_mm: Floats
    normals: Floats
    triangles: NDArray[np.int32]
    edges: Ints
    few_edges: Ints


@dataclass(frozen=True, eq=False)
class PlacedHead:
    """A head over its picture: where it is believed to be, in that pose or in another one.

    Attributes:
        state: Where it is believed to be.
        theta: (3,) angles in which to draw it, rad.
        shift_px: (2,) where else in the picture to draw it.
    """

    state: PoseState
    theta: Floats
    shift_px: Floats = field(default_factory=lambda: np.zeros(2))

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

    def _draw(self, points_mm: Floats) -> NDArray[np.float32]:
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


def _grid_lines(height: int, width: int, every_row: int, every_column: int) -> Ints:
    """Return the edges (k, 2) along every so-many-th row and column of a grid of vertices."""
    places = np.arange(height * width).reshape(height, width)
    along = np.stack([places[::every_row, :-1], places[::every_row, 1:]], axis=-1)
    down = np.stack([places[:-1, ::every_column], places[1:, ::every_column]], axis=-1)
    return np.concatenate([along.reshape(-1, 2), down.reshape(-1, 2)])


SHAPE_ERROR = Series("shape_error_mm", "distance of the face model from the driver's face", "mm")

GROWTH_PLOTS = (
    Plot(
        "own_share",
        "share of the own face",
        "value",
        "How much of the person's own face is in the model, 0 to 1; it moves as far as the evidence says that it "
        "predicts better than the mean face.",
        series=("own_share",),
    ),
    Plot(
        "shape_error",
        "error of the face model",
        "value",
        "How far the points of the face model are from the driver's face, root mean square.",
        unit="mm",
        series=(SHAPE_ERROR.name,),
    ),
    Plot(
        "free_energy",
        "log density of features",
        "value",
        "What the own face expected of the features before it learned from them, up to a constant.",
        series=("free_energy",),
    ),
)
"""Shown beside the plots of a pose when the model grows."""

GROWTH_READINGS = (
    Reading("own face", "value", series="own_share"),
    Reading("face model sure to", "value", unit="mm", series="shape_sd_mm"),
    Reading("frames learned", "value", unit="frames", series="shape_frames"),
)

GROWTH_TERMS = (
    Term("own face", "how much of this person's own shape is in the face model, 0 to 1; 0 is the mean face"),
    Term("face model", "the points of a face in space; it may grow from the mean face to that of the person"),
    Term("frames learned", "how many frames the face model has been learned from so far"),
)


def head_measure(frame: Frame, state: PoseState) -> Mapping[str, SeriesValue]:
    """Return the measurements of the pose, and of a face model that grows its distance from the truth."""
    values = dict(pose_measure(frame, state))
    memory: HeadMemory = state.memory
    known = None if frame.target is None else frame.target.landmarks
    if memory.growth is not None and known is not None:
        apart = residuals(memory.growth.shape, known.model_mm, "similarity")
        values[SHAPE_ERROR.name] = float(np.sqrt(np.square(apart).mean()))
    return values
