"""What all trackers of a ball have in common: how they begin, and what they carry from frame to frame."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from pftrack.filters import fixed_lag
from pftrack.frame import Frame, Target
from pftrack.gaussian import Gaussian
from pftrack.particles import ParticleSet
from pftrack.random import Generator, Purpose, Stream
from pftrack.series import SeriesValue
from pftrack.trackers import reports
from pftrack.trackers.ball.motion import TRACKED, begin_learning
from pftrack.trackers.ball.parameters import LoopParameters
from pftrack.trackers.point_state import PointState

__all__ = ["lineage_of", "measure_particles", "particles_of", "picture_of", "size_of", "start"]


def start(target: Target, frame: Frame, parameters: LoopParameters, rng: Generator) -> PointState:
    """Begin at a known position: all particles around it, at rest; the estimate is the position itself."""
    deviations = parameters.initial_sd_px * rng.standard_normal((TRACKED, parameters.sample_count)).T
    positions = target.position + deviations
    particles = ParticleSet.uniform(np.hstack([positions, positions]))
    known = Gaussian(target.position, parameters.initial_sd_px**2 * np.eye(TRACKED))
    learner = begin_learning(known, size_of(picture_of(frame)), parameters) if parameters.learn_dynamics else None
    return PointState(fixed_lag.augment(known, 1), TRACKED, particles, learner=learner)


def particles_of(state: PointState, parameters: LoopParameters, rng: Stream) -> ParticleSet:
    """Return the particles, drawn from the posterior if a filter without particles was at work before."""
    if state.particles is not None:
        return state.particles
    fresh = Stream(rng.seed, rng.frame, Purpose.START)
    return ParticleSet.uniform(state.posterior.sample(fresh, parameters.sample_count))


def picture_of(frame: Frame) -> NDArray[np.uint8]:
    """Return the picture (height, width, 3) of a frame.

    Raises:
        ValueError: It is a signal.
    """
    if frame.image_rgb is None:
        raise ValueError("a tracker of colour needs pictures, got a signal")
    return frame.image_rgb


def size_of(image_rgb: NDArray[np.uint8]) -> tuple[int, int]:
    """Return width and height of a picture, px."""
    height, width, _ = image_rgb.shape
    return width, height


def lineage_of(
    state: PointState, parents: ParticleSet, particles: ParticleSet | None, parameters: LoopParameters
) -> fixed_lag.Lineage | None:
    """Return the particles' pasts, extended by a frame; None if the path is not smoothed.

    Args:
        state: Of the frame before.
        parents: The particles of the frame before.
        particles: Those of this frame, if there are any.
        parameters: In force.
    """
    if parameters.smoothing_lag_frames == 0 or particles is None:
        return None
    lineage = state.lineage or fixed_lag.begin_lineage(parents, TRACKED)
    return fixed_lag.extend_lineage(lineage, particles, parameters.smoothing_lag_frames)


def measure_particles(state: PointState) -> Mapping[str, SeriesValue]:
    """Report the particles."""
    return {} if state.particles is None else reports.cloud(state.particles, resampled=state.resampled)
