"""The methods by which a solid is tracked: where they begin, what they refuse, and their runs."""

import json

import numpy as np
import pytest
from numpy.typing import NDArray

from pftrack.core.geometry import rotation
from pftrack.core.model.parameters import Value, declarations, revise
from pftrack.core.model.recipe import Change
from pftrack.core.model.source import Frame, History, Landmarks, Target
from pftrack.core.numerics.matrices import pinhole
from pftrack.core.numerics.random import Gaussian, Purpose, Stream
from pftrack.experiments import find
from pftrack.experiments.head import trackers as head
from pftrack.experiments.head.parameters import HeadTrackerParameters
from pftrack.experiments.prism import experiment as prism
from pftrack.experiments.prism.experiment import TrackedPrismParameters
from pftrack.experiments.prism.scene import VERTICES_MM, PrismSource
from pftrack.experiments.shared.pose import methods as pose
from pftrack.experiments.shared.pose.calibrated import AS_PUBLISHED, PoseTrackerParameters
from pftrack.experiments.shared.pose.drawing import place_points
from pftrack.experiments.shared.pose.state import PoseState, Solid
from pftrack.filters.rao_blackwell import RaoBlackwell
from pftrack.runs.run import Run
from pftrack.vision.face import FEATURES, mean_model
from tests.making import whole_run

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


def begun_at(
    pixels: NDArray[np.float64],
    parameters: PoseTrackerParameters = PoseTrackerParameters(),  # noqa: B008 - frozen
    method: pose.Method = "pf-asd",
    theta: Gaussian | None = None,
) -> PoseState:
    belief = pose.begin(SOLID, pixels, parameters, method, rng(), theta=theta)
    return PoseState(SOLID, belief, belief.pose, np.ones(11, np.bool_))


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
    pixels = pinhole(SOLID.points_mm @ rotation(THETA).T + PLACE, FOCAL) + PRINCIPAL
    state = begun_at(pixels, parameters, method, theta=Gaussian(THETA, 1e-4 * np.eye(3)))
    assert isinstance(state.belief.kept, RaoBlackwell) == (method == "rb-pf")
    assert state.estimate == pytest.approx(THETA)
    assert state.feature_means == pytest.approx(pixels)
    assert np.abs(place_points(state, SOLID.points_mm)[:, :2] - pixels).max() < 6
    if upper == "affine" or method == "rb-pf":
        assert state.belief.camera(SOLID)[:, :3] == pytest.approx(SOLID.reference[:, :3] @ rotation(THETA))


def test_a_nose_is_nearer_than_the_corners_of_the_eyes() -> None:
    """Heights of a drawing grow towards the viewer, as depths in the camera's frame fall."""
    places = place_points(begun_at(SOLID.points_mm[:, :2] + 300), SOLID.points_mm)
    heights = dict(zip(FEATURES, places[:, 2], strict=True))
    assert max(heights, key=lambda name: heights[name]) == "nose"
    assert heights["llc"] < heights["lmc"]


def test_particles_of_the_pose_are_kept() -> None:
    """With the pose by particles, those are part of the state."""
    values = {**AS_PUBLISHED, "pose_estimator": "particle", "pose_sample_count": 300}
    parameters = revise(TrackedPrismParameters(), values)
    source, history = PrismSource(1, parameters), History(((0, parameters),))
    state = prism.start("pf-asd", source.start, source.frame(0, history), parameters, rng())
    after = prism.step("pf-asd", state, source.frame(1, history), parameters, Stream(1, 1, Purpose.TRACK))
    assert after.belief.kept.upper.theta_particles.shape == (300, 3)


def test_what_a_tracker_needs_is_named() -> None:
    """A target without points and a frame without a picture or measurements, and the state of another tracker."""
    nothing, picture = Frame(0, 0.0), Frame(1, 0.0, image_rgb=np.zeros((240, 320, 3), np.uint8))
    corners = Landmarks(np.zeros((8, 2)), np.ones(8, np.bool_), VERTICES_MM, tuple("abcdefgh"))
    features = Landmarks(SOLID.points_mm[:, :2] + 100, np.ones(11, np.bool_), SOLID.points_mm, FEATURES)
    of_prism, of_head = TrackedPrismParameters(), HeadTrackerParameters()
    for tracker, known, frame, parameters, said in (
        (prism, None, nothing, of_prism, "a target without any"),
        (prism, corners, nothing, of_prism, "a frame without any"),
        (head, None, picture, of_head, "a target without any"),
        (head, features, nothing, of_head, "a frame without one"),
    ):
        with pytest.raises(ValueError, match=said):
            tracker.start("pf-asd", Target(np.zeros(3), landmarks=known), frame, parameters, rng())
    with pytest.raises(TypeError, match="the state of a tracker of heads"):
        head.step("pf-asd", begun_at(features.points_px, of_head), picture, of_head, rng())


