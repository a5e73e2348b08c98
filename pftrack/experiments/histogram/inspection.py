"""What particles of a window are weighed by, at any place and with its parts, and how a moving camera moves a cloud."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Floats
from pftrack.core.model.likelihood import Amount, Component, Histograms, ObservationLikelihood, Part, Patches
from pftrack.core.model.source import Frame
from pftrack.core.numerics.compiled import read_only
from pftrack.core.numerics.elementary import exponential
from pftrack.experiments.histogram.model import HISTOGRAM, LARGEST, SIZE, HistogramState, pack, with_model
from pftrack.experiments.histogram.parameters import HistogramTrackerParameters
from pftrack.experiments.shared.sampling.samplers import centre_of, crop, picture_of
from pftrack.vision.likelihoods.camera import camera_shift, small_grey
from pftrack.vision.likelihoods.counting import BINS, bin_colours
from pftrack.vision.likelihoods.histogram import Window, shares, similarity


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


COMPONENTS = (
    Component("u", "px"),
    Component("v", "px"),
    Component("velocity u", "px/frame"),
    Component("velocity v", "px/frame"),
    Component("log size"),
)


def _prepare(state: HistogramState, frame: Frame, parameters: HistogramTrackerParameters) -> HistogramState:
    return follow_camera(with_model(state, parameters), picture_of(frame), parameters)


def _weigh(state: HistogramState, states: Floats, frame: Frame, parameters: HistogramTrackerParameters) -> Floats:
    weighed: Floats = HISTOGRAM.log_likelihood(
        read_only(picture_of(frame)), np.ascontiguousarray(states.T).T, pack(state, parameters.sharpness)
    )
    return weighed


def _parts(
    state: HistogramState, one: Floats, frame: Frame, parameters: HistogramTrackerParameters
) -> tuple[Part, ...]:
    """Return the colours of the window beside the model's, and the window beside the first look."""
    image, first, look = picture_of(frame), state.first_window, state.first_look
    factor = float(exponential(np.clip(one[SIZE], -LARGEST, LARGEST)))
    across, down = (int(np.floor(factor * reach + 0.5)) for reach in (first.reach_across_px, first.reach_down_px))
    window = Window(across, down, state.kernel, state.parts)
    place = one[:2] if np.isfinite(one[:2]).all() else np.full(2, -1e6)
    rho = similarity(image, place, window, state.space, state.model, state.background)
    found = shares(image, place, window, state.space)
    colours = tuple(map(tuple, bin_colours(state.space).tolist())) * (len(state.model) // BINS)
    return (
        Amount("likeness rho", rho),
        Amount("sharpness lambda", float(parameters.sharpness)),
        Histograms("colours of the model, and of the window", tuple(state.model), tuple(found), colours),
        Patches(
            "first look, and window",
            crop(look.patch_rgb, look.middle, (first.reach_across_px, first.reach_down_px)),
            crop(image, place, (across, down)),
        ),
    )


LIKELIHOOD = ObservationLikelihood(
    "colours of the window",
    components=lambda _: COMPONENTS,
    prepare=_prepare,
    log_likelihood=_weigh,
    centre=centre_of,
    parts=_parts,
    most_places=4800,
)
"""exp(-lambda (1 - rho)), to be asked at any place."""
