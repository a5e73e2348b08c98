"""Colour histograms: the similarity of the colours within a window and those of a model.

Every pixel of a picture belongs to one of 110 bins: a pixel that has a colour to one of 10 x 10 bins of that colour,
any other to one of 10 bins of its brightness. A window around a place has the shares p_u of its pixels in each bin; a
model has the shares q_u of the window in which it was fitted. Their similarity is the Bhattacharyya coefficient

    rho(p, q) = sum_u sqrt(p_u q_u),      p(z | x) = exp(-lambda (1 - rho))

between 0 and 1; 1 - rho is the square of a distance (Perez, Hue, Vermaak, Gangnet, "Color-based probabilistic
tracking", 2002). Windows are clipped to the picture; one with less than a quarter within has rho = 0.

A window may count all its pixels alike or, with Epanechnikov's kernel, those in the middle more than those near its
edge, which show background. It may be divided into parts with separate bins, so colours have places (the multi-part
model of the same paper).

The histogram b of the target's surroundings in the first picture has two uses:

- *weights of bins*: colours that the surroundings share carry little information, so a bin counts v_u = q_u / (q_u +
  b_u), in the window as in the model (Comaniciu, Ramesh, Meer, "Kernel-based object tracking", 2003, section 5.1, weigh
  by the surroundings alone);
- *contrast*: the same number is the chance that a pixel of that colour is the target's (Collins, Liu, Leordeanu,
  "Online selection of discriminative tracking features", 2005). Its mean within a window and in a frame around it is
  compared with both values in the first picture. A window that is too large, or beside the target, has too low a mean
  within; one that is too small has too high a mean around. The lack of contrast is subtracted from the similarity.

Chances are whole numbers, so sums over rectangles are exact and come from one table of sums for all windows.

All windows of a frame are weighed at once. Only the part of the picture that they touch is put into bins. The windows
are visited along a path of neighbours, and where the next window overlaps the last one, only the pixels that leave and
enter are counted. Counts are whole numbers, so the path does not affect the result.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Floats, Ints, check, check_count, check_picture
from pftrack.core.numerics.compiled import compiled, read_only
from pftrack.vision.likelihoods import counting

SURROUNDINGS = 1.6
"""Sides of the frame around a window in which its contrast is measured, in sides of the window."""
WIDER = 2.0
"""Sides of the window in which the colours of the surroundings are counted, less the target's own."""
LEAST = 1e-3
"""Added to shares, so a colour that occurs nowhere has no effect."""
CERTAIN = 1 << 16
"""The chance 1."""
LEAST_SHARE = 1e-12
"""Least sum of a weighed model, which avoids division by 0 if nothing is left of it."""


@dataclass(frozen=True, slots=True)
class Window:
    """The shape of a window.

    Attributes:
        reach_across_px: Columns to either side of the middle one.
        reach_down_px: Rows to either side of the middle one.
        kernel: Whether pixels count by Epanechnikov's kernel, or all alike.
        parts: Numbers of its parts, across and down.
    """

    reach_across_px: int
    reach_down_px: int
    kernel: bool = False
    parts: tuple[int, int] = (1, 1)

    @property
    def size_px(self) -> tuple[int, int]:
        """Width and height, px."""
        return 2 * self.reach_across_px + 1, 2 * self.reach_down_px + 1


class Background(NamedTuple):
    """The surroundings, for compiled code.

    Attributes:
        weights: v (110,) weight of the pixels of each bin.
        chances: (110,) that a pixel of a bin is the target's, in parts of 2^16.
        inside: Mean chance within the target's window in the first picture, 0..1.
        around: Mean chance in the frame around it.
        contrast: Similarity lost by a lack of contrast of one; 0 if contrast does not count.
    """

    weights: Floats
    chances: Ints
    inside: float
    around: float
    contrast: float


NO_BACKGROUND = Background(np.ones(counting.BINS), np.zeros(counting.BINS, np.int64), 0.0, 0.0, 0.0)
"""All bins count alike, and contrast does not."""


