"""Trackers of the prism: eight measured vertices, by the methods of `pose` (Bando 2007, ch. 4 section 3.3).

The camera is known, so the solid begins where the scene's parameters say; and so is the noise of every measurement,
which is large while its vertex is hidden.
"""

from dataclasses import replace
from functools import partial

import numpy as np

from pftrack.core.arrays import Floats
from pftrack.core.model.source import Frame, Measurements, Target
from pftrack.core.model.tracker import Tracker
from pftrack.core.numerics.random import Gaussian, Generator, Stream
from pftrack.experiments.shared.beliefs import FilterInterface, Update
from pftrack.experiments.shared.pose import methods as pose
from pftrack.experiments.shared.pose.beliefs import Solid
from pftrack.experiments.shared.pose.calibrated import pose_and_band
from pftrack.experiments.shared.pose.layered import FeatureLikelihood
from pftrack.experiments.shared.pose.methods import METHODS, Method, measurement, report
from pftrack.experiments.shared.pose.parameters import PoseTrackerParameters, particles_per_feature, pose_guidance
from pftrack.experiments.shared.pose.particles import (
    PoseParticles,
    contribution_parts,
    point_clouds,
    pose_likelihood,
    project_all,
)
from pftrack.experiments.shared.pose.state import PoseState
from pftrack.filters.particles import ParticleSet
from pftrack.sources.prism import NAMES, PRINCIPAL_PX, VERTICES_MM, PrismParameters
from pftrack.vision.likelihoods import points


def measured_of(frame: Frame) -> Measurements:
    """Return the measured vertices of a frame.

    Raises:
        ValueError: It has none.
    """
    if frame.measurements is None:
        raise ValueError("a prism is tracked by measured vertices, got a frame without any")
    return frame.measurements


def _weigh_points(state: PoseState, frame: Frame, parameters: object) -> FeatureLikelihood:
    del state, parameters
    measured = measured_of(frame)
    noise_sd = measured.sd_px.astype(np.float64)
    return lambda positions: points.log_likelihood(positions, measured.points_px, noise_sd)


def _log_likelihood(state: PoseState, states: Floats, frame: Frame, parameters: object) -> Floats:
    """Return the same of all vertices; one that was not measured says nothing."""
    del parameters
    measured = measured_of(frame)
    sd = measured.sd_px.astype(np.float64).reshape(len(measured.sd_px), -1)[:, None]
    off = (project_all(states, state.solid) - measured.points_px[:, None]) / sd
    return np.asarray(-0.5 * np.square(np.where(np.isfinite(off), off, 0.0)).sum(axis=(0, 2)))


LIKELIHOOD = replace(
    pose_likelihood("measured vertices", NAMES, _weigh_points, most_places=4800), log_likelihood=_log_likelihood
)
"""How well the measured vertices are where a pinhole sees those of a pose."""

SEEN_FACTOR = 3.0
"""A vertex counts as hidden if its measurement is noisier than the best one by this factor."""


class TrackedPrismParameters(PoseTrackerParameters, PrismParameters):
    """The scene, whose camera is known, and its trackers."""

    guidance = pose_guidance("prism")

    sample_count: int = particles_per_feature(len(VERTICES_MM))


def start(method: Method, target: Target, frame: Frame, parameters: TrackedPrismParameters, rng: Stream) -> PoseState:
    """Begin at the true vertices of frame 0, where theta = 0."""
    landmarks = target.landmarks
    if landmarks is None:
        raise ValueError("a prism is tracked by its vertices, got a target without any")
    solid = solid_of(landmarks.model_mm, parameters)
    belief = pose.begin(solid, landmarks.points_px, parameters, method, rng)
    return PoseState(solid, belief, belief.pose, recognised_points(measured_of(frame)))


def step(method: Method, state: PoseState, frame: Frame, parameters: TrackedPrismParameters, rng: Stream) -> PoseState:
    """Weigh particles by the measured vertices."""
    measured = measured_of(frame)
    noise_sd = measured.sd_px.astype(np.float64)
    belief = pose.advance(
        state,
        lambda _: lambda positions: points.log_likelihood(positions, measured.points_px, noise_sd),
        parameters,
        method,
        rng,
    )
    switched = pose.has_switched(state.belief, belief)
    angles, calibration = pose_and_band(state.calibration, state.solid, belief, parameters)
    return PoseState(state.solid, belief, angles, recognised_points(measured), switched, calibration=calibration)


