"""Trackers that measure the colour centroid of the whole picture (Bando 2007, ch. 3 section 4)."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.frame import Frame
from pftrack.core.model.likelihood import ObservationLikelihood
from pftrack.core.model.linear import LinearChain, LinearModel, NoiseScale
from pftrack.core.model.part import Part
from pftrack.core.model.tracker import Tracker
from pftrack.core.numerics.gaussian import Gaussian
from pftrack.core.numerics.random import Stream
from pftrack.experiments.ball.trackers import motion
from pftrack.experiments.ball.trackers.common import lineage_of, start
from pftrack.experiments.ball.trackers.likelihood import LIKELIHOOD, colour_model
from pftrack.experiments.ball.trackers.motion import TRACKED, learn_motion, with_learner
from pftrack.experiments.ball.trackers.parameters import BallTrackerParameters
from pftrack.experiments.shared import reports
from pftrack.experiments.shared.innovation import NIS, innovation_parts, measure_innovation
from pftrack.experiments.shared.point_state import PointState
from pftrack.experiments.shared.sampling.common import centre_of, cloud_of, particles_of, picture_of, size_of
from pftrack.experiments.shared.sampling.samplers import measure_particles
from pftrack.filters import kalman, unscented_particle
from pftrack.filters.resampling import RESAMPLERS
from pftrack.vision.likelihoods import chromaticity

__all__ = ["KALMAN", "UNSCENTED"]


def step_unscented(state: PointState, frame: Frame, parameters: BallTrackerParameters, rng: Stream) -> PointState:
    """Draw every particle towards the colour centroid of the picture."""
    image, model = picture_of(frame), colour_model(parameters)
    size = size_of(image)
    state = with_learner(state, size, parameters)
    particles = particles_of(state, parameters, rng)
    posterior = unscented_particle.step(
        particles,
        motion.dynamics(state, parameters, size),
        lambda states: chromaticity.log_likelihood(image, states, model, parameters.background_level),
        rng,
        measurement=chromaticity.centroid(image, model),
        observe=lambda positions: positions,
        noise_covariance=parameters.measurement_noise_px**2 * np.eye(TRACKED),
        recursive=parameters.recursive_covariance,
        count=parameters.sample_count,
        resample=RESAMPLERS[parameters.resampling],
    )
    tracked = PointState(
        Gaussian(*posterior.particles.moments),
        TRACKED,
        posterior.particles,
        log_evidence=posterior.log_evidence,
        resampled=posterior.resampled,
        alert=False,
        learner=state.learner,
        lineage=lineage_of(state, particles, posterior.particles, parameters),
    )
    return learn_motion(tracked, parameters, size)


def step_kalman(state: PointState, frame: Frame, parameters: BallTrackerParameters, rng: Stream) -> PointState:
    """Follow the colour centroid with a Kalman filter; without any pixel of the colour, predict only."""
    del rng
    image = picture_of(frame)
    size = size_of(image)
    state = with_learner(state, size, parameters)
    posterior = kalman.predict(state.posterior, motion.dynamics(state, parameters, size))
    measurement = chromaticity.centroid(image, colour_model(parameters))
    log_evidence, normalised = 0.0, None
    if measurement is not None:
        observation, noise = np.eye(TRACKED, 2 * TRACKED), parameters.measurement_noise_px**2 * np.eye(TRACKED)
        normalised = kalman.innovate(posterior, measurement, observation, noise).normalised
        posterior, log_evidence = kalman.update(posterior, measurement, observation, noise)
    tracked = PointState(posterior, TRACKED, log_evidence=log_evidence, learner=state.learner, innovation=normalised)
    return learn_motion(tracked, parameters, size)


def _centroid_parts(
    before: PointState, state: PointState, frame: Frame, parameters: BallTrackerParameters
) -> tuple[Part, ...]:
    """Return what the centroid said that was not expected; nothing where there is none."""
    del state
    image = picture_of(frame)
    measurement = chromaticity.centroid(image, colour_model(parameters))
    if measurement is None or frame.index == 0:
        return ()
    size = size_of(image)
    predicted = kalman.predict(
        before.posterior, motion.dynamics(with_learner(before, size, parameters), parameters, size)
    )
    noise = parameters.measurement_noise_px**2 * np.eye(TRACKED)
    innovation = kalman.innovate(predicted, measurement, np.eye(TRACKED, 2 * TRACKED), noise)
    return innovation_parts(("u", "v"), "px", measurement, innovation)


def _centroid_likelihood(
    state: PointState, states: NDArray[np.float64], frame: Frame, parameters: BallTrackerParameters
) -> NDArray[np.float64]:
    """Return the log density of the centroid, 0 where there is none."""
    del state
    measurement = chromaticity.centroid(picture_of(frame), colour_model(parameters))
    if measurement is None:
        return np.zeros(len(states))
    off = (states[:, :TRACKED] - measurement) / parameters.measurement_noise_px
    return np.asarray(-0.5 * np.square(off).sum(axis=1))


def _chains(
    state: PointState, frames: Sequence[Frame], parameters: BallTrackerParameters
) -> tuple[LinearChain, ...] | None:
    """Return the model of some frames, of which the first is the one that the state is of; None if it is learned."""
    if parameters.learn_dynamics or state.learner is not None:
        return None
    images, model = [picture_of(frame) for frame in frames], colour_model(parameters)
    dynamics = motion.dynamics(state, parameters, size_of(images[0]))
    centroids = [chromaticity.centroid(image, model) for image in images[1:]]
    chain = LinearChain.steady(
        state.posterior.mean,
        state.posterior.covariance,
        dynamics.transition,
        dynamics.offset,
        dynamics.noise,
        np.array([np.full(TRACKED, np.nan) if each is None else each for each in centroids]),
        np.eye(TRACKED, 2 * TRACKED),
        parameters.measurement_noise_px**2 * np.eye(TRACKED),
    )
    return (chain,)


UNSCENTED = Tracker(
    "upf",
    "Unscented (UPF)",
    "Draws every particle towards the colour centroid of the whole picture.",
    start,
    step_unscented,
    series=reports.CLOUD,
    measure=measure_particles,
    likelihood=replace(LIKELIHOOD, weighs=False),
    cloud=partial(cloud_of, ()),
)

KALMAN = Tracker(
    "kalman",
    "Kalman filter",
    "Follows the colour centroid of the whole picture with one Gaussian.",
    start,
    step_kalman,
    series=NIS,
    measure=lambda state: measure_innovation(state.innovation),
    evidence="normalised",
    likelihood=ObservationLikelihood(
        "colour centroid of the picture",
        components=LIKELIHOOD.components,
        log_likelihood=_centroid_likelihood,
        centre=centre_of,
    ),
    update_parts=_centroid_parts,
    linear=LinearModel(
        {"process_noise_px": NoiseScale("process"), "measurement_noise_px": NoiseScale("observation")}, _chains
    ),
)
