"""A driver's head, simulated or on any recording: its pose by eleven features (Bando 2007, ch. 4 section 4).

A feature that turns away or is covered no longer looks like its template; only the pose of the head, estimated from the
other features, then gives its place. The adaptive sampling distribution learns for each feature how far to trust each
prediction.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Floats, Ints
from pftrack.core.geometry import rotation
from pftrack.core.model.drawing import (
    COLOURS,
    Arrows,
    Axes,
    Colour,
    Drawing,
    Ellipsoids,
    Links,
    Mesh,
    Picture,
    Primitive,
    Text,
    WorldDrawing,
)
from pftrack.core.model.measures import POSE_MEASURES
from pftrack.core.model.series import Series, SeriesValue
from pftrack.core.model.setup import Export, Setup
from pftrack.core.model.source import Frame, Target
from pftrack.core.model.tracker import Diagnostics, Step
from pftrack.core.numerics.elementary import wrap
from pftrack.experiments.declared import read_words, read_worlds
from pftrack.experiments.experiment import Experiment, Measured, Video
from pftrack.experiments.head import recording
from pftrack.experiments.head.appearance import HeadMemory
from pftrack.experiments.head.parameters import HeadTrackerParameters
from pftrack.experiments.head.scene import HeadSceneParameters, HeadSource
from pftrack.experiments.head.trackers import TRACKERS
from pftrack.experiments.shared.pose import SHOWN_OF_POSES, drawing
from pftrack.experiments.shared.pose.state import PoseState
from pftrack.experiments.shared.sketch import caption, colours, dots, error_words
from pftrack.sources.tracks import write
from pftrack.vision.face import CORRECTION_SD_MM, FEATURES, LINKS, TITLES, FaceModel, gaze, grid_triangles, head_mesh
from pftrack.vision.model_files import Surface, as_json, as_obj, upright
from pftrack.vision.rendering import viridis
from pftrack.vision.structure.factorization import residuals
from pftrack.vision.structure.growing import Growing

FOLDER = Path(__file__).parent

SHAPE_ERROR = Series("shape_error_mm", "distance of the face model from the driver's face", "mm")

(HEAD_WORLD,) = read_worlds(FOLDER, SHOWN_OF_POSES)

# Pieces of drawings of a head, and what is measured and shown of a face model that grows.
#
# The distance of a growing model from the true face is measured where that is known. First turned, moved and scaled
# onto the true face, since a camera does not show size or origin of a face.
#
# Files for other programs: the assumed surface of the head, its eleven points, and their measured places.
#
# A growing face model is coloured by its uncertainty, over its initial mean face. Each point has its ellipsoid of two
# standard deviations. Between the points the surface is as sure as those near it, and far from all of them as unsure as
# people vary: there nothing was seen.

LONGITUDES, LATITUDES = 27, 33
CUT_COLUMNS, CUT_ROWS = 5, 4
"""Only the part of the head within about 70 degrees of straight ahead is drawn: the rest is hair."""

LINE_EVERY = 4
"""Every n-th line of the surface is drawn, and its border."""

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
    """A head over its picture, in the believed pose or in another one.

    Attributes:
        state: The belief in its pose.
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
            f"hidden {name} lines": drawing.dashes(places[~near], colour, width, layer, length=2.0),
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
        places = drawing.place_points(self.state, points_mm @ self._memory.turn.T, self.theta)
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


def head_measure(frame: Frame, state: PoseState) -> Mapping[str, SeriesValue]:
    """Return the measurements of the pose, and of a face model that grows its distance from the truth."""
    values = dict(drawing.pose_measure(frame, state))
    memory: HeadMemory = state.memory
    known = None if frame.target is None else frame.target.landmarks
    if memory.growth is not None and known is not None:
        apart = residuals(memory.growth.shape, known.model_mm, "similarity")
        values[SHAPE_ERROR.name] = float(np.sqrt(np.square(apart).mean()))
    return values


