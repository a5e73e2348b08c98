"""What the tests of pictures and worlds share: single precision, a colour, and where a picture has weight."""

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.drawing import COLOURS

BLUE = COLOURS["estimate"]


def f32(*values: object) -> NDArray[np.float32]:
    return np.array(values, np.float32)


def centre(weights: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the centre (x, y) of weights (height, width)."""
    found: NDArray[np.float64] = (np.indices(weights.shape)[::-1] * weights).sum(axis=(1, 2)) / weights.sum()
    return found
