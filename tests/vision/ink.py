"""What the tests of pictures and worlds share: single precision, a colour, and where a picture has weight."""

import numpy as np

from pftrack.core.model.drawing import COLOURS

BLUE = COLOURS["estimate"]


def f32(*values: object) -> np.ndarray:
    return np.array(values, np.float32)


def centre(weights: np.ndarray) -> np.ndarray:
    """Return the centre (x, y) of weights (height, width)."""
    found: np.ndarray = (np.indices(weights.shape)[::-1] * weights).sum(axis=(1, 2)) / weights.sum()
    return found
