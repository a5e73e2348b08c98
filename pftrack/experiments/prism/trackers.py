"""Trackers of the prism: eight measured vertices, by the methods of `pose` (Bando 2007, ch. 4 section 3.3).

The camera is known, so the solid begins where the scene's parameters say; and so is the noise of every measurement,
which is large while its vertex is hidden.
"""

from functools import partial

import numpy as np

from pftrack.core.model.frame import Frame, Measurements, Target
from pftrack.core.model.tracker import Tracker
from pftrack.core.numerics.random import Stream
from pftrack.experiments.prism.likelihood import LIKELIHOOD, measured_of
from pftrack.experiments.shared.pose import methods as pose
from pftrack.experiments.shared.pose.calibrated import pose_and_band
from pftrack.experiments.shared.pose.clouds import point_clouds
from pftrack.experiments.shared.pose.contributions import contribution_parts
from pftrack.experiments.shared.pose.methods import METHODS, Method
from pftrack.experiments.shared.pose.parameters import PoseTrackerParameters, particles_per_feature, pose_guidance
from pftrack.experiments.shared.pose.reports import measurement, report
from pftrack.experiments.shared.pose.solid import Solid
from pftrack.experiments.shared.pose.state import PoseState
from pftrack.sources.prism import NAMES, PRINCIPAL_PX, VERTICES_MM, PrismParameters
from pftrack.vision.likelihoods import points

__all__ = ["TRACKERS", "TrackedPrismParameters", "recognised_points", "solid_of"]

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
