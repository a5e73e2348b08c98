"""A window described in cells: the direction of its edges, its brightness and its colour, place by place.

A colour histogram ignores where in a window a colour is, and holds little information on a grey picture. Here a window
is divided into 8 x 8 cells (Dalal, Triggs, "Histograms of oriented gradients for human detection", 2005). Each cell has
the strength of the gradients in eight directions, divided by their own length so that contrast does not count, and its
mean red, green and blue beside the brightness of the window. Pixels outside the picture do not count, and a window that
is partly outside counts in proportion.

These numbers y of a window are weighed linearly: s = w . y is near 1 for the target's window and near 0 beside it. The
weights are learned, in the first picture and gradually after it, from windows at known distances d from the target,
whose s should be exp(-d^2 / 2). The method is the normalised least mean squares of Widrow and Hoff ("Adaptive switching
circuits", 1960), w += r (s - w . y) y / y . y for one window after the other.

Pixels are first averaged over squares so that a cell of the first window has about four of them across. Sums over cells
of any size then come from one table of sums of whole numbers, so they depend neither on the order nor on the other
windows.
"""

from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Floats, Ints
from pftrack.core.numerics.compiled import compiled, read_only
from pftrack.core.numerics.elementary import exponentials
from pftrack.core.numerics.matrices import inner_product

ACROSS = 8
"""Cells along each side."""
DIRECTIONS, CHANNELS = 8, 11
"""Numbers of a cell: directions of gradients, and all."""
NUMBERS = ACROSS * ACROSS * CHANNELS + 1
"""Numbers of a window; the last is constant."""
PIXELS_A_CELL = 4
CONSTANT = 0.3
COLOUR = 0.9
"""Weight of colours relative to edges."""
FAINT, FLAT = 0.25, 25.0
"""Share of the mean edge, and variance of colours, that suppress weak edges and colours."""
DIAGONAL = 181
"""The square root of 2, in parts of 128."""
FIRST_ROUNDS, FIRST_RATE = 15, 0.5
NEAR, NEAR_SIZE = 0.12, 0.15
"""Distance of windows, in sides, and of the logarithms of sizes that are worth exp(-1/2)."""

Windows: TypeAlias = tuple[Floats, Floats, Floats, Floats]
"""Columns and rows of middles (N,), half widths and half heights (N,), px."""


class Cells(NamedTuple):
    """The target's description in cells, for compiled code.

    Attributes:
        weights: w (NUMBERS,).
        step: Side of the squares over which pixels are averaged, px.
        share: Weight of s relative to the colours, 0..1; 0 if cells do not count.
    """

    weights: Floats
    step: int
    share: float


NO_CELLS = Cells(np.zeros(NUMBERS), 1, 0.0)
"""Cells do not count."""

RINGS = (0.0, -0.1, 0.1, -0.25, 0.25, -0.5, 0.5, -1.0, 1.0)
OFFSETS = np.array(
    [(x, y, 0) for y in RINGS for x in RINGS] + [(0, 0, size) for size in (-0.3, -0.2, -0.1, 0.1, 0.2, 0.3)]
)
"""Places of windows for learning, (K, 3): across and down in sides, and logarithms of sizes."""
HERE = OFFSETS[:1]
AROUND = np.array([(x, y, 0.0) for x in (0.0, -0.75, 0.75) for y in (0.0, -0.75, 0.75)])
"""The target's place, and eight places around it that are not used for learning: likelihoods should separate them."""


def windows_around(place: Floats, half_sides: Floats, offsets: Floats) -> Windows:
    """Return windows (K,) at offsets (K, 3) from one.

    Args:
        place: (2,) its middle, px.
        half_sides: (2,) half its width and height, px.
        offsets: Across and down in its sides, and logarithms of relative sizes.
    """
    factors, middles = exponentials(offsets[:, 2]), place + 2.0 * half_sides * offsets[:, :2]
    return middles[:, 0].copy(), middles[:, 1].copy(), half_sides[0] * factors, half_sides[1] * factors


