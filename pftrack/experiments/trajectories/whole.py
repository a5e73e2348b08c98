"""Ensembles of trajectories: what the estimate would be with other seeds, without all that it does not depend on.

The estimate is where the selected track is filtered. So no other track need be followed, and no past be kept for the
smoother; and what is measured in a picture is the same for all seeds. Of sixty tracks and twenty-five frames of the
past this leaves a hundredth of the work, to the same numbers.
"""

import math
from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from pftrack.core.arrays import Bools, Floats
from pftrack.core.model.model import LinearChain, LinearStep
from pftrack.core.model.parameters import revise
from pftrack.core.model.source import Frame, History
from pftrack.core.numerics.random import Purpose
from pftrack.experiments.trajectories.inspection import Observation
from pftrack.experiments.trajectories.trackers import (
    Draw,
    Method,
    TrajectoriesState,
    TrajectoriesTrackerParameters,
    select,
    without,
)
from pftrack.filters.dynamics import LinearDynamics

SHORTEST_LAG = 0


def ensemble(
    method: Method,
    state: TrajectoriesState,
    frames: Iterable[Frame],
    history: History[TrajectoriesTrackerParameters],
    seeds: Sequence[int],
) -> Iterator[Floats]:
    """Yield the estimates (N, 2) of each frame after a state, px, with each of N seeds.

    Args:
        method: That of the tracker.
        state: Of the frame before the first.
        frames: To come, one after the other.
        history: The parameters of all frames.
        seeds: (N,) of the random numbers of each run.
    """
    count = state.raw.shape[1]
    tracks = np.unique([parameters.selected_track % max(count, 1) for _, parameters in history.segments])
    # Track by track all seeds.
    numbers, several = np.repeat(tracks, len(seeds)), np.tile(np.asarray(seeds, np.int64), len(tracks))
    belief, corners, places = select(state.belief, numbers), state.corners, numbers
    if corners is not None and not any(getattr(each, "new_corners", False) for _, each in history.segments):
        # No corner takes the place of another, so what becomes of the others does not matter either.
        corners, places = corners.select(tracks), np.repeat(np.arange(len(tracks)), len(seeds))
    short = History(tuple((first, revise(each, {"lag_frames": SHORTEST_LAG})) for first, each in history.segments))
    for frame in frames:
        parameters = short.at(frame.index)
        seen = Observation.following(corners, frame, parameters)
        corners = seen.corners
        belief = without(belief, (seen.again | seen.gone)[places])
        draw = Draw(numbers, several, frame.index, Purpose.TRACK)
        belief, (_, filtered, _, _) = method(belief, seen.points[places], parameters, draw)
        selected = np.flatnonzero(tracks == parameters.selected_track % count)[0]
        yield filtered[selected * len(seeds) :][: len(seeds)]


# A track begins with its first measurement y as N((y, y), s^2 I), of the frame before, so its chain begins there. Where
# a corner has given its place to another one, a chain ends and a further one begins.

TRANSITION = np.array([[2.0, -1.0], [1.0, 0.0]])
"""Of an axis' (p_t, p_{t-1}): the velocity stays."""


def chains_of(
    state: TrajectoriesState, frames: Sequence[Frame], parameters: TrajectoriesTrackerParameters
) -> tuple[LinearChain, ...]:
    """Return the linear model of all tracks over some frames; see `Model.chains`."""
    points, broken = _observe(state, frames, parameters)
    return tuple(
        _chain(column, parameters)
        for track in range(points.shape[1])
        for piece in np.split(points[:, track], np.flatnonzero(broken[:, track]))
        for column in _begin(piece)
    )


def _observe(
    state: TrajectoriesState, frames: Sequence[Frame], parameters: TrajectoriesTrackerParameters
) -> tuple[Floats, Bools]:
    """Return what was measured (T, K, 2), px, and in which frames a track was forgotten before it (T, K)."""
    corners = state.corners
    observed, broken = [state.raw[0]], [np.zeros(len(state.raw[0]), dtype=bool)]
    for frame in frames[1:]:
        seen = Observation.following(corners, frame, parameters)
        corners = seen.corners
        observed.append(seen.points)
        broken.append(seen.gone | seen.again)
    return np.stack(observed), np.stack(broken)


def _begin(piece: Floats) -> Iterator[Floats]:
    """Yield either axis of a track's measurements (T, 2) from the first one on; nothing of one without any."""
    measured = np.flatnonzero(np.isfinite(piece).all(axis=1))
    if len(measured):
        yield from piece[measured[0] :].T


def _chain(measured: Floats, parameters: TrajectoriesTrackerParameters) -> LinearChain:
    noise = np.array([[math.sqrt(parameters.drive_variance_px2)], [0.0]])
    motion, observation = LinearDynamics(TRANSITION, np.zeros(2), noise), np.array([[1.0, 0.0]])
    covariance = np.array([[float(parameters.noise_variance_px2)]])
    steps = [LinearStep(motion, value, observation, covariance) for value in measured[:, None]]
    return LinearChain.of(np.full(2, measured[0]), float(parameters.start_spread_px) ** 2 * np.eye(2), steps)
