"""A face model that somebody brings along, for a growing one to begin with: read, checked, and laid onto the mean face.

What "frontal" is, and where the head's origin, is the mean face's affair, so a model that is turned or moved is turned
and moved back. It must be a face: one of another size by half, or with a point three standard deviations of anybody's
face from where the mean has it, is a mistake or a joke.
"""

from functools import lru_cache

import numpy as np

from pftrack.vision.geometry.face_model import FEATURES, FaceModel, fit_similarity, mean_model
from pftrack.vision.model_files.points import read_points

__all__ = ["starting_model"]

SIZES = (0.5, 2.0)
FURTHEST_MM = 25.0


@lru_cache(maxsize=8)
def starting_model(text: str) -> FaceModel:
    """Return the face of a file of points, as large as it is, turned and moved onto the mean face.

    Raises:
        ValueError: It is no such file, has another number of points, or they make no face.
    """
    points, mean = read_points(text, FEATURES), mean_model().points_mm
    onto = fit_similarity(points, mean)
    if not SIZES[0] <= 1.0 / onto.scale <= SIZES[1]:
        raise ValueError(
            f"expected a face of {SIZES[0]:g} to {SIZES[1]:g} times the mean's size, got {1 / onto.scale:.3g}"
        )
    apart = np.sqrt(np.square(onto(points) - mean).sum(axis=1))
    worst = int(apart.argmax())
    if apart[worst] > FURTHEST_MM:
        raise ValueError(
            f"expected points within {FURTHEST_MM:g} mm of the mean face's, got {FEATURES[worst]} "
            f"{apart[worst]:.0f} mm away"
        )
    return FaceModel(onto(points) / onto.scale)
