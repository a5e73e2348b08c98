"""What all trackers of a ball have in common: how they begin, and what they carry from frame to frame."""

import numpy as np

from pftrack.core.model.frame import Frame, Target
from pftrack.core.numerics.gaussian import Gaussian
from pftrack.core.numerics.random import Generator
from pftrack.experiments.ball.trackers.motion import TRACKED, begin_learning
from pftrack.experiments.ball.trackers.parameters import LoopParameters
from pftrack.experiments.shared.point_state import PointState
from pftrack.experiments.shared.sampling.common import picture_of, size_of
from pftrack.filters import fixed_lag
from pftrack.filters.particles import ParticleSet

__all__ = ["lineage_of", "start"]


def start(target: Target, frame: Frame, parameters: LoopParameters, rng: Generator) -> PointState:
    """Begin at a known position: all particles around it, at rest; the estimate is the position itself."""
    deviations = parameters.initial_sd_px * rng.standard_normal((TRACKED, parameters.sample_count)).T
    positions = target.position + deviations
    particles = ParticleSet.uniform(np.hstack([positions, positions]))
    known = Gaussian(target.position, parameters.initial_sd_px**2 * np.eye(TRACKED))
    learner = begin_learning(known, size_of(picture_of(frame)), parameters) if parameters.learn_dynamics else None
    return PointState(fixed_lag.augment(known, 1), TRACKED, particles, learner=learner)


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
