"""What passes in front of the face: a hand, sunglasses, a pillar.

Hand and pillar are laid over the finished picture, each with a mask that says what it hides. Sunglasses are part of the
head: the surface bulges over the eyes into two lenses, and the texture is dark there, so that they turn with it and
hide the eyes from the side as well.
"""

from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from pftrack.core.numerics.elementary import power
from pftrack.experiments.head.scene.parameters import HeadSceneParameters
from pftrack.experiments.head.scene.texture import LEFT_MM, STEP_MM, TOP_MM
from pftrack.vision.geometry.face_model import FaceModel
from pftrack.vision.geometry.head_surface import HeadMesh, vertex_normals

__all__ = ["cover", "with_lenses", "with_sunglasses"]

REFERENCE_WIDTH = 640
PILLAR_GREY = 30.0
LENS_HALF_MM = (26.0, 20.0)
LENS_ALBEDO, RIM_ALBEDO = 0.05, 0.12
LENS_FRONT_MM = -13.0
"""z of the lenses at the middle of the face; they bend back towards the temples."""


def cover(image: NDArray[np.float32], hidden: NDArray[np.bool_], parameters: HeadSceneParameters) -> None:
    """Lay hand and pillar over a picture, in place.

    Args:
        image: (height, width) grey values.
        hidden: (height, width), set where something is in front.
        parameters: What is in front.
    """
    height, width = image.shape
    scale = width / REFERENCE_WIDTH
    if parameters.hand_cover > 0:
        hand, share = _hand(width)
        top = round(height - parameters.hand_cover * (height - 95.0 * scale))
        rows = min(height - top, len(hand))
        if rows > 0:
            part, ground = share[:rows], image[top : top + rows]
            ground += part * (hand[:rows] - ground)
            hidden[top : top + rows] |= part > 0.5
    if parameters.pillar_width_px > 0:
        middle, half = width / 2 + scale * parameters.pillar_offset_px, scale * parameters.pillar_width_px / 2
        first, last = (min(max(int(np.ceil(edge)), 0), width) for edge in (middle - half, middle + half))
        image[:, first:last] = (
            PILLAR_GREY + 14.0 * np.sin(np.linspace(0.0, np.pi, max(last - first, 1)))[: last - first]
        )
        hidden[:, first:last] = True


def with_lenses(mesh: HeadMesh, model: FaceModel) -> HeadMesh:
    """Return a head whose surface is lifted over the eyes to where the lenses of glasses are."""
    x, y, z = mesh.vertices_mm.T
    share = np.clip((1.0 - _lens_radius(x, y, model)) / 0.15 + 0.5, 0.0, 1.0)
    lens = LENS_FRONT_MM + 0.006 * x**2 + 0.002 * y**2
    lifted = np.where(z < 60.0, np.minimum(z, z + share * (lens - z)), z)
    vertices = np.stack([x, y, lifted], axis=1)
    return HeadMesh(vertices, mesh.triangles, vertex_normals(vertices, mesh.triangles))


def with_sunglasses(texture: NDArray[np.float32], model: FaceModel) -> NDArray[np.float32]:
    """Return a texture with dark lenses, rims, a bridge and temples; arguments as `texture.albedo` has them."""
    rows, columns = texture.shape
    x, y = np.meshgrid(LEFT_MM + STEP_MM * np.arange(columns), TOP_MM + STEP_MM * np.arange(rows))
    radius = _lens_radius(x, y, model)
    top = float(model["leye"][1] + model["reye"][1]) / 2.0 - 6.0
    bars = np.abs(y - top) < np.where(np.abs(x) < 14.0, 2.0, np.where(np.abs(x) > 50.0, 2.5, 0.0))
    glass = LENS_ALBEDO + 0.05 * np.clip((top + 4.0 - y) / 16.0, 0.0, 1.0)
    dark = np.where(radius < 0.93, glass, RIM_ALBEDO)
    share = np.maximum(np.clip((1.08 - radius) / 0.04, 0.0, 1.0), bars)
    worn: NDArray[np.float32] = (texture + (dark - texture) * share).astype(np.float32)
    return worn


def _lens_radius(x: NDArray[np.float64], y: NDArray[np.float64], model: FaceModel) -> NDArray[np.float64]:
    """Return the distance from the middle of the nearer lens, where 1 is its edge."""
    radii = []
    for side in "lr":
        eye = model[side + "eye"]
        u, v = (x - 1.04 * eye[0]) / LENS_HALF_MM[0], (y - eye[1] - 3.0) / LENS_HALF_MM[1]
        radii.append(power(power(np.abs(u), 2.6) + power(np.abs(v), 2.6), 1 / 2.6))
    nearer: NDArray[np.float64] = np.minimum(*radii)
    return nearer


@lru_cache(maxsize=2)
def _hand(width: int) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return grey values and cover (rows, width) of a hand with its forearm, fingertips in the first rows."""
    columns, rows = np.meshgrid(np.arange(REFERENCE_WIDTH), np.arange(560))
    grey = np.full(columns.shape, 0.0)
    nearest = np.full(columns.shape, np.inf)
    # Ends and radius of each part, px at a width of 640: four fingers, thumb, palm, forearm.
    parts = (
        ((262, 62), (277, 210), 23), ((305, 30), (310, 205), 24), ((349, 40), (344, 205), 23),
        ((391, 80), (376, 215), 20), ((203, 190), (262, 285), 25), ((298, 250), (352, 250), 62),
        ((325, 290), (330, 330), 62), ((330, 330), (350, 600), 48),
    )  # fmt: skip
    for (ax, ay), (bx, by), radius in parts:
        along = ((columns - ax) * (bx - ax) + (rows - ay) * (by - ay)) / ((bx - ax) ** 2 + (by - ay) ** 2)
        inside = np.clip(along, 0.0, 1.0)
        away = np.hypot(columns - ax - inside * (bx - ax), rows - ay - inside * (by - ay)) / radius
        # A rounded part is brightest where it faces the lamp; where parts meet there is a crease.
        shade = 150.0 * (0.35 + 0.65 * np.sqrt(np.maximum(1.0 - away**2, 0.0)))
        deeper = radius * (away - 1.0)
        grey = np.where(away < 1.0, np.maximum(grey, shade), grey)
        nearest = np.minimum(nearest, deeper)
    share = np.clip(0.5 - nearest / 2.0, 0.0, 1.0)
    smooth = cv2.GaussianBlur(np.where(nearest < 0.0, grey, 60.0), (0, 0), 1.5)
    size = (width, round(len(grey) * width / REFERENCE_WIDTH))
    resized = [cv2.resize(part, size, interpolation=cv2.INTER_AREA) for part in (smooth, share)]
    return np.asarray(resized[0], np.float32), np.asarray(resized[1], np.float32)
