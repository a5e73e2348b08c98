"""Cameras: the pinhole, and the affine camera that stands in for it.

A *pinhole* of focal length f, in px, sees the point (X, Y, Z) of its own frame at (f X/Z, f Y/Z) from its principal
point. It is what cameras do, but not linear. An *affine camera* is the linear map x = P (X; 1) with a 2 x 4 matrix P
whose first three columns are in px/mm and whose last is in px: exact for an object that is far away compared with its
depth, and wrong by the perspective otherwise. A rigid object that turns by R and does not change its distance has
P = P_0 diag(R, 1) (Bando 2007, Appendix D, eq. A.31, corrected: docs/methods/adaptive.md).

Points that come closer to the pinhole than `NEAREST_MM`, or lie behind it, are projected as if they were at that
distance, so that a filter on a wrong track meets large numbers but no infinite ones.
"""

import numpy as np
from numpy.typing import NDArray

from pftrack.core.numerics.compiled import compiled
from pftrack.core.numerics.matrices import least_squares, product

__all__ = ["NEAREST_MM", "affine_fit", "affine_projection", "pinhole", "pinhole_jacobian"]

NEAREST_MM = 1.0


@compiled
def pinhole(points_mm: NDArray[np.float64], focal_px: float) -> NDArray[np.float64]:
    """Project points (n, 3) of the camera's frame to (n, 2) px from the principal point (Bando 2007, Appendix E)."""
    count = points_mm.shape[0]
    pixels = np.empty((count, 2))
    for n in range(count):
        scale = focal_px / max(points_mm[n, 2], NEAREST_MM)
        pixels[n, 0] = scale * points_mm[n, 0]
        pixels[n, 1] = scale * points_mm[n, 1]
    return pixels


@compiled
def pinhole_jacobian(points_mm: NDArray[np.float64], focal_px: float) -> NDArray[np.float64]:
    """Return the derivative (n, 2, 3), px/mm, of `pinhole` by the points (n, 3) in mm."""
    count = points_mm.shape[0]
    slopes = np.zeros((count, 2, 3))
    for n in range(count):
        depth = max(points_mm[n, 2], NEAREST_MM)
        scale = focal_px / depth
        slopes[n, 0, 0] = scale
        slopes[n, 1, 1] = scale
        slopes[n, 0, 2] = -scale * points_mm[n, 0] / depth
        slopes[n, 1, 2] = -scale * points_mm[n, 1] / depth
    return slopes


def affine_projection(camera: NDArray[np.float64], points_mm: NDArray[np.float64]) -> NDArray[np.float64]:
    """Project points (n, 3) by an affine camera (2, 4) to (n, 2) px."""
    pixels: NDArray[np.float64] = product(points_mm, camera[:, :3].T) + camera[:, 3]
    return pixels


def affine_fit(points_mm: NDArray[np.float64], pixels: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the affine camera (2, 4) that projects points onto pixels with the least sum of squared distances.

    Args:
        points_mm: (n, 3) in the object's frame; at least four, not all in one plane.
        pixels: (n, 2) where they are seen.

    Raises:
        ValueError: The shapes differ, a value is not finite, or the points do not determine a camera.
    """
    if points_mm.ndim != 2 or points_mm.shape[1] != 3 or pixels.shape != (len(points_mm), 2):
        raise ValueError(f"expected (n, 3) points and (n, 2) pixels, got {points_mm.shape} and {pixels.shape}")
    if not (np.isfinite(points_mm).all() and np.isfinite(pixels).all()):
        raise ValueError("expected finite points and pixels, got some that are not")
    extended = np.column_stack([points_mm, np.ones(len(points_mm))])
    fitted, determined = least_squares(extended, pixels)
    if not determined:
        raise ValueError("expected four points that do not lie in one plane, got fewer")
    return np.ascontiguousarray(fitted.T)