def begin(image_rgb: NDArray[np.uint8], place: Floats, half_sides: Floats) -> Cells:
    """Return what is learned of a target in the first picture; arguments as for `learn`."""
    step = max(int(2.0 * float(np.min(half_sides)) / (ACROSS * PIXELS_A_CELL)), 1)
    return learn(NO_CELLS._replace(step=step), image_rgb, place, half_sides, FIRST_RATE, FIRST_ROUNDS)


def score(cells: Cells, image_rgb: NDArray[np.uint8], place: Floats, half_sides: Floats, offsets: Floats) -> Floats:
    """Return s (K,) of windows at offsets (K, 3) from one; see `windows_around` and `scores`."""
    return np.asarray(scores(read_only(image_rgb), windows_around(place, half_sides, offsets), cells))


def learn(
    cells: Cells, image_rgb: NDArray[np.uint8], place: Floats, half_sides: Floats, rate: float, rounds: int = 1
) -> Cells:
    """Return what is known of a target once it was seen at a place.

    Args:
        cells: The description so far.
        image_rgb: (height, width, 3).
        place: (2,) middle of the window, px.
        half_sides: (2,) half its width and height, px.
        rate: r, 0..1.
        rounds: Number of passes over the windows.
    """
    seen = _describe(read_only(image_rgb), windows_around(place, half_sides, OFFSETS), cells.step)
    # Desired s of these windows. This is not a constant, because importing a module must not compile anything.
    worth = exponentials(-0.5 * ((OFFSETS / (NEAR, NEAR, NEAR_SIZE)) ** 2).sum(axis=1))
    return cells._replace(weights=_learn(cells.weights, seen, worth, rate, rounds))


@compiled
def _learn(weights: Floats, seen: Floats, worth: Floats, rate: float, rounds: int) -> Floats:
    learned = weights.copy()
    for _ in range(rounds):
        for n in range(seen.shape[0]):
            length = inner_product(seen[n], seen[n])
            if length > 0.0:
                factor = rate * (worth[n] - inner_product(seen[n], learned)) / length
                for place in range(learned.shape[0]):
                    learned[place] += factor * seen[n, place]
    return learned


@compiled
def scores(image_rgb: NDArray[np.uint8], windows: Windows, cells: Cells) -> Floats:
    """Return s (N,), 0..1, of windows; 0 for those outside the picture or at places that are not finite."""
    seen = _describe(image_rgb, windows, cells.step)
    found = np.empty(seen.shape[0])
    for n in range(seen.shape[0]):
        found[n] = min(max(inner_product(seen[n], cells.weights), 0.0), 1.0)
    return found


@compiled
def _edges(middles: Floats, halves: Floats, step: int, size: int) -> Ints:
    """Return where cells begin and end along an axis, (N, ACROSS + 1), in squares of a picture that has `size`."""
    found = np.zeros((middles.shape[0], ACROSS + 1), np.int64)
    for n in range(middles.shape[0]):
        for place in range(ACROSS + 1 if np.isfinite(middles[n]) else 0):
            edge = (middles[n] + 0.5 + halves[n] * (2.0 * place / ACROSS - 1.0)) / step
            found[n, place] = int(np.floor(min(max(edge, 0.0), float(size)) + 0.5))
    return found


@compiled
def _describe(image_rgb: NDArray[np.uint8], windows: Windows, step: int) -> Floats:
    """Return y (N, NUMBERS) of windows; 0 for those outside the picture or at places that are not finite."""
    height, width = image_rgb.shape[0] // step, image_rgb.shape[1] // step
    across, down = _edges(windows[0], windows[2], step, width), _edges(windows[1], windows[3], step, height)
    seen = np.zeros((across.shape[0], NUMBERS))
    inside = (across[:, ACROSS] > across[:, 0]) & (down[:, ACROSS] > down[:, 0])
    if not inside.any():
        return seen
    # A gradient looks one square further.
    left, top = max(across[inside].min() - 1, 0), max(down[inside].min() - 1, 0)
    right, bottom = min(across[inside].max() + 1, width), min(down[inside].max() + 1, height)
    sums = _sums(image_rgb[top * step : bottom * step, left * step : right * step], step)
    for n in np.flatnonzero(inside):
        _describe_one(sums, across[n] - left, down[n] - top, seen[n])
    return seen


