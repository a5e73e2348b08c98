"""Templates of a face in relief: what is around each feature at first sight, laid onto the surface of a head."""

import cv2
import numpy as np
from numpy.typing import NDArray

from pftrack.core.numerics.matrices import contiguous_copy, product, solve_system
from pftrack.experiments.head.trackers.memory import FirstSight
from pftrack.experiments.head.trackers.templates import template_sizes
from pftrack.experiments.shared.pose.methods import slopes_at
from pftrack.experiments.shared.pose.solid import Solid
from pftrack.vision.geometry.face_model import FEATURES, FaceModel
from pftrack.vision.geometry.head_surface import HeadSurface
from pftrack.vision.likelihoods import relief
from pftrack.vision.likelihoods.relief import Part, Reliefs, Views

__all__ = ["Look", "cut", "detail"]

MOST_ACROSS = 16
"""Points along the longer side of a template."""

ROUNDS = 6
"""In which the depth of a pixel is found: where it lies depends on how deep it is, and the other way round."""

DETAIL = 0.22
"""Half the side of the square over which the shading is taken, as a share of the distance between the eyes."""

MIDDLE = 128.0
"""Grey level of a picture without any detail."""

STEP_MM = 0.5
"""Over which the slope of the surface is taken."""

LEAST_FACING = 0.25
"""Cosine between the surface and the line of sight at first sight below which a pixel is left out: it is smeared."""


def cut(
    sight: FirstSight, factor: float, model: FaceModel, solid: Solid, turn: NDArray[np.float64], upper: str
) -> Reliefs:
    """Cut templates around the features at first sight, and lay them onto the face that is assumed.

    Args:
        sight: The picture.
        factor: How large they are, see `FirstSight.templates`.
        model: The face.
        solid: The head at first sight.
        turn: (3, 3) from the face's frame to the solid's.
        upper: The camera before which the solid is.
    """
    surface = HeadSurface(model)
    sizes = template_sizes(FEATURES, sight.eye_distance_px, factor)
    if upper == "affine":
        slopes = np.tile(solid.reference[:, :3], (len(FEATURES), 1, 1))
    else:
        slopes = slopes_at(solid, np.concatenate([np.zeros(3), solid.translation_mm]))
    height, width = sight.grey.shape
    grey = detail(sight.grey, sight)
    points, normals, levels, ends = [], [], [], [0]
    for n, ((x, y), (w, h)) in enumerate(zip(sight.points_px, sizes, strict=True)):
        step = max(1.0, max(w, h) / MOST_ACROSS)
        across, down = np.meshgrid(_space(int(w), step), _space(int(h), step))
        offsets = np.stack([across.ravel(), down.ravel()], axis=1)
        place, normal = _lay(offsets, surface, model.points_mm[n], product(slopes[n], turn))
        kept = -normal[:, 2] >= LEAST_FACING
        columns = np.floor(x + offsets[kept, 0] + 0.5).astype(int).clip(0, width - 1)
        rows = np.floor(y + offsets[kept, 1] + 0.5).astype(int).clip(0, height - 1)
        points.append(product(place[kept], turn.T))
        normals.append(product(normal[kept], turn.T))
        levels.append(grey[rows, columns].astype(np.float64))
        ends.append(ends[-1] + len(levels[-1]))
    places, facing = contiguous_copy(np.concatenate(points)), contiguous_copy(np.concatenate(normals))
    return Reliefs(places, facing, np.concatenate(levels), np.array(ends))


def detail(grey: NDArray[np.uint8], sight: FirstSight, part: Part | None = None) -> NDArray[np.uint8]:
    """Return a picture (height, width) less its local mean, about a middle grey.

    The shading of a cheek is alike over tens of pixels and at many places, so a template of it correlates with all of
    them; and it changes as the head turns. What tells a feature is the detail in it.

    Args:
        grey: (height, width).
        sight: By which it is known how large the face is.
        part: What of it is wanted, if not all; the rest is anything.
    """
    half = round(DETAIL * sight.eye_distance_px)
    left, top, right, bottom = part or (0, 0, *grey.shape[::-1])
    # The local mean at the part's border is that over the picture beyond it.
    rows, columns = slice(max(top - half, 0), bottom + half), slice(max(left - half, 0), right + half)
    near, found = grey[rows, columns], np.full_like(grey, MIDDLE)
    if near.size:
        shading = cv2.blur(near, (2 * half + 1, 2 * half + 1), borderType=cv2.BORDER_REPLICATE)
        found[rows, columns] = cv2.addWeighted(near, 1.0, shading, -1.0, MIDDLE)
    return found


class Look:
    """How well templates in relief fit one picture, the detail of which is found where they are looked for."""

    def __init__(self, grey: NDArray[np.uint8], sight: FirstSight, views: Views) -> None:
        """Look at a picture (height, width) by templates as they should look in it."""
        self._grey, self._sight, self._views = grey, sight, views
        self._part: Part = (0, 0, 0, 0)
        self._detail = grey

    def __call__(self, positions: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the correlations (F, N) at positions (F, N, 2) px."""
        wanted = relief.reach(positions, self._views, self._grey.shape)
        if not _covers(self._part, wanted):
            self._part, self._detail = wanted, detail(self._grey, self._sight, wanted)
        return relief.correlations(self._detail, positions, self._views)


def _covers(part: Part, other: Part) -> bool:
    (left, top, right, bottom), (west, north, east, south) = part, other
    return left <= west and top <= north and right >= east and bottom >= south


def _space(length_px: int, step_px: float) -> NDArray[np.float64]:
    """Return places along a side, px from its middle."""
    count = max(int(length_px / step_px), 2)
    places: NDArray[np.float64] = (np.arange(count, dtype=np.float64) - (count - 1) / 2.0) * step_px
    return places


def _lay(
    offsets_px: NDArray[np.float64], surface: HeadSurface, feature_mm: NDArray[np.float64], slopes: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return points (P, 3) mm of a surface, relative to a feature's, and their normals, by where they are seen.

    Args:
        offsets_px: (P, 2) from the feature.
        surface: Of the head.
        feature_mm: (3,) the feature.
        slopes: (2, 3) px/mm.
    """
    x, y = feature_mm[:2]
    depth = surface.depth(np.array([x]), np.array([y]))
    back = solve_system(slopes[:, :2], np.eye(2))
    z = np.zeros(len(offsets_px))
    for _ in range(ROUNDS):
        flat = product(offsets_px - z[:, None] * slopes[:, 2], back.T)
        z = surface.depth(x + flat[:, 0], y + flat[:, 1]) - depth
    right, below = x + flat[:, 0], y + flat[:, 1]
    by_x = surface.depth(right + STEP_MM, below) - surface.depth(right - STEP_MM, below)
    by_y = surface.depth(right, below + STEP_MM) - surface.depth(right, below - STEP_MM)
    normals = np.column_stack([by_x, by_y, np.full(len(z), -2.0 * STEP_MM)])
    lengths = np.sqrt(np.square(normals).sum(axis=1, keepdims=True))
    return np.column_stack([flat, z]), np.asarray(normals / lengths, np.float64)
