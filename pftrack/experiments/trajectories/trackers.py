"""Parameters, beliefs and methods of the trackers of trajectories: how a frame is taken under each law of the noise.

No track depends on another: each is filtered by itself, and its random numbers are drawn by its own number. So a method
takes any tracks together, a track may be there several times with other seeds, and what is filtered is the same however
much of the past is kept for smoothing. All methods hold what they believe in the same form.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal, Self, TypeAlias

import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Bools, Floats, Ints
from pftrack.core.model.parameters import Parameters, parameter
from pftrack.core.numerics.random import Purpose, Stream
from pftrack.experiments.trajectories.corners import Corners
from pftrack.experiments.trajectories.scene import Origin, SelectionParameters
from pftrack.filters.kalman import NormalisedInnovation
from pftrack.filters.particles import ParticleSet
from pftrack.filters.trajectories import cloud, gaussian
from pftrack.filters.trajectories.cloud import MOST_PARTICLES, Cloud
from pftrack.filters.trajectories.gaussian import Gaussians
from pftrack.filters.trajectories.whole import beginnings

MODEL, PARTICLES, SCORING = "Model", "Particles", "Scoring"
CLOUDS = ("lng", "nlng")

LONGEST_LAG = 50


class _Model(Parameters, group=MODEL):
    """How points move and are measured."""

    # fmt: off
    noise_variance_px2: float = parameter(
        3, "Measurement noise σ²", "Square of the scale of a measurement's noise; NLNG begins there and finds its own.",
        unit="px²", within=(0.01, 100, 0.5), useful=(0.1, 30), role="noise")
    drive_variance_px2: float = parameter(
        1, "Freedom of motion τ²", "Variance of the change of velocity in a frame; small is smooth. NLNG begins there.",
        unit="px²", within=(0.0001, 100, 0.1), useful=(0.01, 10), role="noise")
    lag_frames: int = parameter(
        25, "Smoothing lag", "How many later frames a smoothed position takes into account.",
        unit="frames", within=(0, LONGEST_LAG, 1), role="smoothing")
    start_spread_px: float = parameter(
        1, "Initial spread", "Standard deviation of the two positions with which a track begins.",
        unit="px", within=(0.1, 50, 0.5), useful=(0.5, 10), live=False)
    # fmt: on


class _Particles(Parameters, group=PARTICLES, trackers=CLOUDS):
    """Particles, and how noises drift."""

    # fmt: off
    sample_count: int = parameter(
        2000, "Particles", "Number of particles of each track.",
        within=(10, MOST_PARTICLES, 10), role="particles", sets=50)
    point_estimate: Literal["mode", "mean"] = parameter(
        "mode", "Estimate", "The fullest place of a histogram in bins of 1 px, or the mean of the particles.")
    law_drift: float = parameter(
        0, "Drift of σ² and τ²", "What their logarithms may change by in a frame; without, they settle once for all.",
        within=(0, 0.5, 0.01), trackers=("nlng",))
    # fmt: on


class _Scoring(Parameters, group=SCORING):
    """When a measurement is an outlier, and a point lost."""

    # fmt: off
    outlier_px: float = parameter(
        5, "Outlier from", "A measurement further from the estimate than this counts as an outlier.",
        unit="px", within=(0.5, 100, 0.5), useful=(0.5, 20))
    lost_px: float = parameter(
        10, "Lost from", "A track further from its true position than this counts as lost.",
        unit="px", within=(0.5, 200, 0.5), useful=(0.5, 40))
    lost_frames_share: float = parameter(
        0.02, "Frames that may be lost", "A run is a success if the selected track is lost in no more of its frames.",
        within=(0, 1, 0.01), role="loss_share")
    # fmt: on


class TrajectoriesTrackerParameters(_Scoring, _Particles, _Model, SelectionParameters):
    """Everything that trackers of trajectories read."""


Belief: TypeAlias = Gaussians | Cloud

KEPT_FRAMES = 64
"""How much of each trajectory is at hand at least, for smoothing and to be drawn."""

BLOCK = 32
"""So many frames at once are put away, into an array that all later states share."""


@dataclass(frozen=True, eq=False)
class TrajectoriesState:
    """The belief after a frame, immutable; the estimate is the position of the selected track.

    Attributes:
        belief: The method's own.
        raw: (W, K, 2) measurements of this frame and those before, the newest first, px; NaN where there is none.
        filtered: (W, K, 2) positions given the frames up to each, px.
        smoothed: (W, K, 2) positions given up to the lag's number of frames more, px.
        sds: (K, 2) standard deviations of the newest positions, px.
        densities: (K,) log p(y_t | Y_{t-1}) of this frame.
        first: (K, 2) first measurement of each track, px; NaN before it.
        born: (K,) frame of that.
        selected: Number of the track that is looked at.
        reach: How many frames ago the oldest position is that this frame has smoothed.
        outlier_px: Distance from the estimate from which on a measurement counts as an outlier.
        paper: Width and height of what is drawn on where there are no pictures, px.
        settled: Measured, filtered and smoothed positions (32, K, 3, 2) of the frames before, the oldest first, px.
        origin: What the tracks were in a file; None for others.
        corners: Where the measurements come from, if they are looked for in pictures.
        own: Particles of the selected track, by a filter from a file; None for others.
        own_track: Which track these are of.
        earlier: Where the selected track's particles were in the frame before, (n, 2) px, each once; None without.
        innovation: How far off the selected track's measurement was, of the Kalman filter that had one.
        repeatable: Whether every step of a filter from a file came to the same when it was computed again.
    """

    belief: Belief
    raw: Floats
    filtered: Floats
    smoothed: Floats
    sds: Floats
    densities: Floats
    first: Floats
    born: Ints
    selected: int
    reach: int
    outlier_px: float
    paper: tuple[int, int]
    settled: tuple[NDArray[np.float32], ...] = ()
    origin: Origin | None = None
    corners: Corners | None = None
    own: ParticleSet | None = None
    own_track: int = -1
    earlier: NDArray[np.float32] | None = None
    innovation: NormalisedInnovation | None = None
    repeatable: bool = True

    @property
    def estimate(self) -> Floats:
        """(2,) filtered position of the selected track."""
        return np.asarray(self.filtered[0, self.selected])

    @property
    def sigma(self) -> Floats:
        """(2,) standard deviations of the same."""
        return np.asarray(self.sds[self.selected])

    @property
    def particles(self) -> tuple[Floats, Floats] | None:
        """Positions (n, 2) of the selected track's particles, px, and their weights (n,); None without particles."""
        if self.own is not None:
            return self.own.states[:, :2], self.own.weights
        return self.belief.age(self.selected, 0) if isinstance(self.belief, Cloud) else None

    @property
    def log_evidence(self) -> float:
        """Of all tracks together."""
        return float(self.densities.sum())

    @property
    def outliers(self) -> Bools:
        """(W, K) which measurements are far from where the track is now thought to have been."""
        return _apart(self.raw, self.smoothed) > self.outlier_px

    @property
    def history(self) -> tuple[Floats, Bools]:
        """Measured, filtered and smoothed positions of all frames (T, K, 3, 2), px, and which are outliers (T, K)."""
        window = np.stack([self.raw, self.filtered, self.smoothed], axis=2)[::-1]
        rows = np.concatenate([*self.settled, window])
        # What was put away before another corner took a place is not that one's past.
        rows[np.arange(len(rows))[:, None] < self.born] = np.nan
        return rows, _apart(rows[:, :, 0], rows[:, :, 2]) > self.outlier_px

    @property
    def nbytes(self) -> int:
        """About how much memory it takes, bytes."""
        arrays = self.raw.nbytes + self.filtered.nbytes + self.smoothed.nbytes + 4096
        return self.belief.nbytes + arrays + (0 if self.corners is None else self.corners.nbytes)

    def arrays(self) -> Mapping[str, NDArray[Any]]:
        """Return the positions, and the particles of the selected track where there are some, for a file."""
        arrays = {"filtered": self.filtered[0], "smoothed": self.smoothed, "raw": self.raw[0]}
        if self.particles is None:
            return arrays
        states, weights = self.particles
        return {**arrays, "states": states, "weights": weights}


