"""What is around a target: which colours tell the two apart, and by how much a window stands out.

Two uses are made of the histogram b of the surroundings in the first picture, beside the target's own, q:

- *weights of bins*: colours that the surroundings have as well say little, so a bin counts v_u = q_u / (q_u + b_u), in
  the window as in the model (Comaniciu, Ramesh, Meer, "Kernel-based object tracking", 2003, section 5.1, weigh by the
  surroundings alone);
- *contrast*: the same number is the chance that a pixel of that colour is the target's (Collins, Liu, Leordeanu,
  "Online selection of discriminative tracking features", 2005). Its mean within a window and in a frame around it is
  compared with what both were in the first picture. A window that is too large, or beside the target, has too little
  within; one that is too small has too much around. What lacks is taken off the likeness.

Chances are whole numbers, so sums over rectangles are exact and come from one table of sums for all windows.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Floats, Ints
from pftrack.core.numerics.compiled import compiled, read_only
from pftrack.vision.likelihoods.counting import BINS, Space, bin_table, count_window

SURROUNDINGS = 1.6
"""Sides of the frame around a window in which its contrast is measured, in sides of the window."""
WIDER = 2.0
"""Sides of the window in which the colours of the surroundings are counted, less the target's own."""
LEAST = 1e-3
"""Added to shares, so that a colour that nobody has tells nothing."""
CERTAIN = 1 << 16
"""The chance 1."""


class Background(NamedTuple):
    """What is known of the surroundings, for compiled code.

    Attributes:
        weights: v (110,) by which pixels of each bin count.
        chances: (110,) that a pixel of a bin is the target's, in parts of 2^16.
        inside: Mean chance within the target's window in the first picture, 0..1.
        around: Mean chance in the frame around it.
        contrast: How much of the likeness a lack of one costs; 0 if contrast does not count.
    """

    weights: Floats
    chances: Ints
    inside: float
    around: float
    contrast: float


NO_BACKGROUND = Background(np.ones(BINS), np.zeros(BINS, np.int64), 0.0, 0.0, 0.0)
"""All bins count alike, and contrast does not."""


def background_of(
    image_rgb: NDArray[np.uint8],
    position: Floats,
    reach_px: tuple[int, int],
    space: Space,
    target: Floats,
    *,
    weigh: bool,
    contrast: float,
) -> Background:
    """Return what the surroundings of a target tell.

    Args:
        image_rgb: (height, width, 3).
        position: (2,) middle of the target's window, px.
        reach_px: Columns and rows to either side of the middle.
        space: Of colour.
        target: q (110,), the shares of the bins in the window.
        weigh: Whether bins are to be weighed.
        contrast: How much of the likeness a lack of contrast is to cost.
    """

    def count(sides: float) -> Ints:
        """Count the pixels of each bin in a window of so many sides of the target's."""
        across, down = (int(np.floor(sides * reach + 0.5)) for reach in reach_px)
        column, row = float(position[0]), float(position[1])
        return count_window(read_only(image_rgb), column, row, across, down, False, (1, 1), bin_table(space))

    within = count(1.0)
    beside = np.maximum(count(WIDER) - within, 0)
    surroundings = beside / max(int(beside.sum()), 1)
    chances = (target + LEAST) / (target + surroundings + 2.0 * LEAST)
    whole = np.floor(CERTAIN * chances + 0.5).astype(np.int64)
    frame = np.maximum(count(SURROUNDINGS) - within, 0)
    inside, around = (
        float((counts * whole).sum()) / (CERTAIN * max(int(counts.sum()), 1)) for counts in (within, frame)
    )
    return Background(chances if weigh else np.ones(BINS), whole, inside, around, contrast)


@compiled
def lacking_contrast(bins: NDArray[np.uint8], windows: Ints, frames: Ints, background: Background) -> Floats:
    """Return how much contrast windows lack, (N,): 0 for as much as in the first picture, or more.

    Args:
        bins: Of the part of the picture in which all windows and frames lie.
        windows: (N, 8) as of `windows_around`, within that part; an empty one lacks nothing.
        frames: (N, 8) likewise, larger and around the same middles.
        background: What is known of the surroundings.
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
