"""Frames: what a source shows at one instant, and what is known to be true of it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Frame", "Target"]


@dataclass(frozen=True, slots=True)
class Target:
    """Where the target truly is.

    Attributes:
        position: (d,) centre; (u, v) in px of the picture with u the column and v the row, or the signal's value.
        size: Longer side of the box around it, px; 0 for a signal.
        hidden: Whether it is known to be out of sight.
    """

    position: NDArray[np.float64]
    size: float = 0.0
    hidden: bool = False


@dataclass(frozen=True, slots=True)
class Frame:
    """One instant of a source.

    Attributes:
        index: Number of the frame within the run, from 0.
        time_s: Time since frame 0, s.
        image_rgb: (height, width, 3) uint8, read-only, or None for a signal.
        signal: (d,) observed values, or None for a picture.
        target: The truth, or None where it is not known.
    """

    index: int
    time_s: float
    image_rgb: NDArray[np.uint8] | None = None
    signal: NDArray[np.float64] | None = None
    target: Target | None = None
