"""The methods by which a solid is tracked: where they begin, and what they refuse."""

import numpy as np
import pytest

from pftrack.core.geometry import rotation
from pftrack.core.model.parameters import revise
from pftrack.core.model.source import Frame, History, Landmarks, Target
from pftrack.core.numerics.matrices import pinhole
from pftrack.core.numerics.random import Gaussian, Purpose, Stream
from pftrack.experiments.head import trackers as head
from pftrack.experiments.head.parameters import HeadTrackerParameters
from pftrack.experiments.prism import experiment as prism
from pftrack.experiments.prism.experiment import TrackedPrismParameters
from pftrack.experiments.prism.scene import VERTICES_MM, PrismSource
from pftrack.experiments.shared.pose import methods as pose
from pftrack.experiments.shared.pose.calibrated import AS_PUBLISHED, PoseTrackerParameters
from pftrack.experiments.shared.pose.drawing import place_points
from pftrack.experiments.shared.pose.layered import Layered
from pftrack.experiments.shared.pose.state import PoseState, Solid
from pftrack.filters.rao_blackwell import RaoBlackwell
from pftrack.vision.face import FEATURES, mean_model

FOCAL, PRINCIPAL = 800.0, np.array([320.0, 240.0])
PLACE = np.array([20.0, -10.0, 700.0])
SOLID = Solid(
    mean_model().points_mm,
    np.column_stack([FOCAL / PLACE[2] * np.eye(2, 3), PRINCIPAL + FOCAL / PLACE[2] * PLACE[:2]]),
    FOCAL,
    PRINCIPAL,
    PLACE,
)
THETA = np.array([0.1, -0.3, 0.2])


def rng() -> Stream:
    return Stream(3, 0, Purpose.START)


def test_the_place_of_a_solid_of_known_pose_is_found_exactly() -> None:
    """From the pixels of a pinhole the translation comes back to rounding."""
    turned = SOLID.points_mm @ rotation(THETA).T
    pixels = pinhole(turned + PLACE, FOCAL) + PRINCIPAL
    assert pose.translation(turned, pixels, FOCAL, PRINCIPAL) == pytest.approx(PLACE, abs=1e-6)


@pytest.mark.parametrize("method", pose.METHODS)
@pytest.mark.parametrize("upper", ["affine", "perspective"])
def test_every_method_begins_at_a_given_pose(method: pose.Method, upper: str) -> None:
    """The belief has the pose that it was given, its features where they are, and its solid drawn over them."""
    parameters = revise(PoseTrackerParameters(), {"upper_layer": upper, "joint_sample_count": 200, "initial_sd_px": 0})
    turned = SOLID.points_mm @ rotation(THETA).T
    pixels = pinhole(turned + PLACE, FOCAL) + PRINCIPAL
    known = Gaussian(THETA, 1e-4 * np.eye(3))
    belief = pose.begin(SOLID, pixels, parameters, method, rng(), theta=known)
    state = PoseState(SOLID, belief, belief.pose, np.ones(11, np.bool_))
    assert isinstance(belief.kept, RaoBlackwell) == (method == "rb-pf")
    assert state.estimate == pytest.approx(THETA)
    assert state.feature_means == pytest.approx(pixels)
    assert np.abs(place_points(state, SOLID.points_mm)[:, :2] - pixels).max() < 6
    if upper == "affine" or method == "rb-pf":
        assert state.belief.camera(SOLID)[:, :3] == pytest.approx(SOLID.reference[:, :3] @ rotation(THETA))


def test_a_nose_is_nearer_than_the_corners_of_the_eyes() -> None:
    """Heights of a drawing grow towards the viewer, as depths in the camera's frame fall."""
    belief = pose.begin(SOLID, SOLID.points_mm[:, :2] + 300, PoseTrackerParameters(), "pf-asd", rng())
    state = PoseState(SOLID, belief, belief.pose, np.ones(11, np.bool_))
    heights = dict(zip(FEATURES, place_points(state, SOLID.points_mm)[:, 2], strict=True))
    assert max(heights, key=lambda name: heights[name]) == "nose"
    assert heights["llc"] < heights["lmc"]


def test_particles_of_the_pose_are_kept() -> None:
    """With the pose by particles, those are part of the state."""
    parameters = revise(
        TrackedPrismParameters(), {**AS_PUBLISHED, "pose_estimator": "particle", "pose_sample_count": 300}
    )
    source, history = PrismSource(1, parameters), History(((0, parameters),))
    state = prism.start("pf-asd", source.start, source.frame(0, history), parameters, rng())
    after = prism.step("pf-asd", state, source.frame(1, history), parameters, Stream(1, 1, Purpose.TRACK))
    assert isinstance(after.belief.kept, Layered)
    angles = after.belief.kept.upper.theta_particles
    assert angles is not None
    assert angles.shape == (300, 3)


def test_what_a_prism_needs_is_named() -> None:
    """A target without vertices and a frame without measurements are refused."""
    parameters = TrackedPrismParameters()
    frame = Frame(0, 0.0)
    with pytest.raises(ValueError, match="a target without any"):
        prism.start("pf-asd", Target(np.zeros(3)), frame, parameters, rng())
    known = Landmarks(np.zeros((8, 2)), np.ones(8, np.bool_), VERTICES_MM, tuple("abcdefgh"))
    with pytest.raises(ValueError, match="a frame without any"):
        prism.start("pf-asd", Target(np.zeros(3), landmarks=known), frame, parameters, rng())


def test_what_a_head_needs_is_named() -> None:
    """A target without features and a frame without a picture are refused, and so is the state of another tracker."""
    parameters = HeadTrackerParameters()
    picture = np.zeros((240, 320, 3), np.uint8)
    with pytest.raises(ValueError, match="a target without any"):
        head.start("pf-asd", Target(np.zeros(3)), Frame(0, 0.0, image_rgb=picture), parameters, rng())
    pixels = mean_model().points_mm[:, :2] + 100
    known = Landmarks(pixels, np.ones(11, np.bool_), mean_model().points_mm, FEATURES)
    with pytest.raises(ValueError, match="a frame without one"):
        head.start("pf-asd", Target(np.zeros(3), landmarks=known), Frame(0, 0.0), parameters, rng())
    belief = pose.begin(SOLID, pixels, parameters, "pf-asd", rng())
    other = PoseState(SOLID, belief, belief.pose, np.ones(11, np.bool_))
    with pytest.raises(TypeError, match="the state of a tracker of heads"):
        head.step("pf-asd", other, Frame(1, 0.0, image_rgb=picture), parameters, rng())
