"""What a filter in a file is told of the states of a window by its colours, and what stands in for what it lacks."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pftrack.model.frame import Frame
from pftrack.model.series import SeriesValue
from pftrack.numerics.compiled import read_only
from pftrack.numerics.gaussian import Gaussian
from pftrack.numerics.matrices import product
from pftrack.numerics.random import Generator
from pftrack.trackers import reports
from pftrack.trackers.filter_interface import Component, FilterInterface, Update
from pftrack.trackers.histogram.camera import follow_camera
from pftrack.trackers.histogram.likelihood import HISTOGRAM, pack
from pftrack.trackers.histogram.model import judge, with_model
from pftrack.trackers.histogram.parameters import HistogramTrackerParameters
from pftrack.trackers.histogram.reports import SERIES, measure
from pftrack.trackers.histogram.state import HistogramState
from pftrack.trackers.histogram.step import motion, start
from pftrack.trackers.sampling.common import particles_of, picture_of
from pftrack.trackers.sampling.samplers import measure_particles

__all__ = ["FILTER_INTERFACE"]

COMPONENTS = (
    Component("u", "px"),
    Component("v", "px"),
    Component("velocity u", "px/frame"),
    Component("velocity v", "px/frame"),
    Component("log size"),
)


def _prepare(state: HistogramState, frame: Frame, parameters: HistogramTrackerParameters) -> HistogramState:
    return follow_camera(with_model(state, parameters), picture_of(frame), parameters)


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


def _log_likelihood(
    state: HistogramState, states: NDArray[np.float64], frame: Frame, parameters: HistogramTrackerParameters
) -> NDArray[np.float64]:
    weighed: NDArray[np.float64] = HISTOGRAM.log_likelihood(
        read_only(picture_of(frame)), np.ascontiguousarray(states.T).T, pack(state, parameters.sharpness)
    )
    return weighed


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
    components=lambda _: COMPONENTS,
    observed="frame.image_rgb is the picture, (height, width, 3), 0 to 255; u counts its columns, v its rows",
    example="pftrack.experiments.histogram.example_filter",
    reads="condensation",
    start=start,
    prepare=_prepare,
    particles=particles_of,
    propagate=_propagate,
    log_likelihood=_log_likelihood,
    believe=_believe,
    series=(*reports.CLOUD, *SERIES),
    measure=_measure,
)
