"""How far a picture has moved since the last one: what a camera that is held in a hand does to all that is seen.

Two small grey pictures are laid over each other, moved against each other by whole pixels, and compared where both have
pixels (block matching, with the whole picture as the block). The best place is where their differences are smaller by
most than those which the same pixels have if nothing is moved, so that moving it out of sight gains nothing. It is
looked for in quarters of the size first, then near the best place in halves and in full. Between pixels the top of a
parabola through three gains counts. Sums are of whole numbers, so every processor has the same bits.

Most of the picture has to be background: a target that fills it takes the camera's place.
"""

import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Floats, Ints
from pftrack.core.numerics.checks import check_picture
from pftrack.core.numerics.compiled import compiled, read_only

LONGER_SIDE_PX = 160
"""Of the small picture, about."""
COARSE_REACH, FINE_REACH = 8, 2
"""How far is looked in quarters of the size, px of those, and around what was found at twice the size before."""


def small_grey(image_rgb: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return a picture (height, width, 3) in grey and small: means of squares of whole pixels.

    Raises:
        TypeError: The picture is not an array of bytes.
        ValueError: It is not (height, width, 3).
    """
    check_picture(image_rgb)
    return _small_grey(read_only(image_rgb), _scale_of(image_rgb))


def camera_shift(before: NDArray[np.uint8], image_rgb: NDArray[np.uint8], after: NDArray[np.uint8]) -> Floats:
    """Return how far what is seen has moved, (2,) to the right and down, px of the picture.

    Args:
        before: The last picture, small and grey.
        image_rgb: This picture, which tells the scale.
        after: This picture, small and grey.

    Raises:
        TypeError: One is not an array of bytes.
        ValueError: One has other sides.
    """
    check_picture(image_rgb)
    check_picture(before, "height width")
    check_picture(after, "height width")
    if before.shape != after.shape:
        return np.zeros(2)
    return float(_scale_of(image_rgb)) * _shift(before, after)


def _scale_of(image_rgb: NDArray[np.uint8]) -> int:
    """Return the side of the squares that become pixels, px."""
    height, width, _ = image_rgb.shape
    longer: int = max(height, width)
    return max((longer + LONGER_SIDE_PX // 2) // LONGER_SIDE_PX, 1)


@compiled
def _small_grey(image_rgb: NDArray[np.uint8], scale: int) -> NDArray[np.uint8]:
    height, width = image_rgb.shape[0] // scale, image_rgb.shape[1] // scale
    grey = np.empty((height, width), np.uint8)
    for row in range(height):
        for column in range(width):
            total = 0
            for y in range(row * scale, (row + 1) * scale):
                for x in range(column * scale, (column + 1) * scale):
                    pixel = image_rgb[y, x]
                    total += 77 * int(pixel[0]) + 150 * int(pixel[1]) + 29 * int(pixel[2])
            grey[row, column] = total // (256 * scale * scale)
    return grey


@compiled
def _shift(before: NDArray[np.uint8], after: NDArray[np.uint8]) -> Floats:
    half_before, half_after = _halve(before), _halve(after)
    quarter_before, quarter_after = _halve(half_before), _halve(half_after)
    x, y = _best(quarter_before, quarter_after, _still(quarter_before, quarter_after), 0, 0, COARSE_REACH)
    x, y = _best(half_before, half_after, _still(half_before, half_after), 2 * x, 2 * y, FINE_REACH)
    still = _still(before, after)
    x, y = _best(before, after, still, 2 * x, 2 * y, FINE_REACH)
    most = _gain(before, after, still, x, y)
    found = np.empty(2)
    found[0] = x + _between(_gain(before, after, still, x - 1, y), most, _gain(before, after, still, x + 1, y))
    found[1] = y + _between(_gain(before, after, still, x, y - 1), most, _gain(before, after, still, x, y + 1))
    return found


@compiled
def _halve(grey: NDArray[np.uint8]) -> NDArray[np.uint8]:
    height, width = grey.shape[0] // 2, grey.shape[1] // 2
    halved = np.empty((height, width), np.uint8)
    for row in range(height):
        for column in range(width):
            upper = int(grey[2 * row, 2 * column]) + int(grey[2 * row, 2 * column + 1])
            lower = int(grey[2 * row + 1, 2 * column]) + int(grey[2 * row + 1, 2 * column + 1])
            halved[row, column] = (upper + lower) // 4
    return halved


@compiled
def _still(before: NDArray[np.uint8], after: NDArray[np.uint8]) -> Ints:
    """Return the differences of two pictures that lie still, as sums over rectangles that begin in the first pixel."""
    height, width = before.shape
    sums = np.zeros((height + 1, width + 1), np.int64)
    for row in range(height):
        along = np.int64(0)
        for column in range(width):
            along += abs(np.int64(after[row, column]) - np.int64(before[row, column]))
            sums[row + 1, column + 1] = sums[row, column + 1] + along
    return sums


@compiled
def _best(
    before: NDArray[np.uint8], after: NDArray[np.uint8], still: Ints, x: int, y: int, reach: int
) -> tuple[int, int]:
    """Return the shift within reach of (x, y) that gains most; that one itself among equals."""
    best_x, best_y, most = x, y, _gain(before, after, still, x, y)
    for down in range(y - reach, y + reach + 1):
        for across in range(x - reach, x + reach + 1):
            gain = _gain(before, after, still, across, down)
            if gain > most:
                best_x, best_y, most = across, down, gain
    return best_x, best_y


@compiled
def _gain(before: NDArray[np.uint8], after: NDArray[np.uint8], still: Ints, x: int, y: int) -> float:
    """Return by how much two pictures differ less where they overlap, the second moved by (x, y), than lying still."""
    height, width = before.shape
    left, right, top, bottom = max(x, 0), min(width + x, width), max(y, 0), min(height + y, height)
    if 2 * (right - left) < width or 2 * (bottom - top) < height:
        return -np.inf
    total = still[bottom, right] - still[top, right] - still[bottom, left] + still[top, left]
    for row in range(top, bottom):
        old, new = before[row - y], after[row]
        along = np.int32(0)
        for column in range(left, right):
            along += abs(np.int32(new[column]) - np.int32(old[column - x]))
        total -= np.int64(along)
    return float(total)


@compiled
def _between(one: float, most: float, other: float) -> float:
    """Return where between two neighbours the parabola through three gains is highest, -1/2..1/2."""
    bend = 2.0 * most - one - other
    if not (bend > 0.0 and bend < np.inf):
        return 0.0
    return float(min(max(0.5 * (other - one) / bend, -0.5), 0.5))
