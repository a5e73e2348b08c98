"""The truth of a frame in which a head is seen."""

from dataclasses import dataclass, field
from typing import Self

import numpy as np
from numpy.typing import NDArray

from pftrack.frame import Target

__all__ = ["HeadTarget"]


@dataclass(frozen=True, slots=True)
class HeadTarget(Target):
    """Where a head truly is; its `position` is theta (3,) in rad, its `size` the longer side of the points' box.

    Attributes:
        translation_mm: (3,) t in Xc = R(theta) X + t, the camera's frame.
        points_px: (11, 2) the features in the picture, in the order of `pftrack.geometry.face_model.FEATURES`.
        visible: (11,) whether each is seen.
    """

    translation_mm: NDArray[np.float64] = field(default_factory=lambda: np.zeros(3))
    points_px: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 2)))
    visible: NDArray[np.bool_] = field(default_factory=lambda: np.zeros(0, np.bool_))

    @classmethod
    def seen(
        cls,
        theta: NDArray[np.float64],
        translation_mm: NDArray[np.float64],
        points_px: NDArray[np.float64],
        visible: NDArray[np.bool_],
    ) -> Self:
        """Return the truth; the head counts as hidden when none of its features is seen."""
        size = float(np.ptp(points_px, axis=0).max())
        return cls(theta, size, not visible.any(), translation_mm, points_px, visible)

    @property
    def theta_rad(self) -> NDArray[np.float64]:
        """(3,) nod, turn and roll."""
        return self.position
