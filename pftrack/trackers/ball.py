"""Trackers of a ball by its colour: the filters of document 1, ch. 3, with the likelihood of its section 2.2.

All of them carry the two newest positions, (u_t, v_t, u_{t-1}, v_{t-1}) in px, and differ in one function: how the
posterior of the next frame is sampled. Whether the dynamics are learned and the path smoothed is the same for all.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from pftrack.dynamics import LinearDynamics, autoregression
from pftrack.filters import auxiliary, bootstrap, fixed_lag, kalman, switching, unscented_particle
from pftrack.filters.posterior import LogLikelihood, Posterior
from pftrack.frame import Frame, Target
from pftrack.gaussian import Gaussian
from pftrack.learning import online_em
from pftrack.likelihoods import chromaticity
from pftrack.particles import ParticleSet
from pftrack.resampling import RESAMPLERS
from pftrack.trackers.ball_parameters import BallTrackerParameters
from pftrack.trackers.tracker import Tracker, TrackState

__all__ = ["TRACKERS", "colour_model"]

TRACKED = 2


@dataclass(frozen=True, slots=True)
class Prior:
    """What the sampling of one frame starts from."""

    state: TrackState
    particles: ParticleSet
    dynamics: LinearDynamics
    image_rgb: NDArray[np.uint8]
    parameters: BallTrackerParameters

    @property
    def log_likelihood(self) -> LogLikelihood:
        """Of states (n, 4)."""
        image, model, level = self.image_rgb, colour_model(self.parameters), self.parameters.background_level
        return lambda states: chromaticity.log_likelihood(image, states, model, level)


Sampler = Callable[[Prior, np.random.Generator], tuple[Posterior, bool]]
"""Sample a frame's posterior, and tell whether the tracker was alert."""


def colour_model(parameters: BallTrackerParameters) -> chromaticity.ColourModel:
    """Return the colour that the parameters describe."""
    green = parameters.green_spread if parameters.colour_model == "chromaticity" else np.inf
    return chromaticity.ColourModel(
        (parameters.target_red_share, parameters.target_green_share), (parameters.red_spread, green)
    )


def start(
    target: Target, size: tuple[int, int], parameters: BallTrackerParameters, rng: np.random.Generator
) -> TrackState:
    """Begin at a known position: all particles around it, at rest; the estimate is the position itself."""
    deviations = parameters.initial_sd_px * rng.standard_normal((parameters.sample_count, TRACKED))
    positions = target.position + deviations
    particles = ParticleSet.uniform(np.hstack([positions, positions]))
    known = Gaussian(target.position, parameters.initial_sd_px**2 * np.eye(TRACKED))
    learner = _begin_learning(known, size, parameters) if parameters.learn_dynamics else None
    return TrackState(fixed_lag.augment(known, 1), TRACKED, particles, learner=learner)


def condensation(prior: Prior, rng: np.random.Generator) -> tuple[Posterior, bool]:
    """All particles from the prediction."""
    return _predicted(prior, rng), False


def auxiliary_filter(prior: Prior, rng: np.random.Generator) -> tuple[Posterior, bool]:
    """All parents chosen with regard to the new picture."""
    return _mixed(prior, rng, prior.parameters.sample_count), True


def hard_switching(prior: Prior, rng: np.random.Generator) -> tuple[Posterior, bool]:
    """All from the prediction, or all by observation when the last posterior was wider than gamma."""
    parameters = prior.parameters
    count = switching.hard(prior.state.sigma, parameters.gamma_px, parameters.sample_count)
    return _mixed(prior, rng, count), count > 0


def soft_switching(prior: Prior, rng: np.random.Generator) -> tuple[Posterior, bool]:
    """A share by observation that grows with the width of the last posterior."""
    parameters = prior.parameters
    count = switching.soft(prior.state.sigma, parameters.gamma_min_px, parameters.gamma_max_px, parameters.sample_count)
    return _mixed(prior, rng, count), count > 0


