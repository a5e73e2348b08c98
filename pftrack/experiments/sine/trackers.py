"""Trackers of a one-dimensional signal: Bando 2007, ch. 2.

Both use the second-order model X_t = (x_t, x_{t-1}), X_t = [[2, -1], [1, 0]] X_{t-1} + (b u, 0), z_t = x_t + noise. In
D dimensions the state is D copies: all newest values first, then all previous ones. The particle filter carries the
exact Kalman answer beside its own, since for this model it is known. A sample that is not finite is a missing one.
"""

import math
from collections.abc import Mapping, Sequence
from functools import lru_cache, partial
from typing import Any

import numpy as np

from pftrack.core.arrays import Floats
from pftrack.core.model.likelihood import Component, ObservationLikelihood, Part, Residual
from pftrack.core.model.parameters import Parameters, parameter
from pftrack.core.model.series import Series, SeriesValue
from pftrack.core.model.source import Frame, Target
from pftrack.core.model.tracker import LinearChain, LinearModel, NoiseScale, Tracker
from pftrack.core.numerics.random import Gaussian, Generator
from pftrack.experiments.shared import reports
from pftrack.experiments.shared.beliefs import NIS, FilterInterface, Update, innovation_parts, measure_innovation
from pftrack.experiments.shared.reports import PointState, particle_count, resampling_threshold
from pftrack.experiments.shared.sampling.samplers import centre_of, cloud_of
from pftrack.filters import bootstrap, kalman
from pftrack.filters.dynamics import LinearDynamics, autoregression
from pftrack.filters.particles import ParticleSet
from pftrack.filters.resampling import systematic

GROUP = "Filter"

EXACT = Series("exact", "exact mean", shape="vector")
"""Mean of the exact posterior, which for this model is known beside the approximate one."""


class SignalTrackerParameters(Parameters):
    """Everything that can be turned on the trackers of a signal."""

    sample_count: int = particle_count(100, group=GROUP, trackers=("condensation",))
    process_noise_sd: float = parameter(
        0.001,
        "Process noise",
        "Standard deviation of what the motion model leaves out, each frame.",
        ge=1e-6,
        le=1,
        step=0.0005,
        group=GROUP,
        role="noise",
    )
    assumed_noise_sd: float = parameter(
        0.1,
        "Assumed observation noise",
        "Standard deviation of the noise as the filter takes it to be.",
        ge=0.001,
        le=10,
        step=0.01,
        group=GROUP,
        role="noise",
    )
    initial_sd: float = parameter(
        0,
        "Initial spread",
        "Standard deviation of both newest values around the true start.",
        ge=0,
        le=10,
        step=0.1,
        live=False,
        group=GROUP,
    )
    resampling_threshold: float = resampling_threshold(group=GROUP, trackers=("condensation",))


def start_kalman(target: Target, frame: Frame, parameters: SignalTrackerParameters, rng: Generator) -> PointState:
    """Begin at the true start with zero velocity and the initial spread."""
    del frame, rng
    dimension = len(target.position)
    mean = np.tile(target.position, 2)
    return PointState(Gaussian(mean, parameters.initial_sd**2 * np.eye(2 * dimension)), dimension)


def start_particles(target: Target, frame: Frame, parameters: SignalTrackerParameters, rng: Generator) -> PointState:
    """Begin with all particles at the true start with zero velocity, scattered by the initial spread."""
    exact = start_kalman(target, frame, parameters, rng).posterior
    states = exact.mean + parameters.initial_sd * rng.standard_normal((parameters.sample_count, len(exact.mean)))
    return PointState(exact, len(target.position), ParticleSet.uniform(states), reference=exact)


def step_kalman(state: PointState, frame: Frame, parameters: SignalTrackerParameters, rng: Generator) -> PointState:
    """Predict and update exactly (Bando 2007, eqs. 2.8 and 2.9)."""
    del rng
    before = state.reference or state.posterior
    posterior, log_evidence = _exact(before, frame, parameters)
    innovation = _innovate(before, frame, parameters)
    normalised = None if innovation is None else innovation.normalised
    return PointState(posterior, state.tracked, log_evidence=log_evidence, innovation=normalised)


