"""What all trackers of pictures by particles need of a frame, and of a state that another method has left."""

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.cloud import Cloud
from pftrack.core.model.frame import Frame
from pftrack.core.numerics.random import Purpose, Stream
from pftrack.experiments.shared.point_state import PointState
from pftrack.experiments.shared.sampling.parameters import SamplingParameters
from pftrack.filters.particles import ParticleSet

__all__ = ["centre_of", "cloud_of", "crop", "particles_of", "picture_of", "size_of"]


def particles_of(state: PointState, parameters: SamplingParameters, rng: Stream) -> ParticleSet:
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


def centre_of(state: PointState) -> NDArray[np.float64]:
    """Return the posterior mean (d,) of all that a state is."""
    return state.posterior.mean


def cloud_of(samplers: tuple[str, ...], state: PointState) -> Cloud | None:
    """Return the particles of a state, laid open; None without.

    Args:
        samplers: Names of what draws by prediction and what by observation; empty where there is no choice.
        state: Any whose particles by prediction come first.
    """
    particles = state.particles
    if particles is None:
        return None
    predicted = len(particles) - state.observation_count
    counts = (predicted, state.observation_count) if samplers else ()
    return Cloud(particles.states, particles.log_weights, particles.ancestors, counts, samplers, state.resampled)


def crop(image_rgb: NDArray[np.uint8], middle: NDArray[np.float64], reach: tuple[int, int]) -> NDArray[np.uint8]:
    """Return the part of a picture within a reach of a place, clipped to it; empty if that is outside.

    Args:
        image_rgb: (height, width, 3).
        middle: (2,) px; it is rounded to a pixel.
        reach: Columns and rows to either side.
    """
    height, width, _ = image_rgb.shape
    if not np.isfinite(middle).all() or np.abs(middle).max() > 2 * (height + width):
        return image_rgb[:0, :0]
    column, row = (int(np.floor(value + 0.5)) for value in middle)
    (across, down) = reach
    left, right = max(column - across, 0), max(column + across + 1, 0)
    top, bottom = max(row - down, 0), max(row + down + 1, 0)
    return image_rgb[top:bottom, left:right].copy()