def _apart(one: Floats, other: Floats) -> Floats:
    """Return the distances (...) of positions (..., 2); NaN where one is not known."""
    off = one - other
    return np.asarray(np.hypot(off[..., 0], off[..., 1]))


P: TypeAlias = TrajectoriesTrackerParameters

Taken: TypeAlias = tuple[Floats, Floats, Floats, Floats]
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

    numbers: Ints
    seeds: int | Ints
    frame: int
    purpose: Purpose

    @classmethod
    def of(cls, rng: Stream, count: int) -> Self:
        """Return what the numbers of a step are drawn by, for all of its tracks."""
        return cls(np.arange(count), rng.seed, rng.frame, rng.purpose)


Method: TypeAlias = Callable[[Belief, Floats, P, Draw], tuple[Belief, Taken]]


def without(belief: Belief, ended: Bools) -> Belief:
    """Believe nothing any more of some tracks (K,): each begins again with its next measurement."""
    if not ended.any():
        return belief
    return cloud.without(belief, ended) if isinstance(belief, Cloud) else gaussian.without(belief, ended)


def select(belief: Belief, tracks: Ints) -> Belief:
    """Return the belief of some of the tracks, given by their numbers (M,), in that order; any may be there again."""
    return cloud.select(belief, tracks) if isinstance(belief, Cloud) else gaussian.select(belief, tracks)


def gaussian_method(belief: Belief, observed: Floats, parameters: P, _draw: Draw) -> tuple[Belief, Taken]:
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


def cloud_method(learned: bool, belief: Belief, observed: Floats, parameters: P, draw: Draw) -> tuple[Belief, Taken]:
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
