"""What a recording shows where its target is not, pixel by pixel: a model of the background over time.

Of a fixed camera a pixel's median over pictures is what it shows most of the time, whatever passes by. How much it
varies about that, by noise or by leaves in the wind, is told by the median of the absolute deviations, which what
passes by does not enlarge either as long as it is there less than half of the time.

The pictures are few and always the same ones, so a frame comes to the same whether one plays, seeks or branches.

Where the target stays for half of them, the median is the target. Near that the model is in doubt, and so it is where
the camera moves: then a pixel is off the median in many of the pictures (`doubtful`).
"""

import math
from functools import lru_cache
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.frame import Backdrop
from pftrack.core.numerics.compiled import read_only

__all__ = ["BackdropModel", "backdrop_model", "differs", "doubtful", "smaller"]

NORMAL_SD = 1.4826
"""Standard deviation of a normal distribution by the median of its absolute deviations."""
DEVIATIONS = 4.0
"""In standard deviations, from which on a pixel differs that varies by itself."""
MAJORITY = 0.7
"""Share of the pictures that show a pixel as the median has it, where the model is not in doubt."""


class BackdropModel(NamedTuple):
    """What a fixed camera sees behind the target.

    Attributes:
        median_rgb: (h, w, 3) grey levels.
        sd_rgb: (h, w, 3) by how much each pixel varies, grey levels.
        majority_rgb: (h, w, 3) deviation from the median that this share of the pictures stays within, grey levels.
    """

    median_rgb: NDArray[np.float32]
    sd_rgb: NDArray[np.float32]
    majority_rgb: NDArray[np.float32]


@lru_cache(maxsize=2)
def backdrop_model(backdrop: Backdrop, first: int, reduction: int) -> BackdropModel:
    """Return the model of a recording's background; those of the last recordings are kept.

    Args:
        backdrop: Whose pictures are looked at.
        first: So many of the first pictures show nothing else; 0 if pictures of the whole recording are to be taken.
        reduction: By which the pictures are made smaller, a whole number.
    """
    pictures = np.array([smaller(picture, reduction) for picture in backdrop.pictures(first)], np.float32)
    median = _middle(np.sort(pictures, axis=0))
    away = np.sort(np.abs(pictures - median), axis=0)
    majority = away[math.ceil(MAJORITY * len(away)) - 1].copy()
    return BackdropModel(read_only(median), read_only(np.float32(NORMAL_SD) * _middle(away)), read_only(majority))


def _middle(ordered: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the median (h, w, 3) of sorted pictures (n, h, w, 3); `np.median` takes several times as long."""
    last = len(ordered) - 1
    middle: NDArray[np.float32] = np.float32(0.5) * (ordered[last // 2] + ordered[last - last // 2])
    return middle


def differs(image_rgb: NDArray[np.uint8], model: BackdropModel, least: int) -> NDArray[np.bool_]:
    """Return which pixels (h, w) are not those of the background.

    Args:
        image_rgb: (h, w, 3), as small as the model.
        model: Of the background.
        least: By how many grey levels a pixel differs in one channel at least; more where the background varies.
    """
    return _beyond(np.abs(image_rgb.astype(np.float32) - model.median_rgb), model, least)


def doubtful(model: BackdropModel, least: int) -> NDArray[np.bool_]:
    """Return which pixels (h, w) differ from the background in so many of its pictures that it may not be there.

    Args:
        model: Of the background.
        least: As for `differs`.
    """
    return _beyond(model.majority_rgb, model, least)


def _beyond(away: NDArray[np.float32], model: BackdropModel, least: int) -> NDArray[np.bool_]:
    """Return which pixels (h, w) deviations (h, w, 3) from the median are too great for, in one channel at least."""
    return np.asarray((away >= np.maximum(np.float32(least), np.float32(DEVIATIONS) * model.sd_rgb)).any(axis=2))


def smaller(image_rgb: NDArray[np.uint8], reduction: int) -> NDArray[np.uint8]:
    """Return a picture (h, w, 3) each pixel of which is the mean of a square of pixels; the rest at the ends is cut."""
    if reduction == 1:
        return image_rgb
    height, width = (max(side // reduction, 1) for side in image_rgb.shape[:2])
    whole = image_rgb[: height * reduction, : width * reduction]
    return np.asarray(cv2.resize(whole, (width, height), interpolation=cv2.INTER_AREA), np.uint8)
