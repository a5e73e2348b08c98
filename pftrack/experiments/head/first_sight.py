"""Models made from the first sight of a face, and the check that a found face is the lost one.

At first sight theta = 0, and the affine camera is the one that fits the face model to the features best. So a face
model of another person does not give a constant error. The pinhole has no such freedom; for it the model is turned to
fit the first sight.
"""

import itertools
import math
from collections.abc import Callable
from typing import NamedTuple, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Floats
from pftrack.core.geometry import rotation
from pftrack.core.numerics.elementary import exponentials
from pftrack.core.numerics.matrices import (
    affine_fit,
    affine_projection,
    contiguous_copy,
    pinhole,
    pinhole_jacobian,
    product,
)
from pftrack.core.numerics.random import Gaussian, Purpose, Stream
from pftrack.experiments.head import appearance
from pftrack.experiments.head import parameters as face_growth
from pftrack.experiments.head.appearance import FirstSight, Form
from pftrack.experiments.head.parameters import HeadTrackerParameters, starting_model
from pftrack.experiments.shared.pose import methods as pose
from pftrack.experiments.shared.pose.calibrated import pin
from pftrack.experiments.shared.pose.state import STUDENT_4, STUDENT_8, Solid, Widths
from pftrack.filters.perspective import PerspectiveLayer
from pftrack.vision.face import FEATURES, FaceModel, fit_similarity, mean_model
from pftrack.vision.likelihoods import template
from pftrack.vision.likelihoods.separation import Reliefs
from pftrack.vision.structure.growing import Growing

LEAST_SCALE = 0.02
"""Least scale of a camera, px/mm; a smaller one does not show a face."""


class Doubt(NamedTuple):
    """Errors of a face's points that a calibrated band assumes.

    Attributes:
        misfit_share: See `Solid`.
        depth: Relative error of the depth of a face that is, or began as, the mean one; it represents all errors that
            grow with the turn.
        own_depth: The same of the person's own face.
        widths: Widths of its errors, in standard deviations.
    """

    misfit_share: float
    depth: float
    own_depth: float
    widths: Widths = STUDENT_4


BEFORE_AFFINE = Doubt(0.8, depth=0.5, own_depth=0.3)
DOUBTS = {
    ("flat", "affine"): BEFORE_AFFINE,
    ("relief", "affine"): BEFORE_AFFINE,
    ("flat", "perspective"): Doubt(1.2, depth=0.7, own_depth=0.7),
    ("relief", "perspective"): Doubt(0.4, depth=0.45, own_depth=0.25, widths=STUDENT_8),
}
"""By templates and camera, chosen by how often bands held the truth of simulated people: 200 to 207 before the affine
camera, 200 to 223 before the pinhole. Templates in relief before the affine camera were not measured."""

NECK_RAD = float(np.deg2rad(40.0))
"""Standard deviation of a head's turn from first sight."""

FIT_ROUNDS = 12
FIT_NOISE = np.array([0.2, 0.2, 0.2, 200.0, 200.0, 400.0])


def camera_of(model: FaceModel, points_px: Floats) -> Floats:
    """Return the affine camera (2, 4) that sees a face at these points, px.

    Raises:
        ValueError: The points do not make a face.
    """
    camera = affine_fit(model.points_mm, points_px)
    if _least_scale(camera[:, :3]) < LEAST_SCALE:
        raise ValueError("expected points that make a face, got points that lie on one line or all in one place")
    return camera


def _least_scale(slopes: Floats) -> float:
    """Return the smaller singular value of a (2, 3) matrix: the area that its rows span, by the larger one."""
    first, second = np.square(slopes).sum(axis=1)
    mixed = float((slopes[0] * slopes[1]).sum())
    larger = 0.5 * (first + second + math.hypot(first - second, 2.0 * mixed))
    area = np.square(np.cross(slopes[0], slopes[1])).sum()
    return math.sqrt(area / larger) if larger > 0.0 else 0.0


def form_of(parameters: HeadTrackerParameters) -> Form:
    """Return by which of the parameters all this is made."""
    grows = parameters.face_model == "growing"
    return Form(
        parameters.face_model,
        parameters.upper_layer,
        parameters.focal_widths,
        parameters.template_scale,
        parameters.starting_face if grows else "",
        parameters.templates,
    )


def reliefs_of(sight: FirstSight, model: FaceModel, form: Form) -> Reliefs | None:
    """Return the templates in relief, if so asked for, as the face was at first sight, however large it is now."""
    if form.templates == "flat":
        return None
    solid, turn = solid_of(sight, model, form)
    return appearance.cut(sight, form.template_scale, model, solid, turn, form.upper_layer)


