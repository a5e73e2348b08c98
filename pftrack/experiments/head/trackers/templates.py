"""How large the templates of a face's features are (Bando 2007, table 4.1)."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from pftrack.vision.likelihoods.template import scaled_sizes

__all__ = ["EYE_DISTANCE_PX", "SIZES_PX", "template_sizes"]

SIZES_PX: Mapping[str, tuple[int, int]] = {
    "nose": (64, 42),
    "leye": (64, 32),
    "reye": (64, 32),
    "lmc": (36, 36),
    "rmc": (36, 36),
    "llc": (36, 36),
    "rlc": (36, 36),
    "lbro": (36, 36),
    "rbro": (36, 36),
    "lmou": (24, 24),
    "rmou": (24, 24),
}
"""Width and height; the table has no size for the ends of the brows, 36 x 36 is a reading."""

EYE_DISTANCE_PX = 108.0
"""Between the eyes of the mean face at Bando's camera; the sizes above are for that."""


def template_sizes(features: Sequence[str], eye_distance_px: float, factor: float = 1.0) -> NDArray[np.int64]:
    """Return widths and heights (F, 2) of templates in proportion to the face, px, even numbers.

    Args:
        features: Names, of `SIZES_PX`.
        eye_distance_px: Between the eyes in the picture; at 108 px the sizes are Bando's.
        factor: A further factor on all sizes.
    """
    return scaled_sizes([SIZES_PX[name] for name in features], factor * eye_distance_px / EYE_DISTANCE_PX)
