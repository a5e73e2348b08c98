"""Bins of colour: a pixel that has a colour belongs to one of 10 x 10 bins of it, any other to one of 10 of brightness.

Three spaces of colour (`SPACES`) share one way of counting, since the bin of each of the 2^24 colours is looked up in
a table.
"""

from collections.abc import Callable
from functools import lru_cache
from typing import Any, Literal, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from pftrack.core.numerics.compiled import read_only

__all__ = ["BINS", "SPACES", "STEPS", "Space", "bin_colours", "bin_table"]

Space: TypeAlias = Literal["hsv", "lab", "chromaticity"]

STEPS = 10
"""Bins along each axis of a colour, and along that of brightness."""
BINS = STEPS * STEPS + STEPS
LEAST_CHROMA = 8
"""Distance from grey in the (a, b) plane of Lab from which on a pixel has a colour; about that of HSV's S > 0.1."""
LAB_REACH = 60
"""What of the (a, b) plane the bins divide, to either side of grey; few surfaces are more colourful."""
DARK = 153
"""R + G + B up to which a pixel has no chromaticity: 0.2 of the greatest, as HSV's V > 0.2."""


@lru_cache(maxsize=3)
def bin_table(space: Space) -> NDArray[np.uint8]:
    """Return the bin (2^24,) of each colour, by 65536 R + 256 G + B."""
    table = np.empty((256, 256, 256), np.uint8)
    plane = np.empty((256, 256, 3), np.uint8)
    plane[:, :, 1], plane[:, :, 2] = np.arange(256)[:, None], np.arange(256)
    for red in range(256):
        plane[:, :, 0] = red
        table[red] = SPACES[space](plane)
    return read_only(table.ravel())


@lru_cache(maxsize=3)
def bin_colours(space: Space) -> NDArray[np.uint8]:
    """Return a colour for each bin, (110, 3) RGB: the mean of those that belong to it, of every eighth level."""
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
"""How colours (h, w, 3) are put into bins (h, w), by name."""