def shares(image_rgb: NDArray[np.uint8], position: Floats, window: Window, space: counting.Space) -> Floats:
    """Return the shares p (110 in each part) of a window's pixels in the bins, which sum to 1.

    Args:
        image_rgb: (height, width, 3).
        position: (2,) middle of the window, px; it is rounded to a pixel.
        window: Its shape.
        space: Colour space.

    Returns:
        The shares; all 0 if the window lies outside the picture.

    Raises:
        TypeError: The picture is not an array of bytes, or the position is not one of numbers.
        ValueError: The picture is not (height, width, 3), the position is not (2,), or the window has no such shape.
    """
    check_picture(image_rgb)
    check(missing=True, position=(position, "2"))
    _check_window(window)
    counts = counting.count_window(
        read_only(image_rgb), float(position[0]), float(position[1]), *_pack(window), counting.bin_table(space)
    )
    return np.asarray(counts / max(counts.sum(), 1))


def fit(image_rgb: NDArray[np.uint8], position: Floats, window: Window, space: counting.Space) -> Floats:
    """Return a model q (110 in each part), the shares of the window around a target; arguments as for `shares`.

    Raises:
        ValueError: Too little of the window lies within the picture.
    """
    model = shares(image_rgb, position, window, space)
    if similarity(image_rgb, position, window, space, model) == 0.0:
        raise ValueError("a quarter of the target's window at least must lie within the picture")
    return model


def similarity(
    image_rgb: NDArray[np.uint8],
    position: Floats,
    window: Window,
    space: counting.Space,
    model: Floats,
    background: Background = NO_BACKGROUND,
) -> float:
    """Return rho of one window, 0..1; arguments as for `shares`, q (110 in each part), and the surroundings."""
    check(missing=True, position=(position, "2"))
    return float(_all(image_rgb, position[None], window, space, model, background)[0])


def log_likelihood(
    image_rgb: NDArray[np.uint8],
    states: Floats,
    window: Window,
    space: counting.Space,
    model: Floats,
    sharpness: float = 20.0,
) -> Floats:
    """Return log p(z | x) = lambda (rho - 1) (N,) of windows around places.

    Args:
        image_rgb: (height, width, 3).
        states: (N, d) with d >= 2; the first two numbers are the middle of the window, px.
        window: Its shape.
        space: Colour space.
        model: (110 in each part) shares of the target; see `fit`.
        sharpness: lambda.

    Raises:
        TypeError: The picture is not an array of bytes, or the states are not one of real numbers.
        ValueError: The picture is not (height, width, 3), or the states are not (N, d) with d >= 2.
    """
    check(missing=True, states=(states, "N d"))
    return sharpness * (_all(image_rgb, states[:, :2], window, space, model, NO_BACKGROUND) - 1.0)


