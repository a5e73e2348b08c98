"""How a lost target is looked for: by the same likeness, all over the picture.

While it is not found, nothing is known of where it is but what the picture says: the particles are spread over all
places in proportion to their likelihood. As soon as the best of them is alike enough, the tracker begins again there.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pftrack.core.numerics.elementary import logarithm
from pftrack.core.numerics.gaussian import Gaussian
from pftrack.core.numerics.random import Stream
from pftrack.experiments.histogram.trackers.model import judge
from pftrack.experiments.histogram.trackers.parameters import HistogramTrackerParameters
from pftrack.experiments.histogram.trackers.state import DIMENSION, HistogramState
from pftrack.filters.particles import ParticleSet, normalise
from pftrack.filters.resampling import systematic
from pftrack.vision.likelihoods.histogram import rho_map

__all__ = ["search"]

STEPS_A_WINDOW = 6
"""So many places are looked at along each side of a window."""


def search(
    state: HistogramState, image_rgb: NDArray[np.uint8], parameters: HistogramTrackerParameters, rng: Stream
) -> HistogramState:
    """Look for the target all over a picture, and begin again where it is found."""
    window = state.first_window
    step = max(min(window.size_px) // STEPS_A_WINDOW, 1)
    found = rho_map(image_rgb, window, state.space, state.model, step, state.background)
    rows, columns = np.unravel_index(np.arange(found.size), found.shape)
    places = np.column_stack([columns, rows]) * float(step) + step // 2
    best = int(found.argmax())
    count = parameters.sample_count
    if found.flat[best] >= parameters.found_likeness:
        chosen = np.full(count, best)
        log_evidence = 0.0
    else:
        log_weights, log_sum = normalise(parameters.sharpness * (found.ravel() - 1.0))
        log_evidence = float(log_sum - logarithm(np.array([found.size], np.float64))[0])
        chosen = systematic(rng, log_weights, count)
    states = np.zeros((count, DIMENSION))
    states[:, :2] = places[chosen] + step * (rng.random((2, count)).T - 0.5)
    states[:, 2:4] = parameters.initial_velocity_px * rng.standard_normal((2, count)).T
    particles = ParticleSet(states, normalise(np.zeros(count))[0], np.arange(count))
    begun = replace(
        state,
        posterior=Gaussian(*particles.moments),
        particles=particles,
        observation_count=count,
        log_evidence=log_evidence,
        resampled=True,
        switched=False,
        alert=None,
    )
    if found.flat[best] >= parameters.found_likeness:
        return judge(replace(begun, missed=0, searching=False), image_rgb, parameters)
    return replace(begun, likeness=float(found.flat[best]))
