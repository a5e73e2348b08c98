"""Adapters: what the filters of other libraries hold, said to a recorder. They import none of these libraries.

| library | in its loop |
|---|---|
| particles | `SMC(..., collect=[ParticlesCollector(rec)])` |
| FilterPy | `record_filterpy(rec, t, kalman_filter)` after `update` |
| Stone Soup | `record_stone_soup(rec, t, state)`, or a track, or a set of tracks, after each update |
| pfilter | `record_pfilter(rec, t, particle_filter)` after `update` |
"""

from collections.abc import Iterable
from typing import Any

import numpy as np

from pftrack.core.numerics.elementary import logarithm
from pftrack.sources.beliefs.recorder import Recorder

__all__ = ["ParticlesCollector", "record_filterpy", "record_pfilter", "record_stone_soup"]


class ParticlesCollector:
    """A collector for `particles.SMC`: it says particles, log-weights and ancestors of every step."""

    summary_name = "recorded"

    def __init__(self, recorder: Recorder) -> None:
        self.recorder = recorder
        self.summary: list[int] = []

    def __call__(self) -> "ParticlesCollector":
        """Return itself: the library makes a copy of each collector, and there is one file."""
        return self

    def collect(self, smc: Any) -> None:  # noqa: ANN401 - of a library that need not be there
        """Say what the filter holds after a step."""
        # Its time is that of the step that comes next, except in the first.
        t = len(self.summary)
        self.recorder(t, particles=smc.X, log_weights=smc.wgts.lw, ancestors=smc.A)
        self.summary.append(t)


def record_filterpy(recorder: Recorder, t: int, kalman: Any, *, target: int = 0) -> None:  # noqa: ANN401
    """Say the state of a filter of FilterPy with a mean `x` and a covariance `P`: Kalman, extended, unscented, ..."""
    recorder(t, mean=np.ravel(kalman.x), covariance=kalman.P, target=target)


def record_pfilter(recorder: Recorder, t: int, tracker: Any, *, target: int = 0) -> None:  # noqa: ANN401
    """Say the particles of a `pfilter.ParticleFilter` as they were before it resampled them."""
    weights = logarithm(np.asarray(tracker.original_weights, float))
    recorder(t, particles=tracker.original_particles, log_weights=weights, target=target)


def record_stone_soup(recorder: Recorder, t: int, said: Any, *, target: int = 0) -> None:  # noqa: ANN401
    """Say a state of Stone Soup, with particles or a Gaussian; or the newest state of a track, or of each of several.

    Tracks have names instead of numbers; they are numbered as they come.
    """
    if isinstance(said, Iterable) and not hasattr(said, "state_vector"):
        for track in said:
            numbers = recorder.numbers
            record_stone_soup(recorder, t, track, target=numbers.setdefault(str(track.id), len(numbers) + 1))
        return
    state = getattr(said, "state", said)
    if hasattr(state, "log_weight"):
        weights = np.asarray(state.log_weight, float).ravel()
        recorder(t, particles=np.asarray(state.state_vector, float).T, log_weights=weights, target=target)
    else:
        covariance = np.asarray(state.covar, float)
        recorder(t, mean=np.asarray(state.mean, float).ravel(), covariance=covariance, target=target)
