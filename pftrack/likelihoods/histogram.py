"""Colour histograms: how alike are the colours within a window and those of a model?

Every pixel of a picture belongs to one of 110 bins: a pixel that has a colour to one of 10 x 10 bins of that colour,
any other to one of 10 bins of its brightness. A window around a place has the shares p_u of its pixels in each bin; a
model has the shares q_u of the window in which it was made. Their likeness is the Bhattacharyya coefficient

    rho(p, q) = sum_u sqrt(p_u q_u),      p(z | x) = exp(-lambda (1 - rho))

between 0 and 1; 1 - rho is the square of a distance (Perez, Hue, Vermaak, Gangnet, "Color-based probabilistic
tracking", 2002). Windows are clipped to the picture; one of which less than a quarter lies within has rho = 0.

A window may count all its pixels alike or, with Epanechnikov's kernel, those in the middle more than those near its
edge, where the background is.

All windows of a frame are weighed at once. Only the part of the picture that they touch is put into bins. They are
then visited along a path on which neighbours follow each other, and where the next window overlaps the last one, only
the pixels that leave and enter are counted. Counts are whole numbers, so the path changes nothing of the result.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pftrack.likelihoods.colour_bins import BINS, Space, bin_table
from pftrack.likelihoods.windows import overlap, path, same, shift, windows_around
from pftrack.numerics.compiled import compiled, read_only
from pftrack.numerics.sums import inner_product

__all__ = ["Window", "fit", "rho_map", "shares", "similarities", "similarity"]

KERNEL_PEAK = 1 << 16
KERNEL_SHIFT = 8
"""Weights of the kernel are whole numbers, 0 to 2^16 / 2^8, so that their sums do not depend on an order."""
LANES = 4
"""Pixels of a row that follow each other are counted in different places: the same bin twice would have to wait."""


@dataclass(frozen=True, slots=True)
class Window:
    """The shape of a window.

    Attributes:
        reach_across_px: Columns to either side of the middle one.
        reach_down_px: Rows to either side of the middle one.
        kernel: Whether pixels count by Epanechnikov's kernel, or all alike.
    """

    reach_across_px: int
    reach_down_px: int
    kernel: bool = False

    @property
    def size_px(self) -> tuple[int, int]:
        """Width and height, px."""
        return 2 * self.reach_across_px + 1, 2 * self.reach_down_px + 1


def shares(
    image_rgb: NDArray[np.uint8], position: NDArray[np.float64], window: Window, space: Space
) -> NDArray[np.float64]:
    """Return the shares p (110,) of a window's pixels in the bins, which sum to 1.

    Args:
        image_rgb: (height, width, 3).
        position: (2,) middle of the window, px; it is rounded to a pixel.
        window: Its shape.
        space: Of colour.

    Returns:
        The shares; all 0 if the window lies outside the picture.
    """
    counts = _counts(read_only(image_rgb), float(position[0]), float(position[1]), *_pack(window), bin_table(space))
    return np.asarray(counts / max(counts.sum(), 1))


def fit(
    image_rgb: NDArray[np.uint8], position: NDArray[np.float64], window: Window, space: Space
) -> NDArray[np.float64]:
    """Return a model q (110,), the shares of the window around a target; arguments as for `shares`.

    Raises:
        ValueError: Too little of the window lies within the picture.
    """
    model = shares(image_rgb, position, window, space)
    if similarity(image_rgb, position, window, space, model) == 0.0:
        raise ValueError("a quarter of the target's window at least must lie within the picture")
    return model


def similarity(
    image_rgb: NDArray[np.uint8],
    position: NDArray[np.float64],
    window: Window,
    space: Space,
    model: NDArray[np.float64],
) -> float:
    """Return rho of one window, 0..1; arguments as for `shares`, and q (110,)."""
    return float(_all(image_rgb, np.asarray(position)[None, :2], window, space, model)[0])


def rho_map(
    image_rgb: NDArray[np.uint8], window: Window, space: Space, model: NDArray[np.float64], step: int
) -> NDArray[np.float64]:
    """Return rho of windows all over a picture, (ceil(height / step), ceil(width / step)).

    Args:
        image_rgb: (height, width, 3).
        window: Their shape.
        space: Of colour.
        model: q (110,).
        step: Distance of neighbouring windows, px; the first is in the middle of the first cell of that size.
    """
    height, width, _ = image_rgb.shape
    rows, columns = np.arange(step // 2, height, step), np.arange(step // 2, width, step)
    places = np.stack(np.meshgrid(columns, rows), axis=-1).reshape(-1, 2).astype(np.float64)
    return np.asarray(_all(image_rgb, places, window, space, model).reshape(len(rows), len(columns)))


def _all(
    image_rgb: NDArray[np.uint8],
    places: NDArray[np.float64],
    window: Window,
    space: Space,
    model: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return rho (N,) of windows of one shape around places (N, 2), px."""
    return similarities(
        read_only(image_rgb),
        np.ascontiguousarray(places[:, 0], np.float64),
        np.ascontiguousarray(places[:, 1], np.float64),
        np.full(len(places), float(window.reach_across_px)),
        np.full(len(places), float(window.reach_down_px)),
        bin_table(space),
        np.sqrt(model),
        window.kernel,
    )


def _pack(window: Window) -> tuple[int, int, bool]:
    return window.reach_across_px, window.reach_down_px, window.kernel


