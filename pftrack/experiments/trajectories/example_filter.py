"""Bootstrap filter of mine.

It follows the selected track. Every function may be left out; pftrack's own then takes its place. Each gets those of
its arguments that it names. Save this file while a session runs: it goes on with the new code from the frame where it
stands.
"""

from dataclasses import dataclass

import numpy as np

EXPERIMENT = "trajectories"  # whose target it follows


@dataclass
class Parameters:
    """Sliders; those with the name of one of the trajectories' parameters, such as sample_count, are these."""

    drive_px: float = 1.0  # how much the velocity changes in a frame, as a standard deviation
    noise_px: float = 1.0  # scale of the noise of measurements
    outliers: float = 0.1  # share of the measurements that may be anywhere


def propagate(states, parameters, rng):
    """Move states (N, 4), whose columns are x, y, x before and y before, px; return the new ones."""
    now, before = states[:, :2], states[:, 2:]
    return np.hstack([2 * now - before + parameters.drive_px * rng.standard_normal(now.shape), now])


def log_likelihood(states, frame, parameters):
    """Return log p(measurement | state), (N,), up to a constant: Gaussian, but it may be an outlier as well."""
    measured = frame.measurements.points_px[0]  # x and y, px; not finite where the track was not found
    if not np.isfinite(measured).all():
        return np.zeros(len(states))
    off = np.sum((states[:, :2] - measured) ** 2, axis=1) / parameters.noise_px**2
    return np.log((1 - parameters.outliers) * np.exp(-0.5 * off) + parameters.outliers * 1e-4)


def resample(log_weights, count, rng):
    """Return the places (count,) of the parents, particle n on average count times its weight."""
    reached = np.cumsum(np.exp(log_weights))
    return np.searchsorted(reached / reached[-1], (rng.random() + np.arange(count)) / count)