# Runs of the experiments that estimate a pose: the same numbers whichever way one comes, and never NaN.

HEAD, PRISM = find("head"), find("prism")
SMALL: dict[str, Value] = {"image_width_px": 160, "feature_noise_px": 1.5, "slack_px": 2.0, "initial_speed_px": 2.0}
"""A small picture, and what is assumed in px of it."""


def begun(name: str, tracker: str, frames: int = 26, **values: Value) -> Run:
    experiment = find(name)
    changes = (Change(0, {**(SMALL if name == "head" else {}), "joint_sample_count": 300, **values}),)
    return Run(experiment, experiment.simulate(), tracker=tracker, seed=4, frames=frames, timeline=changes)


@pytest.mark.parametrize("name", ["prism", "head"])
def test_a_branch_has_the_mixing_ratio_of_its_own_method(name: str) -> None:
    """From the frame in which a branch turns to prediction alone, every feature is drawn from it."""
    run = begun(name, "pf-asd")
    run.seek(10)
    branch = run.branch(10, {"tracker": "alpha-0"})
    assert set(branch.advance().diagnostics.series["alpha"]) == {0.0}


def extremes(name: str) -> list[tuple[str, Value]]:
    chosen: list[tuple[str, Value]] = []
    for declared in declarations(type(find(name).simulate().parameters)):
        options: list[Value] = [True] if declared.kind == "boolean" else list(declared.choices)
        if declared.kind in {"integer", "number"} and declared.name not in {"joint_sample_count", "person"}:
            kind = int if declared.kind == "integer" else float
            options = [kind(declared.minimum or 0), kind(min(declared.maximum or 0, 1280))]
        chosen += [(declared.name, option) for option in options]
    return chosen


@pytest.mark.parametrize(("name", "field", "value"), [(n, f, v) for n in ("prism", "head") for f, v in extremes(n)])
def test_extreme_parameters_give_finite_estimates(name: str, field: str, value: Value) -> None:
    """At the bounds of every parameter the estimate is finite and what is written down is JSON."""
    run = begun(name, "pf-asd", **{"frames": 3, field: value})  # type: ignore[arg-type] # frames are no parameter
    run.finish()
    for row in run.diagnostics:
        assert np.isfinite([*row.estimate, *row.sigma]).all()
        json.dumps(row.as_dict(), allow_nan=False)


@pytest.mark.parametrize("count", [10, 100_000])
def test_joint_particles_may_be_few_or_many(count: int) -> None:
    """With the fewest and the most joint particles the estimate is finite."""
    run = begun("prism", "rb-pf", frames=3, joint_sample_count=count)
    assert np.isfinite(run.finish().diagnostics.estimate).all()


def test_series_say_what_they_are_called() -> None:
    """Yaw is minus theta_y, every feature has a number, and the truth beside the estimate is that of the frame."""
    row = begun("head", "pf-asd", frames=20).finish().diagnostics
    said = [row.series[name] for name in ("pitch_deg", "yaw_deg", "yaw_deg_true")]
    assert said == pytest.approx([-row.estimate[0], -row.estimate[1], -row.truth[1]])
    assert row.error == pytest.approx(np.abs(np.subtract(row.estimate, row.truth)).mean())
    for name in ("alpha", "correlation", "feature_recognised", "feature_error_px", "feature_sd_px", "feature_visible"):
        assert len(row.series[name]) == 11
    assert set(row.series["within_50"]) <= {0.0, 1.0}


def test_alpha_rises_while_a_corner_hides() -> None:
    """Over the prism's course, alpha of a rear corner is higher while hidden, by Bando's figure."""
    run = whole_run(PRISM, tracker="pf-asd", seed=1, values=AS_PUBLISHED)
    alpha, visible = (
        np.array([row.series[name] for row in run.diagnostics])[:, 1::2] for name in ("alpha", "feature_visible")
    )
    assert alpha[visible == 0].mean() > alpha[visible > 0].mean() + 0.15
    assert run.summary().verdict.mean_error == pytest.approx(1.85, abs=0.15)
    assert run.summary().verdict.success is True


def test_each_angle_has_its_own_deviation() -> None:
    """Yaw is a turn about y, pitch about x, roll about z, and so are their deviations."""
    row = begun("prism", "pf-asd", frames=40).finish().diagnostics
    spread = [row.series[f"{name}_deg_sd"] for name in ("pitch", "yaw", "roll")]
    assert spread == pytest.approx(row.sigma)
    assert len({round(value, 6) for value in row.sigma}) == 3
