"""How a ball is expected to move, and how that is learned while it is tracked.

All trackers of a ball share a second-order model of its position: constant velocity in Bando 2007, with less of the
velocity kept or with a known swing on request, or what online EM has made of the path so far.
"""

from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from pftrack.core.numerics.gaussian import Gaussian
from pftrack.experiments.ball.trackers.parameters import LoopParameters
from pftrack.experiments.shared.point_state import PointState
from pftrack.filters.dynamics import LinearDynamics, autoregression
from pftrack.filters.learning import online_em

__all__ = ["TRACKED", "begin_learning", "dynamics", "learn_motion", "noise", "with_learner"]

TRACKED = 2
"""The position: the first coordinates of the state."""


@lru_cache(maxsize=64)
def noise(process_noise_px: float) -> NDArray[np.float64]:
    """Return B of the state (x_t, x_{t-1}): (4, 2), px."""
    return process_noise_px * np.eye(2 * TRACKED, TRACKED)


@lru_cache(maxsize=64)
def initial_dynamics(parameters: LoopParameters, size: tuple[int, int]) -> LinearDynamics:
    """Return x_{t+1} = x_t + retention (x_t - x_{t-1}) + noise, or the swing of the assumed period about the middle."""
    one, retention = np.eye(TRACKED), parameters.velocity_retention
    spread = parameters.process_noise_px * one
    if parameters.assumed_period_frames == 0:
        return autoregression((1 + retention) * one, -retention * one, np.zeros(TRACKED), spread)
    turn = 2 * np.cos(2 * np.pi / parameters.assumed_period_frames)
    return autoregression(turn * one, -one, (2 - turn) * np.array(size) / 2, spread)


def dynamics(state: PointState, parameters: LoopParameters, size: tuple[int, int]) -> LinearDynamics:
    """Return the model in force: what was learned, or the initial one.

    Args:
        state: Of the frame before.
        parameters: In force.
        size: Width and height of the picture, px.
    """
    if state.learner is not None:
        return online_em.dynamics(state.learner, parameters.process_noise_px * np.eye(TRACKED))
    return initial_dynamics(parameters, size)


def begin_learning(known: Gaussian, size: tuple[int, int], parameters: LoopParameters) -> online_em.Learner:
    """Begin with the initial model and the position (2,) as it is known, px."""
    initial = initial_dynamics(parameters, size)
    return online_em.begin(initial, known.mean, float(known.standard_deviations.max()), size)


def with_learner(state: PointState, size: tuple[int, int], parameters: LoopParameters) -> PointState:
    """Begin or end learning when it has been switched on or off."""
    if parameters.learn_dynamics == (state.learner is not None):
        return state
    if not parameters.learn_dynamics:
        return replace(state, learner=None)
    known = Gaussian(state.estimate, state.posterior.covariance[:TRACKED, :TRACKED])
    return replace(state, learner=begin_learning(known, size, parameters))


def learn_motion(state: PointState, parameters: LoopParameters, size: tuple[int, int]) -> PointState:
    """Return the state with what its estimate teaches, if it is to learn."""
    if state.learner is None:
        return state
    settings = online_em.Settings(
        parameters.forgetting,
        parameters.warm_up_frames,
        parameters.learning_ridge,
        parameters.largest_spectral_radius,
    )
    initial = initial_dynamics(parameters, size)
    return replace(state, learner=online_em.learn(state.learner, initial, state.estimate, state.sigma, settings))
