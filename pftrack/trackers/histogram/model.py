"""What the target looks like: the model that a state carries, as the parameters want it, and how it is renewed.

The first look is kept as a patch of the picture, so that another space of colours can be chosen while tracking. A model
that is renewed forgets it little by little; when another space is chosen, it begins with the first look again.
"""

from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from pftrack.likelihoods.colour_bins import Space
from pftrack.likelihoods.histogram import Window, fit, shares, similarity
from pftrack.trackers.histogram.parameters import HistogramTrackerParameters
from pftrack.trackers.histogram.state import HistogramState, Look

__all__ = ["first_likeness", "first_look", "judge", "with_model"]


def first_look(
    image_rgb: NDArray[np.uint8], position: NDArray[np.float64], parameters: HistogramTrackerParameters
) -> Look:
    """Return how a target looks, px."""
    window = Window(int(parameters.window_width_px) // 2, int(parameters.window_height_px) // 2)
    height, width, _ = image_rgb.shape
    column, row = (int(np.floor(value + 0.5)) for value in position)
    left, right = max(column - window.reach_across_px, 0), min(column + window.reach_across_px + 1, width)
    top, bottom = max(row - window.reach_down_px, 0), min(row + window.reach_down_px + 1, height)
    patch = image_rgb[top:bottom, left:right].copy()
    return Look(patch, np.array([column - left, row - top], np.float64), window)


def with_model(state: HistogramState, parameters: HistogramTrackerParameters) -> HistogramState:
    """Return the state with a model that counts as the parameters say.

    Raises:
        ValueError: Too little of the target's window lay within the picture.
    """
    space, kernel = parameters.colour_space, parameters.spatial_kernel
    if (state.space, state.kernel) == (space, kernel):
        return state
    return replace(state, space=space, kernel=kernel, model=model_of(state.look, parameters))


def model_of(look: Look | None, parameters: HistogramTrackerParameters) -> NDArray[np.float64]:
    """Return the model (110,) of a look.

    Raises:
        ValueError: There is none, or too little of the window lay within the picture.
    """
    if look is None:
        raise ValueError("a target's model is made of its first look, got a state without one")
    window = replace(look.window, kernel=parameters.spatial_kernel)
    return fit(look.patch_rgb, look.middle, window, parameters.colour_space)


def first_likeness(state: HistogramState) -> float:
    """Return rho between the model and the first look: 1 until something is renewed, and less as the model drifts."""
    if state.look is None:
        return 1.0
    return min(float((np.sqrt(state.model) * _first_roots(state.look, state.space, state.kernel)).sum()), 1.0)


@lru_cache(maxsize=64)
def _first_roots(look: Look, space: Space, kernel: bool) -> NDArray[np.float64]:
    """Return the square roots (110,) of what a first look counts to."""
    return np.sqrt(fit(look.patch_rgb, look.middle, replace(look.window, kernel=kernel), space))


def judge(
    state: HistogramState, image_rgb: NDArray[np.uint8], parameters: HistogramTrackerParameters
) -> HistogramState:
    """Compare the window at the estimate with the model: is the target lost, and may the model be renewed?

    What is renewed by mistake is followed from then on, so only a window that is like the model counts, and only while
    the particles agree where it is.
    """
    likeness = similarity(image_rgb, state.estimate, state.window, state.space, state.model)
    missed = state.missed + 1 if likeness < parameters.lost_likeness else 0
    searching = bool(parameters.find_again and missed >= parameters.lost_after_frames)
    state = replace(state, likeness=likeness, missed=missed, searching=searching)
    rate = parameters.renewal_rate
    within = parameters.renewal_spread * min(state.box_px) / 2.0
    if rate == 0.0 or likeness < parameters.renewal_likeness or state.sigma.max() > within:
        return state
    seen = shares(image_rgb, state.estimate, state.window, state.space)
    return replace(state, model=(1.0 - rate) * state.model + rate * seen)
