"""Trajectories under Gaussian noise as a linear model: a chain for each axis of each track.

A track begins with its first measurement y as N((y, y), s^2 I), of the frame before, so its chain begins there. Where a
corner has given its place to another one, a chain ends and a further one begins.
"""

import math
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.frame import Frame
from pftrack.core.model.linear import LinearChain, LinearModel, NoiseScale
from pftrack.experiments.trajectories.trackers.observing import Observation
from pftrack.experiments.trajectories.trackers.parameters import TrajectoriesTrackerParameters
from pftrack.experiments.trajectories.trackers.state import TrajectoriesState

__all__ = ["LINEAR_MODEL"]

TRANSITION = np.array([[2.0, -1.0], [1.0, 0.0]])
"""Of an axis' (p_t, p_{t-1}): the velocity stays."""


def _chains(
    state: TrajectoriesState, frames: Sequence[Frame], parameters: TrajectoriesTrackerParameters
) -> tuple[LinearChain, ...]:
    points, broken = _observe(state, frames, parameters)
    return tuple(
        _chain(column, parameters)
        for track in range(points.shape[1])
        for piece in np.split(points[:, track], np.flatnonzero(broken[:, track]))
        for column in _begin(piece)
    )


def _observe(
    state: TrajectoriesState, frames: Sequence[Frame], parameters: TrajectoriesTrackerParameters
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Return what was measured (T, K, 2), px, and in which frames a track was forgotten before it (T, K)."""
    corners = state.corners
    observed, broken = [state.raw[0]], [np.zeros(len(state.raw[0]), dtype=bool)]
    for frame in frames[1:]:
        seen = Observation.following(corners, frame, parameters)
        corners = seen.corners
        observed.append(seen.points)
        broken.append(seen.gone | seen.again)
    return np.stack(observed), np.stack(broken)


def _begin(piece: NDArray[np.float64]) -> Iterator[NDArray[np.float64]]:
    """Yield either axis of a track's measurements (T, 2) from the first one on; nothing of one without any."""
    measured = np.flatnonzero(np.isfinite(piece).all(axis=1))
    if len(measured):
        yield from piece[measured[0] :].T


def _chain(measured: NDArray[np.float64], parameters: TrajectoriesTrackerParameters) -> LinearChain:
    return LinearChain.steady(
        np.full(2, measured[0]),
        float(parameters.start_spread_px) ** 2 * np.eye(2),
        TRANSITION,
        np.zeros(2),
        np.array([[math.sqrt(parameters.drive_variance_px2)], [0.0]]),
        np.ascontiguousarray(measured)[:, None],
        np.array([[1.0, 0.0]]),
        np.array([[float(parameters.noise_variance_px2)]]),
    )


LINEAR_MODEL = LinearModel(
    {
        "drive_variance_px2": NoiseScale("process", is_variance=True),
        "noise_variance_px2": NoiseScale("observation", is_variance=True),
    },
    _chains,
)
"""Of the tracker with Gaussian noise."""
