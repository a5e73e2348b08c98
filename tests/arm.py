"""A made film of an arm with a spotted sticker at its root, its joints and its tip."""

from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from pftrack.core.numerics.random import Purpose, Stream
from pftrack.vision.film import FilmWriter

__all__ = ["FRAMES", "SIZE", "film", "joints"]

FRAMES, SIZE = 24, (240, 200)
RATE_HZ = 15.0
LENGTH_PX = 32.0
STICKER_PX = 15


def joints(index: int) -> NDArray[np.float64]:
    """Return where the points are in a picture, (4, 2) px: at first where an editor begins; the root leaves soon."""
    angles = np.cumsum([0.01, 0.03, 0.02]) * index
    links = LENGTH_PX * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    chain = np.concatenate([np.zeros((1, 2)), np.cumsum(links, axis=0)])
    return np.asarray(chain + np.array([71.5 - 3.0 * index, 99.5]))


def film(path: Path) -> None:
    """Write the film."""
    spots = Stream(3, 0, Purpose.SCENE).random((4, 5, 5, 1)) * 200.0
    with FilmWriter(path, RATE_HZ) as writer:
        for index in range(FRAMES):
            picture = np.full((SIZE[1], SIZE[0], 3), 215, np.uint8)
            points = joints(index)
            cv2.polylines(picture, [np.rint(16 * points).astype(np.int32)], False, (90, 110, 150), 9, cv2.LINE_AA, 4)
            for sticker, (x, y) in zip(spots, points, strict=True):
                grown = cv2.resize(np.repeat(sticker, 3, axis=2), (STICKER_PX,) * 2, interpolation=cv2.INTER_CUBIC)
                half = STICKER_PX // 2
                moved = cv2.warpAffine(
                    grown, np.array([[1, 0, x - half], [0, 1, y - half]]), SIZE, borderValue=(-1,) * 3
                )
                inside = (moved > -0.5).all(axis=2)
                picture[inside] = np.clip(moved[inside], 0, 255)
            writer.write(picture)