def rho_map(
    image_rgb: NDArray[np.uint8],
    window: Window,
    space: counting.Space,
    model: Floats,
    step: int,
    background: Background = NO_BACKGROUND,
) -> Floats:
    """Return rho of windows all over a picture, (ceil(height / step), ceil(width / step)).

    Args:
        image_rgb: (height, width, 3).
        window: Their shape.
        space: Colour space.
        model: q (110 in each part).
        step: Distance of neighbouring windows, px; the first is in the middle of the first cell of that size.
        background: The target's surroundings.

    Raises:
        TypeError: The picture is not an array of bytes, the model not one of numbers, or the step not a whole number.
        ValueError: One has other sides, or the step is below 1.
    """
    check_picture(image_rgb)
    check_count("step", step)
    height, width, _ = image_rgb.shape
    rows, columns = np.arange(step // 2, height, step), np.arange(step // 2, width, step)
    places = np.stack(np.meshgrid(columns, rows), axis=-1).reshape(-1, 2).astype(np.float64)
    return np.asarray(_all(image_rgb, places, window, space, model, background).reshape(len(rows), len(columns)))


def _all(
    image_rgb: NDArray[np.uint8],
    places: Floats,
    window: Window,
    space: counting.Space,
    model: Floats,
    background: Background,
) -> Floats:
    """Return rho (N,) of windows of one shape around places (N, 2), px."""
    check_picture(image_rgb)
    _check_window(window)
    check(missing=True, places=(places, "N 2"), model=(model, f"{counting.BINS * window.parts[0] * window.parts[1]}"))
    return similarities(
        read_only(image_rgb),
        np.ascontiguousarray(places[:, 0], np.float64),
        np.ascontiguousarray(places[:, 1], np.float64),
        np.full(len(places), float(window.reach_across_px)),
        np.full(len(places), float(window.reach_down_px)),
        counting.bin_table(space),
        roots_of(model, background),
        window.kernel,
        window.parts,
        background,
    )


def background_of(
    image_rgb: NDArray[np.uint8],
    position: Floats,
    reach_px: tuple[int, int],
    space: counting.Space,
    target: Floats,
    *,
    weigh: bool,
    contrast: float,
) -> Background:
    """Return a target's surroundings, for the likelihood.

    Args:
        image_rgb: (height, width, 3).
        position: (2,) middle of the target's window, px.
        reach_px: Columns and rows to either side of the middle.
        space: Colour space.
        target: q (110,), the shares of the bins in the window.
        weigh: Whether bins are to be weighed.
        contrast: Similarity lost by a lack of contrast.

    Raises:
        TypeError: The picture is not an array of bytes, or the others are not ones of numbers.
        ValueError: One has other sides, or is not finite.
    """
    check_picture(image_rgb)
    check(position=(position, "2"), target=(target, f"{counting.BINS}"))
    for reach in reach_px:
        check_count("reach_px", reach, 0)

    def count(sides: float) -> Ints:
        """Count the pixels of each bin in a window of the given number of the target's sides."""
        across, down = (int(np.floor(sides * reach + 0.5)) for reach in reach_px)
        column, row = float(position[0]), float(position[1])
        return counting.count_window(
            read_only(image_rgb), column, row, across, down, False, (1, 1), counting.bin_table(space)
        )

    within = count(1.0)
    beside = np.maximum(count(WIDER) - within, 0)
    surroundings = beside / max(int(beside.sum()), 1)
    chances = (target + LEAST) / (target + surroundings + 2.0 * LEAST)
    whole = np.floor(CERTAIN * chances + 0.5).astype(np.int64)
    frame = np.maximum(count(SURROUNDINGS) - within, 0)
    inside, around = (
        float((counts * whole).sum()) / (CERTAIN * max(int(counts.sum()), 1)) for counts in (within, frame)
    )
    return Background(chances if weigh else np.ones(counting.BINS), whole, inside, around, contrast)


def roots_of(model: Floats, background: Background) -> Floats:
    """Return the square roots of a model's shares (110 in each part), weighed by the background.

    Raises:
        TypeError: The model is not an array of numbers.
        ValueError: It is not of shares of whole parts.
    """
    check(model=(model, "shares"))
    if len(model) % counting.BINS:
        raise ValueError(f"model must have {counting.BINS} shares in each part, got {len(model)}")
    if background.weights is NO_BACKGROUND.weights:
        return np.sqrt(model)
    weighed = model * np.tile(background.weights, len(model) // counting.BINS)
    return np.asarray(np.sqrt(weighed / max(weighed.sum(), LEAST_SHARE)))


def _check_window(window: Window) -> None:
    check_count("reach_across_px", window.reach_across_px, 0)
    check_count("reach_down_px", window.reach_down_px, 0)
    for parts in window.parts:
        check_count("parts", parts)


def _pack(window: Window) -> tuple[int, int, bool, tuple[int, int]]:
    return window.reach_across_px, window.reach_down_px, window.kernel, window.parts


@compiled
def _bounds(windows: Ints, frames: Ints, width: int, height: int) -> tuple[int, int, int, int]:
    """Return left, top, right and bottom of the part of a picture in which windows and their frames lie."""
    left, top, right, bottom = width, height, 0, 0
    for n in range(windows.shape[0]):
        if windows[n, 2] > windows[n, 0]:
            for seen in (windows[n], frames[n]):
                if seen[2] > seen[0]:
                    left, top = min(left, seen[0]), min(top, seen[1])
                    right, bottom = max(right, seen[2]), max(bottom, seen[3])
    return left, top, right, bottom


@compiled
def _lacking_contrast(bins: NDArray[np.uint8], windows: Ints, frames: Ints, background: Background) -> Floats:
    """Return the lack of contrast of windows, (N,): 0 for at least the contrast of the first picture.

    Args:
        bins: Bins of the part of the picture in which all windows and frames lie.
        windows: (N, 8) as from `windows_around`, within that part; an empty one lacks nothing.
        frames: (N, 8) likewise, larger and around the same middles.
        background: The surroundings.
    """
    sums = _sums(bins, background.chances)
    lacking = np.zeros(windows.shape[0])
    for n in range(windows.shape[0]):
        inside, around = _mean_chances(sums, windows[n], frames[n])
        if inside >= 0.0 and around >= 0.0:
            lacking[n] = max(background.inside - inside, 0.0) + max(around - background.around, 0.0)
    return lacking


@compiled
def _mean_chances(sums: Ints, window: Ints, frame: Ints) -> tuple[float, float]:
    """Return the mean chance within a window and in the frame around it; -1 where there are no pixels."""
    within, pixels = _rectangle(sums, window)
    all_of_it, all_pixels = _rectangle(sums, frame)
    inside = within / (CERTAIN * pixels) if pixels > 0 else -1.0
    around = (all_of_it - within) / (CERTAIN * (all_pixels - pixels)) if all_pixels > pixels else -1.0
    return inside, around


@compiled
def _rectangle(sums: Ints, window: Ints) -> tuple[int, int]:
    """Return the sum over a window, and its pixels."""
    left, top, right, bottom = window[0], window[1], window[2], window[3]
    total = sums[bottom, right] - sums[top, right] - sums[bottom, left] + sums[top, left]
    return total, (right - left) * (bottom - top)


@compiled
def _sums(bins: NDArray[np.uint8], chances: Ints) -> Ints:
    """Return the sums of chances over all rectangles that begin in the first pixel, a row and a column of 0 before."""
    height, width = bins.shape
    sums = np.zeros((height + 1, width + 1), np.int64)
    for row in range(height):
        along = np.int64(0)
        for column in range(width):
            along += chances[bins[row, column]]
            sums[row + 1, column + 1] = sums[row, column + 1] + along
    return sums


@compiled
def similarities(
    image_rgb: NDArray[np.uint8],
    columns: Floats,
    rows: Floats,
    half_widths: Floats,
    half_heights: Floats,
    table: NDArray[np.uint8],
    root_model: Floats,
    kernel: bool,
    parts: tuple[int, int],
    background: Background,
) -> Floats:
    """Return rho (N,) of N windows, for use inside compiled loops and outside.

    Args:
        image_rgb: (height, width, 3).
        columns: (N,) middles of the windows, px; rounded to pixels; what is not finite is outside the picture.
        rows: (N,) their rows.
        half_widths: (N,) half widths, px, rounded; 0 at least.
        half_heights: (N,) half heights.
        table: Bins of the colours, as of `bin_table`.
        root_model: sqrt(q), (110 in each part), as of `roots_of`.
        kernel: Whether pixels count by Epanechnikov's kernel.
        parts: Numbers of parts of a window, across and down.
        background: The target's surroundings; a lack of contrast is subtracted from rho, down to 0.

    Raises:
        ValueError: The sizes do not agree.
    """
    if background.chances.shape[0] != counting.BINS:
        raise ValueError("expected the chances (110,) of a background, got another number")
    height, width, _ = image_rgb.shape
    windows = counting.windows_around(columns, rows, half_widths, half_heights, width, height)
    # Where contrast counts, the surroundings of the windows are needed as well.
    frames = windows
    if background.contrast > 0.0:
        frames = counting.windows_around(
            columns, rows, SURROUNDINGS * half_widths, SURROUNDINGS * half_heights, width, height
        )
    left, top, right, bottom = _bounds(windows, frames, width, height)
    if right <= left:
        return np.zeros(windows.shape[0])
    bins = counting.assign_bins(image_rgb, table, left, top, right, bottom)
    moved, around = np.zeros_like(windows), np.zeros_like(windows)
    for n in range(windows.shape[0]):
        if windows[n, 2] > windows[n, 0]:
            moved[n] = counting.shift(windows[n], left, top)
            if frames[n, 2] > frames[n, 0]:
                around[n] = counting.shift(frames[n], left, top)
    found = counting.coefficients(bins, moved, root_model, background.weights, kernel, parts)
    if background.contrast > 0.0:
        lacking = _lacking_contrast(bins, moved, around, background)
        for n in range(windows.shape[0]):
            found[n] = max(found[n] - background.contrast * lacking[n], 0.0)
    return found
