"""What is made from the first sight of a face: its camera, the face that is assumed, the solid, templates in relief.

At first sight theta = 0, and the affine camera is the one that fits the face model to the features best. So a face
model that is not the person's own gives no constant error. The pinhole cannot be bent like that; for it the model is
turned to fit the first sight.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pftrack.core.geometry.camera import affine_fit, affine_projection, pinhole, pinhole_jacobian
from pftrack.core.geometry.rotation import rotation
from pftrack.core.numerics.gaussian import Gaussian
from pftrack.core.numerics.matrices import contiguous_copy, product
from pftrack.core.numerics.random import Purpose, Stream
from pftrack.experiments.head.trackers import growth as face_growth
from pftrack.experiments.head.trackers import reliefs
from pftrack.experiments.head.trackers.memory import FirstSight, Form
from pftrack.experiments.head.trackers.parameters import HeadTrackerParameters
from pftrack.experiments.head.trackers.starting_face import starting_model
from pftrack.experiments.shared.pose import methods as pose
from pftrack.experiments.shared.pose.calibrated import pin
from pftrack.experiments.shared.pose.solid import STUDENT_4, STUDENT_8, Solid, Widths
from pftrack.filters.perspective import PerspectiveLayer
from pftrack.vision.geometry.face_model import FaceModel, mean_model
from pftrack.vision.likelihoods.relief import Reliefs
from pftrack.vision.structure.growing import Growing

__all__ = ["camera_of", "fit_pose", "form_of", "growth_of", "model_of", "reliefs_of", "solid_of"]

LEAST_SCALE = 0.02
"""Of a camera, px/mm; what is smaller shows no face."""


class Doubt(NamedTuple):
    """What a calibrated band takes the points of a face to be off by.

    Attributes:
        misfit_share: See `Solid`.
        depth: By which share the depth of a face may be wrong that is the mean one or has begun as that; it stands for
            all errors that grow with the turn.
        own_depth: The same of the person's own face.
        widths: Of its errors, in standard deviations.
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
camera, 200 to 223 before the pinhole. In relief before the affine camera nobody looked."""

NECK_RAD = float(np.deg2rad(40.0))
"""How far a head turns from where it was at first sight, as a standard deviation."""

FIT_ROUNDS = 12
FIT_NOISE = np.array([0.2, 0.2, 0.2, 200.0, 200.0, 400.0])


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


def form_of(parameters: HeadTrackerParameters) -> Form:
    """Return by which of the parameters all this is made."""
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


def reliefs_of(sight: FirstSight, model: FaceModel, form: Form) -> Reliefs | None:
    """Return the templates in relief, if so asked for, as the face was at first sight, however large it is now."""
    if form.templates == "flat":
        return None
    solid, turn = solid_of(sight, model, form)
    return reliefs.cut(sight, form.template_scale, model, solid, turn, form.upper_layer)


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


def solid_of(
    sight: FirstSight, model: FaceModel, form: Form, enlarged: float = 1.0
) -> tuple[Solid, NDArray[np.float64]]:
    """Return the head as a solid that is at theta = 0 at first sight, and how its frame is turned from the model's.

    Args:
        sight: The picture.
        model: The face that is assumed.
        form: How it is made.
        enlarged: How many times as large as at first sight an affine camera sees it now.

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


def _where(points_mm: NDArray[np.float64], pinned_mm: NDArray[np.float64], form: Form) -> NDArray[np.float64]:
    """Return the points of the solid: templates in relief know where each of them is at first sight."""
    return points_mm if form.templates == "flat" else pinned_mm


def fit_pose(
    points_mm: NDArray[np.float64],
    pixels: NDArray[np.float64],
    focal_px: float,
    principal_px: NDArray[np.float64],
    place_mm: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
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
