"""How an open hand is marked: by the tips of its five fingers."""

from collections.abc import Mapping
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.frame import Target
from pftrack.core.model.marks import FeaturePoints
from pftrack.experiments.hand.scene import HandTarget

__all__ = ["TIPS", "HandTips"]

TIPS = {
    "thumb": "Thumb",
    "index": "Index finger",
    "middle": "Middle finger",
    "ring": "Ring finger",
    "little": "Little finger",
}

OFFERED = {
    "thumb": (0.72, 0.52),
    "index": (0.62, 0.3),
    "middle": (0.5, 0.24),
    "ring": (0.39, 0.29),
    "little": (0.29, 0.4),
}
"""As of a right hand that shows its palm: a person sees which point is whose before any is dragged."""


class HandTips(FeaturePoints):
    """The five tips of an open hand."""

    title: ClassVar[str] = "Tips of the fingers"
    instruction: ClassVar[str] = (
        "Drag each point to the tip of its finger, that of a folded finger to where its tip is; two fingers at least "
        "have to be straight."
    )
    features: ClassVar[Mapping[str, str]] = TIPS
    joined: ClassVar[tuple[tuple[str, str], ...]] = tuple(zip(list(TIPS), list(TIPS)[1:], strict=False))
    offered: ClassVar[Mapping[str, tuple[float, float]]] = OFFERED

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
