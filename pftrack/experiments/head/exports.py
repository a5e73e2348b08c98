"""Files for other programs: the surface of the head as it is assumed, its eleven points, and where these were seen.

A face model that grows is coloured by how sure it is, over the mean face that it began with. Each point has its
ellipsoid of two standard deviations. Between the points the surface is as sure as those near it, and far from all of
them as unsure as people vary: there nothing was seen.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Floats
from pftrack.core.model.diagnostics import Diagnostics
from pftrack.core.model.drawing import Ellipsoids, Key, Layer, Links, Mesh, Primitive
from pftrack.core.model.palette import COLOURS
from pftrack.core.model.setup import Export, Make
from pftrack.experiments.head.appearance import HeadMemory
from pftrack.experiments.head.draw import front
from pftrack.experiments.shared.pose.state import PoseState
from pftrack.experiments.shared.sketch import colours
from pftrack.sources.tracks.table import write
from pftrack.vision.geometry.face import CORRECTION_SD_MM, FEATURES, FaceModel
from pftrack.vision.model_files import Surface, as_json, as_obj, upright
from pftrack.vision.rendering.projection import viridis
from pftrack.vision.structure.growing import Growing

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
