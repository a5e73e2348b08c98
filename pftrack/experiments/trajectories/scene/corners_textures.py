"""What is painted on wall, book and box: whole numbers of sixteenths of a grey level.

Whole numbers, since pictures between pixels are then sums of products that are exact on every processor.
"""

from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from pftrack.core.numerics.random import Purpose, Stream

__all__ = ["BOOK_PX", "BOX_PX", "LEVEL", "LINE", "SIZE_PX", "WALL_MARGIN_PX", "book", "box", "wall"]

SIZE_PX = (360, 288)
"""Width and height of the picture."""

LEVEL = 16
"""Numbers to a grey level."""

WALL_MARGIN_PX = 48
"""So far the wall extends beyond the picture on each side; it moves by less."""

WALL, CELL_SD, SMOOTH_SD = 170.0, 12.0, 4.0
LINE_PX = 2
BLUR_PX = 12
"""Side of the square that is run over white noise three times: nearly a Gaussian of 6 px standard deviation."""

BOOK_PX, BOX_PX = (110, 84), (70, 90)
LINE = ((8, 72), (85, 8))
"""From where to where the slanted line runs on the book, px."""
BOOK, BRIGHT = 120, 225
RECTANGLES, AWAY_PX, MOST_TRIES = 14, 20.0, 4000
CHECK_PX = 10

WALL_DRAW, BOOK_DRAW, BOX_DRAW = 1, 2, 3
"""Each surface has random numbers of its own, so that one does not change with another."""


@lru_cache(maxsize=8)
def wall(seed: int, pitch_px: int, contrast: float) -> NDArray[np.int32]:
    """Return the wall: a lattice of dark lines, cells of slightly different brightness, and smooth noise.

    Args:
        seed: Of brightness and noise.
        pitch_px: From one line to the next.
        contrast: How much darker than the wall lines are, grey levels.
    """
    width, height = (side + 2 * WALL_MARGIN_PX for side in SIZE_PX)
    stream = Stream(seed, WALL_DRAW, Purpose.START)
    cells = stream.standard_normal((height // pitch_px + 1, width // pitch_px + 1))
    rows, columns = np.arange(height), np.arange(width)
    dark = (rows[:, None] % pitch_px < LINE_PX) | (columns % pitch_px < LINE_PX)
    uneven = CELL_SD * cells[rows[:, None] // pitch_px, columns // pitch_px]
    return _levels(WALL - contrast * dark + uneven + SMOOTH_SD * _smooth(stream, (height, width)))


@lru_cache(maxsize=8)
def book(seed: int) -> NDArray[np.int32]:
    """Return the book: a bright slanted line, and rectangles of any brightness away from it."""
    width, height = BOOK_PX
    grey = np.full((height, width), BOOK, np.uint8)
    cv2.line(grey, *LINE, BRIGHT, 3)
    stream = Stream(seed, BOOK_DRAW, Purpose.START)
    painted = 0
    for across, down, wide, high, level in stream.random((MOST_TRIES, 5)):
        w, h = 8 + int(14 * wide), 8 + int(12 * high)
        x, y = int((width - w) * across), int((height - h) * down)
        corners = np.array([[x, y], [x + w, y], [x, y + h], [x + w, y + h]], np.float64)
        if painted < RECTANGLES and _beside_line(corners) >= AWAY_PX:
            cv2.rectangle(grey, (x, y), (x + w - 1, y + h - 1), 20 + int(220 * level), -1)
            painted += 1
    return _levels(grey.astype(np.float64))


@lru_cache(maxsize=8)
def box(seed: int) -> NDArray[np.int32]:
    """Return the box: checks of any brightness between 30 and 230."""
    width, height = BOX_PX
    checks = 30.0 + 200.0 * Stream(seed, BOX_DRAW, Purpose.START).random((height // CHECK_PX, width // CHECK_PX))
    return _levels(np.repeat(np.repeat(checks, CHECK_PX, axis=0), CHECK_PX, axis=1))


def _beside_line(points: NDArray[np.float64]) -> float:
    """Return how far the nearest of some points (n, 2), all on one side, is from the line; negative if they are not."""
    (x0, y0), (x1, y1) = LINE
    length = float(np.sqrt((x1 - x0) ** 2 + (y1 - y0) ** 2))
    sides = ((points[:, 0] - x0) * (y1 - y0) - (points[:, 1] - y0) * (x1 - x0)) / length
    return float(max(sides.min(), -sides.max()))


def _smooth(stream: Stream, shape: tuple[int, int]) -> NDArray[np.float64]:
    """Return smooth noise of unit variance.

    Sums of whole numbers are exact in whatever order they are added up.
    """
    noise = np.rint(1024.0 * stream.standard_normal(shape))
    weights = np.ones(1)
    for _ in range(3):
        noise = cv2.boxFilter(noise, cv2.CV_64F, (BLUR_PX, BLUR_PX), normalize=False)
        weights = np.convolve(weights, np.ones(BLUR_PX))
    return np.asarray(noise / (1024.0 * np.square(weights).sum()))


def _levels(grey: NDArray[np.float64]) -> NDArray[np.int32]:
    levels = np.rint(LEVEL * np.clip(grey, 0.0, 255.0)).astype(np.int32)
    levels.flags.writeable = False
    return levels
