"""Trackers of a head: eleven features by their templates, by the methods of `pose` (Bando 2007, ch. 4 section 4).

Templates are cut from frame 0 around the features, and the pose is relative to that frame: there theta = 0
(`first_sight`). Another face model, camera or kind of template may be chosen in mid-run: it is then made from frame 0,
as at the start, and the pose continues from its last value.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray
from typing_extensions import override

from pftrack.core.arrays import Floats
from pftrack.core.model.series import SeriesValue
from pftrack.core.model.source import Frame, Target
from pftrack.core.model.tracker import Tracker
from pftrack.core.numerics.random import Gaussian, Stream
from pftrack.experiments.declared import read_reported
from pftrack.experiments.head import appearance, first_sight
from pftrack.experiments.head import parameters as face_growth
from pftrack.experiments.head.appearance import SEARCH_EVERY, FirstSight, HeadMemory, around, widen
from pftrack.experiments.head.detection import find_again
from pftrack.experiments.head.parameters import HeadTrackerParameters, position_variances
from pftrack.experiments.shared.pose import SHOWN_OF_POSES
from pftrack.experiments.shared.pose import methods as pose
from pftrack.experiments.shared.pose.calibrated import pose_and_band
from pftrack.experiments.shared.pose.layered import FeatureLikelihood
from pftrack.experiments.shared.pose.methods import METHODS, Method, measurement, report
from pftrack.experiments.shared.pose.state import PoseModel, PoseState, Solid
from pftrack.vision.face import FEATURES, FaceModel, fit_similarity
from pftrack.vision.likelihoods import separation, template
from pftrack.vision.likelihoods.template import Templates
from pftrack.vision.structure.growing import Growing

SERIES = tuple(read_reported(Path(__file__).parent, SHOWN_OF_POSES).values())
"""Caches of templates, and of a growing face model."""

RECOGNISED_CORRELATION = 0.5
"""From which correlation with its template on a feature counts as recognised."""

LEAST_RECOGNISED = 3
"""With fewer recognised features a frame is doubtful."""

LARGEST_MISFIT = 0.25
"""Largest median distance of the features from the pose's predictions, as a share of the eyes' distance."""


def head_measurement(method: Method) -> Callable[[PoseState], Mapping[str, SeriesValue]]:
    """Return a function that measures these series of a state; those of a growing model only where there is one."""
    layers = measurement(report(method, FEATURES))

    def measure(state: PoseState) -> Mapping[str, SeriesValue]:
        memory: HeadMemory = state.memory
        values = {
            **layers(state),
            "correlation": tuple(memory.correlations.tolist()),
            "template_likeness": tuple(memory.template_likeness.tolist()),
            "track_sd_px": tuple(_track_sd(state, memory).tolist()),
        }
        growth = memory.growth
        if growth is None:
            return values
        variances = np.trace(growth.covariances, axis1=1, axis2=2)
        return values | {
            "own_share": growth.weight,
            "own_probability": growth.probability,
            "own_advantage": growth.advantage,
            "free_energy": growth.free_energy,
            "shape_sd_mm": float(np.sqrt(variances.mean())),
            "shape_frames": float(growth.own.frames),
        }

    return measure


def _track_sd(state: PoseState, memory: HeadMemory) -> Floats:
    """Return the total error of each feature's position for learning the face, (F,) px; NaN if unknown."""
    variances = position_variances(state, memory.correlations, memory.sight.eye_distance_px, 0.0).mean(axis=1)
    return np.sqrt(np.where(np.isfinite(variances), variances, np.nan))


Look: TypeAlias = Callable[[Floats], Floats]
"""From positions (F, N, 2) px to correlations (F, N)."""

SAME_SIZE = (0.8, 1.25)
"""A face that is found again at a scale between these keeps its templates."""

FOUND_SD_RAD = float(np.deg2rad(10.0))
FOUND_SPREAD = 0.05
"""Spread of the particles of a face that is found again, as a share of the distance between its eyes."""

LEAST_CHANGE_MM = 0.2
"""A growing face makes another solid only when a coordinate of it has changed by this: less is seen by no template."""


def start(method: Method, target: Target, frame: Frame, parameters: HeadTrackerParameters, rng: Stream) -> PoseState:
    """Cut the templates and begin at the features of frame 0, where theta = 0.

    Raises:
        ValueError: The features are not given, not within the picture, or do not make a face.
    """
    landmarks = target.landmarks
    if landmarks is None:
        raise ValueError("a head is tracked by its features, got a target without any")
    sight = FirstSight(_grey(frame), landmarks.points_px, FaceModel(landmarks.model_mm, landmarks.names))
    return _begin(method, sight, parameters, rng)


