"""What a camera that is held in a hand does to a cloud: all that is believed of places moves with the picture."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pftrack.experiments.histogram.trackers.parameters import HistogramTrackerParameters
from pftrack.experiments.histogram.trackers.state import HistogramState
from pftrack.vision.likelihoods.camera import camera_shift, small_grey

__all__ = ["first_view", "follow_camera"]


def first_view(image_rgb: NDArray[np.uint8], parameters: HistogramTrackerParameters) -> NDArray[np.uint8] | None:
    """Return what the next picture is compared with, (h, w); None if the camera is not followed."""
    return small_grey(image_rgb) if parameters.follow_camera else None


def follow_camera(
    state: HistogramState, image_rgb: NDArray[np.uint8], parameters: HistogramTrackerParameters
) -> HistogramState:
    """Return the state with all places moved as the picture has moved; velocities are those within the scene."""
    view = first_view(image_rgb, parameters)
    if view is None or state.view is None:
        return state if state.view is view else replace(state, view=view)
    shift = camera_shift(state.view, image_rgb, view)
    mean = state.posterior.mean.copy()
    mean[:2] += shift
    moved = replace(state, view=view, posterior=replace(state.posterior, mean=mean))
    if state.particles is None:
        return moved
    states = state.particles.states.copy(order="F")
    states[:, :2] += shift
    return replace(moved, particles=replace(state.particles, states=states))
