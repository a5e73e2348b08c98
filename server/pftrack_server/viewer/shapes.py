"""Geometry between a drawing and the scene: plain functions from arrays to arrays.

A drawing counts y downwards, as pictures do; the scene counts it upwards, as cameras and people do. So a point (x, y,
z) of a drawing is at (x, -y, z) in the scene: the picture appears upright and z rises towards the viewer. That mapping
is a mirror, not a rotation, which is why coordinate frames are drawn as three segments (a rotation matrix would lose
its handedness) and why the faces of a mesh are turned over.

`relief` scales the heights. Seen from the front, a cloud lifted by its weights would hide the estimate beneath it, so
the scene is flat there and rises as the camera is tilted; `lift` keeps the painting order where heights are equal.

A drawing that shows its camera uses perspective: a raised point is on the line from its pixel to the camera. With
relief 0 it is at its pixel, as the camera sees it; it leans towards the camera as heights rise.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import viser.transforms
from numpy.typing import NDArray

from pftrack.core.model import drawing as model

Floats = NDArray[np.float32]
Lines: TypeAlias = model.Polyline | model.Ellipse | model.Links | model.Arrows | model.Axes | model.Frustum
"""Primitives drawn as lines."""

CAMERA_SIZE = 0.12
"""Size of the camera's own body, as a share of its frustum."""
ARROW_HEAD, ARROW_HEAD_WIDTHS = 0.35, 6.0
"""Largest share of an arrow that its head takes, and the head's length in line widths."""
ARROW_HALF_ANGLE = float(np.deg2rad(24.0))
THINNEST = 1e-2
"""Least thickness of a flat body, as a share of its size."""


@dataclass(frozen=True, slots=True)
class Stance:
    """How primitives stand above the picture.

    Attributes:
        relief: Factor on the heights; 0 is flat.
        lift: Height added to all points, px.
        apex: (x, y, z) of the camera towards which raised points lean, px; None if they stand upright.
        free: Whether they are free in space, without a picture beneath.
    """

    relief: float
    lift: float
    apex: tuple[float, float, float] | None = None
    free: bool = False


FREE = Stance(1.0, 0.0, free=True)
"""Stance in a world of its own."""


def to_scene(positions: Floats, stance: Stance) -> Floats:
    """Map positions (..., 3) of a drawing, px, into the scene.

    Args:
        positions: x to the right, y down, z towards the viewer.
        stance: Stance above the picture.
    """
    mapped = np.array(positions, dtype=np.float32)
    mapped[..., 2] = mapped[..., 2] * stance.relief + stance.lift
    if stance.apex is not None:
        x, y, z = stance.apex
        share = mapped[..., 2:] * (stance.relief / z)
        mapped[..., :2] += share * (np.array((x, y), dtype=np.float32) - mapped[..., :2])
    mapped[..., 1] *= -1.0
    return mapped


def segments(lines: Lines) -> Floats:
    """Return a primitive drawn as lines as segments (n, 2, 3), px."""
    match lines:
        case model.Polyline():
            return polyline_segments(lines.positions)
        case model.Ellipse():
            return ellipse_segments(lines)
        case model.Links():
            return lines.segments
        case model.Arrows():
            return arrow_segments(lines)
        case model.Axes():
            return axes_segments(lines)
        case model.Frustum():
            return frustum_segments(lines)


def polyline_segments(positions: Floats) -> Floats:
    """Return the segments (n - 1, 2, 3) between positions (n, 3); one that is not finite is a gap."""
    segments = np.stack((positions[:-1], positions[1:]), axis=1)
    return np.asarray(segments[np.isfinite(segments).all(axis=(1, 2))], dtype=np.float32)


def ellipse_segments(ellipse: model.Ellipse, corners: int = 64) -> Floats:
    """Return an ellipse as segments (m, 2, 3); a dashed one has every other segment."""
    angles = np.linspace(0.0, 2.0 * np.pi, corners + 1)
    around = np.stack((np.cos(angles), np.sin(angles)), axis=1)
    outline = np.tile(np.asarray(ellipse.centre, dtype=np.float32), (corners + 1, 1))
    outline[:, :2] += around @ np.asarray(ellipse.half_axes)
    segments = polyline_segments(outline)
    return segments[::2] if ellipse.dashed else segments


def axes_segments(axes: model.Axes) -> Floats:
    """Return the three axes of a frame as segments (3, 2, 3)."""
    origin = np.asarray(axes.origin, dtype=np.float32)
    tips = origin + axes.length * np.asarray(axes.rotation, dtype=np.float32).T
    return np.stack((np.tile(origin, (3, 1)), tips), axis=1)


def frustum_segments(frustum: model.Frustum) -> Floats:
    """Return a camera's edges as segments (12, 2, 3): its rays, the border of the picture, and that of its own body."""
    apex, corners = np.asarray(frustum.apex), np.asarray(frustum.corners)
    own = apex + CAMERA_SIZE * (corners - apex)
    rays = np.stack((np.tile(apex, (4, 1)), corners), axis=1)
    borders = [np.stack((border, np.roll(border, -1, axis=0)), axis=1) for border in (corners, own)]
    return np.concatenate((rays, *borders)).astype(np.float32)


