"""Beliefs in the points of a solid: each kind answers alike, and one method takes over what another believes."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray

from pftrack.core.geometry import rotation
from pftrack.core.model.parameters import revise
from pftrack.core.numerics.matrices import pinhole
from pftrack.core.numerics.random import Gaussian, Purpose, Stream
from pftrack.experiments.prism.scene import NAMES, VERTICES_MM
from pftrack.experiments.shared.pose import methods as pose
from pftrack.experiments.shared.pose.calibrated import PoseTrackerParameters
from pftrack.experiments.shared.pose.layered import Layered
from pftrack.experiments.shared.pose.methods import measurement, report
from pftrack.experiments.shared.pose.state import PoseState, Solid
from pftrack.filters.rao_blackwell import RaoBlackwell
from tests.experiments.shared.always import always

FOCAL, PRINCIPAL, PLACE = 400.0, np.array([160.0, 120.0]), np.array([0.0, 0.0, 80.0])
SCALE = FOCAL / PLACE[2]
SOLID = Solid(VERTICES_MM, np.column_stack([SCALE * np.eye(2, 3), PRINCIPAL]), FOCAL, PRINCIPAL, PLACE)
THETA = np.array([0.15, -0.2, 0.1])
KNOWN = Gaussian(THETA, 1e-4 * np.eye(3))
KINDS = {
    "affine layers": ("pf-asd", "affine", Layered),
    "perspective layers": ("pf-asd", "perspective", Layered),
    "joint particles": ("rb-pf", "affine", RaoBlackwell),
}
METHODS: tuple[pose.Method, ...] = ("pf-asd", "alpha-1", "alpha-0", "rb-pf")


def parameters(upper: str = "affine", **values: object) -> PoseTrackerParameters:
    chosen = {"upper_layer": upper, "joint_sample_count": 400, "sample_count": 60, **values}
    return revise(PoseTrackerParameters(), chosen)


def pixels(shift: tuple[float, float] = (0.0, 0.0)) -> NDArray[np.float64]:
    return pinhole(VERTICES_MM @ rotation(THETA).T + PLACE, FOCAL) + PRINCIPAL + shift


def around(seen: NDArray[np.float64], sd_px: float = 1.5) -> "pose.FeatureLikelihood":
    """A likelihood that is a Gaussian around known places."""
    return lambda positions: -0.5 * ((positions - seen[:, None]) ** 2).sum(axis=2) / sd_px**2


def begun(method: pose.Method, values: PoseTrackerParameters, solid: Solid = SOLID, shift: float = 0.0) -> PoseState:
    belief = pose.begin(solid, pixels((shift, shift)), values, method, Stream(5, 0, Purpose.START), theta=KNOWN)
    return PoseState(solid, belief, belief.pose, np.ones(8, np.bool_))


def stepped(
    state: PoseState, method: pose.Method, values: PoseTrackerParameters, frame: int, shift: float = 0.0
) -> PoseState:
    """Take a frame in which the features are where they are."""
    rng = Stream(5, frame, Purpose.TRACK)
    belief = pose.advance(state, always(around(pixels((shift, shift)))), values, method, rng)
    changed = pose.has_switched(state.belief, belief)
    return replace(state, belief=belief, pose=belief.pose, switched=changed)


@pytest.mark.parametrize("kind", KINDS)
def test_means_and_covariances_are_moments_of_the_particles(kind: str) -> None:
    """Whatever the belief, its features' moments are the weighted moments of what `positions` and weights say."""
    method, upper, expected = KINDS[kind]
    values = parameters(upper)
    state = begun(method, values)  # type: ignore[arg-type] # one of the methods
    for frame in (1, 2, 3):
        state = stepped(state, method, values, frame)  # type: ignore[arg-type]
        belief = state.belief
        assert isinstance(belief.kept, expected)
        weights = np.broadcast_to(np.exp(belief.log_weights), belief.positions.shape[:2])
        assert weights.sum(axis=1) == pytest.approx(np.ones(8))
        means = np.einsum("fn,fnk->fk", weights, belief.positions)
        off = belief.positions - means[:, None]
        assert belief.means == pytest.approx(means, abs=1e-6)
        assert belief.covariances == pytest.approx(np.einsum("fn,fnk,fnl->fkl", weights, off, off), abs=1e-6)


