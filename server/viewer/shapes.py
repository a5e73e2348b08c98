"""Geometry between a drawing and the scene: plain functions from arrays to arrays.

A drawing counts y downwards, as pictures do; the scene counts it upwards, as cameras and people do. So a point
(x, y, z) of a drawing stands at (x, -y, z) in the scene: the picture appears upright and z rises towards the viewer.
That mapping is a mirror, not a rotation, which is why coordinate frames are drawn as three segments (a rotation matrix
would lose its handedness) and why the faces of a mesh are turned over.

`relief` scales the heights. Seen from the front a cloud lifted by its weights would hide the estimate drawn beneath it,
so the scene is flat there and rises as the camera is tilted; `lift` keeps painting order where heights are equal, and
puts the marks of the picture plane (estimate, truth, gate) on top of the clouds that they were painted over.
"""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from pftrack.drawing import Axes, Ellipse, Links, Mesh, Points, Polyline, Primitive, Text

__all__ = [
    "axes_segments",
    "depth",
    "ellipse_segments",
    "is_flat",
    "polyline_segments",
    "summit",
    "to_scene",
    "turned_over",
]

Floats = NDArray[np.float32]

MARK_PX = 2.0
"""Height up to which lines are taken for marks in the picture plane."""
AXES_COLOURS = ((213, 94, 0), (0, 158, 115), (0, 114, 178))
"""Colours of the x, y and z axis, told apart by everybody."""


def to_scene(positions: Floats, relief: float, lift: float) -> Floats:
    """Map positions (..., 3) of a drawing, px, into the scene.

    Args:
        positions: x to the right, y down, z towards the viewer.
        relief: Factor on the heights; 0 is flat.
        lift: Height added to all, px.
    """
    mapped = np.array(positions, dtype=np.float32)
    mapped[..., 1] *= -1.0
    mapped[..., 2] = mapped[..., 2] * relief + lift
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


def axes_segments(axes: Axes) -> tuple[Floats, NDArray[np.uint8]]:
    """Return the three axes of a frame as segments (3, 2, 3) with their colours (3, 2, 3)."""
    origin = np.asarray(axes.origin, dtype=np.float32)
    tips = origin + axes.length * np.asarray(axes.rotation, dtype=np.float32).T
    segments = np.stack((np.tile(origin, (3, 1)), tips), axis=1)
    return segments, np.repeat(np.asarray(AXES_COLOURS, dtype=np.uint8)[:, None], 2, axis=1)


def turned_over(faces: NDArray[np.int32]) -> NDArray[np.uint32]:
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
    return isinstance(item, Ellipse | Links | Polyline | Text) and _highest(np.abs(_heights(item))) <= MARK_PX


def _heights(item: Primitive) -> Floats:
    match item:
        case Points() | Polyline():
            return item.positions[:, 2]
        case Mesh():
            return item.vertices[:, 2]
        case Links():
            return item.segments[..., 2].ravel()
        case Ellipse():
            return item.centre[2:]
        case Text():
            return item.position[2:]
        case _:
            return np.zeros(1, dtype=np.float32)


def _highest(heights: Floats) -> float:
    finite = heights[np.isfinite(heights)]
    return float(finite.max()) if finite.size else 0.0
