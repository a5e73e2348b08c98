"""What is behind the head: a dim car, out of focus, and the driver's neck and shoulders.

The reference scene has smooth noise around grey 45 with blurred rectangles. Neck and shoulders are an addition: without
them the head hangs in the air. They stand still, since the head turns about a point in the neck.
"""

from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from pftrack.core.numerics.elementary import exponential
from pftrack.core.numerics.random import Purpose, Stream

__all__ = ["background"]

GREY, NECK, CLOTHES = 45.0, 62.0, 26.0
WIDTH, HEIGHT = 640, 480


@lru_cache(maxsize=4)
def background(seed: int, width: int) -> NDArray[np.float32]:
    """Return the background (3/4 width, width) in grey levels, read-only.

    Args:
        seed: Of noise and rectangles.
        width: Of the picture, px.
    """
    scene = np.full((HEIGHT, WIDTH), GREY)
    stream = Stream(seed, 1, Purpose.START)
    for across, down, wide, high, grey in stream.random((7, 5)):
        x, y = int(across * WIDTH), int(down * HEIGHT)
        cv2.rectangle(scene, (x, y), (x + 40 + int(160 * wide), y + 30 + int(140 * high)), GREY - 20 + 45 * grey, -1)
    scene = cv2.GaussianBlur(scene, (0, 0), 9.0)
    white = stream.standard_normal((HEIGHT // 8, WIDTH // 8))
    noise = cv2.resize(cv2.GaussianBlur(white, (0, 0), 3.0), (WIDTH, HEIGHT), interpolation=cv2.INTER_CUBIC)
    scene += 6.0 * noise / noise.std()
    scene = _body(np.asarray(scene, np.float64))
    size = (width, 3 * width // 4)
    small = cv2.resize(scene, size, interpolation=cv2.INTER_AREA if width < WIDTH else cv2.INTER_LINEAR)
    picture: NDArray[np.float32] = np.clip(small, 8.0, 255.0).astype(np.float32)
    picture.flags.writeable = False
    return picture


def _body(scene: NDArray[np.float64]) -> NDArray[np.float64]:
    """Paint neck and shoulders; they get darker away from the lamp's middle."""
    columns, rows = np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT))
    beside = np.abs(columns - WIDTH / 2.0)
    shoulders = rows - (418.0 + 26.0 * _tanh(np.maximum(beside - 70.0, 0.0) / 90.0) + 0.0009 * beside**2)
    neck = np.maximum(beside - 84.0, 350.0 - rows)
    for distance, grey in ((neck, NECK - 0.0035 * beside**2), (shoulders, CLOTHES + 0.0 * beside)):
        share = np.clip(0.5 - distance / 6.0 if distance is neck else 0.5 + distance / 6.0, 0.0, 1.0)
        scene = scene + (grey - scene) * share
    return scene


def _tanh(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return tanh x of values that are not negative."""
    shrunk = exponential(-2.0 * values)
    return (1.0 - shrunk) / (1.0 + shrunk)
