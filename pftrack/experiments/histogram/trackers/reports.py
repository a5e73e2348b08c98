"""What the trackers by colour histograms report of their states."""

from collections.abc import Mapping

import numpy as np

from pftrack.core.model.series import Series, SeriesValue
from pftrack.experiments.histogram.trackers.model import first_likeness
from pftrack.experiments.histogram.trackers.state import VELOCITY, HistogramState

__all__ = ["BOX", "PARTICLE_SERIES", "SERIES", "measure", "measure_particles"]

BOX = Series("box", "believed box", "px", "vector", role="extent", components=("width", "height"))

SERIES = (
    Series("likeness", "likeness rho", role="likeness"),
    Series("first_likeness", "model's likeness to the first look", role="model_likeness"),
    BOX,
)

PARTICLE_SERIES = (Series("velocities", "different velocities", role="distinct"), *SERIES)
"""Of those with particles as well: where nothing is added to a velocity, resampling can only lose some of them."""


def measure(state: HistogramState) -> Mapping[str, SeriesValue]:
    """Report rho of the window at the estimate, what became of the model, and the window's size."""
    return {"likeness": state.likeness, "first_likeness": first_likeness(state), "box": state.box_px}


def measure_particles(state: HistogramState) -> Mapping[str, SeriesValue]:
    """Report the same, and how many different velocities the particles have."""
    if state.particles is None:
        return measure(state)
    x, y = state.particles.states[:, VELOCITY].T
    return {"velocities": float(len(np.unique(x + 1j * y))), **measure(state)}
