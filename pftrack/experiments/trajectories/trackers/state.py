"""What is believed of all trajectories after a frame, in the same form for all methods."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from pftrack.experiments.trajectories.scene.target import Origin
from pftrack.experiments.trajectories.trackers.corners import Corners
from pftrack.filters.kalman import NormalisedInnovation
from pftrack.filters.particles import ParticleSet
from pftrack.filters.trajectories.cloud import Cloud
from pftrack.filters.trajectories.gaussian import Gaussians

__all__ = ["BLOCK", "KEPT_FRAMES", "Belief", "TrajectoriesState"]

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
    raw: NDArray[np.float64]
    filtered: NDArray[np.float64]
    smoothed: NDArray[np.float64]
    sds: NDArray[np.float64]
    densities: NDArray[np.float64]
    first: NDArray[np.float64]
    born: NDArray[np.int64]
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
    def estimate(self) -> NDArray[np.float64]:
        """(2,) filtered position of the selected track."""
        return np.asarray(self.filtered[0, self.selected])

    @property
    def sigma(self) -> NDArray[np.float64]:
        """(2,) standard deviations of the same."""
        return np.asarray(self.sds[self.selected])

    @property
    def particles(self) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
        """Positions (n, 2) of the selected track's particles, px, and their weights (n,); None without particles."""
        if self.own is not None:
            return self.own.states[:, :2], self.own.weights
        return self.belief.age(self.selected, 0) if isinstance(self.belief, Cloud) else None

    @property
    def log_evidence(self) -> float:
        """Of all tracks together."""
        return float(self.densities.sum())

    @property
    def outliers(self) -> NDArray[np.bool_]:
        """(W, K) which measurements are far from where the track is now thought to have been."""
        return _apart(self.raw, self.smoothed) > self.outlier_px

    @property
    def history(self) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
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


def _apart(one: NDArray[np.float64], other: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the distances (...) of positions (..., 2); NaN where one is not known."""
    off = one - other
    return np.asarray(np.hypot(off[..., 0], off[..., 1]))
