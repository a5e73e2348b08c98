"""The truth of a frame in which a head is seen."""

from dataclasses import dataclass, field
from typing import Self

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.frame import Landmarks, Target
from pftrack.vision.geometry.face_model import FEATURES, FaceModel

__all__ = ["HeadTarget"]


@dataclass(frozen=True, slots=True)
class HeadTarget(Target):
    """Where a head truly is: `position` is theta (3,) in rad, `landmarks` are the features and the driver's own face.

    Attributes:
        translation_mm: (3,) t in Xc = R(theta) X + t, the camera's frame.
    """

    translation_mm: NDArray[np.float64] = field(default_factory=lambda: np.zeros(3))

    @classmethod
    def observe(
        cls,
        model: FaceModel,
        theta_rad: NDArray[np.float64],
        translation_mm: NDArray[np.float64],
        points_px: NDArray[np.float64],
        visible: NDArray[np.bool_],
    ) -> Self:
        """Return the truth; the head counts as hidden when none of its features is seen.

        Args:
            model: The driver's own face.
            theta_rad: (3,) nod, turn and roll.
            translation_mm: (3,) in the camera's frame.
            points_px: (11, 2) features in the picture.
            visible: (11,) whether each is seen.
        """
        return cls(
            position=theta_rad,
            size=float(np.ptp(points_px, axis=0).max()),
            hidden=not visible.any(),
            landmarks=Landmarks(points_px, visible, model.points_mm, FEATURES),
            translation_mm=translation_mm,
        )
