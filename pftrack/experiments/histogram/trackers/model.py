"""What the target looks like: the model that a state carries, as the parameters want it, and how it is renewed.

The first look is kept as a patch of the picture, so that another space of colours can be chosen while tracking. A model
that is renewed forgets it little by little; when another space is chosen, it begins with the first look again.
"""

from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pftrack.experiments.histogram.trackers.parameters import HistogramTrackerParameters
from pftrack.experiments.histogram.trackers.state import HistogramState, Look
from pftrack.vision.likelihoods.background import NO_BACKGROUND, Background, background_of
from pftrack.vision.likelihoods.colour_bins import Space
from pftrack.vision.likelihoods.histogram import Window, fit, shares, similarity

__all__ = ["counted", "first_likeness", "first_look", "judge", "model_of", "with_model"]

SURROUNDINGS = 2
"""Sides of the part of the picture that a first look keeps, in sides of the window."""


def first_look(
    image_rgb: NDArray[np.uint8], position: NDArray[np.float64], parameters: HistogramTrackerParameters
) -> Look:
    """Return how a target looks, px."""
    window = Window(int(parameters.window_width_px) // 2, int(parameters.window_height_px) // 2)
    height, width, _ = image_rgb.shape
    column, row = (int(np.floor(value + 0.5)) for value in position)
    across, down = SURROUNDINGS * window.reach_across_px, SURROUNDINGS * window.reach_down_px
    left, right = max(column - across, 0), min(column + across + 1, width)
    top, bottom = max(row - down, 0), min(row + down + 1, height)
    patch = image_rgb[top:bottom, left:right].copy()
    size_px = parameters.window_width_px, parameters.window_height_px
    return Look(patch, np.array([column - left, row - top], np.float64), window, size_px)


def with_model(state: HistogramState, parameters: HistogramTrackerParameters) -> HistogramState:
    """Return the state with a model that counts as the parameters say.

    Raises:
        ValueError: Too little of the target's window lay within the picture.
    """
    counting = parameters.colour_space, parameters.spatial_kernel, parts_of(parameters)
    same = (state.space, state.kernel, state.parts) == counting
    if same and state.background_use == _use(parameters):
        return state
    wanted = counted(state.first_look, parameters)
    return replace(state, **({**wanted, "model": state.model} if same else wanted))


def counted(look: Look, parameters: HistogramTrackerParameters) -> dict[str, Any]:
    """Return how a target counts, by the names of a state's fields: space, kernel, parts, model and background."""
    use = _use(parameters)
    return {
        "space": parameters.colour_space,
        "kernel": parameters.spatial_kernel,
        "parts": parts_of(parameters),
        "model": model_of(look, parameters),
        "background": _background(look, parameters.colour_space, parameters.spatial_kernel, *use),
        "background_use": use,
    }


def _use(parameters: HistogramTrackerParameters) -> tuple[bool, float]:
    """Return whether bins are weighed by the background, and how much contrast counts."""
    return bool(parameters.weigh_background), float(parameters.surround_contrast)


def parts_of(parameters: HistogramTrackerParameters) -> tuple[int, int]:
    """Return into how many parts a window is divided, across and down."""
    return int(parameters.parts_across), int(parameters.parts_down)


@lru_cache(maxsize=64)
def _background(look: Look, space: Space, kernel: bool, weigh: bool, contrast: float) -> Background:
    """Return what the surroundings in the first picture tell, as far as it counts."""
    if not (weigh or contrast > 0.0):
        return NO_BACKGROUND
    target = fit(look.patch_rgb, look.middle, replace(look.window, kernel=kernel), space)
    reach = look.window.reach_across_px, look.window.reach_down_px
    return background_of(look.patch_rgb, look.middle, reach, space, target, weigh=weigh, contrast=contrast)


def model_of(look: Look | None, parameters: HistogramTrackerParameters) -> NDArray[np.float64]:
    """Return the model (110 in each part) of a look.

    Raises:
        ValueError: There is none, or too little of the window lay within the picture.
    """
    if look is None:
        raise ValueError("a target's model is made of its first look, got a state without one")
    window = replace(look.window, kernel=parameters.spatial_kernel, parts=parts_of(parameters))
    return fit(look.patch_rgb, look.middle, window, parameters.colour_space)


def first_likeness(state: HistogramState) -> float:
    """Return rho between the model and the first look: 1 until something is renewed, and less as the model drifts."""
    if state.look is None:
        return 1.0
    first = _first_roots(state.look, state.space, state.kernel, state.parts)
    return min(float((np.sqrt(state.model) * first).sum()), 1.0)


@lru_cache(maxsize=64)
def _first_roots(look: Look, space: Space, kernel: bool, parts: tuple[int, int]) -> NDArray[np.float64]:
    """Return the square roots (110 in each part) of what a first look counts to."""
    return np.sqrt(fit(look.patch_rgb, look.middle, replace(look.window, kernel=kernel, parts=parts), space))


def judge(
    state: HistogramState, image_rgb: NDArray[np.uint8], parameters: HistogramTrackerParameters
) -> HistogramState:
    """Compare the window at the estimate with the model: is the target lost, and may the model be renewed?

    What is renewed by mistake is followed from then on, so only a window that is like the model counts, and only while
    the particles agree where it is.
    """
    likeness = similarity(image_rgb, state.estimate, state.window, state.space, state.model, state.background)
    missed = state.missed + 1 if likeness < parameters.lost_likeness else 0
    searching = missed >= parameters.lost_after_frames if parameters.find_again else None
    state = replace(state, likeness=likeness, missed=missed, searching=searching)
    rate = parameters.renewal_rate
    within = parameters.renewal_spread * min(state.box_px) / 2.0
    if rate == 0.0 or likeness < parameters.renewal_likeness or state.sigma.max() > within:
        return state
    seen = shares(image_rgb, state.estimate, state.window, state.space)
    return replace(state, model=(1.0 - rate) * state.model + rate * seen)
