"""What the loop weighs particles of a window by: how like the model its colours are."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pftrack.core.numerics.compiled import compiled
from pftrack.core.numerics.elementary import exponentials
from pftrack.experiments.histogram.trackers.state import SIZE, HistogramState
from pftrack.experiments.shared.sampling.likelihood import Likelihood
from pftrack.vision.likelihoods.background import Background
from pftrack.vision.likelihoods.colour_bins import bin_table
from pftrack.vision.likelihoods.histogram import roots_of, similarities

__all__ = ["HISTOGRAM", "Packed", "pack"]

LARGEST = 1.4
"""Of the logarithm of a size, up or down: a window of a quarter of the first one's sides, or four times them."""


class Packed(NamedTuple):
    """What is known of the target's colours, for compiled code."""

    table: NDArray[np.uint8]
    root_model: NDArray[np.float64]
    half_width: float
    half_height: float
    sharpness: float
    kernel: bool
    parts: tuple[int, int]
    background: Background


def pack(state: HistogramState, sharpness: float) -> Packed:
    """Return what particles are weighed by, given the state before and lambda."""
    window = state.first_window
    return Packed(
        bin_table(state.space),
        roots_of(state.model, state.background),
        float(window.reach_across_px),
        float(window.reach_down_px),
        float(sharpness),
        state.kernel,
        state.parts,
        state.background,
    )


@compiled
def _log_likelihood(image_rgb: NDArray[np.uint8], states: NDArray[np.float64], target: Packed) -> NDArray[np.float64]:
    count = states.shape[0]
    columns, rows, sizes = np.empty(count), np.empty(count), np.empty(count)
    for n in range(count):
        columns[n], rows[n], sizes[n] = states[n, 0], states[n, 1], states[n, SIZE]
        if not abs(sizes[n]) <= LARGEST:
            # Such a window is none: it is put beside the picture.
            columns[n], sizes[n] = np.nan, 0.0
    factors = exponentials(sizes)
    half_widths, half_heights = np.empty(count), np.empty(count)
    for n in range(count):
        half_widths[n], half_heights[n] = target.half_width * factors[n], target.half_height * factors[n]
    scores = similarities(
        image_rgb,
        columns,
        rows,
        half_widths,
        half_heights,
        target.table,
        target.root_model,
        target.kernel,
        target.parts,
        target.background,
    )
    for n in range(count):
        scores[n] = -target.sharpness * (1.0 - scores[n])
    return scores


HISTOGRAM = Likelihood(_log_likelihood, lambda given: pack(*given))
"""exp(-lambda (1 - rho)) of the window around a particle (Kagami 2012; Pérez et al. 2002)."""