@pytest.mark.parametrize("kind", KINDS)
def test_the_believed_camera_sees_the_solid_where_its_features_are(kind: str) -> None:
    """The features' middle, seen by the camera, is that of the features; so is each feature, near enough."""
    method, upper, _ = KINDS[kind]
    values = parameters(upper, initial_sd_px=0.2)
    state = begun(method, values)  # type: ignore[arg-type]
    for frame in range(1, 6):
        state = stepped(state, method, values, frame)  # type: ignore[arg-type]
    camera = state.belief.camera(SOLID)
    seen = VERTICES_MM @ camera[:, :3].T + camera[:, 3]
    # The weak perspective of the camera leaves out that near corners look larger: up to a fifth of 25 mm here.
    assert seen.mean(axis=0) == pytest.approx(state.feature_means.mean(axis=0), abs=3.0)
    assert np.abs(seen - state.feature_means).max() < 25.0
    assert np.abs(state.project(VERTICES_MM) - pixels()).max() < 25.0
    if upper == "perspective":
        assert np.abs(state.project(VERTICES_MM) - pixels()).max() < 2.0
        assert state.translation_mm == pytest.approx(PLACE, abs=1.5)


def test_the_camera_of_a_pinhole_is_its_view_near_the_origin() -> None:
    """It places the origin where the pinhole does, and mm across there have the pinhole's size."""
    values = parameters("perspective")
    state = begun("pf-asd", values)
    camera, place = state.belief.camera(SOLID), state.translation_mm
    assert camera[:, 3] == pytest.approx(pinhole(place[None], FOCAL)[0] + PRINCIPAL)
    turn = rotation(state.estimate)
    across = turn.T @ np.array([1e-4, 0.0, 0.0])
    moved = pinhole((turn @ across + place)[None], FOCAL)[0] - pinhole(place[None], FOCAL)[0]
    assert camera[:, :3] @ across == pytest.approx(moved, rel=1e-6)


@pytest.mark.parametrize("method", METHODS)
def test_a_shift_of_the_picture_leaves_the_pose_alone(method: pose.Method) -> None:
    """With an affine camera and the same random numbers, angles are the same wherever the solid is in the picture."""
    values = parameters()
    reference = SOLID.reference + np.array([[0.0, 0.0, 0.0, 32.0]] * 2)
    moved = replace(SOLID, reference=reference, principal_px=PRINCIPAL + 32.0)
    here, there = begun(method, values), begun(method, values, moved, 32.0)
    for frame in range(1, 8):
        here, there = stepped(here, method, values, frame), stepped(there, method, values, frame, 32.0)
        assert there.estimate == pytest.approx(here.estimate, abs=1e-7)
        assert there.sigma == pytest.approx(here.sigma, abs=1e-7)
        assert there.feature_means - here.feature_means == pytest.approx(np.full((8, 2), 32.0), abs=1e-6)
        assert there.log_evidence == pytest.approx(here.log_evidence, abs=1e-5)


@pytest.mark.parametrize(("before", "after"), list(pairwise([*METHODS, next(iter(METHODS))])))
def test_a_method_takes_over_pose_and_features(before: pose.Method, after: pose.Method) -> None:
    """Whichever method was at work, the next one goes on from its pose and its features."""
    values = parameters()
    state = begun(before, values)
    for frame in range(1, 5):
        state = stepped(state, before, values, frame)
    following = stepped(state, after, values, 5)
    assert isinstance(following.belief.kept, RaoBlackwell) == (after == "rb-pf")
    assert following.estimate == pytest.approx(state.estimate, abs=0.15)
    if (before == "rb-pf") != (after == "rb-pf"):
        assert following.switched
    # An affine camera alone, without particles of each feature, is off by its weak perspective: up to 8 px here.
    assert np.abs(following.feature_means - state.feature_means).mean() < 8.0
    for frame in range(6, 12):
        following = stepped(following, after, values, frame)
    assert following.estimate == pytest.approx(THETA, abs=0.25)


