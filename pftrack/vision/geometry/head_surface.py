"""The surface of a head through the eleven points of a face (docs/methods/heads.md).

An egg, a nose on it, and a smooth correction that makes the surface pass through every point of the face model and
keeps its shape between them. Depth is a function of (x, y) in front; the mesh goes round to behind the ears, with the
correction faded out. Units and axes are the face model's: mm, x to the right of the picture, y down, z away from it.

The full mesh has 200 x 220 vertices. The shape is smooth, so half as many in either direction show the same picture
when colour is looked up for every pixel and only shape and light are interpolated.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from pftrack.core.numerics.elementary import exponential, power
from pftrack.core.numerics.matrices import product, solve_system
from pftrack.vision.geometry.face_model import FaceModel

__all__ = ["HeadMesh", "HeadSurface", "grid_triangles", "head_mesh"]

HALF_WIDTH_MM, HALF_HEIGHT_MM, HALF_DEPTH_MM = 75.0, 115.0, 95.0
MIDDLE_Y_MM = 8.0
FLATNESS = 2.5
"""Exponent along y; at 2 the head would be an ellipsoid."""

ANCHORS_MM = (
    (0.0, -70.0), (40.0, -50.0), (-40.0, -50.0), (50.0, 45.0), (-50.0, 45.0), (60.0, 0.0), (-60.0, 0.0), (0.0, -35.0),
    (0.0, 100.0),
)  # fmt: skip
ANCHOR_CORRECTION_MM = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -14.0)
"""Forehead, cheeks and temples stay on the egg; the chin comes forward."""

CORRECTION_SD_MM = 16.0
RIDGE = 1e-3
LONGITUDE, LATITUDE = np.deg2rad(115.0), np.deg2rad(89.5)
"""Ending at 86 degrees of latitude, as the reference implementation does, leaves a notch at the crown."""


@dataclass(frozen=True, eq=False)
class HeadMesh:
    """A triangle mesh of a head.

    Attributes:
        vertices_mm: (n, 3) in the head's frame.
        triangles: (m, 3) int32 indices of vertices, clockwise as seen from outside in a frame with y down.
        normals: (n, 3) unit vectors that point outwards.
    """

    vertices_mm: NDArray[np.float64]
    triangles: NDArray[np.int32]
    normals: NDArray[np.float64]


class HeadSurface:
    """Depth of the front of a head through the points of a face."""

    def __init__(self, model: FaceModel) -> None:
        """Solve for the correction.

        Args:
            model: The face that the surface passes through.
        """
        self._nose = model["nose"]
        self._centres = np.vstack([model.points_mm[:, :2], ANCHORS_MM])
        x, y = model.points_mm[:, 0], model.points_mm[:, 1]
        missing = model.points_mm[:, 2] - egg_depth(x, y) - self._nose_depth(x, y)
        wanted = np.concatenate([missing, ANCHOR_CORRECTION_MM])
        kernel = self._kernel(self._centres[:, 0], self._centres[:, 1])
        self._weights = solve_system(kernel + RIDGE * np.eye(len(wanted)), wanted)

    def depth(self, x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return z in mm at (x, y) in mm, arrays of equal shape."""
        return egg_depth(x, y) + self.correction(x, y)

    def correction(self, x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return what nose and correction add to the egg's depth, mm."""
        kernel = self._kernel(x, y)
        corrected = product(kernel.reshape(-1, len(self._weights)), self._weights).reshape(np.shape(x))
        added: NDArray[np.float64] = self._nose_depth(x, y) + corrected
        return added

    def _kernel(self, x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
        away = (x[..., None] - self._centres[:, 0]) ** 2 + (y[..., None] - self._centres[:, 1]) ** 2
        return exponential(-away / (2.0 * CORRECTION_SD_MM**2))

    def _nose_depth(self, x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the nose alone: a ridge that rises and widens down to the tip, and ends below it."""
        _, tip_y, tip_z = self._nose
        along = np.maximum(0.0, (y + 4.0) / (tip_y + 4.0))
        width = 6.0 + 5.0 * np.minimum(along, 1.2)
        below = exponential(-((np.maximum(y - tip_y, 0.0) / 6.0) ** 2) / 2.0)
        ridge = power(np.minimum(along, 1.0), 1.4) * below * exponential(-((x / width) ** 2) / 2.0)
        depth: NDArray[np.float64] = 0.85 * tip_z * ridge
        return depth


def egg_depth(x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the depth of the egg's front at (x, y), mm; beyond its outline, that of its widest section."""
    off = power(np.abs(y - MIDDLE_Y_MM) / HALF_HEIGHT_MM, FLATNESS)
    inside = np.maximum(0.0, 1.0 - (x / HALF_WIDTH_MM) ** 2 - off)
    depth: NDArray[np.float64] = HALF_DEPTH_MM - HALF_DEPTH_MM * np.sqrt(inside)
    return depth


def head_mesh(model: FaceModel, longitudes: int = 200, latitudes: int = 220) -> HeadMesh:
    """Return the mesh of a head.

    Args:
        model: The face that it passes through.
        longitudes: Vertices from ear to ear, over 230 degrees, at least 3.
        latitudes: Vertices from crown to throat, over 179 degrees, at least 3.
    """
    surface = HeadSurface(model)
    longitude, latitude = np.meshgrid(
        np.linspace(-LONGITUDE, LONGITUDE, longitudes), np.linspace(-LATITUDE, LATITUDE, latitudes)
    )
    x = HALF_WIDTH_MM * np.sin(longitude) * np.cos(latitude)
    y = MIDDLE_Y_MM + HALF_HEIGHT_MM * np.sign(np.sin(latitude)) * power(np.abs(np.sin(latitude)), 2.0 / FLATNESS)
    # Depth is a function of (x, y) in front only: the correction must not show again at the back.
    front = np.clip((np.cos(longitude) - 0.15) / 0.35, 0.0, 1.0)
    z = HALF_DEPTH_MM - HALF_DEPTH_MM * np.cos(longitude) * np.cos(latitude) + surface.correction(x, y) * front
    vertices = np.stack([x, y, z], axis=-1).reshape(-1, 3)
    triangles = grid_triangles(longitudes, latitudes)
    return HeadMesh(vertices, triangles, vertex_normals(vertices, triangles))


@lru_cache(maxsize=4)
def grid_triangles(columns: int, rows: int) -> NDArray[np.int32]:
    """Return the triangles (m, 3) of a grid of vertices, row by row, two a cell."""
    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    first = np.stack([corner, corner + 1, corner + columns], axis=1)
    second = np.stack([corner + 1, corner + columns + 1, corner + columns], axis=1)
    triangles = np.concatenate([first, second]).astype(np.int32)
    triangles.flags.writeable = False
    return triangles


def vertex_normals(vertices: NDArray[np.float64], triangles: NDArray[np.int32]) -> NDArray[np.float64]:
    """Return unit normals (n, 3): those of the adjoining triangles, averaged by area."""
    a, b, c = (vertices[triangles[:, corner]] for corner in range(3))
    # x right, y down, z away: the cross product of a triangle that runs clockwise to the eye points away from it.
    across = np.cross(c - a, b - a)
    normals = np.zeros_like(vertices)
    for axis in range(3):
        for corner in range(3):
            normals[:, axis] += np.bincount(triangles[:, corner], across[:, axis], len(vertices))
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    unit: NDArray[np.float64] = normals / np.maximum(lengths, 1e-12)
    return unit
