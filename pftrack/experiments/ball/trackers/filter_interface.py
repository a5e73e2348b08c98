"""What a filter in a file is told of the states of a ball, and the bootstrap filter that stands in for it."""

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.frame import Frame
from pftrack.core.numerics.gaussian import Gaussian
from pftrack.core.numerics.random import Generator
from pftrack.experiments.ball.trackers import motion
from pftrack.experiments.ball.trackers.common import lineage_of, start
from pftrack.experiments.ball.trackers.likelihood import LIKELIHOOD
from pftrack.experiments.ball.trackers.motion import TRACKED
from pftrack.experiments.ball.trackers.parameters import BallTrackerParameters
from pftrack.experiments.shared import reports
from pftrack.experiments.shared.filter_interface import FilterInterface, Update
from pftrack.experiments.shared.point_state import PointState
from pftrack.experiments.shared.sampling.common import particles_of, picture_of, size_of
from pftrack.experiments.shared.sampling.samplers import measure_particles

__all__ = ["FILTER_INTERFACE"]


def _propagate(
    state: PointState, states: NDArray[np.float64], frame: Frame, parameters: BallTrackerParameters, rng: Generator
) -> NDArray[np.float64]:
    dynamics = motion.dynamics(state, parameters, size_of(picture_of(frame)))
    means = dynamics.predict(states)
    return dynamics.diffuse(rng, means, np.arange(len(states)))


def _believe(state: PointState, update: Update, frame: Frame, parameters: BallTrackerParameters) -> PointState:
    del frame
    particles = update.particles
    parents = state.particles
    return PointState(
        Gaussian(*particles.moments),
        TRACKED,
        particles,
        log_evidence=update.log_evidence,
        resampled=update.resampled,
        lineage=lineage_of(state, parents, particles, parameters) if parents is not None else None,
        repeatable=update.repeatable,
    )


FILTER_INTERFACE = FilterInterface(
    likelihood=LIKELIHOOD,
    observed="frame.image_rgb is the picture, (height, width, 3), 0 to 255; u counts its columns, v its rows",
    example="pftrack.experiments.ball.example_filter",
    reads="condensation",
    start=start,
    particles=particles_of,
    propagate=_propagate,
    believe=_believe,
    series=reports.CLOUD,
    measure=measure_particles,
)
