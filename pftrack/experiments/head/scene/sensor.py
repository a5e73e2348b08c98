"""From light to an 8-bit picture: the lens's blur, noise on every pixel, rounding and clipping."""

import numpy as np
from numpy.typing import NDArray

from pftrack.core.numerics.compiled import compiled
from pftrack.core.numerics.elementary import exponential

__all__ = ["blur", "expose"]

REACH = 3.0
"""Of the blur, in its standard deviations."""


def blur(grey: NDArray[np.float32], sd_px: float) -> NDArray[np.float32]:
    """Return a picture (height, width) as a lens shows it that is out of focus by a Gaussian; beyond its edge it stays.

    Args:
        grey: (height, width) grey levels.
        sd_px: Standard deviation of the Gaussian, px; at 0 the picture itself comes back.
    """
    reach = int(np.ceil(REACH * sd_px))
    if reach < 1:
        return grey
    weights = exponential(-0.5 * np.square(np.arange(-reach, reach + 1) / sd_px))
    return _blur_rows(_blur_rows(grey, weights / weights.sum()), weights / weights.sum())


@compiled
def _blur_rows(grey: NDArray[np.float32], weights: NDArray[np.float64]) -> NDArray[np.float32]:
    """Return a picture (height, width) blurred along its rows, transposed."""
    height, width = grey.shape
    reach = weights.shape[0] // 2
    blurred = np.empty((width, height), np.float32)
    sums = np.empty(width)
    for row in range(height):
        sums[:] = 0.0
        for k in range(weights.shape[0]):
            for column in range(width):
                sums[column] += weights[k] * grey[row, min(max(column + k - reach, 0), width - 1)]
        for column in range(width):
            blurred[column, row] = sums[column]
    return blurred


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
