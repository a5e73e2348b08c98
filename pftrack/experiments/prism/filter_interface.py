"""What a filter in a file is told of the poses of a prism, and the bootstrap filter that stands in for it."""

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.frame import Frame, Target
from pftrack.core.numerics.gaussian import Gaussian
from pftrack.core.numerics.random import Generator, Stream
from pftrack.experiments.prism.likelihood import LIKELIHOOD, measured_of
from pftrack.experiments.prism.trackers import TrackedPrismParameters, recognised_points, solid_of
from pftrack.experiments.shared.filter_interface import FilterInterface, Update
from pftrack.experiments.shared.pose.pose_particles import PoseParticles, project_all
from pftrack.experiments.shared.pose.reports import measurement, report
from pftrack.experiments.shared.pose.state import PoseState
from pftrack.filters.particles import ParticleSet
from pftrack.sources.prism import NAMES

__all__ = ["FILTER_INTERFACE"]

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
