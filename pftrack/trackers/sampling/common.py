"""What all trackers of pictures by particles need of a frame, and of a state that another method has left."""

import numpy as np
from numpy.typing import NDArray

from pftrack.model.frame import Frame
from pftrack.numerics.random import Purpose, Stream
from pftrack.particles import ParticleSet
from pftrack.trackers.point_state import PointState
from pftrack.trackers.sampling.parameters import SamplingParameters

__all__ = ["particles_of", "picture_of", "size_of"]


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
