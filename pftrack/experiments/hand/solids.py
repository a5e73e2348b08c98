"""Meshes of a hand's parts in space: phalanges as tapered capsules, the palm as a plate, lines as thin ribbons."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

__all__ = ["capsules", "plate", "ribbon"]

SIDES = 10
"""Of a capsule, around its axis."""

_QUARTER = np.deg2rad([90.0, 45.0, 0.0])
PROFILE = [(0.0, -np.sin(angle), np.cos(angle)) for angle in _QUARTER]
PROFILE += [(1.0, np.sin(angle), np.cos(angle)) for angle in _QUARTER[::-1]]
"""Rings from end to end: which end they belong to, how far beyond it along the axis and away from it, in radii."""


def capsules(
    starts: NDArray[np.float64], ends: NDArray[np.float64], radii: NDArray[np.float64]
) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """Return vertices (n, 3) and faces (m, 3) of capsules.

    Args:
        starts: (k, 3) centres of one end.
        ends: (k, 3) centres of the other.
        radii: (k, 2) at these ends.
    """
    axes = ends - starts
    lengths = np.maximum(np.sqrt(np.square(axes).sum(axis=1, keepdims=True)), 1e-9)
    along = axes / lengths
    # Any direction that is not nearly that of the axis gives two others at right angles to it.
    helper = np.where(np.abs(along[:, 2:]) < 0.9, [[0.0, 0.0, 1.0]], [[1.0, 0.0, 0.0]])
    across = np.cross(along, helper)
    across /= np.sqrt(np.square(across).sum(axis=1, keepdims=True))
    other = np.cross(along, across)
    angles = 2.0 * np.pi * np.arange(SIDES) / SIDES
    around = across[:, None] * np.cos(angles)[:, None] + other[:, None] * np.sin(angles)[:, None]
    rings = []
    for end, beyond, away in PROFILE:
        radius = radii[:, int(end)][:, None]
        centre = starts + end * axes + beyond * radius * along
        rings.append(centre[:, None] + away * radius[:, :, None] * around)
    vertices = np.stack(rings, axis=1).reshape(-1, 3)
    own = len(PROFILE) * SIDES
    faces = _rings() + own * np.arange(len(starts))[:, None, None]
    return vertices.astype(np.float32), faces.reshape(-1, 3).astype(np.int32)


def plate(near: NDArray[np.float64], far: NDArray[np.float64]) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """Return vertices (2 n, 3) and faces of a plate between two outlines (n, 3), the near one seen clockwise."""
    count = len(near)
    fan = np.stack([np.zeros(count - 2, int), np.arange(1, count - 1), np.arange(2, count)], axis=1)
    here = np.arange(count)
    following = (here + 1) % count
    sides = [
        np.stack([here, here + count, following], axis=1),
        np.stack([following, here + count, following + count], axis=1),
    ]
    faces = np.concatenate([fan, fan[:, ::-1] + count, *sides])
    return np.concatenate([near, far]).astype(np.float32), faces.astype(np.int32)


def ribbon(segments: NDArray[np.float64], width: float) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """Return vertices (4 n, 3) and faces of flat strips along segments (n, 2, 3), a little longer than these.

    Args:
        segments: In planes of constant z.
        width: Of a strip, in the unit of the segments.
    """
    start, end = segments[:, 0], segments[:, 1]
    along = end - start
    along /= np.maximum(np.sqrt(np.square(along).sum(axis=1, keepdims=True)), 1e-9)
    aside = 0.5 * width * np.stack([-along[:, 1], along[:, 0], np.zeros(len(along))], axis=1)
    ahead = 0.5 * width * along
    corners = np.stack([start - ahead - aside, end + ahead - aside, end + ahead + aside, start - ahead + aside], axis=1)
    faces = np.array([[0, 1, 2], [0, 2, 3]]) + 4 * np.arange(len(segments))[:, None, None]
    return corners.reshape(-1, 3).astype(np.float32), faces.reshape(-1, 3).astype(np.int32)


@lru_cache(maxsize=1)
def _rings() -> NDArray[np.int64]:
    """Return the faces between the rings of one capsule."""
    faces = []
    for ring in range(len(PROFILE) - 1):
        for side in range(SIDES):
            a, b = ring * SIDES + side, ring * SIDES + (side + 1) % SIDES
            faces += [[a, a + SIDES, b], [b, a + SIDES, b + SIDES]]
    return np.array(faces)
