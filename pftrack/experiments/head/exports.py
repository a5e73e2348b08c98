"""Files for other programs: the surface of the head as it is assumed, its eleven points, and where these were seen."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.diagnostics import Diagnostics
from pftrack.core.model.drawing import COLOURS
from pftrack.core.model.export import Export, Make
from pftrack.experiments.head.own_face import surface_colours
from pftrack.experiments.head.sketch import front
from pftrack.experiments.head.trackers.memory import HeadMemory
from pftrack.experiments.shared.pose.state import PoseState
from pftrack.sources.tracks.table import write
from pftrack.vision.geometry.face_model import FEATURES
from pftrack.vision.model_files.points import as_json
from pftrack.vision.model_files.surface import Surface, as_glb, as_obj, as_ply, upright

__all__ = ["EXPORTS"]

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
    return np.tile(np.array(COLOURS["estimate"], np.uint8), (count, 1))


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
    Export(
        "face-glb", "Face model, glTF", "glb", "model/gltf-binary", _of_frame(lambda state: as_glb(surface_of(state)))
    ),
    Export("face-obj", "Face model, OBJ", "obj", "model/obj", _of_frame(lambda state: as_obj(surface_of(state)))),
    Export("face-ply", "Face model, PLY", "ply", "model/ply", _of_frame(lambda state: as_ply(surface_of(state)))),
    Export("face-json", "Points of the face model, JSON", "points.json", "application/json", _of_frame(points_of)),
    Export(
        "tracks",
        "Tracks of the features up to here, CSV",
        "tracks.csv",
        "text/csv",
        lambda _state, past: tracks_of(past),
    ),
)
