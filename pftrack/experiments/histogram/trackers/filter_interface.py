"""What a filter in a file is told of the states of a window by its colours, and what stands in for what it lacks."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.frame import Frame
from pftrack.core.model.series import SeriesValue
from pftrack.core.numerics.gaussian import Gaussian
from pftrack.core.numerics.matrices import product
from pftrack.core.numerics.random import Generator
from pftrack.experiments.histogram.trackers.inspection import LIKELIHOOD
from pftrack.experiments.histogram.trackers.model import judge
from pftrack.experiments.histogram.trackers.parameters import HistogramTrackerParameters
from pftrack.experiments.histogram.trackers.reports import SERIES, measure
from pftrack.experiments.histogram.trackers.state import HistogramState
from pftrack.experiments.histogram.trackers.step import motion, start
from pftrack.experiments.shared import reports
from pftrack.experiments.shared.filter_interface import FilterInterface, Update
from pftrack.experiments.shared.sampling.common import particles_of, picture_of
from pftrack.experiments.shared.sampling.samplers import measure_particles

__all__ = ["FILTER_INTERFACE"]


def _propagate(
    state: HistogramState,
    states: NDArray[np.float64],
    frame: Frame,
    parameters: HistogramTrackerParameters,
    rng: Generator,
) -> NDArray[np.float64]:
    del state, frame
    moves = motion(parameters)
    noise = rng.standard_normal((len(states), moves.noise.shape[1]))
    moved: NDArray[np.float64] = product(states, moves.transition.T) + moves.offset + product(noise, moves.noise.T)
    return moved


def _believe(
    state: HistogramState, update: Update, frame: Frame, parameters: HistogramTrackerParameters
) -> HistogramState:
    believed = replace(
        state,
        posterior=Gaussian(*update.particles.moments),
        particles=update.particles,
        log_evidence=update.log_evidence,
        resampled=update.resampled,
        repeatable=update.repeatable,
    )
    return replace(judge(believed, picture_of(frame), parameters), searching=None)


def _measure(state: HistogramState) -> dict[str, SeriesValue]:
    return {**measure_particles(state), **measure(state)}


FILTER_INTERFACE = FilterInterface(
    likelihood=LIKELIHOOD,
    observed="frame.image_rgb is the picture, (height, width, 3), 0 to 255; u counts its columns, v its rows",
    example="pftrack.experiments.histogram.example_filter",
    reads="condensation",
    start=start,
    particles=particles_of,
    propagate=_propagate,
    believe=_believe,
    series=(*reports.CLOUD, *SERIES),
    measure=_measure,
)
