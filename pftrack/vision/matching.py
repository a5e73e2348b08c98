"""Block matching: finds small pieces of an earlier picture in a later one, and the shift of the whole picture.

A template is compared with the picture at every place within a reach, and the place of the least cost is the match. Two
costs are offered: the mean absolute difference of the grey levels, which is cheap but fails when the picture becomes
brighter, and one minus the normalised correlation, which does not fail then. Only the template guides the search, so a
match in a repetitive picture may be one repetition off: `seconds` gives the cost of the best other place.

Sums are of whole numbers and the few roots and quotients are rounded by IEEE 754, so matches are the same to the bit on
every processor. Among equally good places the one nearest to the start of the search is chosen, so a patch without
structure stays where it is. Among equally near ones the upper, then the left one is chosen.
"""

from typing import Literal, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Floats, Ints, check_picture
from pftrack.core.numerics.compiled import compiled, read_only

Cost: TypeAlias = Literal["difference", "correlation"]

LARGEST_TEMPLATE_PX = 15
"""This limit keeps a sum of differences within 16 bits, so a processor adds sixteen sums at once."""

LANES = 16
APART_PX = 3
"""Distance from which another place is a separate match rather than the slope of the best one."""


class Matches(NamedTuple):
    """The best place of each template.

    Attributes:
        places: (K, 2) int64, the pixel (column, row) of the template's middle; the start of the search, if the template
            is nowhere wholly within the picture.
        offsets: (K, 2) where between the pixels the least cost is, -0.5..0.5 px; 0 beside what was not searched.
        costs: (K,) at that place, in grey levels, or 0..2 for correlation; infinite without such a place.
        seconds: (K,) the least cost at least 3 px away; infinite without such a place.
    """

    places: Ints
    offsets: Floats
    costs: Floats
    seconds: Floats


def match(
    grey: NDArray[np.uint8],
    templates: NDArray[np.uint8],
    around: Ints,
    reach_px: int,
    cost: Cost = "difference",
) -> Matches:
    """Find each template near a place.

    Args:
        grey: Picture (height, width).
        templates: (K, b, b), b odd and at most 15.
        around: (K, 2) pixels (column, row) around which to search, of any value.
        reach_px: How far to search to all four sides.
        cost: The cost to use.

    Raises:
        ValueError: Templates are not odd squares of at most 15 px, or there is not one place for each.
    """
    count, high, wide = templates.shape
    if high != wide or high % 2 == 0 or not 1 <= high <= LARGEST_TEMPLATE_PX:
        raise ValueError(f"templates must be odd squares of 1 to {LARGEST_TEMPLATE_PX} px, got {high} x {wide}")
    if around.shape != (count, 2):
        raise ValueError(f"expected a place (x, y) for each of {count} templates, got an array of {around.shape}")
    return _match(
        read_only(np.ascontiguousarray(grey)),
        read_only(np.ascontiguousarray(templates)),
        np.ascontiguousarray(around, np.int64),
        reach_px,
        cost == "correlation",
    )


def cost_map(
    grey: NDArray[np.uint8], template: NDArray[np.uint8], place: tuple[int, int], reach_px: int, cost: Cost
) -> Floats:
    """Return the cost (2 reach + 1, 2 reach + 1) of each place about one; infinite where the template sticks out."""
    x, y = place
    picture, piece = read_only(np.ascontiguousarray(grey)), read_only(np.ascontiguousarray(template))
    return _costs(picture, piece, x, y, reach_px, cost == "correlation")


def cut(grey: NDArray[np.uint8], places: Ints, size_px: int) -> NDArray[np.uint8]:
    """Return pieces (K, size, size) of a picture about pixels (K, 2); the edge is repeated beyond the picture."""
    steps = np.arange(size_px) - size_px // 2
    rows = np.clip(places[:, 1, None] + steps, 0, grey.shape[0] - 1)
    columns = np.clip(places[:, 0, None] + steps, 0, grey.shape[1] - 1)
    pieces: NDArray[np.uint8] = grey[rows[:, :, None], columns[:, None, :]]
    return pieces


@compiled
def _match(
    grey: NDArray[np.uint8], templates: NDArray[np.uint8], around: Ints, reach: int, correlation: bool
) -> Matches:
    count = templates.shape[0]
    places, offsets = around.copy(), np.zeros((count, 2))
    least, seconds = np.full(count, np.inf), np.full(count, np.inf)
    for k in range(count):
        costs = _costs(grey, templates[k], around[k, 0], around[k, 1], reach, correlation)
        row, column, least[k], seconds[k] = _two_least(costs)
        if least[k] == np.inf:
            continue
        places[k, 0], places[k, 1] = around[k, 0] + column - reach, around[k, 1] + row - reach
        if 0 < column < costs.shape[1] - 1:
            offsets[k, 0] = _between(costs[row, column - 1], least[k], costs[row, column + 1])
        if 0 < row < costs.shape[0] - 1:
            offsets[k, 1] = _between(costs[row - 1, column], least[k], costs[row + 1, column])
    return Matches(places, offsets, least, seconds)


@compiled
def _two_least(costs: Floats) -> tuple[int, int, float, float]:
    """Return row and column of the least cost, nearest to the middle, that cost, and the least one elsewhere."""
    side = costs.shape[0]
    middle = side // 2
    row, column, least, nearest = middle, middle, np.inf, 0
    for y in range(side):
        for x in range(side):
            away = (x - middle) ** 2 + (y - middle) ** 2
            if costs[y, x] < least or (costs[y, x] == least and away < nearest):
                row, column, least, nearest = y, x, costs[y, x], away
    second = np.inf
    for y in range(side):
        for x in range(side):
            if max(abs(x - column), abs(y - row)) >= APART_PX:
                second = min(second, costs[y, x])
    return row, column, least, second