def turn_over(faces: NDArray[np.int32]) -> NDArray[np.uint32]:
    """Return triangles with reversed orientation, as mirroring their vertices requires."""
    return np.ascontiguousarray(faces[:, ::-1], dtype=np.uint32)


def arrow_segments(arrows: model.Arrows) -> Floats:
    """Return arrows as segments (5 n, 2, 3): the shaft, and four lines back from its tip."""
    starts, ends = arrows.segments[:, 0].astype(np.float64), arrows.segments[:, 1].astype(np.float64)
    ways = ends - starts
    lengths = np.linalg.norm(ways, axis=1, keepdims=True)
    known = np.isfinite(lengths[:, 0]) & (lengths[:, 0] > 0.0)
    starts, ends, ways, lengths = starts[known], ends[known], ways[known], lengths[known]
    along = ways / lengths
    # A direction across the arrow: perpendicular to it and to the axis that it follows least.
    aside = np.cross(along, np.eye(3)[np.abs(along).argmin(axis=1)])
    aside /= np.linalg.norm(aside, axis=1, keepdims=True)
    heads = np.minimum(ARROW_HEAD * lengths, ARROW_HEAD_WIDTHS * arrows.width)
    spread = heads * np.tan(ARROW_HALF_ANGLE)
    across = np.cross(along, aside)
    barbs = [ends - heads * along + spread * side for side in (aside, across, -aside, -across)]
    return np.concatenate([np.stack((tail, ends), axis=1) for tail in (starts, *barbs)]).astype(np.float32)


@dataclass(frozen=True, slots=True)
class Bodies:
    """Ellipsoids as stretched and rotated balls: centres (n, 3), quaternions (n, 4) and half axes (n, 3).

    viser draws any number of instances of one mesh, each with its position, rotation, scale and colour.
    """

    centres: Floats
    wxyz: Floats
    half_axes: Floats


def bodies(item: model.Ellipsoids, stance: Stance) -> Bodies:
    """Return ellipsoids in the scene; a flat one keeps some thickness, since a body without any would be unlit."""
    upright = np.array((1.0, -1.0, max(stance.relief, THINNEST)))
    spread = upright[:, None] * np.asarray(item.covariances, dtype=np.float64) * upright
    known = np.isfinite(spread).all(axis=(1, 2)) & np.isfinite(item.centres).all(axis=1)
    values, vectors = np.linalg.eigh(np.where(known[:, None, None], spread, 0.0))
    vectors[:, :, 0] *= np.linalg.det(vectors)[:, None]  # a rotation, not a reflection
    half_axes = item.sigmas * np.sqrt(np.clip(values, 0.0, None))
    half_axes = np.maximum(half_axes, THINNEST * half_axes.max(axis=1, keepdims=True))
    wxyz = viser.transforms.SO3.from_matrix(vectors).wxyz
    centres = np.where(known[:, None], to_scene(item.centres, stance), 0.0)
    return Bodies(*(values.astype(np.float32) for values in (centres, wxyz, half_axes)))


def _ball() -> tuple[Floats, NDArray[np.uint32]]:
    """Return a ball of radius 1 as vertices (n, 3) and triangles (m, 3), counterclockwise from outside."""
    rings, columns = 8, 16
    polar, around = np.meshgrid(
        np.linspace(0.0, np.pi, rings + 1), np.linspace(0.0, 2.0 * np.pi, columns, endpoint=False), indexing="ij"
    )
    vertices = np.stack((np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around), np.cos(polar)), axis=-1)
    here = np.arange(rings * columns).reshape(rings, columns)
    right = np.roll(here, -1, axis=1)
    faces = np.stack((here, here + columns, right, right, here + columns, right + columns), axis=-1)
    return vertices.reshape(-1, 3).astype(np.float32), faces.reshape(-1, 3).astype(np.uint32)


BALL = _ball()


def depth(items: Iterable[model.Primitive]) -> float:
    """Return the largest height of primitives above their picture, px."""
    return max((_highest(_heights(item)) for item in items), default=0.0)


def behind(items: Iterable[model.Primitive]) -> float:
    """Return the largest distance of primitives behind their picture, px."""
    return max((0.0, *(_highest(-_heights(item)) for item in items)))


def _heights(item: model.Primitive) -> Floats:
    match item:
        case model.Points() | model.Polyline():
            return item.positions[:, 2]
        case model.Mesh():
            return item.vertices[:, 2]
        case model.Links() | model.Arrows():
            return item.segments[..., 2].ravel()
        case model.Ellipse() | model.Ellipsoids():
            return (item.centre if isinstance(item, model.Ellipse) else item.centres)[..., 2].ravel()
        case model.Text():
            return item.position[2:]
        case _:
            return np.zeros(1, dtype=np.float32)


def _highest(heights: Floats) -> float:
    finite = heights[np.isfinite(heights)]
    return float(finite.max()) if finite.size else 0.0
