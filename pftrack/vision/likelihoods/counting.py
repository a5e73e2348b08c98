"""Counting the bins of many windows: those of a picture are visited along a path, so that neighbours share work.

Where all pixels of a window count alike and it has one part, and the next window overlaps the last one, only the pixels
that leave and enter are counted. Counts are whole numbers, so the path changes nothing of the result.
"""

import numpy as np
from numpy.typing import NDArray

from pftrack.core.numerics.compiled import compiled
from pftrack.core.numerics.sums import inner_product
from pftrack.vision.likelihoods.colour_bins import BINS
from pftrack.vision.likelihoods.windows import overlap, path, same, shift, windows_around

__all__ = ["assign_bins", "coefficients", "count_window"]

KERNEL_PEAK = 1 << 16
KERNEL_SHIFT = 8
"""Weights of the kernel are whole numbers, 0 to 2^16 / 2^8, so that their sums do not depend on an order."""
LANES = 4
"""Pixels of a row that follow each other are counted in different places: the same bin twice would have to wait."""


@compiled
def assign_bins(
    image_rgb: NDArray[np.uint8], table: NDArray[np.uint8], left: int, top: int, right: int, bottom: int
) -> NDArray[np.uint8]:
    """Return the bins of the pixels left..right - 1, top..bottom - 1."""
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
    windows: NDArray[np.int64],
    root_model: NDArray[np.float64],
    weights: NDArray[np.float64],
    kernel: bool,
    parts: tuple[int, int],
) -> NDArray[np.float64]:
    """Return rho (N,) of windows in a picture of bins, given sqrt(q) (110 in each part) and weights (110,) of bins."""
    count = windows.shape[0]
    found = np.zeros(count)
    counts = np.zeros((LANES, root_model.shape[0]), np.int32)
    whole = not kernel and parts[0] * parts[1] == 1
    last = np.zeros(8, np.int64)
    value = 0.0
    order = path(windows)
    for place in range(count):
        window = windows[order[place]]
        if window[2] <= window[0]:
            continue
        # Where particles are closer to each other than pixels are, the window is often the last one again.
        if not same(window, last):
            common = overlap(last, window) if whole else 0
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
    one: NDArray[np.int64],
    other: NDArray[np.int64],
    counts: NDArray[np.int32],
    sign: int,
) -> None:
    """Add the pixels of one window that are not in the other, of which the two share some, times the sign."""
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
    window: NDArray[np.int64],
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
    window: NDArray[np.int64],
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
    # A window that is clipped keeps its parts: they are counted from where its left top corner would be.
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
def _rho(counts: NDArray[np.int32], root_model: NDArray[np.float64], weights: NDArray[np.float64]) -> float:
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
) -> NDArray[np.int64]:
    """Return the weights (110 in each part) of a window's pixels in the bins."""
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
