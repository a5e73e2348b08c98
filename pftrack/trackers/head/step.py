"""Trackers of a head: eleven features by their templates, by the methods of `pose` (document 1, ch. 4 section 4).

Templates are cut from frame 0 around the features, and the pose is relative to that frame: there theta = 0, and the
affine camera is the one that fits the face model to the features best. So a face model that is not the person's own
gives no constant error. The pinhole cannot be bent like that; for it the model is turned to fit frame 0.

Another face model, another camera or other templates may be chosen in mid-run: they are then made from frame 0, as they
would have been there, and the pose goes on from where it was.
"""

import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from pftrack.detection.face import find_again
from pftrack.elementary import exponential, logarithm
from pftrack.filters.perspective import PerspectiveLayer
from pftrack.frame import Frame, Target
from pftrack.gaussian import Gaussian
from pftrack.geometry.camera import affine_fit, affine_projection, pinhole, pinhole_jacobian
from pftrack.geometry.face_model import FaceModel, fit_similarity, mean_model
from pftrack.geometry.rotation import rotation
from pftrack.likelihoods import relief, template
from pftrack.likelihoods.relief import Reliefs
from pftrack.likelihoods.template import Templates
from pftrack.likelihoods.template_bank import TemplateBank
from pftrack.matrices import owned, product
from pftrack.random import Purpose, Stream
from pftrack.structure.growing import Growing
from pftrack.trackers.head import growth as face_growth
from pftrack.trackers.head import reliefs
from pftrack.trackers.head.memory import SEARCH_EVERY, FirstSight, Form, HeadMemory, around, eye_distance, widened
from pftrack.trackers.head.parameters import HeadTrackerParameters
from pftrack.trackers.head.reports import head_measurement, head_series
from pftrack.trackers.head.starting_face import starting_model
from pftrack.trackers.pose import methods as pose
from pftrack.trackers.pose.calibrated import pinned, pose_and_band
from pftrack.trackers.pose.methods import METHODS, Method
from pftrack.trackers.pose.solid import STUDENT_4, Solid
from pftrack.trackers.pose.state import PoseState
from pftrack.trackers.tracker import Tracker

__all__ = ["TRACKERS", "camera_of"]

Look: TypeAlias = Callable[[NDArray[np.float64]], NDArray[np.float64]]
"""From positions (F, N, 2) px to correlations (F, N)."""

LEAST_SCALE = 0.02
"""Of a camera, px/mm; what is smaller shows no face."""

SAME_SIZE = (0.8, 1.25)
"""A face that is found again at a scale between these keeps its templates."""

FOUND_SD_RAD = float(np.deg2rad(10.0))
FOUND_SPREAD = 0.05
"""Spread of the particles of a face that is found again, as a share of the distance between its eyes."""

DEPTH_DOUBT = {"mean": 0.5, "personal": 0.3, "growing": 0.5}
"""By which share the depth of a face may be wrong, by face model; it stands for all errors that grow with the turn."""

MISFIT_SHARE = 0.8
"""This and the above were chosen on eight simulated people, 200 to 207, by how often their bands held the truth."""

LEAST_CHANGE_MM = 0.2
"""A growing face makes another solid only when a coordinate of it has changed by this: less is seen by no template."""

NECK_RAD = float(np.deg2rad(40.0))
"""How far a head turns from where it was at first sight, as a standard deviation."""

FIT_ROUNDS = 12
FIT_NOISE = np.array([0.2, 0.2, 0.2, 200.0, 200.0, 400.0])


def start(method: Method, target: Target, frame: Frame, parameters: HeadTrackerParameters, rng: Stream) -> PoseState:
    """Cut the templates and begin at the features of frame 0, where theta = 0.

    Raises:
        ValueError: The features are not given, not within the picture, or do not make a face.
    """
    landmarks = target.landmarks
    if landmarks is None:
        raise ValueError("a head is tracked by its features, got a target without any")
    sight = FirstSight(_grey(frame), landmarks.points_px, FaceModel(landmarks.model_mm, landmarks.names))
    return _begun(method, sight, parameters, rng)


