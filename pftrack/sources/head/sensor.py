"""From light to an 8-bit picture: noise on every pixel, rounding and clipping."""

import numpy as np
from numpy.typing import NDArray

from pftrack.numerics.compiled import compiled

__all__ = ["expose"]


@compiled
def expose(grey: NDArray[np.float32], noise_sd: float, noise: NDArray[np.float64]) -> NDArray[np.uint8]:
    """Return the picture (height, width, 3), its three channels alike.

    Args:
        grey: (height, width) grey levels.
        noise_sd: Standard deviation of the noise, grey levels.
        noise: (height width,) of unit variance; empty where there is none.
    """
    height, width = grey.shape
    image = np.empty((height, width, 3), np.uint8)
    for row in range(height):
        for column in range(width):
            level = grey[row, column]
            if noise_sd > 0.0:
                level += noise_sd * noise[row * width + column]
            rounded = np.uint8(min(max(level, 0.0), 255.0) + 0.5)
            for channel in range(3):
                image[row, column, channel] = rounded
    return image