def step_particles(state: PointState, frame: Frame, parameters: SignalTrackerParameters, rng: Generator) -> PointState:
    """Sample from the dynamics, weigh by the likelihood, resample (Bando 2007, ch. 2 section 3)."""
    signal = _signal(frame)
    dimension = state.tracked
    posterior = bootstrap.step(
        _particles(state, parameters, rng),
        _dynamics(dimension, parameters.process_noise_sd),
        partial(_log_likelihood, signal, parameters.assumed_noise_sd),
        rng,
        count=parameters.sample_count,
        resample=systematic,
        threshold=parameters.resampling_threshold,
    )
    exact, _ = _exact(state.reference or state.posterior, frame, parameters)
    return PointState(
        Gaussian(*posterior.particles.moments),
        dimension,
        posterior.particles,
        log_evidence=posterior.log_evidence,
        resampled=posterior.resampled,
        reference=exact,
    )


def _particles(state: PointState, parameters: SignalTrackerParameters, rng: Generator) -> ParticleSet:
    """Return the particles, drawn from the posterior if a filter without particles was at work before."""
    if state.particles is not None:
        return state.particles
    return ParticleSet.uniform(state.posterior.sample(rng, parameters.sample_count))


def measure_particles(state: PointState) -> Mapping[str, SeriesValue]:
    """Report the particles, and the exact answer beside theirs."""
    if state.particles is None or state.reference is None:
        return {}
    return {
        **reports.cloud(state.particles, resampled=state.resampled),
        "exact": tuple(state.reference.mean[: state.tracked].tolist()),
    }


def _log_likelihood(signal: Floats, noise_sd: float, states: Floats) -> Floats:
    """Return log N(signal | newest values, noise_sd^2), (N,), of states (N, 2 d); 0 where the sample is missing."""
    if not np.isfinite(signal).all():
        return np.zeros(len(states))
    dimension = len(signal)
    constant = -dimension * math.log(noise_sd * math.sqrt(2.0 * math.pi))
    values: Floats = constant - 0.5 / noise_sd**2 * ((signal - states[:, :dimension]) ** 2).sum(axis=1)
    return values


def _exact(prior: Gaussian, frame: Frame, parameters: SignalTrackerParameters) -> tuple[Gaussian, float]:
    signal = _signal(frame)
    dimension = len(signal)
    predicted = kalman.predict(prior, _dynamics(dimension, parameters.process_noise_sd))
    if not np.isfinite(signal).all():
        return predicted, 0.0
    noise = parameters.assumed_noise_sd**2 * np.eye(dimension)
    return kalman.update(predicted, signal, np.eye(dimension, 2 * dimension), noise)


def _innovate(prior: Gaussian, frame: Frame, parameters: SignalTrackerParameters) -> kalman.Innovation | None:
    """Return what the measurement said that the exact filter did not expect; None where it is missing."""
    signal = _signal(frame)
    dimension = len(signal)
    if not np.isfinite(signal).all():
        return None
    predicted = kalman.predict(prior, _dynamics(dimension, parameters.process_noise_sd))
    noise = parameters.assumed_noise_sd**2 * np.eye(dimension)
    return kalman.innovate(predicted, signal, np.eye(dimension, 2 * dimension), noise)


@lru_cache(maxsize=64)
def _dynamics(dimension: int, process_noise_sd: float) -> LinearDynamics:
    one = np.eye(dimension)
    return autoregression(2 * one, -one, np.zeros(dimension), process_noise_sd * one)


def _signal(frame: Frame) -> Floats:
    if frame.signal is None:
        raise ValueError("a tracker of signals needs a signal, got a picture")
    return frame.signal


def _components(parameters: Any) -> tuple[Component, ...]:  # noqa: ANN401 - scene and trackers in one model
    axes = range(1, parameters.dimension + 1)
    return tuple(Component(f"x{axis}{when}") for when in ("", " before") for axis in axes)


def _propagate(
    state: PointState,
    states: Floats,
    frame: Frame,
    parameters: SignalTrackerParameters,
    rng: Generator,
) -> Floats:
    del frame
    dynamics = _dynamics(state.tracked, parameters.process_noise_sd)
    return dynamics.diffuse(rng, dynamics.predict(states), np.arange(len(states)))