@compiled
def _describe_one(sums: Ints, across: Ints, down: Ints, seen: Floats) -> None:
    """Write y (NUMBERS,) of a window."""
    edges, brightness, inside = 0.0, 0.0, 0.0
    for begin in range(0, NUMBERS - 1, CHANNELS):
        row, column = begin // CHANNELS // ACROSS, begin // CHANNELS % ACROSS
        top, bottom, left, right = down[row], down[row + 1], across[column], across[column + 1]
        area = (bottom - top) * (right - left)
        if area > 0:
            for channel in range(CHANNELS):
                total = sums[bottom, right, channel] - sums[top, right, channel]
                seen[begin + channel] = (total - sums[bottom, left, channel] + sums[top, left, channel]) / area
            edges += inner_product(seen[begin : begin + DIRECTIONS], seen[begin : begin + DIRECTIONS])
            brightness += seen[begin + DIRECTIONS : begin + CHANNELS].mean()
            inside += 1.0
    faint, brightness = FAINT * edges / (ACROSS * ACROSS) + 1.0, brightness / inside
    length, contrast = 1e-9, FLAT * ACROSS * ACROSS
    for begin in range(0, NUMBERS - 1, CHANNELS):
        directions, colours = seen[begin : begin + DIRECTIONS], seen[begin + DIRECTIONS : begin + CHANNELS]
        if colours.any():
            directions /= np.sqrt(inner_product(directions, directions) + faint)
            colours -= brightness
            length += inner_product(directions, directions)
            contrast += inner_product(colours, colours)
    for begin in range(0, NUMBERS - 1, CHANNELS):
        seen[begin : begin + DIRECTIONS] /= np.sqrt(length)
        seen[begin + DIRECTIONS : begin + CHANNELS] *= COLOUR / np.sqrt(contrast)
    seen[NUMBERS - 1] = CONSTANT
    seen *= inside / (ACROSS * ACROSS)


@compiled
def _sums(part_rgb: NDArray[np.uint8], step: int) -> Ints:
    """Return sums (height + 1, width + 1, CHANNELS) over all rectangles of squares that begin in the first one."""
    height, width = part_rgb.shape[0] // step, part_rgb.shape[1] // step
    means, bright = np.zeros((height, width, 3), np.int64), np.zeros((height, width), np.int64)
    for y in range(height * step):
        for x in range(width * step):
            for channel in range(3):
                means[y // step, x // step, channel] += part_rgb[y, x, channel]
    means //= step * step
    for channel in range(3):
        bright += means[:, :, channel]
    sums = np.zeros((height + 1, width + 1, CHANNELS), np.int64)
    for row in range(height):
        along = np.zeros(CHANNELS, np.int64)
        for column in range(width):
            right = bright[row, min(column + 1, width - 1)] - bright[row, max(column - 1, 0)]
            down = bright[min(row + 1, height - 1), column] - bright[max(row - 1, 0), column]
            # A gradient is split along the nearest axis and the adjacent diagonal.
            less, more = min(abs(right), abs(down)), max(abs(right), abs(down))
            axis = (0 if right > 0 else 4) if abs(right) >= abs(down) else (2 if down > 0 else 6)
            along[axis] += more - less
            along[(1 if down > 0 else 7) if right > 0 else (3 if down > 0 else 5)] += less * DIAGONAL >> 7
            for channel in range(CHANNELS):
                if channel >= DIRECTIONS:
                    along[channel] += means[row, column, channel - DIRECTIONS]
                sums[row + 1, column + 1, channel] = sums[row, column + 1, channel] + along[channel]
    return sums
