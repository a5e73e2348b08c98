"""Windows of a picture: rectangles of whole pixels around places, clipped, and the order in which to visit many.

A window is a row of eight whole numbers: left, top, right, bottom within the picture (right and bottom are the first
beyond it), the middle's column and row, half width and half height.
"""

import numpy as np
from numpy.typing import NDArray

from pftrack.core.numerics.compiled import compiled

__all__ = ["overlap", "path", "same", "shift", "windows_around"]

LEAST_COVERAGE = 0.25
"""A window of which a smaller share lies within the picture is outside."""
EVERYWHERE = 1e9
"""Places beyond this many px are no places."""


@compiled
def windows_around(
    columns: NDArray[np.float64],
    rows: NDArray[np.float64],
    half_widths: NDArray[np.float64],
    half_heights: NDArray[np.float64],
    width: int,
    height: int,
) -> NDArray[np.int64]:
    """Return the windows (N, 8) around places.

    One of which less than a quarter lies within the picture is empty: its right edge is its left one.

    Args:
        columns: (N,) middles, px; rounded to pixels; what is not finite is outside the picture.
        rows: (N,) of them.
        half_widths: (N,) px, rounded; 0 at least.
        half_heights: (N,) likewise.
        width: Of the picture, px.
        height: Of it.
    """
    count = columns.shape[0]
    windows = np.zeros((count, 8), np.int64)
    for n in range(count):
        if not (abs(columns[n]) < EVERYWHERE and abs(rows[n]) < EVERYWHERE):
            continue
        column, row = int(np.floor(columns[n] + 0.5)), int(np.floor(rows[n] + 0.5))
        across = int(np.floor(min(max(half_widths[n], 0.0), EVERYWHERE) + 0.5))
        down = int(np.floor(min(max(half_heights[n], 0.0), EVERYWHERE) + 0.5))
        left, right = max(column - across, 0), min(column + across + 1, width)
        top, bottom = max(row - down, 0), min(row + down + 1, height)
        if left < right and top < bottom:
            within = (right - left) * (bottom - top)
            if within >= LEAST_COVERAGE * ((2 * across + 1) * (2 * down + 1)):
                windows[n] = np.array((left, top, right, bottom, column, row, across, down))
    return windows


@compiled
def shift(window: NDArray[np.int64], left: int, top: int) -> NDArray[np.int64]:
    """Return a window as it lies in a part of the picture that begins at (left, top)."""
    moved = window.copy()
    for place in (0, 2, 4):
        moved[place] -= left
        moved[place + 1] -= top
    return moved


@compiled
def path(windows: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the windows' numbers (N,) so that neighbours follow each other: in strips, to and fro."""
    count = windows.shape[0]
    left = top = 1 << 40
    right = bottom = -(1 << 40)
    for n in range(count):
        if windows[n, 2] > windows[n, 0]:
            left, right = min(left, windows[n, 4]), max(right, windows[n, 4])
            top, bottom = min(top, windows[n, 5]), max(bottom, windows[n, 5])
    # Strips as high as the mean distance of neighbours make the shortest paths.
    area = max((right - left + 1) * (bottom - top + 1), 1)
    strip = max(int(np.sqrt(3.0 * area / max(count, 1))), 1)
    keys = np.empty(count, np.int64)
    for n in range(count):
        number = (windows[n, 5] - top) // strip
        along = windows[n, 4] - left
        keys[n] = (number << 32) + (along if number % 2 == 0 else (1 << 31) - along)
    return np.argsort(keys)


@compiled
def same(one: NDArray[np.int64], other: NDArray[np.int64]) -> bool:
    """Tell whether two windows are the same."""
    for place in range(one.shape[0]):  # noqa: SIM110 - `all` of a generator cannot be compiled
        if one[place] != other[place]:
            return False
    return True


@compiled
def overlap(one: NDArray[np.int64], other: NDArray[np.int64]) -> int:
    """Return the number of pixels that two windows share."""
    across = min(one[2], other[2]) - max(one[0], other[0])
    down = min(one[3], other[3]) - max(one[1], other[1])
    return across * down if across > 0 and down > 0 else 0
