"""What a filter in a file is told of trajectories: it follows the selected track, and the Kalman filter all others."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.frame import Frame, Measurements, Target
from pftrack.core.model.likelihood import Component, ObservationLikelihood
from pftrack.core.model.series import SeriesValue
from pftrack.core.numerics.gaussian import Gaussian
from pftrack.core.numerics.random import Generator, Purpose, Stream
from pftrack.experiments.shared import reports
from pftrack.experiments.shared.filter_interface import FilterInterface, Update
from pftrack.experiments.trajectories.trackers.inspection import cauchy
from pftrack.experiments.trajectories.trackers.methods import gaussian_method
from pftrack.experiments.trajectories.trackers.parameters import TrajectoriesTrackerParameters
from pftrack.experiments.trajectories.trackers.state import TrajectoriesState
from pftrack.experiments.trajectories.trackers.step import COMMON, measure, start, step
from pftrack.filters.particles import ParticleSet
from pftrack.filters.trajectories.gaussian import Gaussians

__all__ = ["FILTER_INTERFACE"]

COMPONENTS = (Component("x", "px"), Component("y", "px"), Component("x before", "px"), Component("y before", "px"))


def _start(target: Target, frame: Frame, parameters: TrajectoriesTrackerParameters, rng: Stream) -> TrajectoriesState:
    begun = start(gaussian_method, target, frame, parameters, rng)
    particles = ParticleSet.uniform(_drawn(begun, 0, parameters, rng))
    return replace(begun, own=particles, own_track=begun.selected)


def _prepare(state: TrajectoriesState, frame: Frame, parameters: TrajectoriesTrackerParameters) -> TrajectoriesState:
    """Take the frame for all tracks; what is known of the selected one is replaced when its particles have taken it."""
    return step(gaussian_method, state, frame, parameters, Stream(0, frame.index, Purpose.TRACK))


def _particles(state: TrajectoriesState, parameters: TrajectoriesTrackerParameters, rng: Generator) -> ParticleSet:
    """Return the particles of the frame before, drawn about what the Kalman filter believed if there are none."""
    if state.own is not None and state.own_track == state.selected:
        return state.own
    return ParticleSet.uniform(_drawn(state, 1, parameters, rng))


def _drawn(
    state: TrajectoriesState, age: int, parameters: TrajectoriesTrackerParameters, rng: Generator
) -> NDArray[np.float64]:
    """Return states (N, 4) of the selected track some frames ago, of a track that had not begun about where it is."""
    belief, track = state.belief, state.selected
    shape = parameters.sample_count, 2
    if isinstance(belief, Gaussians) and age < len(belief.means) and np.isfinite(belief.means[age, track]).all():
        mean, (own, both, before) = belief.means[age, track], belief.covariances[age, track]
        covariance = np.array([[own, both], [both, before]]) + 1e-9 * np.eye(2)
        x, y = (Gaussian(axis, covariance).sample(rng, parameters.sample_count) for axis in mean)
        return np.stack([x[:, 0], y[:, 0], x[:, 1], y[:, 1]], axis=1)
    place = state.raw[0, track] if np.isfinite(state.raw[0, track]).all() else np.array(state.paper) / 2.0
    positions = place + parameters.start_spread_px * rng.standard_normal(shape)
    return np.concatenate([positions, positions], axis=1)


def _propagate(
    state: TrajectoriesState,
    states: NDArray[np.float64],
    frame: Frame,
    parameters: TrajectoriesTrackerParameters,
    rng: Generator,
) -> NDArray[np.float64]:
    """Return the second-order motion that all methods of trajectories take for true."""
    del state, frame
    now, before = states[:, :2], states[:, 2:]
    drive = np.sqrt(parameters.drive_variance_px2)
    return np.concatenate([2.0 * now - before + drive * rng.standard_normal(now.shape), now], axis=1)


def _log_likelihood(
    state: TrajectoriesState, states: NDArray[np.float64], frame: Frame, parameters: TrajectoriesTrackerParameters
) -> NDArray[np.float64]:
    """Return the Cauchy density of the selected track's measurement, 0 where it has none."""
    del frame
    measured = state.raw[0, state.selected]
    if not np.isfinite(measured).all():
        return np.zeros(len(states))
    return cauchy(states[:, :2] - measured, float(parameters.noise_variance_px2))


def _believe(
    state: TrajectoriesState, update: Update, frame: Frame, parameters: TrajectoriesTrackerParameters
) -> TrajectoriesState:
    del frame, parameters
    track, (mean, covariance) = state.selected, update.particles.moments
    rows = {name: getattr(state, name).copy() for name in ("filtered", "smoothed", "sds", "densities")}
    rows["filtered"][0, track] = mean[:2]
    rows["smoothed"][:, track] = rows["filtered"][:, track]  # of particles without their past nothing is smoothed
    rows["sds"][track] = np.sqrt(np.diag(covariance)[:2])
    rows["densities"][track] = update.log_evidence
    return replace(state, **rows, own=update.particles, own_track=track, repeatable=update.repeatable)


def _see(state: TrajectoriesState, frame: Frame) -> Frame:
    """Return the frame with the measurement of the selected track alone, (1, 2)."""
    measured = state.raw[0, state.selected][None]
    return replace(frame, measurements=Measurements(measured, np.ones(1)))


def _measure(state: TrajectoriesState) -> Mapping[str, SeriesValue]:
    own = {} if state.own is None else reports.cloud(state.own, resampled=True)
    return {**measure(state), **own}


def _centre(state: TrajectoriesState) -> NDArray[np.float64]:
    """Return the filtered place of the selected track, in this frame and the one before, (4,)."""
    now = state.filtered[0, state.selected]
    return np.concatenate([now, state.filtered[min(1, len(state.filtered) - 1), state.selected]])


LIKELIHOOD = ObservationLikelihood(
    "measurement of the selected track",
    components=lambda _: COMPONENTS,
    prepare=_prepare,
    log_likelihood=_log_likelihood,
    centre=_centre,
)

FILTER_INTERFACE = FilterInterface(
    likelihood=LIKELIHOOD,
    observed=(
        "frame.measurements.points_px (1, 2) is the measurement of the selected track, not finite where it is missing"
    ),
    example="pftrack.experiments.trajectories.example_filter",
    reads="lng",
    start=_start,
    particles=_particles,
    propagate=_propagate,
    believe=_believe,
    series=(*COMMON, *reports.CLOUD),
    measure=_measure,
    see=_see,
)