@compiled
def similarities(
    image_rgb: NDArray[np.uint8],
    columns: NDArray[np.float64],
    rows: NDArray[np.float64],
    half_widths: NDArray[np.float64],
    half_heights: NDArray[np.float64],
    table: NDArray[np.uint8],
    root_model: NDArray[np.float64],
    kernel: bool,
) -> NDArray[np.float64]:
    """Return rho (N,) of N windows, for use inside compiled loops and outside.

    Args:
        image_rgb: (height, width, 3).
        columns: (N,) middles of the windows, px; rounded to pixels; what is not finite is outside the picture.
        rows: (N,) of them.
        half_widths: (N,) half widths, px, rounded; 0 at least.
        half_heights: (N,) half heights.
        table: Bins of the colours, as of `bin_table`.
        root_model: sqrt(q), (110,).
        kernel: Whether pixels count by Epanechnikov's kernel.
    """
    height, width, _ = image_rgb.shape
    windows = windows_around(columns, rows, half_widths, half_heights, width, height)
    left, top, right, bottom = width, height, 0, 0
    for n in range(windows.shape[0]):
        if windows[n, 2] > windows[n, 0]:
            left, top = min(left, windows[n, 0]), min(top, windows[n, 1])
            right, bottom = max(right, windows[n, 2]), max(bottom, windows[n, 3])
    if right <= left:
        return np.zeros(windows.shape[0])
    bins = _assign_bins(image_rgb, table, left, top, right, bottom)
    for n in range(windows.shape[0]):
        windows[n] = shift(windows[n], left, top)
    return _coefficients(bins, windows, root_model, kernel)


@compiled
def _assign_bins(
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
def _coefficients(
    bins: NDArray[np.uint8], windows: NDArray[np.int64], root_model: NDArray[np.float64], kernel: bool
) -> NDArray[np.float64]:
    """Return rho (N,) of windows in a picture of bins."""
    count = windows.shape[0]
    found = np.zeros(count)
    counts = np.zeros((LANES, BINS), np.int32)
    last = np.zeros(8, np.int64)
    value = 0.0
    order = path(windows)
    for place in range(count):
        window = windows[order[place]]
        if window[2] <= window[0]:
            continue
        # Where particles are closer to each other than pixels are, the window is often the last one again.
        if not same(window, last):
            common = 0 if kernel else overlap(last, window)
            leaving = (last[2] - last[0]) * (last[3] - last[1]) - common
            if leaving < common:
                _change(bins, last, window, counts, -1)
                _change(bins, window, last, counts, 1)
            else:
                counts[:] = 0
                if kernel:
                    _weigh(bins, window, counts)
                else:
                    _add(bins, window[0], window[1], window[2], window[3], counts, 1)
            last[:] = window
            value = _rho(counts, root_model)
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
def _weigh(bins: NDArray[np.uint8], window: NDArray[np.int64], counts: NDArray[np.int32]) -> None:
    """Add the pixels of a window to the counts (LANES, 110), each by Epanechnikov's kernel."""
    across, down = window[6] + 0.5, window[7] + 0.5
    first, second, third, fourth = counts[0], counts[1], counts[2], counts[3]
    offs = np.empty(window[2] - window[0], np.int32)
    for place in range(offs.shape[0]):
        off = (window[0] + place - window[4]) / across
        offs[place] = int(KERNEL_PEAK * (off * off))
    weights = np.empty(offs.shape[0], np.int32)
    for row in range(window[1], window[3]):
        line = bins[row, window[0] : window[2]]
        off = (row - window[5]) / down
        level = np.int32(KERNEL_PEAK - int(KERNEL_PEAK * (off * off)))
        for place in range(offs.shape[0]):
            weights[place] = max(level - offs[place], np.int32(0)) >> np.int32(KERNEL_SHIFT)
        column = 0
        while column + LANES <= offs.shape[0]:
            first[line[np.uint64(column)]] += weights[column]
            second[line[np.uint64(column + 1)]] += weights[column + 1]
            third[line[np.uint64(column + 2)]] += weights[column + 2]
            fourth[line[np.uint64(column + 3)]] += weights[column + 3]
            column += LANES
        while column < offs.shape[0]:
            first[line[np.uint64(column)]] += weights[column]
            column += 1


@compiled
def _rho(counts: NDArray[np.int32], root_model: NDArray[np.float64]) -> float:
    """Return the Bhattacharyya coefficient of counts (LANES, 110) and a model whose roots (110,) are given."""
    roots = np.empty(BINS)
    total = 0
    for u in range(BINS):
        number = counts[0, u] + counts[1, u] + counts[2, u] + counts[3, u]
        total += number
        roots[u] = np.sqrt(float(number))
    return inner_product(roots, root_model) / np.sqrt(float(total)) if total > 0 else 0.0


@compiled
def _counts(
    image_rgb: NDArray[np.uint8],
    column: float,
    row: float,
    half_width: int,
    half_height: int,
    kernel: bool,
    table: NDArray[np.uint8],
) -> NDArray[np.int64]:
    """Return the weights (110,) of a window's pixels in the bins."""
    height, width, _ = image_rgb.shape
    found = np.zeros(BINS, np.int64)
    place = np.array((column, row, float(half_width), float(half_height)))
    window = windows_around(place[:1], place[1:2], place[2:3], place[3:4], width, height)[0]
    if window[2] <= window[0]:
        return found
    bins = _assign_bins(image_rgb, table, window[0], window[1], window[2], window[3])
    window = shift(window, window[0], window[1])
    counts = np.zeros((LANES, BINS), np.int32)
    if kernel:
        _weigh(bins, window, counts)
    else:
        _add(bins, window[0], window[1], window[2], window[3], counts, 1)
    for u in range(BINS):
        for lane in range(LANES):
            found[u] += counts[lane, u]
    return found