def growth_of(sight: FirstSight, form: Form, parameters: HeadTrackerParameters) -> Growing | None:
    """Return a face that begins to grow, if one is asked for."""
    if form.face_model != "growing":
        return None
    start = starting_model(form.starting_face) if form.starting_face else mean_model()
    return face_growth.begin(start, form.focal_widths * sight.grey.shape[1], parameters)


def model_of(sight: FirstSight, form: Form, growth: Growing | None) -> FaceModel:
    """Return the face that is assumed: what has grown, the mean face, or the person's own."""
    if growth is not None:
        return FaceModel(growth.shape)
    return mean_model() if form.face_model == "mean" else sight.own


def solid_of(sight: FirstSight, model: FaceModel, form: Form, enlarged: float = 1.0) -> tuple[Solid, Floats]:
    """Return the head as a solid that is at theta = 0 at first sight, and how its frame is turned from the model's.

    Args:
        sight: The picture.
        model: The face that is assumed.
        form: Its parameters.
        enlarged: Present size for an affine camera, relative to first sight.

    Returns:
        The solid, and (3, 3) from the model's frame to its own.

    Raises:
        ValueError: The features do not make a face.
    """
    points_px, (height, width) = sight.points_px, sight.grey.shape
    camera = camera_of(model, points_px)
    doubt = DOUBTS[form.templates, form.upper_layer]
    share, depth = doubt.misfit_share, doubt.own_depth if form.face_model == "personal" else doubt.depth
    focal_px, principal_px = form.focal_widths * width, np.array([width, height]) / 2.0
    place = pose.translation(model.points_mm, points_px, focal_px, principal_px)
    if form.upper_layer == "affine":
        points_mm, seen_px = contiguous_copy(model.points_mm), affine_projection(camera, model.points_mm)
        known = pin(points_mm, points_px, seen_px, np.tile(camera[:, :3], (len(points_px), 1, 1)))
        camera[:, :3] *= enlarged
        shown_mm = _where(model.points_mm, known, form)
        solid = Solid(shown_mm, camera, focal_px, principal_px, place, known, depth, share, widths=doubt.widths)
        return solid, np.eye(3)
    theta, place = fit_pose(model.points_mm, points_px, focal_px, principal_px, place)
    turn = rotation(theta)
    camera[:, :3] = product(enlarged * camera[:, :3], turn.T)
    points_mm = product(model.points_mm, turn.T)
    expected, slopes = pinhole(points_mm + place, focal_px), pinhole_jacobian(points_mm + place, focal_px)
    known = pin(contiguous_copy(points_mm), points_px - principal_px, expected, slopes)
    points_mm = _where(points_mm, known, form)
    reach = math.inf if form.templates == "flat" else NECK_RAD
    solid = Solid(points_mm, camera, focal_px, principal_px, place, known, depth, share, reach, doubt.widths)
    return solid, turn


def _where(points_mm: Floats, pinned_mm: Floats, form: Form) -> Floats:
    """Return the points of the solid: templates in relief have their places at first sight."""
    return points_mm if form.templates == "flat" else pinned_mm


def fit_pose(
    points_mm: Floats,
    pixels: Floats,
    focal_px: float,
    principal_px: Floats,
    place_mm: Floats,
) -> tuple[Floats, Floats]:
    """Return angles (3,) rad and place (3,) mm at which a pinhole sees points best, by repeating its layer's update.

    Args:
        points_mm: (F, 3).
        pixels: (F, 2) where they are seen.
        focal_px: Focal length.
        principal_px: (2,) principal point.
        place_mm: (3,) where they are about, in the camera's frame.
    """
    start_at = np.concatenate([np.zeros(3), place_mm])
    layer = PerspectiveLayer(points_mm, focal_px, start_at, principal_px, FIT_NOISE)
    belief, variances, nothing = layer.begin(), np.ones_like(pixels), Stream(0, 0, Purpose.START)
    for _ in range(FIT_ROUNDS):
        found = layer.update(belief, pixels, variances, nothing).mean[:6]
        belief = Gaussian(np.concatenate([found, found]), belief.covariance)
    return belief.mean[:3], belief.mean[3:6]


# A finder takes a mouth and a chin for a small face now and then, mostly while the true one is turned away. Enough
# features of the lost face must look there as they did at first sight.
#
# The finder gives the eyes' places, but of the pose only that the face is not seen from the side. If a turned face is
# taken for a frontal one, its features are misplaced, and templates follow the wrong places. Templates in relief
# distinguish poses: several are tried, and each predicts the places and the look of the features for the found eyes.
# Flat templates look alike from everywhere, and gained nothing by it.

