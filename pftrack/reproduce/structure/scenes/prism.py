"""Tracks of the turning prism: its eight corners and the centres of its six faces, 360 frames.

It turns by 1 degree a frame about the vertical axis and by 2 about the horizontal one, so that in no frame all fourteen
points are seen: a corner is while one of its faces is, a centre while its face is. What is hidden is measured all the
same, with noise of 50 px (Bando 2007, ch. 4 section 5.3, with the readings of docs/methods/heads.md).
"""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from pftrack.core.geometry.camera import pinhole
from pftrack.core.geometry.rotation import rotation
from pftrack.core.numerics.matrices import product
from pftrack.core.numerics.random import Purpose, Stream
from pftrack.reproduce.structure.scenes.simulated import SimulatedTracks
from pftrack.sources.prism import FACES, NAMES, VERTICES_MM, visible_faces
from pftrack.vision.structure.tracks import Tracks

__all__ = ["CENTRES", "FRAMES", "POINTS_MM", "prism_tracks"]

FRAMES = 360
POINTS_MM: NDArray[np.float64] = np.concatenate([VERTICES_MM, VERTICES_MM[np.array(FACES)].mean(axis=1)])
"""(14, 3) corners, then the centres of front, rear, left, right, top and bottom."""
POINTS_MM.flags.writeable = False

CENTRES = slice(len(VERTICES_MM), None)
POINT_NAMES = (*NAMES, "front", "rear", "left", "right", "top", "bottom")

FOCAL_PX = 400.0
TURN_DEG: NDArray[np.float64] = np.array([2.0, 1.0, 0.0])
"""A frame, about the horizontal axis, the vertical axis and the line of sight."""

TOUCHING = np.array([[vertex in corners for corners in FACES] for vertex in range(len(VERTICES_MM))])


def prism_tracks(
    seed: int, *, frames: int = FRAMES, distance_mm: float = 150.0, hidden_sd_px: float = 50.0
) -> SimulatedTracks:
    """Return the tracks; the same arguments give the same, to the bit.

    Args:
        seed: Of the noise.
        frames: How many.
        distance_mm: From the camera to the prism's centre.
        hidden_sd_px: Standard deviation of the noise of a hidden point; that of a visible one is 1 px.
    """
    theta, true, visible = _motion(frames, distance_mm)
    sd = np.where(visible, 1.0, hidden_sd_px)[..., None]
    noise = np.stack([Stream(seed, index, Purpose.SCENE).standard_normal(true.shape[1:]) for index in range(frames)])
    tracks = Tracks(true + sd * noise, np.broadcast_to(sd**2, true.shape))
    translation = np.tile([0.0, 0.0, distance_mm], (frames, 1))
    return SimulatedTracks(tracks, POINTS_MM, POINT_NAMES, FOCAL_PX, theta, translation, true, visible)


@lru_cache(maxsize=4)
def _motion(frames: int, distance_mm: float) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.bool_]]:
    """Return theta (T, 3), true positions (T, 14, 2) and which points are seen (T, 14)."""
    theta = np.deg2rad(np.arange(frames)[:, None] * TURN_DEG)
    translation = np.array([0.0, 0.0, distance_mm])
    true = np.array([pinhole(product(POINTS_MM, rotation(one).T) + translation, FOCAL_PX) for one in theta])
    faces = np.array([visible_faces(one, translation) for one in theta])
    corners = (faces[:, None] & TOUCHING).any(axis=2)
    return theta, true, np.concatenate([corners, faces], axis=1)