SURE_MM, UNSURE_MM = 0.5, 3.0
"""Standard deviations of a place in space at both ends of the colours."""

UNCERTAINTY, MEAN_FACE = "uncertainty of the model", "mean face"
"""Layers."""

MASK_OPACITY, SOLID_OPACITY = 0.3, 0.6
"""On the picture, which must be seen through it, and in the world."""

ELLIPSOID_OPACITY = 0.4
REACH_MM = CORRECTION_SD_MM
"""Distance up to which a point bends the surface."""

UNKNOWN = 0.2
"""An unseen part weighs as much as a point 1.8 times the reach away."""


def draw_grown_face(growth: Growing, model: FaceModel) -> dict[str, Primitive]:
    """Draw the face as it has grown, its points' uncertainty, and the mean face as a thin wire, in mm."""
    own, usual = front(model), front(FaceModel(growth.mean_shape, model.names))
    vertices = own.vertices_mm.astype(np.float32)
    colours = surface_colours(growth, model)
    covariances = growth.covariances
    return {
        "surface": Mesh(vertices, own.triangles, colours, SOLID_OPACITY, UNCERTAINTY),
        "mean face": Links(usual.vertices_mm.astype(np.float32)[usual.edges], COLOURS["hidden"], 0.5, MEAN_FACE),
        "model ellipsoids": Ellipsoids(
            model.points_mm.astype(np.float32),
            covariances.astype(np.float32),
            viridis(_shares(_deviations(covariances))),
            ELLIPSOID_OPACITY,
            UNCERTAINTY,
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
    """Return the points of the model as JSON, with standard deviations and its data if it grows."""
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
        past: History of all frames from 0 on.
    """
    unknown = (np.nan,) * len(FEATURES)
    x, y, sd = (
        np.array([row.vector(name) or unknown for row in past], dtype=np.float64)
        for name in ("feature_x_px", "feature_y_px", "track_sd_px")
    )
    variances = np.where(np.isnan(sd), np.inf, np.square(sd))
    return write(FEATURES, np.stack([x, y], axis=2), np.stack([variances, variances], axis=2)).encode()


EXPORTS = (
    Export("face-obj", "Face model, OBJ", "obj", "model/obj", lambda state, _: as_obj(surface_of(state))),
    Export(
        "face-json",
        "Points of the face model, JSON",
        "points.json",
        "application/json",
        lambda state, _: points_of(state),
    ),
    Export(
        "tracks", "Tracks of the features up to here, CSV", "tracks.csv", "text/csv", lambda _, past: tracks_of(past)
    ),
)


# The world of the head, in mm in the head's own frame and at rest while the picture's head turns, shows what the
# tracker assumes of the head, where in it each feature is seen in this frame, and from where the camera looks at it. A
# feature is known across the camera's line of sight only, so its uncertainty is a disc that faces the camera, at the
# depth of the model's point.

RADIUS_MM = 130.0
POINT_MM = 4.5
AXES_MM = 50.0
NAMES_AT = 1.15
"""Position of an axis's name, in lengths of the axis."""
ARROW_MM = (62.0, 98.0)
"""Distances from the head's origin at which the arrow towards the camera begins and ends, clear of the face."""
NAME_ABOVE_MM = 11.0
"""Distance of its name above the end of the arrow."""
TRUE_ARROW_MM = (62.0, 90.0)
LARGEST_SD_MM = RADIUS_MM / 2.0
"""Largest standard deviation of a feature's place: two of a larger one would reach beyond the world and hide all of
it."""


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
    pairs = [(model.names.index(one), model.names.index(other)) for one, other in LINKS]
    return {
        "surface": Mesh(vertices, shape.triangles, colour, 0.22, "head"),
        "lines": Links(vertices[shape.edges], COLOURS["hidden"], 0.5, "head"),
        "face": Links(points[np.array(pairs)], colour, 1.5, "model points"),
        "points": dots(points, colour, POINT_MM, "model points"),
    }


def _axes() -> dict[str, Primitive]:
    colour = COLOURS["hidden"]
    axes = np.eye(3, dtype=np.float32)
    drawn: dict[str, Primitive] = {"axes": Axes(np.zeros(3, np.float32), axes, AXES_MM, colour, 1.5, "axes")}
    for name, axis in zip("xyz", axes, strict=True):
        drawn[f"axis {name}"] = Text(np.float32(NAMES_AT * AXES_MM) * axis, name, colour, "axes", anchor="middle")
    return drawn


def _features(state: PoseState, turn: Floats) -> Ellipsoids:
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


def _arrow(state: PoseState, turn: Floats, reach_mm: tuple[float, float], colour: str, layer: str) -> Arrows:
    """Draw an arrow from before the face towards the camera, for a head that is turned so."""
    way = _to_camera(state) @ turn
    ends = np.outer(reach_mm, way / np.linalg.norm(way))
    return Arrows(ends[None].astype(np.float32), COLOURS[colour], 3.0, layer)


def _to_camera(state: PoseState) -> Floats:
    """Return the direction (3,) to the camera, in the camera's frame: an affine one sees along parallels."""
    place = state.belief.place_mm
    if place is not None:
        return -place
    along: Floats = np.cross(state.solid.reference[0, :3], state.solid.reference[1, :3])
    return -along if along[2] > 0.0 else along


SAID_FOR_S = 1.0
"""Duration of the message that a face was found again."""


class SimulatedHeadParameters(HeadTrackerParameters, HeadSceneParameters):
    """The simulated driver and its trackers."""


def simulate() -> Setup:
    """Wire the simulated driver, whose camera and features' size are known."""
    return Setup(HeadSource, SimulatedHeadParameters())


def draw(step: Step, past: Sequence[Diagnostics], other: Diagnostics | None = None) -> Drawing:
    """Draw a frame: picture, head, particles, features, where the head looks; the head in its true pose, in another's.

    A separate world next to it shows the model of the head.

    The head of a second run is drawn in its pose, but where this one is: a row holds only the pose.
    """
    image, state = step.frame.picture, step.state
    memory: HeadMemory = state.memory
    height, width, _ = image.shape
    mark = max(width, height) / 250.0
    primitives: dict[str, Primitive] = {"picture": Picture(image)}
    head = PlacedHead(state, state.estimate)
    if memory.lost:
        primitives |= head.surface(COLOURS["lost"], 0.1)
        primitives |= head.lines("head", COLOURS["lost"], 1.0, "head")
    else:
        growth = memory.growth
        if growth is None:
            primitives |= head.surface(COLOURS["estimate"], 0.18)
        else:
            primitives |= head.surface(surface_colours(growth, memory.model), MASK_OPACITY, UNCERTAINTY)
        primitives |= head.lines("head", COLOURS["estimate"], 2.0, "head")
    if other is not None:
        second = PlacedHead(state, np.array(other.estimate) / drawing.JUDGE.scale)
        primitives |= second.lines("second", COLOURS["second"], 1.5, "second run", few=True)
        primitives["second look"] = second.look(COLOURS["second"], 2.0, "second run")
    if not memory.lost:
        primitives |= drawing.feature_clouds(state, mark)
        primitives |= drawing.model_points(state, mark)
        primitives |= drawing.feature_marks(state, FEATURES)
        names = drawing.beside(state.feature_means, memory.model.points_mm[:, :2], height)
        primitives |= drawing.feature_names(state, FEATURES, names, TITLES)
        primitives["look"] = head.look(COLOURS["estimate"], 3.0, "viewing direction")
        primitives |= drawing.pose_axes(state, memory.turn @ memory.model["nose"], AXES_MM)
    if step.frame.target is not None:
        primitives |= _truth(state, step.frame.target, mark)
    primitives |= drawing.camera(state, (width, height))
    return Drawing(width, height, primitives, _caption(step, past), (head_world(state, step.frame.target),))


def _truth(state: PoseState, target: Target, size: float) -> dict[str, Primitive]:
    """Draw the head in its true pose, and its features where they truly are."""
    head = PlacedHead(state, target.position, _apart(state, target))
    lines = {**head.lines("true", COLOURS["truth"], 1.0, "truth", few=True)}
    lines["true look"] = head.look(COLOURS["truth"], 1.0, "truth")
    drawn: dict[str, Primitive] = {}
    for name, line in lines.items():
        drawn |= drawing.draw_with_rim(name, line)
    return drawn if target.landmarks is None else drawn | drawing.true_marks(target.landmarks, size)


def _apart(state: PoseState, target: Target) -> Floats:
    """Return the offset of the true head from the believed one in the picture, (2,) px, where known."""
    if target.landmarks is None:
        return np.zeros(2)
    off = target.landmarks.points_px - state.project(state.solid.points_mm, target.position)
    mean: Floats = off.mean(axis=0)
    return mean


def _caption(step: Step, past: Sequence[Diagnostics]) -> str:
    row, memory = step.diagnostics, step.state.memory
    yaw, pitch, roll = np.rad2deg(gaze(step.state.estimate))
    parts = []
    if memory.lost:
        frames = f"{memory.lost_frames} frame" + ("s" if memory.lost_frames > 1 else "")
        parts.append(f"no face for {frames}, looking for it")
    else:
        parts.append(f"yaw {round(yaw)}°, pitch {round(pitch)}°, roll {round(roll)}°")
        if _is_found_again(row, past):
            parts.append("face found again")
    return caption(row, *parts, error_words(row, "°"), step.tracker_title)


def _is_found_again(row: Diagnostics, past: Sequence[Diagnostics]) -> bool:
    """Whether there is a face that was lost a moment ago, and is not lost by the truth, which has the last word."""
    if row.lost:
        return False
    for before in reversed(past[: row.frame]):
        if row.time_s - before.time_s > SAID_FOR_S:
            return False
        if before.searching:
            return True
    return False


def report(rows: Sequence[Diagnostics]) -> Mapping[str, Any]:
    """Report the turns of the head in a whole run, the share of tracked frames, and the error, if the truth is known.

    The errors are those of yaw, pitch and roll after both the estimate and the truth have been taken relative to the
    first frame whose truth is known. A frame counts as tracked if there is a face and it is not known to be lost.
    """
    found = {name: [row.number(f"{name}_deg") for row in rows] for name in ("yaw", "pitch", "roll")}
    said: dict[str, Any] = {f"{name}_deg": values for name, values in found.items()}
    said["tracked_share"] = float(np.mean([not row.is_lost for row in rows]))
    labelled = np.array([row.truth is not None for row in rows])
    said["mean_abs_error_deg"] = None
    if labelled.any():
        errors = {}
        for name, values in found.items():
            truth = np.array([row.number(f"{name}_deg_true") for row in rows])
            off = (np.array(values) - truth)[labelled]
            errors[name] = float(np.abs(np.rad2deg(wrap(np.deg2rad(off - off[0])))).mean())
        said["mean_abs_error_deg"] = errors
    return said


EXPERIMENT = Experiment(
    **read_words(
        FOLDER,
        TRACKERS,
        SHOWN_OF_POSES,
        Measured((*drawing.pose_series(FEATURES), SHAPE_ERROR), head_measure, POSE_MEASURES, report),
    ),
    id="head",
    exports=(*EXPORTS, SimulatedHeadParameters.guidance.export),
    guidance=SimulatedHeadParameters.guidance,
    simulate=simulate,
    draw=draw,
    judge=drawing.JUDGE,
    video=Video(
        recording.wire,
        recorded=lambda _kind: recording.RecordedHeadParameters(),
        marks=(recording.FacePoints, recording.FaceBox),
        wanted="features of a face, or a box around it",
        advice="Left and right are the person's own.",
        finder=recording.FINDER,
        suits=recording.suits,
        truth=recording.POSES,
        clip_about=("sample_count", "face_model", "hidden_weight", "template_renewal", "pose_band", "find_again"),
    ),
)
