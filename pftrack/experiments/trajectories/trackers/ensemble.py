"""Ensembles of trajectories: what the estimate would be with other seeds, without all that it does not depend on.

The estimate is where the selected track is filtered. So no other track need be followed, and no past be kept for the
smoother; and what is measured in a picture is the same for all seeds. Of sixty tracks and twenty-five frames of the
past this leaves a hundredth of the work, to the same numbers.
"""

from collections.abc import Iterable, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.frame import Frame
from pftrack.core.model.parameters import revise
from pftrack.core.model.source import History
from pftrack.core.numerics.random import Purpose
from pftrack.experiments.trajectories.trackers.methods import Draw, Method, select, without
from pftrack.experiments.trajectories.trackers.observing import Observation
from pftrack.experiments.trajectories.trackers.parameters import TrajectoriesTrackerParameters
from pftrack.experiments.trajectories.trackers.state import TrajectoriesState

__all__ = ["ensemble"]

SHORTEST_LAG = 0


def ensemble(
    method: Method,
    state: TrajectoriesState,
    frames: Iterable[Frame],
    history: History[TrajectoriesTrackerParameters],
    seeds: Sequence[int],
) -> Iterator[NDArray[np.float64]]:
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
