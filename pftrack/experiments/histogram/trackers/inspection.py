"""What particles of a window are weighed by, to be asked at any place, and what that number is made of."""

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.frame import Frame
from pftrack.core.model.likelihood import Component, ObservationLikelihood
from pftrack.core.model.part import Amount, Histograms, Part, Patches
from pftrack.core.numerics.compiled import read_only
from pftrack.core.numerics.elementary import exponential
from pftrack.experiments.histogram.trackers.camera import follow_camera
from pftrack.experiments.histogram.trackers.likelihood import HISTOGRAM, LARGEST, pack
from pftrack.experiments.histogram.trackers.model import with_model
from pftrack.experiments.histogram.trackers.parameters import HistogramTrackerParameters
from pftrack.experiments.histogram.trackers.state import SIZE, HistogramState
from pftrack.experiments.shared.sampling.common import centre_of, crop, picture_of
from pftrack.vision.likelihoods.colour_bins import BINS, bin_colours
from pftrack.vision.likelihoods.histogram import Window, shares, similarity

__all__ = ["LIKELIHOOD"]

COMPONENTS = (
    Component("u", "px"),
    Component("v", "px"),
    Component("velocity u", "px/frame"),
    Component("velocity v", "px/frame"),
    Component("log size"),
)


def _prepare(state: HistogramState, frame: Frame, parameters: HistogramTrackerParameters) -> HistogramState:
    return follow_camera(with_model(state, parameters), picture_of(frame), parameters)


def _weigh(
    state: HistogramState, states: NDArray[np.float64], frame: Frame, parameters: HistogramTrackerParameters
) -> NDArray[np.float64]:
    weighed: NDArray[np.float64] = HISTOGRAM.log_likelihood(
        read_only(picture_of(frame)), np.ascontiguousarray(states.T).T, pack(state, parameters.sharpness)
    )
    return weighed


def _parts(
    state: HistogramState, one: NDArray[np.float64], frame: Frame, parameters: HistogramTrackerParameters
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
