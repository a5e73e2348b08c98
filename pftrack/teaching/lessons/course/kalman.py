"""Lesson 6: where all is linear and Gaussian, two numbers an axis are the whole density."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from pftrack.core.arrays import Floats
from pftrack.core.model.parameters import Parameters, parameter
from pftrack.core.numerics.matrices import cholesky, solve_system
from pftrack.core.numerics.random import Gaussian, Purpose, Stream
from pftrack.filters import kalman
from pftrack.filters.dynamics import LinearDynamics
from pftrack.teaching.lessons.figure import Panel, Shown, ceiling, look
from pftrack.teaching.lessons.lesson import Answer, Computed, Demonstration, Outcome

# Computations of lesson 6: tracks of an object with a slowly changing velocity, and their Kalman filter.
#
# One track is filtered by the library's filter. Its covariances and gains do not depend on what is measured, so they
# serve any number of further tracks, whose errors show whether the filter is right about its own.


LOOK = look(__file__)
TRANSITION = np.array([[1.0, 1.0], [0.0, 1.0]])
OBSERVATION = np.array([[1.0, 0.0]])
PRIOR = Gaussian(np.zeros(2), np.diag([4.0, 1.0]))
"""Prior before the first frame: position, m, and velocity, m/s."""


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
    """The filter's results on one track.

    Attributes:
        means: (frames, 2) positions, m, and velocities, m/s.
        covariances: (frames, 2, 2).
        predicted: (frames, 2, 2) covariances before the frame's measurement.
        innovations: (frames,) measurements less their predictions, m; NaN where there is none.
        gains: (frames, 2): share of the innovation that is added; nothing without a measurement.
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
    """Return tracks of the model, with the same draws for every noise.

    Args:
        process: Intensity of the noise on the velocity, m^2/s^3.
        noise: Variance of a measurement, m^2.
        seed: Seed of all draws.
        frames: Number of frames.
        count: Number of tracks.
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
        measured: (frames,) positions, m; NaN without a measurement.
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


FRAMES, TRACKS = 60, 400
GAP = 20
"""The first frame whose measurement may be dropped."""

WITHIN = 1.0 - math.exp(-2.0)
"""Probability that lies within two standard deviations of a Gaussian in the plane."""

FOUR_SDS = 4.0
"""Tolerance of a sampled number, which one in sixteen thousand draws exceeds."""

CIRCLE: Floats = np.stack([f(np.linspace(0.0, 2.0 * np.pi, 121)) for f in (np.cos, np.sin)])


class KalmanParameters(Parameters):
    """Noises of motion and measurements, missing measurements, and the examined frame."""

    process: float = parameter(0.05, "Process noise", unit="m²/s³", within=(0.005, 0.5, 0.005))
    """Variance of the velocity change in a second."""
    noise: float = parameter(4, "Measurement noise R", unit="m²", within=(0.5, 25, 0.5))
    """Variance of the position measurement error."""
    dropped: int = parameter(
        0, "Dropped frames", f"Number of missing measurements from frame {GAP} on.", within=(0, 30, 1)
    )
    frame: int = parameter(39, "Frame", within=(0, FRAMES - 1, 1))
    """The frame whose errors are shown."""


def show(parameters: KalmanParameters, seed: int) -> Shown:
    """Show one track with its filter, and in one frame the errors of many against the filter's ellipse."""
    tracks, known = _apply_filter(parameters, seed)
    frame = parameters.frame
    off, covariance = errors(tracks, known.gains[: frame + 1]), known.covariances[frame]
    squared, variance = float(np.mean(off[0] ** 2)), float(covariance[0, 0])
    within = float(np.mean((off * solve_system(covariance, off)).sum(axis=0) <= 4.0))
    numbers = {
        "error": (squared, variance, FOUR_SDS * variance * math.sqrt(2.0 / TRACKS)),
        "within": (within, WITHIN, FOUR_SDS * math.sqrt(WITHIN * (1.0 - WITHIN) / TRACKS)),
        "gain": (float(known.gains[frame, 0]),),
    }
    panels = _track_panel(parameters, tracks, known), _plane_panel(parameters, off, known)
    return LOOK.show(panels, numbers, tracks=TRACKS)


def _apply_filter(parameters: KalmanParameters, seed: int) -> tuple[Tracks, Filtered]:
    """Return all tracks, the shown one first, and the filter's results on that one."""
    tracks = simulate(parameters.process, parameters.noise, seed, FRAMES, TRACKS)
    measured = tracks.measured[:, 0].copy()
    measured[GAP : GAP + parameters.dropped] = np.nan
    return tracks, apply_filter(parameters.process, parameters.noise, measured)