def process_noise_controlled(prior: Prior, rng: np.random.Generator) -> tuple[Posterior, bool]:
    """All from the prediction, with larger process noise when the last posterior was wider than gamma."""
    parameters = prior.parameters
    if not switching.exceeds(prior.state.sigma, parameters.gamma_px):
        return _predicted(prior, rng), False
    widened = replace(prior.dynamics, noise=_noise(parameters.large_process_noise_px))
    return _predicted(replace(prior, dynamics=widened), rng), True


def unscented(prior: Prior, rng: np.random.Generator) -> tuple[Posterior, bool]:
    """Every particle drawn towards the colour centroid of the picture."""
    parameters = prior.parameters
    posterior = unscented_particle.step(
        prior.particles,
        prior.dynamics,
        prior.log_likelihood,
        rng,
        measurement=chromaticity.centroid(prior.image_rgb, colour_model(parameters)),
        observe=lambda positions: positions,
        noise_covariance=parameters.measurement_noise_px**2 * np.eye(TRACKED),
        count=parameters.sample_count,
        resample=RESAMPLERS[parameters.resampling],
    )
    return posterior, False


def step_kalman(
    state: TrackState, frame: Frame, parameters: BallTrackerParameters, rng: np.random.Generator
) -> TrackState:
    """Follow the colour centroid with a Kalman filter; without any pixel of the colour, predict only."""
    del rng
    image = _picture(frame)
    state = _with_learner(state, frame, parameters)
    predicted = kalman.predict(state.posterior, _dynamics(state, parameters))
    measurement = chromaticity.centroid(image, colour_model(parameters))
    log_evidence = 0.0
    if measurement is not None:
        noise = parameters.measurement_noise_px**2 * np.eye(TRACKED)
        predicted, log_evidence = kalman.update(predicted, measurement, np.eye(TRACKED, 2 * TRACKED), noise)
    tracked = TrackState(predicted, TRACKED, log_evidence=log_evidence, learner=state.learner)
    return _learned(tracked, parameters)


def _particle_step(
    sample: Sampler,
) -> Callable[[TrackState, Frame, BallTrackerParameters, np.random.Generator], TrackState]:
    """Turn a way of sampling into a tracker's step."""

    def step(
        state: TrackState, frame: Frame, parameters: BallTrackerParameters, rng: np.random.Generator
    ) -> TrackState:
        image = _picture(frame)
        state = _with_learner(state, frame, parameters)
        particles = state.particles
        if particles is None:
            particles = ParticleSet.uniform(state.posterior.sample(rng, parameters.sample_count))
        prior = Prior(state, particles, _dynamics(state, parameters), image, parameters)
        posterior, alert = sample(prior, rng)
        tracked = TrackState(
            Gaussian(*posterior.particles.moments),
            TRACKED,
            posterior.particles,
            posterior.observation_count,
            posterior.log_evidence,
            posterior.resampled,
            switched=state.alert is not None and alert != state.alert,
            alert=alert,
            learner=state.learner,
            lineage=_lineage(state, particles, posterior.particles, parameters),
        )
        return _learned(tracked, parameters)

    return step


def _predicted(prior: Prior, rng: np.random.Generator) -> Posterior:
    parameters = prior.parameters
    return bootstrap.step(
        prior.particles,
        prior.dynamics,
        prior.log_likelihood,
        rng,
        count=parameters.sample_count,
        resample=RESAMPLERS[parameters.resampling],
        threshold=parameters.resampling_threshold,
    )


def _mixed(prior: Prior, rng: np.random.Generator, observation_count: int) -> Posterior:
    if observation_count == 0:
        return _predicted(prior, rng)
    parameters = prior.parameters
    return auxiliary.step(
        prior.particles,
        prior.dynamics,
        prior.log_likelihood,
        rng,
        weights=parameters.apf_weights,
        prediction_count=parameters.sample_count - observation_count,
        observation_count=observation_count,
        resample=RESAMPLERS[parameters.resampling],
    )


def _picture(frame: Frame) -> NDArray[np.uint8]:
    if frame.image_rgb is None:
        raise ValueError("a tracker of colour needs pictures, got a signal")
    return frame.image_rgb


