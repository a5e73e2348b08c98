"""Where wall, book and box are in each frame, and with them any point of the picture."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pftrack.experiments.trajectories.scene.corners_textures import BOOK_PX, BOX_PX

__all__ = ["BOOK", "BOX", "FRAMES", "STEPS", "WALL", "SceneMotion", "shifts_px"]

FRAMES = 60
"""So long everything drifts on; then it drifts back."""

STEPS = 64
"""Shifts are whole numbers of such parts of a pixel."""

WALL, BOOK, BOX = range(3)
"""The surfaces, the rear one first; the book is in front of the box."""

CORNERS_PX: NDArray[np.float64] = np.array([[0.0, 0.0], [40.0, 150.0], [235.0, 40.0]])
SIZES_PX: NDArray[np.float64] = np.array([[0.0, 0.0], BOOK_PX, BOX_PX])
FRONT_TO_REAR = (BOOK, BOX)


def shifts_px(phases: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return how far wall, book and box have moved from where they would be without motion, (n, 3, 2) px.

    Args:
        phases: (n,) frames at the speed of the study.
    """
    drift = FRAMES - np.abs(FRAMES - phases % (2 * FRAMES))
    turns = 2.0 * np.pi * phases
    across = 0.5 * drift + 4.0 * np.sin(turns / 40.0), 1.1 * drift + 3.0 * np.sin(turns / 25.0), -0.8 * drift
    down = 2.5 * np.sin(turns / 30.0), -0.7 * drift, 0.9 * drift + 3.0 * np.sin(turns / 35.0)
    moved = np.array([across, down]).transpose(2, 1, 0)
    return np.asarray(np.rint(STEPS * moved) / STEPS)


@dataclass(frozen=True, eq=False)
class SceneMotion:
    """The motion up to a frame.

    Attributes:
        shifts: (n, 3, 2) of the surfaces in frames 0..n - 1, px.
    """

    shifts: NDArray[np.float64]

    def surfaces(self, points: NDArray[np.float64], born: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return on which surface each point (K, 2) of a frame's picture is, given its frame (K,)."""
        found = np.full(len(points), WALL, np.int64)
        for surface in reversed(FRONT_TO_REAR):
            found[self.inside(surface, points, born, 0.0)] = surface
        return found

    def inside(
        self, surface: int, points: NDArray[np.float64], frames: NDArray[np.int64], margin_px: float
    ) -> NDArray[np.bool_]:
        """Return which points (K, 2), each of a frame (K,), are on a surface or so near to it, whatever hides it."""
        corner = CORNERS_PX[surface] + self.shifts[frames, surface]
        beyond = np.maximum(corner - points, points - corner - SIZES_PX[surface] + 1.0)
        return np.asarray((beyond <= margin_px).all(axis=1))

    def path(self, points: NDArray[np.float64], index: int, born: NDArray[np.int64]) -> NDArray[np.float64]:
        """Return where points (K, 2), each of the picture of a frame `born` (K,), are in a frame so far, (K, 2) px."""
        surfaces = self.surfaces(points, born)
        return np.asarray(points + self.shifts[index, surfaces] - self.shifts[born, surfaces])

    def hidden(self, points: NDArray[np.float64], index: int, margin_px: float) -> NDArray[np.bool_]:
        """Return which points (K, 2) of frame 0 are behind something, or as near to its edge or to their surface's."""
        first, frames = np.zeros(len(points), np.int64), np.full(len(points), index)
        now, surfaces = self.path(points, index, first), self.surfaces(points, first)
        book, box = (self.inside(surface, now, frames, margin_px) for surface in FRONT_TO_REAR)
        on_book, on_box = (self.inside(surface, now, frames, -margin_px) for surface in FRONT_TO_REAR)
        seen = np.where(surfaces == BOOK, on_book, np.where(surfaces == BOX, on_box & ~book, ~book & ~box))
        return np.asarray(~seen)
