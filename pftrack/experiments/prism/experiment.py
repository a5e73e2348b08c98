"""The turning prism: which prediction to trust when vertices hide (Bando 2007, ch. 4 section 3.3).

Eight vertices of a solid are measured, the hidden ones wildly. Both the solid's pose and each vertex's own past predict
the vertex; the adaptive sampling distribution learns which prediction is right, vertex by vertex.
"""

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TypeAlias

import numpy as np
from typing_extensions import override

from pftrack.core.arrays import Bools, Floats
from pftrack.core.geometry import rotation
from pftrack.core.model.drawing import COLOURS, Colour, Drawing, Links, Picture, Primitive
from pftrack.core.model.measures import POSE_MEASURES
from pftrack.core.model.model import FilterModel, State, Values
from pftrack.core.model.series import Series, SeriesValue
from pftrack.core.model.setup import Setup
from pftrack.core.model.source import Frame, Landmarks, Measurements, Target
from pftrack.core.model.tracker import Diagnostics, Step, Tracker
from pftrack.core.numerics.matrices import pinhole
from pftrack.core.numerics.random import Gaussian, Generator, Stream
from pftrack.experiments.declared import read_words
from pftrack.experiments.experiment import Experiment, Measured
from pftrack.experiments.prism import scene
from pftrack.experiments.shared.filtered import Update
from pftrack.experiments.shared.pose import SHOWN_OF_POSES, calibrated, drawing
from pftrack.experiments.shared.pose import methods as pose
from pftrack.experiments.shared.pose.layered import FeatureLikelihood
from pftrack.experiments.shared.pose.methods import METHODS, Method, measurement, report
from pftrack.experiments.shared.pose.state import Belief, PoseModel, PoseState, Solid, project_all
from pftrack.experiments.shared.sketch import at_height, caption, error_words, paper
from pftrack.filters.particles import ParticleSet
from pftrack.vision.likelihoods import points

# Trackers of the prism: eight measured vertices, by the methods of `pose` (Bando 2007, ch. 4 section 3.3).
#
# The camera is known, so the scene's parameters give the solid's first place. The noise of every measurement is also
# known; it is large while its vertex is hidden.


def measured_of(frame: Frame) -> Measurements:
    """Return the measured vertices of a frame.

    Raises:
        ValueError: It has none.
    """
    if frame.measurements is None:
        raise ValueError("a prism is tracked by measured vertices, got a frame without any")
    return frame.measurements


def landmarks_of(target: Target) -> Landmarks:
    """Return the vertices of a target.

    Raises:
        ValueError: It has none.
    """
    if target.landmarks is None:
        raise ValueError("a prism is tracked by its vertices, got a target without any")
    return target.landmarks


SEEN_FACTOR = 3.0
"""A vertex counts as hidden if its measurement is noisier than the best one by this factor."""


class TrackedPrismParameters(calibrated.PoseTrackerParameters, scene.PrismParameters, group=calibrated.FEATURES):
    """The scene, whose camera is known, and its trackers."""

    guidance = calibrated.pose_guidance("prism")

    sample_count: int = calibrated.particles_per_feature(len(scene.VERTICES_MM))


def start(method: Method, target: Target, frame: Frame, parameters: TrackedPrismParameters, rng: Stream) -> PoseState:
    """Begin at the true vertices of frame 0, where theta = 0."""
    landmarks = landmarks_of(target)
    solid = solid_of(landmarks.model_mm, parameters)
    belief = pose.begin(solid, landmarks.points_px, parameters, method, rng)
    return PoseState(solid, belief, belief.pose, recognised_points(measured_of(frame)))


def step(method: Method, state: PoseState, frame: Frame, parameters: TrackedPrismParameters, rng: Stream) -> PoseState:
    """Weigh particles by the measured vertices."""
    belief = pose.advance(state, lambda known: MODEL.weigh(known, frame, parameters), parameters, method, rng)
    switched = pose.has_switched(state.belief, belief)
    angles, excess = calibrated.pose_and_band(state.excess_px2, state.solid, belief, parameters)
    return PoseState(state.solid, belief, angles, recognised_points(measured_of(frame)), switched, excess_px2=excess)


def solid_of(points_mm: Floats, parameters: TrackedPrismParameters) -> Solid:
    """Return the prism with vertices (8, 3) mm before the scene's camera."""
    scale = parameters.focal_length_px / parameters.distance_mm
    reference = np.column_stack([scale * np.eye(2, 3), scene.PRINCIPAL_PX])
    place = np.array([0.0, 0.0, parameters.distance_mm])
    return Solid(points_mm, reference, float(parameters.focal_length_px), scene.PRINCIPAL_PX, place)


