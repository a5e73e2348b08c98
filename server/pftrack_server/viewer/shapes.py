"""Geometry between a drawing and the scene: plain functions from arrays to arrays.

A drawing counts y downwards, as pictures do; the scene counts it upwards, as cameras and people do. So a point
(x, y, z) of a drawing stands at (x, -y, z) in the scene: the picture appears upright and z rises towards the viewer.
That mapping is a mirror, not a rotation, which is why coordinate frames are drawn as three segments (a rotation matrix
would lose its handedness) and why the faces of a mesh are turned over.

`relief` scales the heights. Seen from the front a cloud lifted by its weights would hide the estimate drawn beneath it,
so the scene is flat there and rises as the camera is tilted; `lift` keeps painting order where heights are equal, and
puts the marks of the picture plane (estimate, truth, gate) on top of the clouds that they were painted over.

A drawing that shows its camera is in perspective: what is high stands on the way from its pixel to the camera. From the
front it stands on its pixel, which is what the camera sees; it leans towards the camera as heights rise.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.drawing import (
    Arrows,
    Axes,
    Ellipse,
    Ellipsoids,
    Frustum,
    Links,
    Mesh,
    Points,
    Polyline,
    Primitive,
    Text,
)

Floats = NDArray[np.float32]

MARK_PX = 2.0
"""Height up to which lines are taken for marks in the picture plane."""
CAMERA_SIZE = 0.12
"""Size of the camera's own body, as a share of its frustum."""


@dataclass(frozen=True, slots=True)
class Stance:
    """How things stand above the picture.

    Attributes:
        relief: Factor on the heights; 0 is flat.
        lift: Height added to all, px.
        apex: (x, y, z) px of the camera towards which things lean as they are high; None if they stand upright.
        free: Whether they stand free in space, with no picture beneath.
    """

    relief: float
    lift: float
    apex: tuple[float, float, float] | None = None
    free: bool = False


FREE = Stance(1.0, 0.0, free=True)
"""How things stand in a world of their own."""


def to_scene(positions: Floats, stance: Stance) -> Floats:
    """Map positions (..., 3) of a drawing, px, into the scene.

    Args:
        positions: x to the right, y down, z towards the viewer.
        stance: How they stand above the picture.
    """
    mapped = np.array(positions, dtype=np.float32)
    mapped[..., 2] = mapped[..., 2] * stance.relief + stance.lift
    if stance.apex is not None:
        x, y, z = stance.apex
        share = mapped[..., 2:] * (stance.relief / z)
        mapped[..., :2] += share * (np.array((x, y), dtype=np.float32) - mapped[..., :2])
    mapped[..., 1] *= -1.0
    return mapped


def polyline_segments(positions: Floats) -> Floats:
    """Return the segments (n - 1, 2, 3) between positions (n, 3); one that is not finite is a gap."""
    segments = np.stack((positions[:-1], positions[1:]), axis=1)
    return np.asarray(segments[np.isfinite(segments).all(axis=(1, 2))], dtype=np.float32)


def ellipse_segments(ellipse: Ellipse, corners: int = 64) -> Floats:
    """Return an ellipse as segments (m, 2, 3); a dashed one has every other of them."""
    angles = np.linspace(0.0, 2.0 * np.pi, corners + 1)
    around = np.stack((np.cos(angles), np.sin(angles)), axis=1)
    outline = np.tile(np.asarray(ellipse.centre, dtype=np.float32), (corners + 1, 1))
    outline[:, :2] += around @ np.asarray(ellipse.half_axes)
    segments = polyline_segments(outline)
    return segments[::2] if ellipse.dashed else segments


def axes_segments(axes: Axes) -> Floats:
    """Return the three axes of a frame as segments (3, 2, 3)."""
    origin = np.asarray(axes.origin, dtype=np.float32)
    tips = origin + axes.length * np.asarray(axes.rotation, dtype=np.float32).T
    return np.stack((np.tile(origin, (3, 1)), tips), axis=1)


def frustum_segments(frustum: Frustum) -> Floats:
    """Return a camera's edges as segments (12, 2, 3): its rays, the border of the picture, and one of its own size."""
    apex, corners = np.asarray(frustum.apex), np.asarray(frustum.corners)
    own = apex + CAMERA_SIZE * (corners - apex)
    rays = np.stack((np.tile(apex, (4, 1)), corners), axis=1)
    borders = [np.stack((border, np.roll(border, -1, axis=0)), axis=1) for border in (corners, own)]
    return np.concatenate((rays, *borders)).astype(np.float32)


def turn_over(faces: NDArray[np.int32]) -> NDArray[np.uint32]:
    """Return triangles with the other side in front, as mirroring their vertices demands."""
    return np.ascontiguousarray(faces[:, ::-1], dtype=np.uint32)


def depth(items: Iterable[Primitive]) -> float:
    """Return how high primitives rise above their picture, px."""
    return max((_highest(_heights(item)) for item in items), default=0.0)


def summit(item: Primitive) -> float:
    """Return the height of a cloud, px; other primitives have none."""
    return _highest(item.positions[:, 2]) if isinstance(item, Points) else 0.0


def is_flat(item: Primitive) -> bool:
    """Whether a primitive is a mark in the picture plane: lines or a label hardly above it."""
    return isinstance(item, Arrows | Ellipse | Links | Polyline | Text) and _highest(np.abs(_heights(item))) <= MARK_PX


def _heights(item: Primitive) -> Floats:
    match item:
        case Points() | Polyline():
            return item.positions[:, 2]
        case Mesh():
            return item.vertices[:, 2]
        case Links() | Arrows():
            return item.segments[..., 2].ravel()
        case Ellipse() | Ellipsoids():
            return (item.centre if isinstance(item, Ellipse) else item.centres)[..., 2].ravel()
        case Text():
            return item.position[2:]
        case _:
            return np.zeros(1, dtype=np.float32)


def _highest(heights: Floats) -> float:
    finite = heights[np.isfinite(heights)]
    return float(finite.max()) if finite.size else 0.0
