"""Whole tracks at once: filtered and smoothed positions, the likelihood of the noise, and the errors.

A batch may hold one track many times, with different random numbers or noise. So 101 runs, or the 400 pairs of sigma^2
and tau^2 of a grid, cost one pass over the frames.
"""

from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from pftrack.core.arrays import Floats, Ints, check
from pftrack.core.numerics.random import Purpose
from pftrack.filters.trajectories import cloud, gaussian

Method: TypeAlias = Literal["lg", "lng", "nlng", "mcf-gaussian"]
"""Linear Gaussian, linear with Cauchy noise, self-organising with Cauchy noise; and, to check the particles by the
Kalman filter, particles with Gaussian noise."""

GRID: Floats = np.arange(1.0, 21.0)
"""The values of sigma^2 and of tau^2, px^2, that Ichimura and Ikoma look through."""


@dataclass(frozen=True, slots=True)
class Settings:
    """How tracks are followed.

    Attributes:
        noise: sigma^2, px^2.
        drive: tau^2, px^2.
        lag: Frames after a frame that its smoothed position takes into account.
        count: Number of particles of each track.
        by_mode: Whether estimates are modes of histograms; otherwise they are means.
        start_sd: Standard deviation of a track's first positions, px.
        drift: Standard deviation of the steps of learned logarithms per frame.
        seed: Random seed.
    """

    noise: float = 3.0
    drive: float = 1.0
    lag: int = 25
    count: int = 2000
    by_mode: bool = True
    start_sd: float = 1.0
    drift: float = 0.0
    seed: int = 0


@dataclass(frozen=True, eq=False)
class Smoothed:
    """Results for K tracks of T frames.

    Attributes:
        filtered: (T, K, 2) px, given the frames up to each.
        smoothed: (T, K, 2) px, given the next `lag` frames, or all frames up to the end.
        log_likelihoods: (K,) sum of log p(y_t | Y_{t-1}).
        last: Belief after the last frame.
    """

    filtered: Floats
    smoothed: Floats
    log_likelihoods: Floats
    last: cloud.Cloud | gaussian.Gaussians


def follow(
    method: Method,
    tracks: Floats,
    settings: Settings,
    *,
    noise: Floats | None = None,
    drive: Floats | None = None,
    numbers: Ints | None = None,
) -> Smoothed:
    """Filter and smooth tracks.

    Args:
        method: Which filter.
        tracks: (T, K, 2) px, NaN where a track has no measurement.
        settings: Settings of all tracks.
        noise: (K,) sigma^2 of each, if they differ.
        drive: (K,) tau^2 of each, if they differ.
        numbers: (K,) index of each track's random numbers; by default its place in the batch.

    Raises:
        TypeError: The tracks are not an array of real numbers.
        ValueError: They have another shape.
    """
    check(missing=True, tracks=(tracks, "frames tracks 2"))
    length, count, _ = tracks.shape
    noises = np.full(count, float(settings.noise)) if noise is None else noise
    drives = np.full(count, float(settings.drive)) if drive is None else drive
    filtered, smoothed = np.full(tracks.shape, np.nan), np.full(tracks.shape, np.nan)
    totals = np.zeros(count)
    belief: cloud.Cloud | gaussian.Gaussians = gaussian.nothing(count) if method == "lg" else cloud.nothing(count)
    law = cloud.Law(noises, drives, method != "mcf-gaussian", method == "nlng", settings.drift)
    names = np.arange(count) if numbers is None else numbers
    for frame in range(length):
        if isinstance(belief, gaussian.Gaussians):
            belief, densities = gaussian.step(
                belief, tracks[frame], noises, drives, lag=settings.lag, start_sd=settings.start_sd
            )
            filtered[frame] = belief.means[0, :, :, 0]
            past = gaussian.smooth(belief)[0]
        else:
            belief, moments = cloud.step(
                belief,
                tracks[frame],
                law,
                beginnings(belief, tracks[frame], settings.start_sd),
                count=settings.count,
                lag=settings.lag,
                by_mode=settings.by_mode,
                numbers=names,
                stream=(settings.seed, frame, Purpose.TRACK.value),
            )
            filtered[frame], past, densities = moments.estimates, moments.past, moments.densities
        totals += densities
        # The oldest positions have their whole lag now; the others are written over until they have.
        reach = min(settings.lag, frame) + 1
        smoothed[frame + 1 - reach : frame + 1] = past[:reach][::-1]
    return Smoothed(filtered, smoothed, totals, belief)


def beginnings(belief: cloud.Cloud, observed: Floats, start_sd: float) -> tuple[Floats, Floats, Ints]:
    """Return how tracks begin that are measured for the first time, as `cloud.step` takes it."""
    count = len(observed)
    nobody = np.full((count, 2, 2), np.nan), np.full((count, 3), np.nan)
    waiting = belief.offsets[:, 0] == belief.offsets[:, -1]
    means, covariances = gaussian.begin(*nobody, np.where(waiting[:, None], observed, np.nan), start_sd)
    return means, covariances, np.zeros(count, np.int64)


def likelihood_surface(method: Method, track: Floats, settings: Settings, grid: Floats = GRID) -> Floats:
    """Return log p(Y; sigma^2, tau^2) of a track (T, 2) over a grid (n, n), sigma^2 along the first axis.

    All pairs use the same random numbers, so the surface is smooth.

    Raises:
        TypeError: The track or the grid is not an array of real numbers.
        ValueError: An array has another shape, or the grid is not finite.
    """
    check(grid=(grid, "n"))
    check(missing=True, track=(track, "T 2"))
    noise, drive = (values.ravel() for values in np.meshgrid(grid, grid, indexing="ij"))
    if method == "lg":
        found = gaussian.log_likelihoods(np.ascontiguousarray(track), noise, drive, settings.start_sd)
    else:
        tracks = np.repeat(track[:, None], len(noise), axis=1)
        alike = np.zeros(len(noise), np.int64)
        found = follow(method, tracks, settings, noise=noise, drive=drive, numbers=alike).log_likelihoods
    return found.reshape(len(grid), len(grid))


def track_error(positions: Floats, truth: Floats) -> Floats:
    """Return E = sqrt(sum_t |e_t|^2) / T of positions (T, ..., 2), px.

    Ichimura and Ikoma call their figures mean squared errors; only by this reading do they agree with each other.
    """
    return np.asarray(np.sqrt(np.square(positions - truth).sum(axis=-1).sum(axis=0)) / len(positions))