def recognised_points(measured: Measurements) -> Bools:
    """Return which vertices (8,) are seen: those whose measurement is not much noisier than the best."""
    return np.asarray(measured.sd_px < SEEN_FACTOR * measured.sd_px.min())


class Prism(PoseModel, FilterModel):
    """Fit of the measured vertices to a pose's vertices, seen by a pinhole; missing measurements are ignored.

    Angles and place walk at random.
    """

    most_places = 4800
    observed = (
        "frame.measurements.points_px (8, 2) are the measured vertices, with noise of frame.measurements.sd_px (8,), "
        "which is large while a vertex is hidden"
    )
    example = "pftrack.experiments.prism.example_filter"
    reads = "rb-pf"

    @override
    def weigh(self, known: PoseState, frame: Frame, parameters: Values) -> FeatureLikelihood:
        measured = measured_of(frame)
        noise_sd = measured.sd_px.astype(np.float64)
        return lambda positions: points.log_likelihood(positions, measured.points_px, noise_sd)

    def begin(self, parameters: TrackedPrismParameters, rng: Generator, count: int) -> Floats:
        """Return states (count, 6) of frame 0, where theta = 0, as certain as a frame's noise."""
        place = np.array([0.0, 0.0, 0.0, 0.0, 0.0, parameters.distance_mm])
        return np.asarray(place + _walk_sd(parameters) / 3.0 * rng.standard_normal((count, 6)))

    @override
    def propagate(
        self, states: Floats, frame: Frame, parameters: TrackedPrismParameters, rng: Generator, known: State
    ) -> Floats:
        return np.asarray(states + _walk_sd(parameters) * rng.standard_normal(states.shape))

    @override
    def log_likelihood(self, states: Floats, frame: Frame, parameters: Values, known: PoseState) -> Floats:
        measured = measured_of(frame)
        sd = measured.sd_px.astype(np.float64).reshape(len(measured.sd_px), -1)[:, None]
        off = (project_all(states, known.solid) - measured.points_px[:, None]) / sd
        return np.asarray(-0.5 * np.square(np.where(np.isfinite(off), off, 0.0)).sum(axis=(0, 2)))

    @override
    def project(self, states: Floats, known: PoseState) -> Floats:
        return project_all(states, known.solid)

    @override
    def count(self, parameters: TrackedPrismParameters) -> int:
        return int(parameters.joint_sample_count)

    @override
    def start(self, target: Target, frame: Frame, parameters: TrackedPrismParameters, rng: Stream) -> PoseState:
        states = self.begin(parameters, rng, self.count(parameters))
        solid = solid_of(landmarks_of(target).model_mm, parameters)
        belief = Belief.of_poses(ParticleSet.uniform(states), solid, 0.0)
        return PoseState(solid, belief, belief.pose, recognised_points(measured_of(frame)))

    @override
    def particles(self, state: PoseState, parameters: TrackedPrismParameters, rng: Generator) -> ParticleSet:
        """Return the particles, drawn about pose and place if another tracker was at work before."""
        if isinstance(state.belief.kept, ParticleSet):
            return state.belief.kept
        covariance = np.zeros((6, 6))
        covariance[:3, :3] = state.belief.pose.covariance
        covariance[3:, 3:] = np.eye(3) * _walk_sd(parameters)[3] ** 2
        known = Gaussian(self.centre(state), covariance)
        return ParticleSet.uniform(known.sample(rng, self.count(parameters)))

    @override
    def believe(self, known: PoseState, update: Update, frame: Frame, parameters: TrackedPrismParameters) -> PoseState:
        belief = Belief.of_poses(update.particles, known.solid, update.log_evidence)
        seen = recognised_points(measured_of(frame))
        return PoseState(known.solid, belief, belief.pose, seen, repeatable=update.repeatable)

    @property
    @override
    def series(self) -> tuple[Series, ...]:
        return report("rb-pf", scene.NAMES)

    @override
    def measure(self, state: PoseState) -> Mapping[str, SeriesValue]:
        return measurement(self.series)(state)


def _walk_sd(parameters: TrackedPrismParameters) -> Floats:
    """Return the motion of angles, rad, and place, mm, per frame, (6,): that of features at their distance."""
    shift_mm = parameters.feature_noise_px * parameters.distance_mm / parameters.focal_length_px
    return np.concatenate([np.full(3, np.deg2rad(parameters.pose_noise_deg)), np.full(3, shift_mm)])


MODEL = Prism("measured vertices", scene.NAMES)


def _tracker(method: Method) -> Tracker:
    series = report(method, scene.NAMES)
    return Tracker(
        method, partial(start, method), partial(step, method), series=series, measure=measurement(series), model=MODEL
    )


