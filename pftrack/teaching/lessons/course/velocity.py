"""What lesson 6 computes: tracks of something that moves with a slowly changing velocity, and their Kalman filter.

One track is filtered by the library's filter. Its covariances and gains do not depend on what is measured, so they
serve any number of further tracks, whose errors show whether the filter is right about its own.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pftrack.core.arrays import Floats
from pftrack.core.numerics.matrices import cholesky
from pftrack.core.numerics.random import Gaussian, Purpose, Stream
from pftrack.filters import kalman
from pftrack.filters.dynamics import LinearDynamics

TRANSITION = np.array([[1.0, 1.0], [0.0, 1.0]])
OBSERVATION = np.array([[1.0, 0.0]])
PRIOR = Gaussian(np.zeros(2), np.diag([4.0, 1.0]))
"""What is known before the first frame: position, m, and velocity, m/s."""


@dataclass(frozen=True, slots=True)
class Tracks:
    """Tracks as they are and as they are measured, once a second.

    Attributes:
        states: (frames, 2, n) positions, m, and velocities, m/s.
        measured: (frames, n) positions, m.
    """

    states: Floats
    measured: Floats


@dataclass(frozen=True, slots=True)
class Filtered:
    """What the filter says of one track.

    Attributes:
        means: (frames, 2) positions, m, and velocities, m/s.
        covariances: (frames, 2, 2).
        predicted: (frames, 2, 2) covariances before the frame's measurement.
        innovations: (frames,) measurements less their predictions, m; NaN where there is none.
        gains: (frames, 2): what share of the innovation is added; nothing where there is no measurement.
    """

    means: Floats
    covariances: Floats
    predicted: Floats
    innovations: Floats
    gains: Floats


def motion(process: float) -> LinearDynamics:
    """Return the model of a second, given the intensity of the noise on the velocity, m^2/s^3."""
    covariance = process * np.array([[1.0 / 3.0, 1.0 / 2.0], [1.0 / 2.0, 1.0]])
    return LinearDynamics(TRANSITION, np.zeros(2), cholesky(covariance))


def simulate(process: float, noise: float, seed: int, frames: int, count: int) -> Tracks:
    """Return tracks that move and are measured as the model says, with the same draws whatever the noise.

    Args:
        process: Intensity of the noise on the velocity, m^2/s^3.
        noise: Variance of a measurement, m^2.
        seed: Of all draws.
        frames: How many.
        count: Of tracks.
    """
    dynamics = motion(process)
    draws = Stream(seed, 0, Purpose.SCENE).standard_normal((frames, 3, count))
    states = np.empty((frames, 2, count))
    states[0] = PRIOR.standard_deviations[:, None] * draws[0, :2]
    for frame in range(1, frames):
        states[frame] = TRANSITION @ states[frame - 1] + dynamics.noise @ draws[frame, :2]
    return Tracks(states, states[:, 0] + np.sqrt(noise) * draws[:, 2])


def apply_filter(process: float, noise: float, measured: Sequence[float] | Floats) -> Filtered:
    """Filter a track by the library's Kalman filter.

    Args:
        process: Intensity of the noise on the velocity, m^2/s^3.
        noise: Variance of a measurement, m^2.
        measured: (frames,) positions, m; NaN where there is no measurement.
    """
    dynamics, covariance, frames = motion(process), np.array([[noise]]), len(measured)
    known, innovations = PRIOR, np.asarray(measured, dtype=np.float64).copy()
    means, covariances, predicted = np.empty((frames, 2)), np.empty((frames, 2, 2)), np.empty((frames, 2, 2))
    gains = np.zeros((frames, 2))
    for frame in range(frames):
        expected = kalman.predict(known, dynamics) if frame else known
        known, predicted[frame] = expected, expected.covariance
        if np.isfinite(innovations[frame]):
            known, _ = kalman.update(expected, innovations[frame : frame + 1], OBSERVATION, covariance)
            innovations[frame] -= expected.mean[0]
            gains[frame] = expected.covariance[:, 0] / (expected.covariance[0, 0] + noise)
        means[frame], covariances[frame] = known.mean, known.covariance
    return Filtered(means, covariances, predicted, innovations, gains)


def errors(tracks: Tracks, gains: Floats) -> Floats:
    """Return state less estimate, (2, n), of all tracks after as many frames as there are gains (frames, 2)."""
    estimates = np.zeros(tracks.states.shape[1:])
    for frame, gain in enumerate(gains):
        if frame:
            estimates = TRANSITION @ estimates
        estimates += gain[:, None] * (tracks.measured[frame] - estimates[0])
    off: Floats = tracks.states[len(gains) - 1] - estimates
    return off
