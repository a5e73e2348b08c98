"""The methods by which trajectories are followed: how a frame is taken under each law of the noise.

No track depends on another: each is filtered by itself, and its random numbers are drawn by its own number. So a method
takes any tracks together, a track may be there several times with other seeds, and what is filtered is the same however
much of the past is kept for smoothing.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Self, TypeAlias

import numpy as np
from numpy.typing import NDArray

from pftrack.core.numerics.random import Purpose, Stream
from pftrack.experiments.trajectories.trackers.parameters import TrajectoriesTrackerParameters
from pftrack.experiments.trajectories.trackers.state import Belief
from pftrack.filters.trajectories import cloud, gaussian
from pftrack.filters.trajectories.cloud import Cloud
from pftrack.filters.trajectories.gaussian import Gaussians
from pftrack.filters.trajectories.whole import beginnings

__all__ = ["Draw", "Method", "Taken", "cloud_method", "gaussian_method", "select", "without"]

P: TypeAlias = TrajectoriesTrackerParameters

Taken: TypeAlias = tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]
"""Positions (A, K, 2) of this frame and those before it given all, the newest as it is filtered (K, 2), its standard
deviations (K, 2), and log densities (K,)."""


@dataclass(frozen=True, slots=True, eq=False)
class Draw:
    """What the random numbers of a frame are drawn by.

    Attributes:
        numbers: (K,) of the tracks.
        seeds: One for all, or (K,) one for each.
        frame: Index of the frame.
        purpose: What they are for.
    """

    numbers: NDArray[np.int64]
    seeds: int | NDArray[np.int64]
    frame: int
    purpose: Purpose

    @classmethod
    def of(cls, rng: Stream, count: int) -> Self:
        """Return what the numbers of a step are drawn by, for all of its tracks."""
        return cls(np.arange(count), rng.seed, rng.frame, rng.purpose)


Method: TypeAlias = Callable[[Belief, NDArray[np.float64], P, Draw], tuple[Belief, Taken]]


def without(belief: Belief, ended: NDArray[np.bool_]) -> Belief:
    """Believe nothing any more of some tracks (K,): each begins again with its next measurement."""
    if not ended.any():
        return belief
    return cloud.without(belief, ended) if isinstance(belief, Cloud) else gaussian.without(belief, ended)


def select(belief: Belief, tracks: NDArray[np.int64]) -> Belief:
    """Return the belief of some of the tracks, given by their numbers (M,), in that order; any may be there again."""
    return cloud.select(belief, tracks) if isinstance(belief, Cloud) else gaussian.select(belief, tracks)


def gaussian_method(belief: Belief, observed: NDArray[np.float64], parameters: P, _draw: Draw) -> tuple[Belief, Taken]:
    """Take a frame by the Kalman filter and smooth by its exact smoother."""
    if isinstance(belief, Cloud):
        means, covariances = belief.moments()
        belief = Gaussians(means[None], covariances[None], np.zeros((1, len(means))))
    count = len(observed)
    belief, densities = gaussian.step(
        belief,
        observed,
        np.full(count, float(parameters.noise_variance_px2)),
        np.full(count, float(parameters.drive_variance_px2)),
        lag=parameters.lag_frames,
        start_sd=parameters.start_spread_px,
    )
    past, _ = gaussian.smooth(belief)
    sds = np.repeat(np.sqrt(belief.covariances[0, :, :1]), 2, axis=1)
    return belief, (past, belief.means[0, :, :, 0], sds, densities)


def cloud_method(
    learned: bool, belief: Belief, observed: NDArray[np.float64], parameters: P, draw: Draw
) -> tuple[Belief, Taken]:
    """Take a frame by particles with Cauchy noise, whose scale and that of the motion are learned or not."""
    count = len(observed)
    if isinstance(belief, Gaussians):
        followed = np.isfinite(belief.means[0, :, 0, 0])
        fresh = gaussian.begin(belief.means[0], belief.covariances[0], observed, parameters.start_spread_px)
        beginning = (*fresh, followed.astype(np.int64))
        belief = cloud.nothing(count)
    else:
        beginning = beginnings(belief, observed, parameters.start_spread_px)
    belief, moments = cloud.step(
        belief,
        observed,
        cloud.Law(
            np.full(count, float(parameters.noise_variance_px2)),
            np.full(count, float(parameters.drive_variance_px2)),
            learned=learned,
            drift=float(parameters.law_drift),
        ),
        beginning,
        count=parameters.sample_count,
        lag=parameters.lag_frames,
        by_mode=parameters.point_estimate == "mode",
        numbers=draw.numbers,
        stream=(draw.seeds, draw.frame, draw.purpose.value),
    )
    return belief, (moments.past, moments.estimates, moments.sds, moments.densities)