@pytest.mark.parametrize("kind", KINDS)
def test_nothing_is_lost_where_nothing_changes(kind: str) -> None:
    """Moved to the same solid, an affine belief is the very same; with a pinhole it begins anew, in the same pose."""
    method, upper, _ = KINDS[kind]
    values = parameters(upper)
    state = stepped(begun(method, values), method, values, 1)  # type: ignore[arg-type]
    kept = pose.transfer(state, replace(SOLID), values)
    if upper == "perspective":
        assert kept.belief.place_mm is not None
        assert kept.translation_mm == pytest.approx(state.translation_mm, abs=1.0)
    else:
        assert kept.belief is state.belief
    larger = pose.transfer(state, replace(SOLID, points_mm=1.1 * VERTICES_MM), values)
    assert larger.belief is not state.belief
    assert larger.feature_means == pytest.approx(state.feature_means)
    assert larger.estimate == pytest.approx(state.estimate)


def test_a_change_of_the_camera_keeps_the_particles() -> None:
    """From affine to pinhole the features' particles stay, and the solid is set before the camera by their places."""
    values = parameters("affine")
    state = stepped(begun("pf-asd", values), "pf-asd", values, 1)
    changed = pose.transfer(state, SOLID, parameters("perspective"))
    assert isinstance(changed.belief.kept, Layered)
    assert isinstance(state.belief.kept, Layered)
    assert (state.belief.place_mm is None, changed.belief.place_mm is None) == (True, False)
    assert changed.belief.kept.features is state.belief.kept.features
    assert changed.translation_mm == pytest.approx(PLACE, abs=3.0)


@pytest.mark.parametrize("method", METHODS)
def test_what_is_reported_is_what_the_belief_has(method: pose.Method) -> None:
    """Numbers of particles add up, the effective sample size lies between its bounds, and no series is undeclared."""
    values, series = parameters(), report(method, NAMES)
    measure = measurement(series)
    state = begun(method, values)
    for frame in range(1, 6):
        ratios = state.belief.alpha
        state = stepped(state, method, values, frame)
        found = measure(state)
        assert found.keys() == {one.name for one in series}
        clouds = 1 if method == "rb-pf" else 8
        assert found["particles"] == (400 if method == "rb-pf" else 480)
        assert clouds <= found["ess"] <= found["particles"]  # type: ignore[operator] # numbers
        if method == "rb-pf":
            assert "alpha" not in found
            assert "samples" not in found
            continue
        own, upper = found["samples"]  # type: ignore[misc] # two numbers
        assert own + upper == found["particles"]
        assert upper == sum(round(60 * float(ratio)) for ratio in ratios)  # type: ignore[union-attr]
        survivors = state.belief.kept.features.survivors  # type: ignore[union-attr] # these have layers
        assert found["unique_ancestors"] == sum(len(set(each.tolist())) for each in survivors)
        assert found["unique_ancestors"] < found["particles"]  # type: ignore[operator]
    shares = {"alpha-1": 1.0, "alpha-0": 0.0}
    if method in shares:
        assert set(found["alpha"]) == {shares[method]}  # type: ignore[arg-type] # a vector


def test_a_switch_is_a_feature_that_trusts_another_prediction() -> None:
    """From alpha 1 to alpha 0 all features change; from one frame to the next of either none does."""
    values = parameters()
    ones, zeros = begun("alpha-1", values), begun("alpha-0", values)
    assert pose.has_switched(ones.belief, zeros.belief)
    assert not pose.has_switched(ones.belief, stepped(ones, "alpha-1", values, 1).belief)
    assert not pose.has_switched(zeros.belief, stepped(zeros, "alpha-0", values, 1).belief)
    joint = begun("rb-pf", values)
    assert pose.has_switched(ones.belief, joint.belief)
    assert not pose.has_switched(joint.belief, stepped(joint, "rb-pf", values, 1).belief)