def _track_panel(parameters: KalmanParameters, tracks: Tracks, known: Filtered) -> Panel:
    times, truth, measured = np.arange(FRAMES), tracks.states[:, 0, 0], tracks.measured[:, 0]
    seen, reach = np.isfinite(known.innovations), 2.0 * np.sqrt(known.covariances[:, 0, 0])
    means = known.means[:, 0]
    drawn = np.concatenate([truth, measured, means])
    low, high, margin = float(drawn.min()), float(drawn.max()), 0.15 * float(np.ptp(drawn))
    ends = GAP - 0.5, min(GAP + parameters.dropped, FRAMES) - 0.5
    return LOOK.draw(
        "track",
        {
            **({"gap begins": ends[:1], "gap ends": ends[1:]} if parameters.dropped else {}),
            "truth": (times, truth),
            "measured": (times[seen], measured[seen]),
            "above": (times, means + reach),
            "below": (times, means - reach),
            "estimate": (times, means),
        },
        turned=parameters,
        x=(0.0, FRAMES - 1.0),
        y=(low - margin, high + margin),
        frames=FRAMES,
        first=truth[0],
        last=truth[-1],
        seen=int(seen.sum()),
        frame=parameters.frame,
    )


def _plane_panel(parameters: KalmanParameters, off: Floats, known: Filtered) -> Panel:
    frame = parameters.frame
    before = min(frame, GAP - 1)
    steady, now = (cholesky(known.covariances[at]) @ CIRCLE * 2.0 for at in (before, frame))
    reach = [ceiling(1.3 * max(float(ellipse[axis].max()) for ellipse in (steady, now))) for axis in (0, 1)]
    ellipses = {"now": tuple(now), **({"steady": tuple(steady)} if before < frame else {})}
    return LOOK.draw(
        "plane",
        {**ellipses, "errors": tuple(off), "shown": tuple(off[:, :1])},
        x=(-reach[0], reach[0]),
        y=(-reach[1], reach[1]),
        frame=frame,
        tracks=TRACKS,
        before=before,
        position=steady[0].max(),
        velocity=steady[1].max(),
    )


def _answer(parameters: KalmanParameters, seed: int) -> Answer:
    _, known = _apply_filter(parameters, seed)
    before, after = (known.covariances[at] for at in (GAP - 1, parameters.frame))
    first, last = (math.sqrt(covariance[0, 0]) for covariance in (before, after))
    words = (
        f"The standard deviation of the position grows from {first:.1f} m to {last:.1f} m, and its correlation with "
        f"the velocity from {_correlation(before):.2f} to {_correlation(after):.2f}."
    )
    return Answer("tilts", words=words)


def _correlation(covariance: Floats) -> float:
    return float(covariance[0, 1] / math.sqrt(covariance[0, 0] * covariance[1, 1]))


def riccati(process: float, noise: float) -> Floats:
    """Return the covariance (2, 2) to which predictions settle, by Riccati's equation.

    It is spanned by the eigenvectors of the equation's symplectic matrix that die out (Vaughan 1970).
    """
    dynamics, information = motion(process), OBSERVATION.T @ OBSERVATION / noise
    back = np.linalg.inv(TRANSITION)
    added = dynamics.noise_covariance
    symplectic = np.block([[TRANSITION.T + information @ back @ added, -information @ back], [-back @ added, back]])
    values, vectors = np.linalg.eig(symplectic)
    dying = vectors[:, np.abs(values) < 1.0]
    covariance: Floats = np.real(dying[2:] @ np.linalg.inv(dying[:2]))
    return covariance


def _steady_state(axis: int) -> Outcome:
    ours = apply_filter(0.05, 4.0, np.zeros(300)).predicted[-1, axis, axis]
    return Outcome(float(ours), float(riccati(0.05, 4.0)[axis, axis]), 1e-8)


def _surprises() -> Outcome:
    frames = 4000
    known = apply_filter(0.05, 4.0, simulate(0.05, 4.0, 1, frames, 1).measured[:, 0])
    squares = known.innovations**2 / (known.predicted[:, 0, 0] + 4.0)
    return Outcome(float(squares.mean()), 1.0, 4.0 * math.sqrt(2.0 / frames))


def _without_data() -> Outcome:
    one, other = (apply_filter(0.05, 4.0, simulate(0.05, 4.0, seed, FRAMES, 1).measured[:, 0]) for seed in (1, 2))
    return Outcome(float(np.abs(one.covariances - other.covariances).max()), 0.0, 0.0)


COMPUTED = Computed(
    _answer,
    {
        "settled-position": partial(_steady_state, 0),
        "settled-velocity": partial(_steady_state, 1),
        "surprises": _surprises,
        "without-data": _without_data,
    },
    Demonstration(KalmanParameters(), show, random=True),
)