TRACKERS: dict[str, Tracker] = {method: _tracker(method) for method in METHODS}
"""The trackers of the prism, by name, in the order in which they are shown."""

FOLDER = Path(__file__).parent

Placed: TypeAlias = tuple[Floats, Bools]
"""Corners (8, 3) px, and which faces (6,) are seen."""

SEEN_BY = np.array([[{a, b} <= set(face) for face in scene.FACES] for a, b in scene.EDGES])
"""(12, 6) which edges belong to which faces."""

AXES_MM = 8.0
TICK = np.array([[-4.0, 0.0, 0.0], [4.0, 0.0, 0.0]], dtype=np.float32)
"""The ends of the mark of a measurement, px around it."""


# `docs/explanation/calibration.md` has the bands. `python -m tools.loss_probability fit prism` fits the probability of
# a loss and writes `loss_probability.json`.


def simulate() -> Setup:
    """Wire the prism with Bando's values."""
    return Setup(scene.PrismSource, TrackedPrismParameters())


def draw(step: Step, past: Sequence[Diagnostics], other: Diagnostics | None = None) -> Drawing:
    """Draw a frame: the solid as estimated, as another run has it and as it is, hidden edges dashed; its features.

    The solid of a second run is drawn in its pose, but where this one is: a row holds only the pose.
    """
    del past
    frame, state, row = step.frame, step.state, step.diagnostics
    width, height = scene.SIZE_PX
    primitives: dict[str, Primitive] = {"picture": Picture(paper(*scene.SIZE_PX))}
    if frame.measurements is not None:
        points = at_height(frame.measurements.points_px, 1.0)
        primitives["measurements"] = Links(points[:, None] + TICK, COLOURS["hidden"], 2.0, "measurements")
    primitives |= drawing.feature_clouds(state, 3.0)
    primitives |= _edges("estimated", _place_solid(state, state.estimate), COLOURS["estimate"], 3.0, "estimate")
    if other is not None:
        theta = np.array(other.estimate) / drawing.JUDGE.scale
        primitives |= _edges("second", _place_solid(state, theta), COLOURS["second"], 1.5, "second run")
    target = frame.target
    if isinstance(target, scene.PrismTarget):
        primitives |= _edges("true", _true(state, target), COLOURS["truth"], 1.0, "truth")
    primitives |= drawing.model_points(state, 4.0)
    primitives |= drawing.feature_marks(state, scene.NAMES)
    primitives |= drawing.feature_names(
        state, scene.NAMES, drawing.beside(state.project(scene.VERTICES_MM), scene.VERTICES_MM[:, :2], height)
    )
    if target is not None and target.landmarks is not None:
        primitives |= drawing.true_marks(target.landmarks, 3.0)
    primitives |= drawing.pose_axes(state, np.zeros(3), AXES_MM)
    primitives |= drawing.camera(state, scene.SIZE_PX)
    return Drawing(width, height, primitives, caption(row, step.tracker_title, error_words(row, "°")))


def _place_solid(state: PoseState, theta: Floats) -> Placed:
    """Return the solid at the believed place, at these angles."""
    return drawing.place_points(state, scene.VERTICES_MM, theta), scene.visible_faces(theta, state.translation_mm)


def _true(state: PoseState, target: scene.PrismTarget) -> Placed:
    """Return the solid where it is, over the same picture."""
    corners = scene.VERTICES_MM @ rotation(target.position).T + target.translation_mm
    pixels = pinhole(corners, state.solid.focal_px) + scene.PRINCIPAL_PX
    seen = scene.visible_faces(target.position, target.translation_mm)
    return np.column_stack([pixels, drawing.heights(state, corners[:, 2])]), seen


def _edges(name: str, placed: Placed, colour: Colour, width: float, layer: str) -> dict[str, Primitive]:
    """Draw a prism's edges, those between two hidden faces dashed."""
    corners, seen = placed
    edges = corners[np.array(scene.EDGES)].astype(np.float32)
    front = (SEEN_BY & seen).any(axis=1)
    return {
        f"{name} edges": Links(edges[front], colour, width, layer),
        f"{name} hidden edges": drawing.dashes(edges[~front], colour, width, layer),
    }


EXPERIMENT = Experiment(
    **read_words(
        FOLDER,
        TRACKERS,
        SHOWN_OF_POSES,
        Measured(drawing.pose_series(scene.NAMES), drawing.pose_measure, POSE_MEASURES),
    ),
    id="prism",
    simulate=simulate,
    draw=draw,
    judge=drawing.JUDGE,
    exports=(TrackedPrismParameters.guidance.export,),
    guidance=TrackedPrismParameters.guidance,
    model=MODEL,
)
