"""The truth of a frame in which a hand is seen."""

from dataclasses import dataclass, field
from typing import Self

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.frame import Target
from pftrack.experiments.hand.shape import ANGLES, MODEL, HandShape, joints

__all__ = ["HandTarget"]


@dataclass(frozen=True, slots=True)
class HandTarget(Target):
    """Where a hand truly is: `position` (15,) is where the five tips are, thumb first, px.

    Of each that is column, row, and height above the wrist towards the camera.

    Attributes:
        pose: (25,) as `pftrack.experiments.hand.shape` has it.
        scale: Length of the palm axis, px.
        shape: Of this hand.
        model: What a tracker knows of the hand's shape: that of the average hand, or what was measured of a person.
    """

    pose: NDArray[np.float64] = field(default_factory=lambda: np.zeros(ANGLES))
    scale: float = 1.0
    shape: HandShape = MODEL
    model: HandShape = MODEL

    @classmethod
    def of(
        cls,
        pose: NDArray[np.float64],
        scale: float,
        shape: HandShape,
        model: HandShape,
        *,
        hidden: bool | None = False,
    ) -> Self:
        """Return the truth of a pose, with the box around wrist and tips."""
        tips = joints(pose, scale, shape)[:, 3]
        points = np.vstack([pose[:2], tips[:, :2]])
        width, height = (points.max(axis=0) - points.min(axis=0)).tolist()
        return cls(
            position=tips.ravel(),
            size=max(width, height),
            hidden=hidden,
            extent=(width, height),
            pose=pose,
            scale=scale,
            shape=shape,
            model=model,
        )

    @property
    def tips(self) -> NDArray[np.float64]:
        """(5, 2) column and row of the tips, thumb first, px."""
        return self.position.reshape(5, 3)[:, :2]
