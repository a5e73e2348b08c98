"""Pieces of drawings of a head, and what is measured and shown of a face model that grows.

The distance of a growing model from the true face is measured where that is known. Turned, moved and scaled onto the
true face first, since no camera tells size or origin of a face.

Files for other programs: the surface of the head as it is assumed, its eleven points, and where these were seen.

A face model that grows is coloured by how sure it is, over the mean face that it began with. Each point has its
ellipsoid of two standard deviations. Between the points the surface is as sure as those near it, and far from all of
them as unsure as people vary: there nothing was seen.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Floats, Ints
from pftrack.core.geometry.rotation import rotation
from pftrack.core.model.diagnostics import Diagnostics
from pftrack.core.model.drawing import Ellipsoids, Key, Layer, Links, Mesh, Primitive
from pftrack.core.model.glossary import Term
from pftrack.core.model.palette import COLOURS, Colour
from pftrack.core.model.plot import Plot, Reading
from pftrack.core.model.series import Series, SeriesValue
from pftrack.core.model.setup import Export, Make
from pftrack.core.model.source import Frame
from pftrack.experiments.head.appearance import HeadMemory
from pftrack.experiments.shared.pose.drawing import dashes, place_points, pose_measure
from pftrack.experiments.shared.pose.state import PoseState
from pftrack.experiments.shared.sketch import colours
from pftrack.sources.tracks.table import write
from pftrack.vision.geometry.face import CORRECTION_SD_MM, FEATURES, FaceModel, grid_triangles, head_mesh
from pftrack.vision.model_files import Surface, as_json, as_obj, upright
from pftrack.vision.rendering.projection import viridis
from pftrack.vision.structure.growing import Growing
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


SURE_MM, UNSURE_MM = 0.5, 3.0
"""Standard deviations of a place in space at both ends of the colours."""

UNCERTAINTY = Layer(
    "uncertainty of the model",
    legend=(
        Key("sure", f"face model, sure to {SURE_MM:g} mm or less"),
        Key("unsure", f"face model, to {UNSURE_MM:g} mm or more"),
    ),
)
MEAN_FACE = Layer("mean face", legend=(Key("hidden", "mean face, where the model began"),))

MASK_OPACITY, SOLID_OPACITY = 0.3, 0.6
"""On the picture, which must be seen through it, and in the world."""

ELLIPSOID_OPACITY = 0.4
REACH_MM = CORRECTION_SD_MM
"""A point tells of the surface as far as it bends it."""

UNKNOWN = 0.2
"""What nothing was seen of weighs as much as a point 1.8 times the reach away."""


def draw_grown_face(growth: Growing, model: FaceModel) -> dict[str, Primitive]:
    """Draw the face as it has grown, its points' uncertainty, and the mean face as a thin wire, in mm."""
    own, usual = front(model), front(FaceModel(growth.mean_shape, model.names))
    vertices = own.vertices_mm.astype(np.float32)
    colours = surface_colours(growth, model)
    covariances = growth.covariances
    return {
        "surface": Mesh(vertices, own.triangles, colours, SOLID_OPACITY, UNCERTAINTY.name),
        "mean face": Links(usual.vertices_mm.astype(np.float32)[usual.edges], COLOURS["hidden"], 0.5, MEAN_FACE.name),
        "model ellipsoids": Ellipsoids(
            model.points_mm.astype(np.float32),
            covariances.astype(np.float32),
            viridis(_shares(_deviations(covariances))),
            ELLIPSOID_OPACITY,
            UNCERTAINTY.name,
        ),
    }


def surface_colours(growth: Growing, model: FaceModel) -> NDArray[np.uint8]:
    """Return the colours (n, 3) of the vertices of the front of a head, by how sure the model is there."""
    vertices = front(model).vertices_mm
    apart = np.square(vertices[:, None] - model.points_mm).sum(axis=2)
    nearness = np.exp(-apart / (2.0 * REACH_MM**2))
    unknown = _deviations(replace(growth, weight=0.0).covariances).mean()
    known = nearness @ _deviations(growth.covariances) + UNKNOWN * unknown
    return viridis(_shares(known / (nearness.sum(axis=1) + UNKNOWN)))


def _deviations(covariances: Floats) -> Floats:
    """Return standard deviations (n,) of places in space."""
    variances: Floats = np.trace(covariances, axis1=1, axis2=2)
    return np.sqrt(variances)


def _shares(deviations_mm: Floats) -> Floats:
    return (deviations_mm - SURE_MM) / (UNSURE_MM - SURE_MM)


FRAME = "origin midway between the eyes, x to the person's left, y down, z away from the camera"


def surface_of(state: PoseState) -> Surface:
    """Return the front of the head of the model that is assumed, coloured by how sure it is where it grows."""
    memory: HeadMemory = state.memory
    shape = front(memory.model)
    return Surface(
        "face model of pftrack",
        upright(shape.vertices_mm),
        shape.triangles[:, ::-1].copy(),
        _colours(memory, len(shape.vertices_mm)),
    )


def points_of(state: PoseState) -> bytes:
    """Return the points of the model as JSON, with standard deviations and what it was learned from, where it grows."""
    memory: HeadMemory = state.memory
    growth = memory.growth
    model = memory.model
    if growth is None:
        return as_json(model.names, model.points_mm, frame=FRAME)
    spread = np.sqrt(growth.covariances.diagonal(axis1=1, axis2=2))
    return as_json(
        model.names,
        growth.shape,
        frame=FRAME,
        standard_deviations=dict(zip(model.names, np.round(spread, 4).tolist(), strict=True)),
        own_share=round(growth.weight, 4),
        frames=growth.own.frames,
    )


def _colours(memory: HeadMemory, count: int) -> NDArray[np.uint8]:
    if memory.growth is not None:
        return surface_colours(memory.growth, memory.model)
    return colours(count, COLOURS["estimate"])


def tracks_of(past: Sequence[Diagnostics]) -> bytes:
    """Return where the features were seen, as a table of tracks (px, px^2) from which another tracker finds the face.

    A feature that was not recognised in a frame has no line there; nor has a row that an older version has measured.

    Args:
        past: Of all frames from 0 on.
    """
    unknown = (np.nan,) * len(FEATURES)
    x, y, sd = (
        np.array([row.vector(name) or unknown for row in past], dtype=np.float64)
        for name in ("feature_x_px", "feature_y_px", "track_sd_px")
    )
    variances = np.where(np.isnan(sd), np.inf, np.square(sd))
    return write(FEATURES, np.stack([x, y], axis=2), np.stack([variances, variances], axis=2)).encode()


def _of_frame(make: Callable[[Any], bytes]) -> Make:
    return lambda state, _past: make(state)


EXPORTS = (
    Export("face-obj", "Face model, OBJ", "obj", "model/obj", _of_frame(lambda state: as_obj(surface_of(state)))),
    Export("face-json", "Points of the face model, JSON", "points.json", "application/json", _of_frame(points_of)),
    Export(
        "tracks",
        "Tracks of the features up to here, CSV",
        "tracks.csv",
        "text/csv",
        lambda _state, past: tracks_of(past),
    ),
)
