"""What is true of a body that is followed by its points, and what a tracker may know of it beforehand."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.frame import Target
from pftrack.sources.tracks.bodies import Shape

__all__ = ["BodyTarget"]


@dataclass(frozen=True, slots=True)
class BodyTarget(Target):
    """A body: `position` is its shape (3 n,), about its centre and of unit size; zero where that is not known.

    Attributes:
        shape: What is between its points, and what others of the kind look like; a tracker may know that.
        principal_px: (2,) where the camera's axis meets the picture.
        focal_px: Of the camera.
        turn: (3, 3) from the body's frame to the camera's.
        translation: (3,) the body's centre in the camera's frame, in units of the body's size.
    """

    shape: Shape = field(default_factory=lambda: Shape(()))
    principal_px: NDArray[np.float64] = field(default_factory=lambda: np.zeros(2))
    focal_px: float = 1000.0
    turn: NDArray[np.float64] = field(default_factory=lambda: np.eye(3))
    translation: NDArray[np.float64] = field(default_factory=lambda: np.zeros(3))