def _weigh(state: PointState, states: Floats, frame: Frame, parameters: SignalTrackerParameters) -> Floats:
    del state
    return _log_likelihood(_signal(frame), parameters.assumed_noise_sd, states)


def _believe(state: PointState, update: Update, frame: Frame, parameters: SignalTrackerParameters) -> PointState:
    exact = state.posterior if frame.index == 0 else _exact(state.reference or state.posterior, frame, parameters)[0]
    return PointState(
        Gaussian(*update.particles.moments),
        state.tracked,
        update.particles,
        log_evidence=update.log_evidence,
        resampled=update.resampled,
        reference=exact,
        repeatable=update.repeatable,
    )


def _parts(state: PointState, one: Floats, frame: Frame, parameters: SignalTrackerParameters) -> tuple[Part, ...]:
    """Return each measured value beside that of a state."""
    del state
    names = (component.name for component in _components(parameters))
    pairs = zip(names, _signal(frame).tolist(), one.tolist(), strict=False)
    return tuple(Residual(name, found, expected, parameters.assumed_noise_sd) for name, found, expected in pairs)


def _update_parts(
    before: PointState, state: PointState, frame: Frame, parameters: SignalTrackerParameters
) -> tuple[Part, ...]:
    """Return what the measurement said that the exact filter did not expect; nothing where it is missing."""
    innovation = _innovate(before.reference or before.posterior, frame, parameters)
    if innovation is None or frame.index == 0:
        return ()
    names = tuple(component.name for component in _components(parameters)[: state.tracked])
    return innovation_parts(names, "", _signal(frame), innovation)


def _chains(state: PointState, frames: Sequence[Frame], parameters: SignalTrackerParameters) -> tuple[LinearChain, ...]:
    """Return the model of some frames, of which the first is the one that the state is of."""
    posterior, dimension = state.reference or state.posterior, state.tracked
    dynamics = _dynamics(dimension, parameters.process_noise_sd)
    chain = LinearChain.steady(
        posterior.mean,
        posterior.covariance,
        dynamics.transition,
        dynamics.offset,
        dynamics.noise,
        np.array([_signal(frame) for frame in frames[1:]]),
        np.eye(dimension, 2 * dimension),
        parameters.assumed_noise_sd**2 * np.eye(dimension),
    )
    return (chain,)


LIKELIHOOD = ObservationLikelihood(
    "measured value", components=_components, log_likelihood=_weigh, centre=centre_of, anchor=None, parts=_parts
)

FILTER_INTERFACE = FilterInterface(
    likelihood=LIKELIHOOD,
    observed="frame.signal is what was measured, (d,); a value that is not finite is missing",
    example="pftrack.experiments.sine.example_filter",
    reads="condensation",
    start=start_particles,
    particles=_particles,
    propagate=_propagate,
    believe=_believe,
    series=(*reports.CLOUD, EXACT),
    measure=measure_particles,
)

TRACKERS: dict[str, Tracker] = {
    tracker.id: tracker
    for tracker in (
        Tracker(
            "condensation",
            "Particle filter",
            "Samples from the dynamics and weighs by the likelihood, beside the exact Kalman answer.",
            start_particles,
            step_particles,
            series=(*reports.CLOUD, EXACT),
            measure=measure_particles,
            evidence="normalised",
            likelihood=LIKELIHOOD,
            cloud=partial(cloud_of, ()),
        ),
        Tracker(
            "kalman",
            "Kalman filter",
            "Computes the posterior exactly, since the model is linear and the noise Gaussian.",
            start_kalman,
            step_kalman,
            series=NIS,
            measure=lambda state: measure_innovation(state.innovation),
            reads=(),
            evidence="normalised",
            likelihood=LIKELIHOOD,
            update_parts=_update_parts,
            linear=LinearModel(
                {"process_noise_sd": NoiseScale("process"), "assumed_noise_sd": NoiseScale("observation")}, _chains
            ),
        ),
    )
}
"""The trackers of a signal, by name, in the order in which they are shown."""
