"""Bins of colour, windows of a picture, and counting the bins of many windows so that neighbours share work.

If all pixels of a window count alike, the window has one part, and the next window overlaps the last one, only the
pixels that leave and enter are counted. Counts are whole numbers, so the order of windows does not affect the result.
"""

from collections.abc import Callable
from functools import lru_cache
from typing import Any, Literal, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Floats, Ints
from pftrack.core.numerics.compiled import compiled, read_only
from pftrack.core.numerics.matrices import inner_product

# A pixel that has a colour belongs to one of 10 x 10 bins of it, any other to one of 10 of brightness. Three spaces of
# colour (`SPACES`) share one way of counting, since the bin of each of the 2^24 colours is looked up in a table.

Space: TypeAlias = Literal["hsv", "lab", "chromaticity"]

STEPS = 10
"""Bins along each axis of a colour, and along that of brightness."""
BINS = STEPS * STEPS + STEPS
LEAST_CHROMA = 8
"""Distance from grey in the (a, b) plane of Lab from which on a pixel has a colour; about that of HSV's S > 0.1."""
LAB_REACH = 60
"""Range of the (a, b) plane that the bins divide, to either side of grey; few surfaces are more colourful."""
DARK = 153
"""R + G + B up to which a pixel has no chromaticity: 0.2 of the greatest, as HSV's V > 0.2."""


@lru_cache(maxsize=3)
def bin_table(space: Space) -> NDArray[np.uint8]:
    """Return the bin (2^24,) of each colour, by 65536 R + 256 G + B.

    Raises:
        ValueError: The space is unknown.
    """
    _check_space(space)
    table = np.empty((256, 256, 256), np.uint8)
    plane = np.empty((256, 256, 3), np.uint8)
    plane[:, :, 1], plane[:, :, 2] = np.arange(256)[:, None], np.arange(256)
    for red in range(256):
        plane[:, :, 0] = red
        table[red] = SPACES[space](plane)
    return read_only(table.ravel())


@lru_cache(maxsize=3)
def bin_colours(space: Space) -> NDArray[np.uint8]:
    """Return a colour for each bin, (110, 3) RGB: the mean of those that belong to it, of every eighth level.

    Raises:
        ValueError: The space is unknown.
    """
    _check_space(space)
    levels = np.arange(0, 256, 8, dtype=np.uint8)
    colours = np.stack(np.meshgrid(levels, levels, levels, indexing="ij"), axis=-1).reshape(-1, 1, 3)
    bins = SPACES[space](colours).ravel()
    counts = np.maximum(np.bincount(bins, minlength=BINS), 1)
    sums = [np.bincount(bins, colours[:, 0, channel], minlength=BINS) for channel in range(3)]
    return np.asarray(np.rint(np.column_stack(sums) / counts[:, None]), np.uint8)