def solid_of(points_mm: np.ndarray[tuple[int, ...], np.dtype[np.float64]], parameters: TrackedPrismParameters) -> Solid:
    """Return the prism with vertices (8, 3) mm before the scene's camera."""
    scale = parameters.focal_length_px / parameters.distance_mm
    reference = np.column_stack([scale * np.eye(2, 3), PRINCIPAL_PX])
    place = np.array([0.0, 0.0, parameters.distance_mm])
    return Solid(points_mm, reference, float(parameters.focal_length_px), PRINCIPAL_PX, place)


def recognised_points(measured: Measurements) -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
    """Return which vertices (8,) are seen: those whose measurement is not much noisier than the best."""
    seen: np.ndarray[tuple[int, ...], np.dtype[np.bool_]] = np.less(measured.sd_px, SEEN_FACTOR * measured.sd_px.min())
    return seen


def _tracker(method: Method, title: str, description: str) -> Tracker:
    series = report(method, NAMES)
    return Tracker(
        method,
        title,
        description,
        partial(start, method),
        partial(step, method),
        series=series,
        measure=measurement(series),
        likelihood=LIKELIHOOD,
        cloud=partial(point_clouds, NAMES),
        update_parts=partial(contribution_parts, NAMES),
    )


TRACKERS: dict[str, Tracker] = {method: _tracker(method, *words) for method, words in METHODS.items()}
"""The trackers of the prism, by name, in the order in which they are shown."""

SERIES = report("rb-pf", NAMES)


def _start(target: Target, frame: Frame, parameters: TrackedPrismParameters, rng: Stream) -> PoseState:
    """Begin where theta = 0, as certain as a frame's noise."""
    landmarks = target.landmarks
    if landmarks is None:
        raise ValueError("a prism is tracked by its vertices, got a target without any")
    solid = solid_of(landmarks.model_mm, parameters)
    place = np.concatenate([np.zeros(3), solid.translation_mm])
    spread = np.concatenate([np.full(3, _turn_sd(parameters)), np.full(3, _shift_sd_mm(parameters))]) / 3.0
    states = place + spread * rng.standard_normal((parameters.joint_sample_count, 6))
    belief = PoseParticles.of(ParticleSet.uniform(states), solid, 0.0)
    return PoseState(solid, belief, belief.pose, recognised_points(measured_of(frame)))


def _particles(state: PoseState, parameters: TrackedPrismParameters, rng: Generator) -> ParticleSet:
    """Return the particles, drawn about pose and place if another tracker was at work before."""
    if isinstance(state.belief, PoseParticles):
        return state.belief.particles
    covariance = np.zeros((6, 6))
    covariance[:3, :3] = state.belief.pose.covariance
    covariance[3:, 3:] = np.eye(3) * _shift_sd_mm(parameters) ** 2
    known = Gaussian(np.concatenate([state.belief.pose.mean, state.translation_mm]), covariance)
    return ParticleSet.uniform(known.sample(rng, parameters.joint_sample_count))


def _propagate(
    state: PoseState,
    states: Floats,
    frame: Frame,
    parameters: TrackedPrismParameters,
    rng: Generator,
) -> Floats:
    """Return random walks of angles and place."""
    del state, frame
    spread = np.concatenate([np.full(3, _turn_sd(parameters)), np.full(3, _shift_sd_mm(parameters))])
    moved: Floats = states + spread * rng.standard_normal(states.shape)
    return moved


def _believe(state: PoseState, update: Update, frame: Frame, parameters: TrackedPrismParameters) -> PoseState:
    del parameters
    belief = PoseParticles.of(update.particles, state.solid, update.log_evidence)
    seen = recognised_points(measured_of(frame))
    return PoseState(state.solid, belief, belief.pose, seen, repeatable=update.repeatable)


def _project(state: PoseState, states: Floats) -> Floats:
    return project_all(states, state.solid)


def _turn_sd(parameters: TrackedPrismParameters) -> float:
    return float(np.deg2rad(parameters.pose_noise_deg))


def _shift_sd_mm(parameters: TrackedPrismParameters) -> float:
    """Return how far the place may move in a frame, mm: as much as features may, at their distance."""
    return float(parameters.feature_noise_px * parameters.distance_mm / parameters.focal_length_px)


def _count(parameters: TrackedPrismParameters) -> int:
    return int(parameters.joint_sample_count)


FILTER_INTERFACE = FilterInterface(
    likelihood=LIKELIHOOD,
    observed=(
        "frame.measurements.points_px (8, 2) are the measured vertices, with noise of frame.measurements.sd_px (8,), "
        "which is large while a vertex is hidden"
    ),
    example="pftrack.experiments.prism.example_filter",
    reads="rb-pf",
    start=_start,
    particles=_particles,
    propagate=_propagate,
    believe=_believe,
    series=SERIES,
    measure=measurement(SERIES),
    count=_count,
    project=_project,
)
