"""Gaussian noise: the Kalman filter of K tracks at once, and the exact smoother with a fixed lag.

The state of an axis is (p_t, p_{t-1}), and both axes of a track have the same covariance, so that a track is four means
and three numbers of a 2 x 2 matrix. The smoother goes back from the newest frame by the recursion of Rauch, Tung and
Striebel over the last frames, which are kept.

A track begins with its first measurement y as N((y, y), s^2 I) in the frame before, and then also uses y as a
measurement.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Bools, Floats, Ints, check
from pftrack.core.numerics.compiled import compiled
from pftrack.core.numerics.elementary import logarithms

LOG_2_PI = 1.8378770664093453


@dataclass(frozen=True, eq=False)
class Gaussians:
    """Belief in K tracks in the last frames, the newest first.

    Attributes:
        means: (A, K, 2, 2) px, for x and y the position in that frame and in the one before; NaN before a track begins.
        covariances: (A, K, 3) px^2, of either axis: variance, covariance and variance of these two.
        drives: (A, K) px^2, the tau^2 of the step to that frame.
    """

    means: Floats
    covariances: Floats
    drives: Floats

    def __post_init__(self) -> None:
        """Refuse arrays that do not fit together.

        Raises:
            TypeError: An argument is not an array of real numbers.
            ValueError: They are not of as many frames or tracks as one another.
        """
        if any(map(np.size, (self.means, self.covariances, self.drives))):  # there may be no tracks
            of = {"means": (self.means, "A K 2 2"), "covariances": (self.covariances, "A K 3")}
            check(missing=True, drives=(self.drives, "A K"), **of)


def nothing(count: int) -> Gaussians:
    """Return the belief in `count` tracks before their first frame."""
    return Gaussians(np.full((1, count, 2, 2), np.nan), np.full((1, count, 3), np.nan), np.zeros((1, count)))


def begin(means: Floats, covariances: Floats, observed: Floats, start_sd: float) -> tuple[Floats, Floats]:
    """Return means (K, 2, 2) and covariances (K, 3) in which tracks that are measured for the first time have begun.

    Args:
        means: (K, 2, 2) of the frame before, NaN where a track has not begun.
        covariances: (K, 3) of the same.
        observed: (K, 2) measurements, px; NaN where there is none.
        start_sd: Standard deviation of either position, px.

    Raises:
        TypeError: An argument is not an array of real numbers.
        ValueError: The arrays differ in length.
    """
    if any(map(np.size, (means, observed))):
        of = {"means": (means, "K 2 2"), "covariances": (covariances, "K 3")}
        check(missing=True, observed=(observed, "K 2"), **of)
    new = np.isnan(means[:, 0, 0]) & np.isfinite(observed).all(axis=1)
    if not new.any():
        return means, covariances
    first = np.repeat(observed[:, :, None], 2, axis=2)
    spread = np.array([1.0, 0.0, 1.0]) * start_sd**2
    return np.where(new[:, None, None], first, means), np.where(new[:, None], spread, covariances)


def step(
    before: Gaussians,
    observed: Floats,
    noise: Floats,
    drive: Floats,
    *,
    lag: int,
    start_sd: float = 1.0,
) -> tuple[Gaussians, Floats]:
    """Predict all tracks by one frame and update those that are measured.

    Args:
        before: Belief of the frame before.
        observed: (K, 2) px, NaN where a track has no measurement.
        noise: (K,) sigma^2, px^2.
        drive: (K,) tau^2, px^2.
        lag: Number of earlier frames to keep.
        start_sd: Standard deviation of a track's first positions, px.

    Returns:
        The new belief, and (K,) log p(y_t | Y_{t-1}), 0 where a measurement is missing.

    Raises:
        TypeError: An argument is not an array of real numbers.
        ValueError: An array's length differs from the number of tracks.
    """
    if len(observed):
        check(
            missing=True,
            means=(before.means, "A K 2 2"),
            observed=(observed, "K 2"),
            noise=(noise, "K"),
            drive=(drive, "K"),
        )
    means, covariances = begin(before.means[0], before.covariances[0], observed, start_sd)
    new_means, new_covariances, densities = _update(means, covariances, observed, noise, drive)
    return (
        Gaussians(
            np.concatenate([new_means[None], before.means[:lag]]),
            np.concatenate([new_covariances[None], before.covariances[:lag]]),
            np.concatenate([drive[None], before.drives[:lag]]),
        ),
        densities,
    )


def smooth(belief: Gaussians) -> tuple[Floats, Floats]:
    """Return positions (A, K, 2), px, and their variances (A, K), px^2, given everything up to the newest frame."""
    return _smooth(belief.means, belief.covariances, belief.drives)


def without(belief: Gaussians, gone: Bools) -> Gaussians:
    """Return the belief with some of the tracks (K,) as if they had not begun."""
    means = np.where(gone[:, None, None], np.nan, belief.means)
    return replace(belief, means=means, covariances=np.where(gone[:, None], np.nan, belief.covariances))


def select(belief: Gaussians, tracks: Ints) -> Gaussians:
    """Return the belief of some of the tracks, given by their numbers (M,), in that order; any may be there again."""
    return Gaussians(belief.means[:, tracks], belief.covariances[:, tracks], belief.drives[:, tracks])


@compiled
def _update(
    means: Floats,
    covariances: Floats,
    observed: Floats,
    noise: Floats,
    drive: Floats,
) -> tuple[Floats, Floats, Floats]:
    count = means.shape[0]
    new_means, new_covariances = np.empty((count, 2, 2)), np.empty((count, 3))
    squares, spreads = np.zeros(count), np.ones(count)
    for track in range(count):
        own, cross, past = covariances[track]
        first = 4.0 * own - 4.0 * cross + past + drive[track]
        second = 2.0 * own - cross
        third = own
        measured = np.isfinite(observed[track, 0]) and np.isfinite(observed[track, 1])
        spread = first + noise[track]
        for axis in range(2):
            here, there = means[track, axis]
            mean = 2.0 * here - there
            new_means[track, axis, 0] = mean
            new_means[track, axis, 1] = here
            if measured:
                innovation = observed[track, axis] - mean
                new_means[track, axis, 0] = mean + first / spread * innovation
                new_means[track, axis, 1] = here + second / spread * innovation
                squares[track] += innovation * innovation / spread
        if measured:
            spreads[track] = spread
            third -= second * second / spread
            # p r / (p + r) rather than p - p^2 / (p + r), which rounding may reduce to 0.
            first, second = first * noise[track] / spread, second * noise[track] / spread
        new_covariances[track, 0], new_covariances[track, 1], new_covariances[track, 2] = first, second, third
    logs = logarithms(spreads)
    densities = np.zeros(count)
    for track in range(count):
        if np.isfinite(observed[track, 0]) and np.isfinite(observed[track, 1]):
            densities[track] = -LOG_2_PI - logs[track] - 0.5 * squares[track]
    return new_means, new_covariances, densities


@compiled
def log_likelihoods(track: Floats, noise: Floats, drive: Floats, start_sd: float) -> Floats:
    """Return log p(Y; sigma^2, tau^2) of one track under many pairs, (n,).

    Args:
        track: (T, 2) px, NaN where nothing is measured.
        noise: (n,) sigma^2 of each pair, px^2.
        drive: (n,) tau^2, px^2.
        start_sd: Standard deviation of the track's first positions, px.

    Raises:
        ValueError: The two arrays of noises differ in length, or positions have another size.
    """
    count = noise.shape[0]
    if drive.shape[0] != count or track.shape[1] != 2:
        raise ValueError("expected a track (T, 2) and as many of sigma^2 as of tau^2, got other sizes")
    means, covariances = np.empty((count, 2, 2)), np.zeros((count, 3))
    observed, found, begun_yet = np.empty((count, 2)), np.zeros(count), False
    for frame in range(track.shape[0]):
        if not begun_yet and np.isfinite(track[frame, 0]) and np.isfinite(track[frame, 1]):
            begun_yet = True
            for axis in range(2):
                means[:, axis] = track[frame, axis]
            covariances[:, 0] = start_sd * start_sd
            covariances[:, 2] = start_sd * start_sd
        if begun_yet:
            observed[:] = track[frame]
            means, covariances, densities = _update(means, covariances, observed, noise, drive)
            found += densities
    return found


@compiled
def _smooth(means: Floats, covariances: Floats, drives: Floats) -> tuple[Floats, Floats]:
    ages, count = means.shape[0], means.shape[1]
    positions, variances = np.full((ages, count, 2), np.nan), np.full((ages, count), np.nan)
    for track in range(count):
        later = means[0, track].copy()
        own, cross, past = covariances[0, track]
        positions[0, track] = later[:, 0]
        variances[0, track] = own
        for age in range(1, ages):
            a, b, c = covariances[age, track]
            if np.isnan(a):
                break
            # Predicted from that frame to the next, and the gain P F' (F P F' + G G' tau^2)^-1.
            first, second, third = 4.0 * a - 4.0 * b + c + drives[age - 1, track], 2.0 * a - b, a
            area = first * third - second * second
            gain_00 = ((2.0 * a - b) * third - a * second) / area
            gain_01 = (a * first - (2.0 * a - b) * second) / area
            gain_10 = ((2.0 * b - c) * third - b * second) / area
            gain_11 = (b * first - (2.0 * b - c) * second) / area
            for axis in range(2):
                here, there = means[age, track, axis]
                ahead, behind = later[axis, 0] - (2.0 * here - there), later[axis, 1] - here
                later[axis, 0] = here + gain_00 * ahead + gain_01 * behind
                later[axis, 1] = there + gain_10 * ahead + gain_11 * behind
                positions[age, track, axis] = later[axis, 0]
            more, mixed, rest = own - first, cross - second, past - third
            own = a + gain_00 * (gain_00 * more + gain_01 * mixed) + gain_01 * (gain_00 * mixed + gain_01 * rest)
            cross = b + gain_10 * (gain_00 * more + gain_01 * mixed) + gain_11 * (gain_00 * mixed + gain_01 * rest)
            past = c + gain_10 * (gain_10 * more + gain_11 * mixed) + gain_11 * (gain_10 * mixed + gain_11 * rest)
            variances[age, track] = own
    return positions, variances


# The estimate of a cloud of particles is the mode of a histogram, refined by the mean about it, or the mean. The
# histogram has bins of 1 px that begin at whole numbers; the mean is taken over the particles in the 3 x 3 bins around
# the fullest. A jump of the measurement makes the distribution bimodal, whose mean is at neither place.

LOG_BIN = 0.25
"""Width of a bin of a logarithm."""

NEIGHBOURS = 1


@compiled
def locate(nodes: NDArray[np.float32], counts: NDArray[np.uint16], by_mode: bool) -> tuple[float, float]:
    """Return the estimate from nodes (n, 2), px, of `counts` (n,) particles each, in the first of the fullest bins.

    Raises:
        ValueError: The arrays differ in length, or are empty.
    """
    count = nodes.shape[0]
    if count == 0 or nodes.shape[1] != 2 or counts.shape[0] != count:
        raise ValueError("expected as many counts as nodes (n, 2), and at least one, got other sizes")
    bins = np.zeros((count, 2), np.int64)
    top_x, top_y = np.int64(0), np.int64(0)
    if by_mode:
        for n in range(count):
            bins[n, 0], bins[n, 1] = np.int64(np.floor(nodes[n, 0])), np.int64(np.floor(nodes[n, 1]))
        top_x, top_y = bins[_fullest(bins, counts)]
    whole, sum_x, sum_y = 0.0, 0.0, 0.0
    for n in range(count):
        if abs(bins[n, 0] - top_x) <= NEIGHBOURS and abs(bins[n, 1] - top_y) <= NEIGHBOURS:
            whole += counts[n]
            sum_x += counts[n] * float(nodes[n, 0])
            sum_y += counts[n] * float(nodes[n, 1])
    return sum_x / whole, sum_y / whole


@compiled
def _fullest(bins: Ints, counts: NDArray[np.uint16]) -> int:
    """Return the number of the first node that lies in the fullest bin, given each node's bin (n, 2)."""
    count, size = bins.shape[0], 16
    while size < 2 * count:
        size *= 2
    # A table of the first node of each bin, by a hash of the bin.
    slots, held = np.full(size, -1, np.int32), np.zeros(count, np.int64)
    for n in range(count):
        slot = (bins[n, 0] * 73856093 ^ bins[n, 1] * 19349663) & (size - 1)
        while slots[slot] >= 0 and (bins[slots[slot], 0] != bins[n, 0] or bins[slots[slot], 1] != bins[n, 1]):
            slot = (slot + 1) & (size - 1)
        if slots[slot] < 0:
            slots[slot] = n
        held[slots[slot]] += counts[n]
    return int(np.argmax(held))


def logs_mode(logs: Floats, weights: Floats) -> float:
    """Return the mode of logarithms (n,) with weights (n,): the mean in three bins of 0.25 around the fullest."""
    bins = np.floor(logs / LOG_BIN).astype(np.int64)
    bins -= bins.min()
    top = int(np.argmax(np.bincount(bins, weights)))
    near = np.abs(bins - top) <= NEIGHBOURS
    return float((logs[near] * weights[near]).sum() / weights[near].sum())
