"""Where a drawing shows a solid: over its place in the picture, and how high above it.

A drawing has the picture stand behind the solid, clear of it, and the camera a focal length before the picture: so a px
in the plane of the picture is a fixed number of mm there, and everything else has its true proportions.
"""

import numpy as np
from numpy.typing import NDArray

from pftrack.core.geometry.camera import NEAREST_MM
from pftrack.core.geometry.rotation import rotation
from pftrack.experiments.shared.pose.state import PoseState

__all__ = ["heights", "place_points"]

CLEAR_RADII = 1.5
"""How far behind a solid's origin its picture is drawn, in radii of its points: a head is larger than its features."""

MOST_RAISED = 0.9
"""Nothing is drawn nearer to the camera than a tenth of its focal length, nor behind it."""


def heights(state: PoseState, depths_mm: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return how high above the picture a drawing shows what is at depths (n,) in the camera's frame, (n,) px."""
    radius = float(np.linalg.norm(state.solid.points_mm, axis=1).max())
    plane_mm = max(float(state.translation_mm[2]), NEAREST_MM) + CLEAR_RADII * radius
    focal = state.solid.focal_px
    return np.minimum(focal * (1.0 - depths_mm / plane_mm), MOST_RAISED * focal)


def place_points(
    state: PoseState, points_mm: NDArray[np.float64], theta: NDArray[np.float64] | None = None
) -> NDArray[np.float64]:
    """Return where points (n, 3) of the solid are seen, and how high above the picture they stand, (n, 3) px.

    Args:
        state: What is believed.
        points_mm: In the solid's frame.
        theta: Angles (3,) of the solid, rad, if not those that are believed.
    """
    turn = rotation(state.pose.mean if theta is None else theta)
    depths = points_mm @ turn[2] + state.translation_mm[2]
    return np.column_stack([state.project(points_mm, theta), heights(state, depths)])
