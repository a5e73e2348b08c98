"""Heat: numbers over a picture as colours, so that one sees where they are high."""

import cv2
import numpy as np
from numpy.typing import NDArray

from pftrack.palette import VIRIDIS

__all__ = ["over"]

SHARE = 0.65
"""Of the colours; the rest is the picture, in grey."""

LEVELS = 256


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
    stops = np.linspace(0.0, 1.0, len(VIRIDIS))
    levels = np.linspace(0.0, 1.0, LEVELS)
    colours = np.column_stack([np.interp(levels, stops, channel) for channel in np.array(VIRIDIS, float).T])
    heat = colours[np.clip(np.rint((LEVELS - 1) * places), 0, LEVELS - 1).astype(np.intp)]
    grey = cv2.cvtColor(small, cv2.COLOR_RGB2GRAY).astype(np.float64)[:, :, None]
    return np.rint(SHARE * heat + (1.0 - SHARE) * grey).astype(np.uint8)
