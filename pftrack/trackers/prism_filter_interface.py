"""What a filter in a file is told of the poses of a prism, and the bootstrap filter that stands in for it."""

import numpy as np
from numpy.typing import NDArray

from pftrack.model.frame import Frame, Target
from pftrack.model.likelihood import Anchor, Component, ObservationLikelihood
from pftrack.numerics.gaussian import Gaussian
from pftrack.numerics.random import Generator, Stream
from pftrack.particles import ParticleSet
from pftrack.sources.prism import NAMES
from pftrack.trackers.filter_interface import FilterInterface, Update
from pftrack.trackers.pose.pose_particles import PoseParticles, project_all
from pftrack.trackers.pose.reports import measurement, report
from pftrack.trackers.pose.state import PoseState
from pftrack.trackers.prism import TrackedPrismParameters, measured_of, recognised_points, solid_of

__all__ = ["FILTER_INTERFACE"]

COMPONENTS = (
    Component("theta x", "rad"),
    Component("theta y", "rad"),
    Component("theta z", "rad"),
    Component("x", "mm"),
    Component("y", "mm"),
    Component("z", "mm"),
)
"""How the prism is turned, and where it is in the camera's frame."""

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
    states: NDArray[np.float64],
    frame: Frame,
    parameters: TrackedPrismParameters,
    rng: Generator,
) -> NDArray[np.float64]:
    """Return random walks of angles and place."""
    del state, frame
    spread = np.concatenate([np.full(3, _turn_sd(parameters)), np.full(3, _shift_sd_mm(parameters))])
    moved: NDArray[np.float64] = states + spread * rng.standard_normal(states.shape)
    return moved


def _log_likelihood(
    state: PoseState, states: NDArray[np.float64], frame: Frame, parameters: TrackedPrismParameters
) -> NDArray[np.float64]:
    """Return how well the measured vertices are where a pinhole sees those of each pose."""
    del parameters
    measured = measured_of(frame)
    sd = measured.sd_px.astype(np.float64).reshape(len(measured.sd_px), -1)[:, None]
    off = (project_all(states, state.solid) - measured.points_px[:, None]) / sd
    return np.asarray(-0.5 * np.square(np.where(np.isfinite(off), off, 0.0)).sum(axis=(0, 2)))


def _centre(state: PoseState) -> NDArray[np.float64]:
    """Return angles, rad, and place in the camera's frame, mm, (6,)."""
    return np.concatenate([state.pose.mean, state.translation_mm])


def _place(state: PoseState, states: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return where a pinhole sees the origin of the solid's frame, (N, 2) px."""
    solid = state.solid
    return np.asarray(solid.focal_px * states[:, 3:5] / np.maximum(states[:, 5:], 1.0) + solid.principal_px)


def _put(state: PoseState, one: NDArray[np.float64], places: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return poses as far away as the one, whose origins are seen at places, (M, 6)."""
    states = np.tile(one, (len(places), 1))
    states[:, 3:5] = (places - state.solid.principal_px) * one[5] / state.solid.focal_px
    return states


def _believe(state: PoseState, update: Update, frame: Frame, parameters: TrackedPrismParameters) -> PoseState:
    del parameters
    belief = PoseParticles.of(update.particles, state.solid, update.log_evidence)
    seen = recognised_points(measured_of(frame))
    return PoseState(state.solid, belief, belief.pose, seen, repeatable=update.repeatable)


def _project(state: PoseState, states: NDArray[np.float64]) -> NDArray[np.float64]:
    return project_all(states, state.solid)


def _turn_sd(parameters: TrackedPrismParameters) -> float:
    return float(np.deg2rad(parameters.pose_noise_deg))


def _shift_sd_mm(parameters: TrackedPrismParameters) -> float:
    """Return how far the place may move in a frame, mm: as much as features may, at their distance."""
    return float(parameters.feature_noise_px * parameters.distance_mm / parameters.focal_length_px)


def _count(parameters: TrackedPrismParameters) -> int:
    return int(parameters.joint_sample_count)


LIKELIHOOD = ObservationLikelihood(
    "measured vertices",
    components=lambda _: COMPONENTS,
    log_likelihood=_log_likelihood,
    centre=_centre,
    anchor=Anchor(_place, _put),
)

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
