"""Heat: numbers as colours, such as over a picture, so that one sees where they are high."""

from functools import cache

import cv2
import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.palette import VIRIDIS

__all__ = ["over", "viridis"]

SHARE = 0.65
"""Of the colours; the rest is the picture, in grey."""

LEVELS = 256


def viridis(values: NDArray[np.float64]) -> NDArray[np.uint8]:
    """Return colours (..., 3) RGB for numbers (...), from purple for 0 and below to yellow for 1 and above."""
    places = np.clip(np.rint((LEVELS - 1) * values), 0, LEVELS - 1).astype(np.intp)
    return np.rint(_levels()[places]).astype(np.uint8)


def over(image_rgb: NDArray[np.uint8], values: NDArray[np.float64], *, width: int) -> NDArray[np.uint8]:
    """Return a picture in grey with numbers over it in viridis, from purple for 0 to yellow for 1.

    Args:
        image_rgb: (h, w, 3).
        values: 0..1, over the same picture, of any size.
        width: Of the result, px, if the picture is not narrower.

    Returns:
        (height, width, 3) RGB.
    """
    scale = min(1.0, width / image_rgb.shape[1])
    size = max(round(image_rgb.shape[1] * scale), 1), max(round(image_rgb.shape[0] * scale), 1)
    small = cv2.resize(np.ascontiguousarray(image_rgb), size, interpolation=cv2.INTER_AREA)
    places = cv2.resize(values.astype(np.float32), size, interpolation=cv2.INTER_AREA)
    heat = _levels()[np.clip(np.rint((LEVELS - 1) * places), 0, LEVELS - 1).astype(np.intp)]
    grey = cv2.cvtColor(small, cv2.COLOR_RGB2GRAY).astype(np.float64)[:, :, None]
    return np.rint(SHARE * heat + (1.0 - SHARE) * grey).astype(np.uint8)


@cache
def _levels() -> NDArray[np.float64]:
    """Return the colours (levels, 3) in equal steps."""
    stops, levels = np.linspace(0.0, 1.0, len(VIRIDIS)), np.linspace(0.0, 1.0, LEVELS)
    return np.column_stack([np.interp(levels, stops, channel) for channel in np.array(VIRIDIS, float).T])