def camera_of(model: FaceModel, points_px: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the affine camera (2, 4) that sees a face at these points, px.

    Raises:
        ValueError: The points do not make a face.
    """
    camera = affine_fit(model.points_mm, points_px)
    if _least_scale(camera[:, :3]) < LEAST_SCALE:
        raise ValueError("expected points that make a face, got points that lie on one line or all in one place")
    return camera


def _least_scale(slopes: NDArray[np.float64]) -> float:
    """Return the smaller singular value of a (2, 3) matrix: the area that its rows span, by the larger one."""
    first, second = np.square(slopes).sum(axis=1)
    mixed = float((slopes[0] * slopes[1]).sum())
    larger = 0.5 * (first + second + math.hypot(first - second, 2.0 * mixed))
    area = np.square(np.cross(slopes[0], slopes[1])).sum()
    return math.sqrt(area / larger) if larger > 0.0 else 0.0


def step(method: Method, state: PoseState, frame: Frame, parameters: HeadTrackerParameters, rng: Stream) -> PoseState:
    """Weigh particles by how well the picture there correlates with the templates; look for a face that is lost."""
    grey, state = _grey(frame), _formed(state, parameters)
    memory = _memory(state)
    if memory.lost:
        return _searched(method, state, grey, parameters, rng)
    templates = memory.templates(state.pose.mean, by_pose=parameters.templates_by_pose)
    look = _look(state, grey, templates, parameters)
    belief = pose.advance(state, partial(_log_likelihood, look, parameters), parameters, method, rng)
    angles, calibration = pose_and_band(state.calibration, state.solid, belief, parameters)
    switched = pose.switched(state.belief, belief)
    after = replace(state, belief=belief, pose=angles, switched=switched, calibration=calibration)
    means = after.feature_means
    correlations = look(means[:, None])[:, 0]
    recognised = correlations >= parameters.recognised_correlation
    misfit = memory.misfit(after.seen(after.solid.points_mm), means)
    doubtful = int(recognised.sum()) < parameters.least_recognised or misfit > parameters.largest_misfit
    patience = parameters.patience_frames if parameters.find_again else 0
    memory = memory.judged(correlations, means, patience, doubtful=doubtful)
    after = replace(after, recognised=recognised)
    if memory.growth is not None and not doubtful:
        size_px = eye_distance(memory.sight.points_px)
        memory = replace(memory, growth=face_growth.taught(memory.growth, after, correlations, size_px, parameters))
    return replace(after, memory=_learned(memory, grey, after, templates, parameters))


def _look(state: PoseState, grey: NDArray[np.uint8], templates: Templates, parameters: HeadTrackerParameters) -> Look:
    """Return how well features look like their templates, flat ones or those in relief as the head will stand."""
    bent = _memory(state).reliefs
    if bent is None:
        return lambda positions: template.correlations(grey, positions, templates)
    views = relief.seen(bent, pose.slopes(state, parameters))
    detail = reliefs.detail(grey, _memory(state).sight)
    return lambda positions: relief.correlations(detail, positions, views)


def _log_likelihood(
    look: Look, parameters: HeadTrackerParameters, positions: NDArray[np.float64]
) -> NDArray[np.float64]:
    scores = template.scored(look(positions), parameters.correlation_spread)
    if parameters.hidden_weight > 0.0:
        scores = logarithm(exponential(scores) + parameters.hidden_weight)
    return scores


def _begun(
    method: Method, sight: FirstSight, parameters: HeadTrackerParameters, rng: Stream, growth: Growing | None = None
) -> PoseState:
    """Begin at first sight, with what is known of the person's face from before."""
    form, points_px = _form(parameters), sight.points_px
    bank = TemplateBank.begin(sight.templates(form.template_scale))
    growth = growth or _growth(sight, form, parameters)
    model = _model(sight, form, growth)
    solid, turn = _solid(sight, model, form)
    belief = pose.begin(solid, points_px, parameters, method, rng)
    relief_templates = _reliefs(sight, model, form, solid, turn)
    memory = HeadMemory(bank, sight, form, model, turn, around(points_px), growth=growth, reliefs=relief_templates)
    return PoseState(solid, belief, belief.pose, np.ones(len(points_px), np.bool_), memory=memory)


def _formed(state: PoseState, parameters: HeadTrackerParameters) -> PoseState:
    """Make solid and templates again where the parameters that they depend on have changed."""
    memory, form = _memory(state), _form(parameters)
    if form == memory.form:
        return _grown(state)
    if form.template_scale != memory.form.template_scale:
        bank = TemplateBank.begin(memory.sight.templates(form.template_scale))
        memory = replace(memory, bank=bank, form=memory.form._replace(template_scale=form.template_scale))
    if form == memory.form and form.templates == "flat":
        return replace(state, memory=memory)
    kept = memory.growth is not None and form.learned_from == memory.form.learned_from
    growth = memory.growth if kept else _growth(memory.sight, form, parameters)
    model = _model(memory.sight, form, growth)
    solid, turn = _solid(memory.sight, model, form, memory.enlarged)
    relief_templates = _reliefs(memory.sight, model, form, solid, turn)
    memory = replace(memory, form=form, model=model, turn=turn, growth=growth, reliefs=relief_templates)
    return replace(pose.transferred(state, solid, parameters), memory=memory)


def _grown(state: PoseState) -> PoseState:
    """Put what the face has grown to in the place of the face that was assumed; the belief follows it as it grows."""
    memory = _memory(state)
    growth = memory.growth
    if growth is None or np.abs(growth.shape - memory.model.points_mm).max() < LEAST_CHANGE_MM:
        return state
    model = FaceModel(growth.shape)
    solid, turn = _solid(memory.sight, model, memory.form, memory.enlarged)
    return replace(state, solid=solid, memory=replace(memory, model=model, turn=turn))


def _form(parameters: HeadTrackerParameters) -> Form:
    grows = parameters.face_model == "growing"
    return Form(
        parameters.face_model,
        parameters.upper_layer,
        parameters.focal_widths,
        parameters.template_scale,
        parameters.model_restarts if grows else 0,
        parameters.starting_face if grows else "",
        parameters.templates,
    )


def _reliefs(
    sight: FirstSight, model: FaceModel, form: Form, solid: Solid, turn: NDArray[np.float64]
) -> Reliefs | None:
    """Return the templates in relief, if so asked for."""
    if form.templates == "flat":
        return None
    return reliefs.cut(sight, form.template_scale, model, solid, turn, form.upper_layer)


def _growth(sight: FirstSight, form: Form, parameters: HeadTrackerParameters) -> Growing | None:
    """Return a face that begins to grow, if one is asked for."""
    if form.face_model != "growing":
        return None
    start = starting_model(form.starting_face) if form.starting_face else mean_model()
    return face_growth.begun(start, form.focal_widths * sight.grey.shape[1], parameters)


def _model(sight: FirstSight, form: Form, growth: Growing | None) -> FaceModel:
    if growth is not None:
        return FaceModel(growth.shape)
    return mean_model() if form.face_model == "mean" else sight.own


def _solid(sight: FirstSight, model: FaceModel, form: Form, enlarged: float = 1.0) -> tuple[Solid, NDArray[np.float64]]:
    """Return the head as a solid that is at theta = 0 at first sight, and how its frame is turned from the model's."""
    points_px, (height, width) = sight.points_px, sight.grey.shape
    camera = camera_of(model, points_px)
    doubt = DEPTH_DOUBT[form.face_model]
    focal_px, principal_px = form.focal_widths * width, np.array([width, height]) / 2.0
    place = pose.translation(model.points_mm, points_px, focal_px, principal_px)
    if form.upper_layer == "affine":
        points_mm, seen_px = owned(model.points_mm), affine_projection(camera, model.points_mm)
        known = pinned(points_mm, points_px, seen_px, np.tile(camera[:, :3], (len(points_px), 1, 1)))
        camera[:, :3] *= enlarged
        shown_mm = _where(model.points_mm, known, form)
        solid = Solid(shown_mm, camera, focal_px, principal_px, place, known, doubt, MISFIT_SHARE, widths=STUDENT_4)
        return solid, np.eye(3)
    theta, place = _fitted(model.points_mm, points_px, focal_px, principal_px, place)
    turn = rotation(theta)
    camera[:, :3] = product(enlarged * camera[:, :3], turn.T)
    points_mm = product(model.points_mm, turn.T)
    expected, slopes = pinhole(points_mm + place, focal_px), pinhole_jacobian(points_mm + place, focal_px)
    known = pinned(owned(points_mm), points_px - principal_px, expected, slopes)
    points_mm = _where(points_mm, known, form)
    reach = math.inf if form.templates == "flat" else NECK_RAD
    solid = Solid(points_mm, camera, focal_px, principal_px, place, known, doubt, MISFIT_SHARE, reach, STUDENT_4)
    return solid, turn


def _where(points_mm: NDArray[np.float64], pinned_mm: NDArray[np.float64], form: Form) -> NDArray[np.float64]:
    """Return the points of the solid: templates in relief know where each of them is at first sight."""
    return points_mm if form.templates == "flat" else pinned_mm


def _fitted(
    points_mm: NDArray[np.float64],
    pixels: NDArray[np.float64],
    focal_px: float,
    principal_px: NDArray[np.float64],
    place_mm: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return angles (3,) and place (3,) at which a pinhole sees points best, by repeating the layer's own update."""
    start_at = np.concatenate([np.zeros(3), place_mm])
    layer = PerspectiveLayer(points_mm, focal_px, start_at, principal_px, FIT_NOISE)
    belief = layer.begin()
    for _ in range(FIT_ROUNDS):
        found = layer.update(belief, pixels, np.ones_like(pixels), Stream(0, 0, Purpose.START))
        belief = Gaussian(np.tile(found.mean[:6], 2), belief.covariance)
    return belief.mean[:3], belief.mean[3:6]


def _searched(
    method: Method, state: PoseState, grey: NDArray[np.uint8], parameters: HeadTrackerParameters, rng: Stream
) -> PoseState:
    """Look for a lost face now and then, and become less and less sure in between."""
    memory = _memory(state)
    if memory.lost_frames % SEARCH_EVERY == 1:
        face = find_again(grey, memory.box, memory.model)
        if face is not None:
            return _resumed(method, state, grey, face.points_px, parameters, rng)
    return replace(
        state,
        pose=widened(state.pose, np.deg2rad(parameters.pose_noise_deg)),
        recognised=np.zeros_like(state.recognised),
        switched=False,
        memory=replace(memory, lost_frames=memory.lost_frames + 1),
    )


def _resumed(
    method: Method,
    state: PoseState,
    grey: NDArray[np.uint8],
    points_px: NDArray[np.float64],
    parameters: HeadTrackerParameters,
    rng: Stream,
) -> PoseState:
    """Go on with a face that was found again, as seen from the front but perhaps rolled."""
    memory = _memory(state)
    moved = fit_similarity(memory.sight.points_px, points_px)
    growth = None if memory.growth is None else face_growth.again(memory.growth)
    if memory.reliefs is None and not SAME_SIZE[0] <= moved.scale <= SAME_SIZE[1]:
        return _begun(method, FirstSight(grey, points_px, memory.sight.own), parameters, rng, growth)
    solid, turn = _solid(memory.sight, memory.model, memory.form, moved.scale)
    roll = math.atan2(moved.rotation[1, 0], moved.rotation[0, 0])
    theta = Gaussian(np.array([0.0, 0.0, roll]), FOUND_SD_RAD**2 * np.eye(3))
    spread_px = FOUND_SPREAD * memory.box[2] / 1.5
    belief = pose.begin(solid, points_px, parameters, method, rng, theta=theta, spread_px=spread_px)
    fresh = replace(
        memory,
        turn=turn,
        enlarged=moved.scale,
        lost_frames=0,
        doubtful_frames=0,
        box=around(points_px),
        growth=growth,
    )
    return PoseState(solid, belief, belief.pose, np.ones(len(points_px), np.bool_), switched=True, memory=fresh)


def _learned(
    memory: HeadMemory,
    grey: NDArray[np.uint8],
    state: PoseState,
    templates: Templates,
    parameters: HeadTrackerParameters,
) -> HeadMemory:
    """Renew flat templates, or gather those of this pose, if so asked for."""
    bank = memory.bank
    if memory.reliefs is not None:
        return memory
    if parameters.templates_by_pose:
        bank = bank.learn(grey, state.feature_means, state.pose.mean, float(memory.correlations.mean()))
    elif parameters.template_renewal > 0.0 and not memory.doubtful_frames:
        bank = TemplateBank.begin(template.renewed(templates, grey, state.feature_means, parameters.template_renewal))
    return memory if bank is memory.bank else replace(memory, bank=bank)


def _memory(state: PoseState) -> HeadMemory:
    memory = state.memory
    if not isinstance(memory, HeadMemory):
        raise TypeError(f"expected the state of a tracker of heads, got one with {type(memory).__name__}")
    return memory


def _grey(frame: Frame) -> NDArray[np.uint8]:
    if frame.image_rgb is None:
        raise ValueError("a head is tracked in pictures, got a frame without one")
    return template.luma(frame.image_rgb)


def _tracker(method: Method, title: str, description: str) -> Tracker:
    return Tracker(
        method,
        title,
        description,
        partial(start, method),
        partial(step, method),
        series=head_series(method),
        measure=head_measurement(method),
        searching=lambda state: _memory(state).lost,
    )


TRACKERS: dict[str, Tracker] = {method: _tracker(method, *words) for method, words in METHODS.items()}
"""The trackers of a head, by name, in the order in which they are shown."""
