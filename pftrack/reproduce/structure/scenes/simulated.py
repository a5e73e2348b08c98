"""What a simulation of tracks gives: what is measured, and what is true."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pftrack.vision.structure.tracks import Tracks

__all__ = ["SimulatedTracks"]


@dataclass(frozen=True, eq=False)
class SimulatedTracks:
    """Tracks of a body that is known.

    Attributes:
        tracks: Measured positions, px from the principal point, and the variances of their noise.
        shape_mm: (n, 3) the body's points in its own frame.
        names: (n,) of the points.
        focal_px: Focal length of the camera.
        theta_rad: (T, 3) how the body is turned.
        translation_mm: (T, 3) where its origin is in the camera's frame.
        true_px: (T, n, 2) where the points truly are, px from the principal point.
        visible: (T, n) whether each is seen.
    """

    tracks: Tracks
    shape_mm: NDArray[np.float64]
    names: tuple[str, ...]
    focal_px: float
    theta_rad: NDArray[np.float64]
    translation_mm: NDArray[np.float64]
    true_px: NDArray[np.float64]
    visible: NDArray[np.bool_]