def step(method: Method, state: PoseState, frame: Frame, parameters: HeadTrackerParameters, rng: Stream) -> PoseState:
    """Weigh particles by the picture's correlation with the templates; search for a lost face."""
    grey, state = _grey(frame), _form(state, parameters)
    memory: HeadMemory = state.memory
    if memory.lost:
        return _search(method, state, grey, parameters, rng)
    templates = memory.templates
    look = _look(state, grey, templates, parameters)

    def likelihood(hypothesis: PoseState) -> FeatureLikelihood:
        seen = look if hypothesis is state else _look(hypothesis, grey, templates, parameters)
        return partial(_log_likelihood, seen, parameters)

    belief = pose.advance(state, likelihood, parameters, method, rng)
    angles, excess = pose_and_band(state.excess_px2, state.solid, belief, parameters)
    switched = pose.has_switched(state.belief, belief)
    after = replace(state, belief=belief, pose=angles, switched=switched, excess_px2=excess)
    means = after.feature_means
    correlations = look(means[:, None])[:, 0]
    recognised = correlations >= RECOGNISED_CORRELATION
    misfit = memory.misfit(after.project(after.solid.points_mm), means)
    doubtful = int(recognised.sum()) < LEAST_RECOGNISED or misfit > LARGEST_MISFIT
    patience = parameters.patience_frames if parameters.find_again else 0
    memory = memory.judge(correlations, means, patience, doubtful=doubtful)
    after = replace(after, recognised=recognised)
    clear = belief.rival is None or belief.rival.all_visible
    if memory.growth is not None and clear and not doubtful:
        size_px = memory.sight.eye_distance_px
        memory = replace(memory, growth=face_growth.learn(memory.growth, after, correlations, size_px, parameters))
    if memory.reliefs is None and parameters.template_renewal > 0.0 and not memory.doubtful_frames:
        renewed = template.renew(templates, grey, means, parameters.template_renewal)
        memory = replace(memory, templates=renewed)
    return replace(after, memory=memory)


def _look(state: PoseState, grey: NDArray[np.uint8], templates: Templates, parameters: HeadTrackerParameters) -> Look:
    """Return the fit of features to their templates, flat ones or those in relief at the predicted pose."""
    memory: HeadMemory = state.memory
    if memory.reliefs is None:
        return lambda positions: template.correlations(grey, positions, templates)
    views = separation.project_views(memory.reliefs, pose.slopes(state, parameters))
    return appearance.Look(grey, memory.sight, views)


def _log_likelihood(look: Look, parameters: HeadTrackerParameters, positions: Floats) -> Floats:
    return template.score(look(positions), parameters.correlation_spread)


def _begin(
    method: Method, sight: FirstSight, parameters: HeadTrackerParameters, rng: Stream, growth: Growing | None = None
) -> PoseState:
    """Begin at first sight, with what is known of the person's face from before."""
    form, points_px = first_sight.form_of(parameters), sight.points_px
    templates = sight.templates(form.template_scale)
    growth = growth or first_sight.growth_of(sight, form, parameters)
    model = first_sight.model_of(sight, form, growth)
    solid, turn = first_sight.solid_of(sight, model, form)
    belief = pose.begin(solid, points_px, parameters, method, rng)
    bent = first_sight.reliefs_of(sight, model, form)
    memory = HeadMemory(templates, sight, form, model, turn, around(points_px), growth=growth, reliefs=bent)
    return PoseState(solid, belief, belief.pose, np.ones(len(points_px), np.bool_), memory=memory)


def _form(state: PoseState, parameters: HeadTrackerParameters) -> PoseState:
    """Make solid and templates again where the parameters that they depend on have changed."""
    memory, form = state.memory, first_sight.form_of(parameters)
    if not isinstance(memory, HeadMemory):
        raise TypeError(f"expected the state of a tracker of heads, got one with {type(memory).__name__}")
    if form == memory.form:
        return _grow(state)
    if form.template_scale != memory.form.template_scale:
        templates = memory.sight.templates(form.template_scale)
        resized = memory.form._replace(template_scale=form.template_scale)
        memory = replace(
            memory,
            templates=templates,
            form=resized,
            reliefs=first_sight.reliefs_of(memory.sight, memory.model, resized),
        )
    if form == memory.form:
        return replace(state, memory=memory)
    kept = memory.growth is not None and form.learned_from == memory.form.learned_from
    growth = memory.growth if kept else first_sight.growth_of(memory.sight, form, parameters)
    model = first_sight.model_of(memory.sight, form, growth)
    solid, turn = first_sight.solid_of(memory.sight, model, form, memory.enlarged)
    bent = first_sight.reliefs_of(memory.sight, model, form)
    memory = replace(memory, form=form, model=model, turn=turn, growth=growth, reliefs=bent)
    return replace(pose.transfer(state, solid, parameters), memory=memory)


