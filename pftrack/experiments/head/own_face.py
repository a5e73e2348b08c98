"""How a face model that grows is drawn: coloured by how sure it is, over the mean face that it began with.

Each point has its ellipsoid of two standard deviations. Between the points the surface is as sure as those near it, and
far from all of them as unsure as people vary: there nothing was seen.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.drawing import COLOURS, Ellipsoids, Links, Mesh, Primitive
from pftrack.core.model.layer import Key, Layer
from pftrack.experiments.head.sketch import front
from pftrack.vision.geometry.face_model import FaceModel
from pftrack.vision.geometry.head_surface import CORRECTION_SD_MM
from pftrack.vision.rendering.heat import viridis
from pftrack.vision.structure.growing import Growing

__all__ = ["MASK_OPACITY", "MEAN_FACE", "UNCERTAINTY", "draw_grown_face", "surface_colours"]

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


def _deviations(covariances: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return standard deviations (n,) of places in space."""
    variances: NDArray[np.float64] = np.trace(covariances, axis1=1, axis2=2)
    return np.sqrt(variances)


def _shares(deviations_mm: NDArray[np.float64]) -> NDArray[np.float64]:
    return (deviations_mm - SURE_MM) / (UNSURE_MM - SURE_MM)
