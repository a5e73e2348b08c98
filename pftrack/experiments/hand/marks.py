"""How an open hand is marked: by the tips of its five fingers."""

from collections.abc import Mapping
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from pftrack.model.frame import Target
from pftrack.model.marks import FeaturePoints
from pftrack.sources.hand import HandTarget

__all__ = ["TIPS", "HandTips"]

TIPS = {
    "thumb": "Tip of the thumb",
    "index": "Tip of the index finger",
    "middle": "Tip of the middle finger",
    "ring": "Tip of the ring finger",
    "little": "Tip of the little finger",
}


class HandTips(FeaturePoints):
    """The five tips of an open hand."""

    title: ClassVar[str] = "Tips of the fingers"
    instruction: ClassVar[str] = "Drag each point to the tip of its finger; all five fingers have to be spread."
    features: ClassVar[Mapping[str, str]] = TIPS
    joined: ClassVar[tuple[tuple[str, str], ...]] = tuple(zip(list(TIPS), list(TIPS)[1:], strict=False))

    @classmethod
    def of_target(cls, target: Target) -> Self | None:
        """Return the tips of a hand that is known."""
        return cls.of(target.tips) if isinstance(target, HandTarget) else None

    @classmethod
    def of(cls, tips: NDArray[np.float64]) -> Self:
        """Return the mark of tips (5, 2), thumb first, px."""
        return cls.model_validate({"points": dict(zip(TIPS, tips.tolist(), strict=True))})

    @property
    def tips(self) -> NDArray[np.float64]:
        """(5, 2) the tips, thumb first, px; NaN where one is not marked."""
        return np.array([self.points.get(name, (np.nan, np.nan)) for name in TIPS])