@compiled
def _between(before: float, least: float, after: float) -> float:
    """Return where the least of three costs is between them, by two lines of equal slope."""
    higher = max(before, after)
    if higher == np.inf or higher <= least:
        return 0.0
    return 0.5 * (before - after) / (higher - least)


@compiled
def _costs(
    grey: NDArray[np.uint8],
    template: NDArray[np.uint8],
    x: int,
    y: int,
    reach: int,
    correlation: bool,
) -> Floats:
    height, width = grey.shape
    size, side = template.shape[0], 2 * reach + 1
    top, left = y - reach - size // 2, x - reach - size // 2
    # A copy that is a multiple of the lanes wide: the rest would be added one by one.
    padded = (side + LANES - 1) // LANES * LANES
    window = np.zeros((side + size - 1, padded + size - 1), np.uint8)
    for row in range(max(0, -top), min(side + size - 1, height - top)):
        for column in range(max(0, -left), min(side + size - 1, width - left)):
            window[row, column] = grey[top + row, left + column]
    costs = np.full((side, side), np.inf)
    first, last = max(0, -left), min(side, width - left - size + 1)
    for row in range(max(0, -top), min(side, height - top - size + 1)):
        if correlation:
            _dissimilarities(window, template, row, costs[row], first, last)
        else:
            _differences(window, template, row, costs[row], first, last)
    return costs


@compiled
def _differences(
    window: NDArray[np.uint8],
    template: NDArray[np.uint8],
    top: int,
    costs: Floats,
    first: int,
    last: int,
) -> None:
    """Write the mean absolute difference at first..last - 1 of a row."""
    size = template.shape[0]
    padded = window.shape[1] - size + 1
    sums = np.zeros(padded, np.uint16)
    for row in range(size):
        for column in range(size):
            level, beside = template[row, column], window[top + row][column:]
            for place in range(padded):
                pixel = beside[place]
                off = np.uint8(max(pixel, level) - min(pixel, level))
                sums[place] = np.uint16(sums[place] + np.uint16(off))
    for place in range(first, last):
        costs[place] = sums[place] / float(size * size)


@compiled
def _dissimilarities(
    window: NDArray[np.uint8],
    template: NDArray[np.uint8],
    top: int,
    costs: Floats,
    first: int,
    last: int,
) -> None:
    """Write one minus the normalised correlation at first..last - 1 of a row."""
    size = template.shape[0]
    padded, count = window.shape[1] - size + 1, size * size
    products, sums, squares = np.zeros(padded, np.int32), np.zeros(padded, np.int32), np.zeros(padded, np.int32)
    total, square = 0, 0
    for row in range(size):
        for column in range(size):
            level, beside = np.int32(template[row, column]), window[top + row][column:]
            total, square = total + int(level), square + int(level) * int(level)
            for place in range(padded):
                pixel = np.int32(beside[place])
                products[place] = np.int32(products[place] + level * pixel)
                sums[place] = np.int32(sums[place] + pixel)
                squares[place] = np.int32(squares[place] + pixel * pixel)
    own = count * square - total * total
    for place in range(first, last):
        shared = count * np.int64(products[place]) - total * np.int64(sums[place])
        spread = count * np.int64(squares[place]) - np.int64(sums[place]) * np.int64(sums[place])
        # Without structure on either side the correlation is undefined.
        alike = shared / np.sqrt(float(own) * float(spread)) if own > 0 and spread > 0 else 0.0
        costs[place] = 1.0 - alike


# How far a picture has moved since the last one: what a camera that is held in a hand does to all that is seen.
#
# Two small grey pictures are laid over each other, moved against each other by whole pixels, and compared where both
# have pixels (block matching, with the whole picture as the block). The best shift reduces the differences most,
# compared with the same pixels without a shift, so shifting the picture out of sight gains nothing. It is looked for in
# quarters of the size first, then near the best place in halves and in full. Between pixels the top of a parabola
# through three gains counts. Sums are of whole numbers, so every processor has the same bits.
#
# Most of the picture has to be background: a target that fills it takes the camera's place.

LONGER_SIDE_PX = 160
"""Approximate width of the small picture."""
COARSE_REACH, FINE_REACH = 8, 2
"""Reach of the search at a quarter of the size, in px of that size, and around the result at each doubled size."""


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
        image_rgb: This picture, which sets the scale.
        after: This picture, small and grey.

    Raises:
        TypeError: An argument is not an array of bytes.
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
    found[0] = x + _top_between(_gain(before, after, still, x - 1, y), most, _gain(before, after, still, x + 1, y))
    found[1] = y + _top_between(_gain(before, after, still, x, y - 1), most, _gain(before, after, still, x, y + 1))
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
    """Return the differences of two unshifted pictures, as sums over rectangles that begin in the first pixel."""
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
    """Return the shift within reach of (x, y) that gains most; (x, y) itself wins ties."""
    best_x, best_y, most = x, y, _gain(before, after, still, x, y)
    for down in range(y - reach, y + reach + 1):
        for across in range(x - reach, x + reach + 1):
            gain = _gain(before, after, still, across, down)
            if gain > most:
                best_x, best_y, most = across, down, gain
    return best_x, best_y


@compiled
def _gain(before: NDArray[np.uint8], after: NDArray[np.uint8], still: Ints, x: int, y: int) -> float:
    """Return the gain of moving the second picture by (x, y): the reduction of the differences where both overlap."""
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
def _top_between(one: float, most: float, other: float) -> float:
    """Return where between two neighbours the parabola through three gains is highest, -1/2..1/2."""
    bend = 2.0 * most - one - other
    if not (bend > 0.0 and bend < np.inf):
        return 0.0
    return float(min(max(0.5 * (other - one) / bend, -0.5), 0.5))