ALIKE = 0.6
FEWEST_ALIKE = 5
"""Number of features that must correlate with their templates, and the least correlation. On six simulated people, 220
to 225, in two sizes, 650 of 655 faces have them that were found where the face is, and none of 9 that were found
elsewhere."""

ALIKE_REACH, ALIKE_STEPS = 0.15, 9
"""Radius of the search for each, as a share of the distance between the eyes, and number of steps along a side."""

YAWS_RAD = np.deg2rad(np.arange(-45.0, 46.0, 15.0))
PITCHES_RAD = np.deg2rad(np.arange(-20.0, 21.0, 20.0))
TURNED_SD_RAD = float(np.deg2rad(25.0))
"""Standard deviations of the angles of found faces, about those of a frontal face."""

REACH, STEPS = 0.12, 5
"""The same for a feature that is searched where a pose predicts it."""

SHARED = 0.2
"""Weight of the features' log likelihood: their errors are correlated, since all depend on the eyes. This was the best
of 0, 0.05, 0.2 and 0.5, tried on four people, 226 to 229."""

EYES = [FEATURES.index("reye"), FEATURES.index("leye")]

Scores: TypeAlias = Callable[[Floats, Floats], Floats]
"""From slopes (F, 2, 3), px/mm, and positions (F, N, 2) px to log likelihoods (F, N)."""


class Found(NamedTuple):
    """A face that was found again.

    Attributes:
        theta: (3,) angles of the solid, rad.
        scale: Its size relative to the solid's camera.
        points_px: (F, 2) its features.
    """

    theta: Floats
    scale: float
    points_px: Floats


def is_same_face(grey: NDArray[np.uint8], sight: FirstSight, points_px: Floats) -> bool:
    """Return whether found features look like those of a face at first sight, at the same size and upright.

    Args:
        grey: (height, width), 8 bit.
        sight: First sight of the lost face.
        points_px: (F, 2) where its features would be.
    """
    moved = fit_similarity(sight.points_px, points_px)
    turn = moved.scale * moved.rotation[:2, :2]
    there = np.column_stack([turn, points_px.mean(axis=0) - product(turn, sight.points_px.mean(axis=0))])
    how = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    as_then = np.empty_like(sight.grey)
    cv2.warpAffine(grey, there, as_then.shape[::-1], as_then, flags=how, borderMode=cv2.BORDER_REPLICATE)
    around = sight.points_px[:, None] + _offsets(ALIKE_REACH * sight.eye_distance_px, ALIKE_STEPS)
    alike = template.correlations(as_then, around, sight.templates(1.0)).max(axis=1)
    return int((alike >= ALIKE).sum()) >= FEWEST_ALIKE


def pose_found(solid: Solid, eyes_px: Floats, roll_rad: float, scores: Scores) -> Found:
    """Return how a face stands on average over the hypotheses.

    Args:
        solid: The head, before an affine camera that sees it about as large as it is now.
        eyes_px: (2, 2) where the right and the left eye were found.
        roll_rad: Roll of the head, by its eyes.
        scores: Scores of the picture.
    """
    thetas = np.array([(pitch, yaw, roll_rad) for pitch, yaw in itertools.product(PITCHES_RAD, YAWS_RAD)])
    told = np.array([_judge(solid, eyes_px, theta, scores)[1] for theta in thetas])
    log_weights = SHARED * told - 0.5 * np.square(thetas[:, :2] / TURNED_SD_RAD).sum(axis=1)
    weights = exponentials(log_weights - log_weights.max())
    return _judge(solid, eyes_px, (weights[:, None] * thetas).sum(axis=0) / weights.sum(), scores)[0]


def _judge(solid: Solid, eyes_px: Floats, theta: Floats, scores: Scores) -> tuple[Found, float]:
    """Return where the features are by a pose, and its log likelihood."""
    slopes = product(solid.reference[:, :3], rotation(theta))
    seen = product(solid.points_mm, slopes.T)
    apart, across = (float(np.hypot(*(eyes[1] - eyes[0]))) for eyes in (seen[EYES], eyes_px))
    scale = across / apart
    places = scale * (seen - seen[EYES].mean(axis=0)) + eyes_px.mean(axis=0)
    around = places[:, None] + _offsets(REACH * across, STEPS)
    told = scores(np.tile(scale * slopes, (len(places), 1, 1)), around)
    best, each = told.argmax(axis=1), np.arange(len(places))
    return Found(theta, scale, around[each, best]), float(told[each, best].sum())


def _offsets(reach_px: float, steps: int) -> Floats:
    """Return the points (steps * steps, 2) of a grid about 0."""
    along = np.linspace(-reach_px, reach_px, steps)
    return np.stack(np.meshgrid(along, along), axis=2).reshape(-1, 2)