def _hsv(colours_rgb: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return bins by hue and saturation; without colour are S <= 0.1 and V <= 0.2 (S and V from 0 to 1)."""
    hue, saturation, value = cv2.split(cv2.cvtColor(colours_rgb, cv2.COLOR_RGB2HSV))
    every = np.arange(256)
    by_hue = (STEPS * (STEPS * every // 180)).astype(np.uint8)
    by_level = (STEPS * every // 256).astype(np.uint8)
    coloured = (saturation > 25) & (value > 51)
    by_colour: NDArray[np.uint8] = by_hue[hue] + by_level[saturation]
    return np.where(coloured, by_colour, _by_brightness(value))


def _lab(colours_rgb: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return bins by a and b of Lab."""
    lightness, a, b = cv2.split(cv2.cvtColor(colours_rgb, cv2.COLOR_RGB2LAB))
    off = np.arange(256) - 128
    along = np.clip(STEPS * (off + LAB_REACH) // (2 * LAB_REACH), 0, STEPS - 1)
    coloured = off[:, None] * off[:, None] + off * off > LEAST_CHROMA * LEAST_CHROMA
    by_colour = np.where(coloured, STEPS * along[:, None] + along, BINS).astype(np.uint8)
    found = np.take(by_colour, np.uint16(256) * a.astype(np.uint16) + b)
    return np.where(found < BINS, found, _by_brightness(lightness))


def _chromaticity(colours_rgb: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return bins by the shares of red and green."""
    red, green, blue = (channel.astype(np.uint16) for channel in cv2.split(colours_rgb))
    total = red + green + blue
    divisor = np.maximum(total, np.uint16(1))
    of_red, of_green = (
        np.minimum(np.uint16(STEPS) * one // divisor, STEPS - 1).astype(np.uint8) for one in (red, green)
    )
    by_colour: NDArray[np.uint8] = np.uint8(STEPS) * of_red + of_green
    return np.where(total > DARK, by_colour, _by_brightness(total // 3))


def _by_brightness(levels: Any) -> NDArray[np.uint8]:  # noqa: ANN401 - what OpenCV says it returns
    """Return the bins of pixels without a colour, given their brightness."""
    by_level: NDArray[np.uint8] = (STEPS * STEPS + STEPS * np.arange(256) // 256).astype(np.uint8)
    found: NDArray[np.uint8] = by_level[levels]
    return found


SPACES: dict[Space, Callable[[NDArray[np.uint8]], NDArray[np.uint8]]] = {
    "hsv": _hsv,
    "lab": _lab,
    "chromaticity": _chromaticity,
}
"""Functions from colours (h, w, 3) to bins (h, w), by name."""


def _check_space(space: Space) -> None:
    if space not in SPACES:
        raise ValueError(f"a space of colour is one of {', '.join(SPACES)}, got {space!r}")


# A window is a row of eight whole numbers: left, top, right, bottom within the picture (right and bottom are the first
# beyond it), the middle's column and row, half width and half height.

WINDOW, CHANNELS, COLOURS = 8, 3, 1 << 24
"""Numbers per window, channels per picture, and number of colours."""
LEAST_COVERAGE = 0.25
"""A window with a smaller share within the picture counts as outside."""
EVERYWHERE = 1e9
"""Places beyond this many px are invalid."""


@compiled
def windows_around(
    columns: Floats,
    rows: Floats,
    half_widths: Floats,
    half_heights: Floats,
    width: int,
    height: int,
) -> Ints:
    """Return the windows (N, 8) around places.

    A window with less than a quarter within the picture is empty: its right edge equals its left one.

    Args:
        columns: (N,) middles, px; rounded to pixels; what is not finite is outside the picture.
        rows: (N,) their rows.
        half_widths: (N,) px, rounded; 0 at least.
        half_heights: (N,) likewise.
        width: Width of the picture, px.
        height: Height of the picture, px.

    Raises:
        ValueError: The arrays differ in length.
    """
    count = columns.shape[0]
    if rows.shape[0] != count or half_widths.shape[0] != count or half_heights.shape[0] != count:
        raise ValueError("expected as many rows and half sides as columns of windows, got other numbers")
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
def shift(window: Ints, left: int, top: int) -> Ints:
    """Return a window in the coordinates of a part of the picture that begins at (left, top).

    Raises:
        ValueError: It is not a window (8,).
    """
    if window.shape[0] != WINDOW:
        raise ValueError("expected a window of 8 numbers, got another number")
    moved = window.copy()
    for place in (0, 2, 4):
        moved[place] -= left
        moved[place + 1] -= top
    return moved


@compiled
def _path(windows: Ints) -> Ints:
    """Return the windows' indices (N,) in an order that visits neighbours in turn: in strips, to and fro."""
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
def _same(one: Ints, other: Ints) -> bool:
    """Return whether two windows are the same."""
    for place in range(one.shape[0]):  # noqa: SIM110 - `all` of a generator cannot be compiled
        if one[place] != other[place]:
            return False
    return True


@compiled
def _overlap(one: Ints, other: Ints) -> int:
    """Return the number of pixels that two windows share."""
    across = min(one[2], other[2]) - max(one[0], other[0])
    down = min(one[3], other[3]) - max(one[1], other[1])
    return across * down if across > 0 and down > 0 else 0


KERNEL_PEAK = 1 << 16
KERNEL_SHIFT = 8
"""Weights of the kernel are whole numbers, 0 to 2^16 / 2^8, so their sums do not depend on the order."""
LANES = 4
"""Pixels of a row that follow each other are counted in different places: the same bin twice would have to wait."""


@compiled
def assign_bins(
    image_rgb: NDArray[np.uint8], table: NDArray[np.uint8], left: int, top: int, right: int, bottom: int
) -> NDArray[np.uint8]:
    """Return the bins of the pixels left..right - 1, top..bottom - 1.

    Raises:
        ValueError: They are not all within the picture (height, width, 3), or the table has no bin for some colours.
    """
    height, width, channels = image_rgb.shape
    if channels != CHANNELS or table.shape[0] != COLOURS:
        raise ValueError("expected a picture (height, width, 3) and bins (2^24,) of colours, got other sizes")
    if not (0 <= left <= right <= width and 0 <= top <= bottom <= height):
        raise ValueError("expected a rectangle within the picture, got one that reaches beyond it")
    bins = np.empty((bottom - top, right - left), np.uint8)
    for row in range(bottom - top):
        line, pixels = bins[row], image_rgb[top + row]
        for column in range(right - left):
            place = np.uint64(left + column)
            red, green = np.uint32(pixels[place, 0]), np.uint32(pixels[place, 1])
            line[np.uint64(column)] = table[
                (red << np.uint32(16)) | (green << np.uint32(8)) | np.uint32(pixels[place, 2])
            ]
    return bins


@compiled
def coefficients(
    bins: NDArray[np.uint8],
    windows: Ints,
    root_model: Floats,
    weights: Floats,
    kernel: bool,
    parts: tuple[int, int],
) -> Floats:
    """Return rho (N,) of windows in a picture of bins, given sqrt(q) (110 in each part) and weights (110,) of bins.

    Raises:
        ValueError: The sizes do not agree, or a window reaches beyond the picture.
    """
    count, numbers = windows.shape
    height, width = bins.shape
    if root_model.shape[0] != BINS * parts[0] * parts[1] or weights.shape[0] != BINS or numbers != WINDOW:
        raise ValueError("expected 110 roots in each part, weights (110,) and windows (N, 8), got other sizes")
    for n in range(count):
        if min(windows[n, 0], windows[n, 1]) < 0 or windows[n, 2] > width or windows[n, 3] > height:
            raise ValueError("expected windows within the picture, got one that reaches beyond it")
    found = np.zeros(count)
    counts = np.zeros((LANES, root_model.shape[0]), np.int32)
    whole = not kernel and parts[0] * parts[1] == 1
    last = np.zeros(8, np.int64)
    value = 0.0
    order = _path(windows)
    for place in range(count):
        window = windows[order[place]]
        if window[2] <= window[0]:
            continue
        # Where particles are denser than pixels, successive windows are often equal.
        if not _same(window, last):
            common = _overlap(last, window) if whole else 0
            leaving = (last[2] - last[0]) * (last[3] - last[1]) - common
            if leaving < common:
                _change(bins, last, window, counts, -1)
                _change(bins, window, last, counts, 1)
            else:
                counts[:] = 0
                _count(bins, window, counts, kernel, parts)
            last[:] = window
            value = _rho(counts, root_model, weights)
        found[order[place]] = value
    return found


@compiled
def _change(
    bins: NDArray[np.uint8],
    one: Ints,
    other: Ints,
    counts: NDArray[np.int32],
    sign: int,
) -> None:
    """Add the pixels of one window that are not in the other, overlapping one, times the sign."""
    top, bottom = max(one[1], other[1]), min(one[3], other[3])
    _add(bins, one[0], one[1], one[2], top, counts, sign)
    _add(bins, one[0], bottom, one[2], one[3], counts, sign)
    _add(bins, one[0], top, min(other[0], one[2]), bottom, counts, sign)
    _add(bins, max(other[2], one[0]), top, one[2], bottom, counts, sign)


@compiled
def _add(
    bins: NDArray[np.uint8], left: int, top: int, right: int, bottom: int, counts: NDArray[np.int32], sign: int
) -> None:
    """Add the pixels of a rectangle, which may be empty, to the counts (LANES, 110), times the sign."""
    first, second, third, fourth = counts[0], counts[1], counts[2], counts[3]
    step = np.int32(sign)
    for row in range(top, bottom):
        line = bins[row]
        column = left
        while column + LANES <= right:
            first[line[np.uint64(column)]] += step
            second[line[np.uint64(column + 1)]] += step
            third[line[np.uint64(column + 2)]] += step
            fourth[line[np.uint64(column + 3)]] += step
            column += LANES
        while column < right:
            first[line[np.uint64(column)]] += step
            column += 1


@compiled
def _count(
    bins: NDArray[np.uint8],
    window: Ints,
    counts: NDArray[np.int32],
    kernel: bool,
    parts: tuple[int, int],
) -> None:
    """Add all pixels of a window to the counts (LANES, 110 in each part)."""
    if kernel or parts[0] * parts[1] > 1:
        _weigh(bins, window, counts, kernel, parts)
    else:
        _add(bins, window[0], window[1], window[2], window[3], counts, 1)


@compiled
def _weigh(
    bins: NDArray[np.uint8],
    window: Ints,
    counts: NDArray[np.int32],
    kernel: bool,
    parts: tuple[int, int],
) -> None:
    """Add the pixels of a window to the counts (LANES, 110 in each part), by Epanechnikov's kernel or all alike."""
    across, down = window[6] + 0.5, window[7] + 0.5
    offs = np.empty(window[2] - window[0], np.int32)
    for place in range(offs.shape[0]):
        off = (window[0] + place - window[4]) / across
        offs[place] = int(KERNEL_PEAK * (off * off))
    weights = np.ones(offs.shape[0], np.int32)
    # A window that is clipped keeps its parts: they are counted from the place of its unclipped left top corner.
    firsts = np.empty(offs.shape[0], np.uint64)
    for place in range(offs.shape[0]):
        along = window[0] + place - window[4] + window[6]
        firsts[place] = np.uint64(BINS * (along * parts[0] // (2 * window[6] + 1)))
    for row in range(window[1], window[3]):
        line = bins[row, window[0] : window[2]]
        part = (row - window[5] + window[7]) * parts[1] // (2 * window[7] + 1)
        begin = part * parts[0] * BINS
        first, second = counts[0, begin:], counts[1, begin:]
        third, fourth = counts[2, begin:], counts[3, begin:]
        off = (row - window[5]) / down
        level = np.int32(KERNEL_PEAK - int(KERNEL_PEAK * (off * off)))
        for place in range(offs.shape[0] if kernel else 0):
            weights[place] = max(level - offs[place], np.int32(0)) >> np.int32(KERNEL_SHIFT)
        column = 0
        while column + LANES <= offs.shape[0]:
            first[firsts[column] + line[column]] += weights[column]
            second[firsts[column + 1] + line[column + 1]] += weights[column + 1]
            third[firsts[column + 2] + line[column + 2]] += weights[column + 2]
            fourth[firsts[column + 3] + line[column + 3]] += weights[column + 3]
            column += LANES
        while column < offs.shape[0]:
            first[firsts[column] + line[column]] += weights[column]
            column += 1


@compiled
def _rho(counts: NDArray[np.int32], root_model: Floats, weights: Floats) -> float:
    """Return the Bhattacharyya coefficient of counts (LANES, 110 in each part), weighed, and a model given by roots."""
    roots = np.empty(root_model.shape[0])
    total = 0.0
    for begin in range(0, root_model.shape[0], BINS):
        for u in range(BINS):
            place = begin + u
            number = counts[0, place] + counts[1, place] + counts[2, place] + counts[3, place]
            weighed = weights[u] * float(number)
            total += weighed
            roots[place] = np.sqrt(weighed)
    return inner_product(roots, root_model) / np.sqrt(total) if total > 0.0 else 0.0


@compiled
def count_window(
    image_rgb: NDArray[np.uint8],
    column: float,
    row: float,
    half_width: int,
    half_height: int,
    kernel: bool,
    parts: tuple[int, int],
    table: NDArray[np.uint8],
) -> Ints:
    """Return the weights (110 in each part) of a window's pixels in the bins.

    Raises:
        ValueError: The picture is not (height, width, 3), or there is no part.
    """
    if parts[0] < 1 or parts[1] < 1:
        raise ValueError("expected a part at least across and down, got none")
    height, width, _ = image_rgb.shape
    found = np.zeros(parts[0] * parts[1] * BINS, np.int64)
    place = np.array((column, row, float(half_width), float(half_height)))
    window = windows_around(place[:1], place[1:2], place[2:3], place[3:4], width, height)[0]
    if window[2] <= window[0]:
        return found
    bins = assign_bins(image_rgb, table, window[0], window[1], window[2], window[3])
    window = shift(window, window[0], window[1])
    counts = np.zeros((LANES, found.shape[0]), np.int32)
    _count(bins, window, counts, kernel, parts)
    for u in range(found.shape[0]):
        for lane in range(LANES):
            found[u] += counts[lane, u]
    return found