@lru_cache(maxsize=64)
def _noise(process_noise_px: float) -> NDArray[np.float64]:
    return process_noise_px * np.eye(2 * TRACKED, TRACKED)


@lru_cache(maxsize=64)
def _initial_dynamics(velocity_retention: float, process_noise_px: float) -> LinearDynamics:
    """Return x_{t+1} = x_t + retention (x_t - x_{t-1}) + noise."""
    one = np.eye(TRACKED)
    return autoregression(
        (1 + velocity_retention) * one, -velocity_retention * one, np.zeros(TRACKED), process_noise_px * one
    )


def _dynamics(state: TrackState, parameters: BallTrackerParameters) -> LinearDynamics:
    if state.learner is not None:
        return online_em.dynamics(state.learner, parameters.process_noise_px * np.eye(TRACKED))
    return _initial_dynamics(parameters.velocity_retention, parameters.process_noise_px)


def _begin_learning(known: Gaussian, size: tuple[int, int], parameters: BallTrackerParameters) -> online_em.Learner:
    initial = _initial_dynamics(parameters.velocity_retention, parameters.process_noise_px)
    return online_em.begin(initial, known.mean, float(known.standard_deviations.max()), size)


def _with_learner(state: TrackState, frame: Frame, parameters: BallTrackerParameters) -> TrackState:
    """Begin or end learning when it has been switched on or off."""
    if parameters.learn_dynamics == (state.learner is not None):
        return state
    if not parameters.learn_dynamics:
        return replace(state, learner=None)
    height, width, _ = _picture(frame).shape
    known = Gaussian(state.estimate, state.posterior.covariance[:TRACKED, :TRACKED])
    return replace(state, learner=_begin_learning(known, (width, height), parameters))


def _learned(state: TrackState, parameters: BallTrackerParameters) -> TrackState:
    if state.learner is None:
        return state
    settings = online_em.Settings(
        parameters.forgetting,
        parameters.warm_up_frames,
        parameters.learning_ridge,
        parameters.largest_spectral_radius,
    )
    initial = _initial_dynamics(parameters.velocity_retention, parameters.process_noise_px)
    return replace(state, learner=online_em.learn(state.learner, initial, state.estimate, state.sigma, settings))


def _lineage(
    state: TrackState, parents: ParticleSet, particles: ParticleSet, parameters: BallTrackerParameters
) -> fixed_lag.Lineage | None:
    if parameters.smoothing_lag_frames == 0:
        return None
    lineage = state.lineage or fixed_lag.begin_lineage(parents, TRACKED)
    return fixed_lag.extend_lineage(lineage, particles, parameters.smoothing_lag_frames)


TRACKERS: dict[str, Tracker] = {
    tracker.id: tracker
    for tracker in (
        Tracker(
            "h-spf",
            "Hard switching (h-SPF)",
            "Draws by prediction while it is sure and wholly by observation when it is not.",
            start,
            _particle_step(hard_switching),
        ),
        Tracker(
            "s-spf",
            "Soft switching (s-SPF)",
            "Draws a share of the particles by observation that grows with its uncertainty.",
            start,
            _particle_step(soft_switching),
        ),
        Tracker(
            "condensation",
            "Condensation",
            "Draws every particle by prediction: the bootstrap filter.",
            start,
            _particle_step(condensation),
        ),
        Tracker(
            "apf",
            "Auxiliary (APF)",
            "Draws every parent with regard to the new picture.",
            start,
            _particle_step(auxiliary_filter),
        ),
        Tracker(
            "upf",
            "Unscented (UPF)",
            "Draws every particle towards the colour centroid of the whole picture.",
            start,
            _particle_step(unscented),
        ),
        Tracker(
            "pc-pf",
            "Process-noise control (PC-PF)",
            "Draws by prediction, with more process noise when it is unsure.",
            start,
            _particle_step(process_noise_controlled),
        ),
        Tracker(
            "kalman",
            "Kalman filter",
            "Follows the colour centroid of the whole picture with one Gaussian.",
            start,
            step_kalman,
        ),
    )
}
"""The trackers of a ball, by name, in the order in which they are shown."""
