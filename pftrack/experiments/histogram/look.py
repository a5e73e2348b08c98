"""A target's look in the marked picture, and what is counted of it: colours, surroundings and cells.

The look is kept as a patch of the picture, so another colour space can be chosen while tracking.
"""

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Floats
from pftrack.core.numerics.compiled import read_only
from pftrack.experiments.histogram.parameters import HistogramTrackerParameters
from pftrack.vision.likelihoods import cells, histogram
from pftrack.vision.likelihoods.counting import Space, bin_table


@dataclass(frozen=True, slots=True, eq=False)
class Look:
    """The target's look in the marked picture.

    Attributes:
        patch_rgb: (h, w, 3) the part of the picture in which the window and its surroundings lie.
        middle: (2,) of the window within the patch, px.
        window: Its shape; kernel and parts are chosen later.
        size_px: Width and height as they were marked; those of the window are odd.
    """

    patch_rgb: NDArray[np.uint8]
    middle: Floats
    window: histogram.Window
    size_px: tuple[float, float]


SURROUNDINGS = 4
"""Sides of the part of the picture that a first look keeps, in sides of the window."""


def first_look(image_rgb: NDArray[np.uint8], position: Floats, parameters: HistogramTrackerParameters) -> Look:
    """Return how a target looks, px."""
    window = histogram.Window(int(parameters.window_width_px) // 2, int(parameters.window_height_px) // 2)
    height, width, _ = image_rgb.shape
    column, row = (int(np.floor(value + 0.5)) for value in position)
    across, down = SURROUNDINGS * window.reach_across_px, SURROUNDINGS * window.reach_down_px
    left, right = max(column - across, 0), min(column + across + 1, width)
    top, bottom = max(row - down, 0), min(row + down + 1, height)
    patch = image_rgb[top:bottom, left:right].copy()
    size_px = parameters.window_width_px, parameters.window_height_px
    return Look(patch, np.array([column - left, row - top], np.float64), window, size_px)


def counted(look: Look, parameters: HistogramTrackerParameters) -> dict[str, Any]:
    """Return how a target counts, by the names of a state's fields: space, kernel, parts, model and background."""
    space, kernel, parts = counting(parameters)
    use = use_of_surroundings(parameters)
    return {
        "space": space,
        "kernel": kernel,
        "parts": parts,
        "model": model_of(look, space, kernel, parts),
        "background": _background(look, space, kernel, *use),
        "background_use": use,
    }


def use_of_surroundings(parameters: HistogramTrackerParameters) -> tuple[bool, float]:
    """Return whether bins are weighed by the background, and the weight of contrast."""
    return bool(parameters.weigh_background), float(parameters.surround_contrast)


def counting(parameters: HistogramTrackerParameters) -> tuple[Space, bool, tuple[int, int]]:
    """Return the space, whether the middle counts more, and the parts of a window, across and down."""
    parts = int(parameters.parts_across), int(parameters.parts_down)
    return parameters.colour_space, parameters.spatial_kernel, parts


@lru_cache(maxsize=64)
def _background(look: Look, space: Space, kernel: bool, weigh: bool, contrast: float) -> histogram.Background:
    """Return the surroundings in the first picture, as far as they count."""
    if not (weigh or contrast > 0.0):
        return histogram.NO_BACKGROUND
    target = model_of(look, space, kernel, (1, 1))
    reach = look.window.reach_across_px, look.window.reach_down_px
    return histogram.background_of(look.patch_rgb, look.middle, reach, space, target, weigh=weigh, contrast=contrast)


@lru_cache(maxsize=64)
def model_of(look: Look, space: Space, kernel: bool, parts: tuple[int, int]) -> Floats:
    """Return the model (110 in each part) of a look.

    Raises:
        ValueError: Too little of the window lay within the picture.
    """
    return histogram.fit(look.patch_rgb, look.middle, replace(look.window, kernel=kernel, parts=parts), space)


@lru_cache(maxsize=64)
def first_cells(look: Look) -> cells.Cells:
    """Return what is known of a look in cells."""
    return cells.begin(look.patch_rgb, look.middle, half_sides(look))


def half_sides(look: Look, scale: float = 1.0) -> Floats:
    """Return half the width and height of the window, (2,) px, at a size."""
    return scale * (np.array(look.window.size_px) / 2.0)


def separating_share(image_rgb: NDArray[np.uint8], place: Floats, parameters: HistogramTrackerParameters) -> float:
    """Return the weight of cells: what they separate the target from its surroundings, relative to that of both."""
    look, (space, kernel, parts) = first_look(image_rgb, place, parameters), counting(parameters)
    patch, windows = read_only(look.patch_rgb), cells.windows_around(look.middle, half_sides(look), cells.AROUND)
    background = _background(look, space, kernel, *use_of_surroundings(parameters))
    root = histogram.roots_of(model_of(look, space, kernel, parts), background)
    rho = histogram.similarities(patch, *windows, bin_table(space), root, kernel, parts, background)
    score = cells.scores(patch, windows, first_cells(look))
    by_cells, by_colours = (max(float(found[0] - found[1:].mean()), 0.0) for found in (score, rho))
    return by_cells / (by_cells + by_colours) if by_cells > 0.0 else 0.0