def _grow(state: PoseState) -> PoseState:
    """Put what the face has grown to in the place of the face that was assumed; the belief follows it as it grows."""
    memory: HeadMemory = state.memory
    growth = memory.growth
    if growth is None or np.abs(growth.shape - memory.model.points_mm).max() < LEAST_CHANGE_MM:
        return state
    model = FaceModel(growth.shape)
    solid, turn = first_sight.solid_of(memory.sight, model, memory.form, memory.enlarged)
    return replace(state, solid=solid, memory=replace(memory, model=model, turn=turn))


def _search(
    method: Method, state: PoseState, grey: NDArray[np.uint8], parameters: HeadTrackerParameters, rng: Stream
) -> PoseState:
    """Look for a lost face now and then, and become less and less sure in between."""
    memory: HeadMemory = state.memory
    if memory.lost_frames % SEARCH_EVERY == 1:
        face = find_again(grey, memory.box, memory.model)
        if face is not None and first_sight.is_same_face(grey, memory.sight, face.points_px):
            return _resume(method, state, grey, face.points_px, parameters, rng)
    return replace(
        state,
        belief=pose.hold(state.belief),
        pose=widen(state.pose, np.deg2rad(parameters.pose_noise_deg)),
        recognised=np.zeros_like(state.recognised),
        switched=False,
        memory=replace(memory, lost_frames=memory.lost_frames + 1),
    )


def _resume(
    method: Method,
    state: PoseState,
    grey: NDArray[np.uint8],
    points_px: Floats,
    parameters: HeadTrackerParameters,
    rng: Stream,
) -> PoseState:
    """Continue with a face that was found again, in the pose from the picture."""
    memory: HeadMemory = state.memory
    moved = fit_similarity(memory.sight.points_px, points_px)
    growth = None if memory.growth is None else face_growth.widen_motion(memory.growth)
    if memory.reliefs is None and not SAME_SIZE[0] <= moved.scale <= SAME_SIZE[1]:
        return _begin(method, FirstSight(grey, points_px, memory.sight.own), parameters, rng, growth)
    solid, turn = first_sight.solid_of(memory.sight, memory.model, memory.form, moved.scale)
    roll = math.atan2(moved.rotation[1, 0], moved.rotation[0, 0])
    found = _judge_face(memory, solid, grey, points_px, roll, parameters)
    scale = moved.scale * found.scale
    if found.scale != 1.0:
        solid, turn = first_sight.solid_of(memory.sight, memory.model, memory.form, scale)
    theta = Gaussian(found.theta, FOUND_SD_RAD**2 * np.eye(3))
    spread_px = FOUND_SPREAD * memory.box[2] / 1.5
    belief = pose.begin(solid, found.points_px, parameters, method, rng, theta=theta, spread_px=spread_px)
    fresh = replace(
        memory,
        turn=turn,
        enlarged=scale,
        lost_frames=0,
        doubtful_frames=0,
        box=around(found.points_px),
        growth=growth,
    )
    return PoseState(solid, belief, belief.pose, np.ones(len(points_px), np.bool_), switched=True, memory=fresh)


def _judge_face(
    memory: HeadMemory,
    solid: Solid,
    grey: NDArray[np.uint8],
    points_px: Floats,
    roll_rad: float,
    parameters: HeadTrackerParameters,
) -> first_sight.Found:
    """Return how a face stands that was found: from the front but perhaps rolled, if templates are flat."""
    bent = memory.reliefs
    if bent is None:
        return first_sight.Found(np.array([0.0, 0.0, roll_rad]), 1.0, points_px)

    def scores(slopes: Floats, positions: Floats) -> Floats:
        look = appearance.Look(grey, memory.sight, separation.project_views(bent, slopes))
        return _log_likelihood(look, parameters, positions)

    return first_sight.pose_found(solid, points_px[first_sight.EYES], roll_rad, scores)


def _grey(frame: Frame) -> NDArray[np.uint8]:
    return template.luma(frame.picture)


class HeadModel(PoseModel):
    """Correlation of the picture with the templates at a pose's features, seen by a pinhole."""

    @override
    def prepare(self, state: PoseState, frame: Frame, parameters: HeadTrackerParameters) -> PoseState:
        return _form(state, parameters)

    @override
    def weigh(self, known: PoseState, frame: Frame, parameters: HeadTrackerParameters) -> FeatureLikelihood:
        look = _look(known, _grey(frame), known.memory.templates, parameters)
        return partial(_log_likelihood, look, parameters)


MODEL = HeadModel("templates of the features", FEATURES)


def _tracker(method: Method) -> Tracker:
    return Tracker(
        method,
        partial(start, method),
        partial(step, method),
        series=(*report(method, FEATURES), *SERIES),
        measure=head_measurement(method),
        searching=lambda state: state.memory.lost,
        model=MODEL,
    )


TRACKERS: dict[str, Tracker] = {method: _tracker(method) for method in METHODS}
"""The trackers of a head, by name, in the order in which they are shown."""
