"""Geometry of what has a direction or a spread: arrows as lines, and ellipsoids as one ball, stretched and turned.

viser draws any number of instances of one mesh, each with its place, turn, extent and colour, and replaces all of them
in place.
"""

from dataclasses import dataclass

import numpy as np
import viser.transforms
from numpy.typing import NDArray

from pftrack.core.model.drawing import Arrows, Ellipsoids
from pftrack_server.viewer import shapes
from pftrack_server.viewer.shapes import Floats, Stance

ARROW_HEAD, ARROW_HEAD_WIDTHS = 0.35, 6.0
"""Length of an arrow's head: in widths of its line, but at most this share of the arrow."""
ARROW_HALF_ANGLE = float(np.deg2rad(24.0))
THINNEST = 1e-2
"""Thickness that is left to what is flat, as a share."""


def arrow_segments(arrows: Arrows) -> Floats:
    """Return arrows as segments (5 n, 2, 3): the way, and four lines back from its end."""
    starts, ends = arrows.segments[:, 0].astype(np.float64), arrows.segments[:, 1].astype(np.float64)
    ways = ends - starts
    lengths = np.linalg.norm(ways, axis=1, keepdims=True)
    known = np.isfinite(lengths[:, 0]) & (lengths[:, 0] > 0.0)
    starts, ends, ways, lengths = starts[known], ends[known], ways[known], lengths[known]
    along = ways / lengths
    # Aside of the arrow is across the axis that it follows least.
    aside = np.cross(along, np.eye(3)[np.abs(along).argmin(axis=1)])
    aside /= np.linalg.norm(aside, axis=1, keepdims=True)
    heads = np.minimum(ARROW_HEAD * lengths, ARROW_HEAD_WIDTHS * arrows.width)
    spread = heads * np.tan(ARROW_HALF_ANGLE)
    barbs = [ends - heads * along + spread * side for side in _four_ways(along, aside)]
    return np.concatenate([np.stack((tail, ends), axis=1) for tail in (starts, *barbs)]).astype(np.float32)


def _four_ways(along: NDArray[np.float64], aside: NDArray[np.float64]) -> tuple[NDArray[np.float64], ...]:
    across = np.cross(along, aside)
    return aside, across, -aside, -across


@dataclass(frozen=True, slots=True)
class Bodies:
    """Ellipsoids as a ball that is stretched and turned: centres (n, 3), quaternions (n, 4) and half axes (n, 3)."""

    centres: Floats
    wxyz: Floats
    half_axes: Floats


def bodies(item: Ellipsoids, stance: Stance) -> Bodies:
    """Return ellipsoids in the scene; one that is flat has some thickness left, since a body without has no light."""
    upright = np.array((1.0, -1.0, max(stance.relief, THINNEST)))
    spread = upright[:, None] * np.asarray(item.covariances, dtype=np.float64) * upright
    known = np.isfinite(spread).all(axis=(1, 2)) & np.isfinite(item.centres).all(axis=1)
    values, vectors = np.linalg.eigh(np.where(known[:, None, None], spread, 0.0))
    vectors[:, :, 0] *= np.linalg.det(vectors)[:, None]  # a turn, not a mirror image
    half_axes = item.sigmas * np.sqrt(np.clip(values, 0.0, None))
    half_axes = np.maximum(half_axes, THINNEST * half_axes.max(axis=1, keepdims=True))
    wxyz = viser.transforms.SO3.from_matrix(vectors).wxyz
    centres = np.where(known[:, None], shapes.to_scene(item.centres, stance), 0.0)
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
