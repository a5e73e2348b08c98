"""The methods of a solid against closed forms: with Gaussian measurements every one of them has an exact answer.

From below only (alpha 0) each feature is a Kalman filter of its own; from above only (alpha 1) its prior is the solid's
Gaussian; between them it is a mixture of both, whose evidence is the mixture of the evidences; and the joint particles
are a Kalman filter of the camera.
"""

from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from scipy.stats import multivariate_normal, norm

from pftrack.core.arrays import Floats
from pftrack.core.geometry import rotation
from pftrack.core.model.parameters import Value, revise
from pftrack.core.numerics.matrices import pinhole
from pftrack.core.numerics.random import Gaussian, Purpose, Stream
from pftrack.experiments.prism.scene import NAMES, VERTICES_MM
from pftrack.experiments.shared.pose import methods as pose
from pftrack.experiments.shared.pose.calibrated import AS_PUBLISHED, PoseTrackerParameters
from pftrack.experiments.shared.pose.layered import Layered
from pftrack.experiments.shared.pose.methods import measurement, report
from pftrack.experiments.shared.pose.state import PoseState, Solid
from pftrack.filters.affine import ENTRY_NOISE, AffineLayer
from pftrack.filters.perspective import POSE_NOISE, PerspectiveLayer
from pftrack.filters.rao_blackwell import SCATTER_PX, RaoBlackwell

FOCAL, PRINCIPAL, PLACE = 400.0, np.array([160.0, 120.0]), np.array([0.0, 0.0, 80.0])
SCALE = FOCAL / PLACE[2]
SOLID = Solid(VERTICES_MM, np.column_stack([SCALE * np.eye(2, 3), PRINCIPAL]), FOCAL, PRINCIPAL, PLACE)
AT_START = VERTICES_MM[:, :2] * SCALE + PRINCIPAL
DRIFT = np.array([2.0, -1.0])
NOISE_PX = 3.0
MANY = 5000


def parameters(**values: Value) -> PoseTrackerParameters:
    return revise(PoseTrackerParameters(), {**AS_PUBLISHED, "sample_count": MANY, "feature_noise_px": 4.0, **values})


SMALL = parameters(sample_count=60, joint_sample_count=500)
METHODS: tuple[pose.Method, ...] = ("pf-asd", "alpha-1", "alpha-0", "rb-pf")


def seen_at(frame: int, seed: int = 0) -> Floats:
    """What is measured of vertices that drift away, with noise."""
    return AT_START + frame * DRIFT + NOISE_PX * np.random.default_rng((seed, frame)).standard_normal((8, 2))


def log_likelihood(frame: int, noise_px: float = NOISE_PX) -> "pose.FeatureLikelihood":
    seen = seen_at(frame)
    return lambda positions: -0.5 * ((positions - seen[:, None]) ** 2).sum(axis=2) / noise_px**2


def begun(
    method: pose.Method, given: PoseTrackerParameters, seen: Floats = AT_START, theta: Gaussian | None = None
) -> PoseState:
    belief = pose.begin(SOLID, seen, given, method, Stream(7, 0, Purpose.START), theta=theta)
    return PoseState(SOLID, belief, belief.pose, np.ones(8, np.bool_))


def after(
    state: PoseState,
    likelihood: "pose.FeatureLikelihood",
    method: pose.Method,
    given: PoseTrackerParameters,
    frame: int,
) -> PoseState:
    belief = pose.advance(state, lambda _: likelihood, given, method, Stream(7, frame, Purpose.TRACK))
    return replace(state, belief=belief, pose=belief.pose, switched=pose.has_switched(state.belief, belief))


def stepped(
    state: PoseState, method: pose.Method, given: PoseTrackerParameters, frame: int, noise_px: float = NOISE_PX
) -> PoseState:
    return after(state, log_likelihood(frame, noise_px), method, given, frame)


def apart(state: PoseState) -> Layered[Any]:
    assert isinstance(state.belief.kept, Layered)
    return state.belief.kept


def unnormalised(variance: float) -> float:
    """Log of what a Gaussian likelihood without its constant leaves out, on one axis."""
    return 0.5 * float(np.log(2 * np.pi * variance))


def weighed(
    prior: Floats, variances: Floats | float, seen: Floats, noise_px: float = NOISE_PX
) -> tuple[Floats, Floats]:
    """Return the log evidences (8,) and the means (8, 2) of Gaussian features (8, 2) that were seen with some noise."""
    total = variances + noise_px**2
    evidence = norm.logpdf(seen, prior, np.sqrt(total)) + unnormalised(noise_px**2)
    return evidence.sum(axis=1), prior + variances / total * (seen - prior)


def test_from_below_each_feature_is_a_kalman_filter() -> None:
    """Means, deviations and evidences of three frames are the exact ones, to 0.5 px, 8 % and 0.2 a feature."""
    given, spread = parameters(initial_sd_px=2.0), 2.0
    state = begun("alpha-0", given)
    transition, noise = np.array([[2.0, -1.0], [1.0, 0.0]]), np.diag([4.0**2, 0.0])
    # All have the same covariance, that of (x_t, x_{t-1}); one position of two frames, at rest.
    means, covariance = np.stack([AT_START, AT_START]), spread**2 * np.ones((2, 2))
    for frame in range(1, 4):
        state, seen = stepped(state, "alpha-0", given, frame), seen_at(frame)
        means = np.einsum("ij,jfk->ifk", transition, means)
        covariance = transition @ covariance @ transition.T + noise
        evidence, _ = weighed(means[0], covariance[0, 0], seen)
        gain = covariance[:, 0] / (covariance[0, 0] + NOISE_PX**2)
        means = means + gain[:, None, None] * (seen - means[0])
        covariance = covariance - np.outer(gain, covariance[0])
        features = apart(state).features
        assert state.feature_means == pytest.approx(means[0], abs=0.5)
        assert np.sqrt(features.variances) == pytest.approx(np.full((8, 2), np.sqrt(covariance[0, 0])), rel=0.08)
        assert features.log_evidences == pytest.approx(evidence, abs=0.2)
        assert state.log_evidence == pytest.approx(evidence.sum(), abs=0.4)
        assert features.upper_counts.tolist() == [0] * 8


@pytest.mark.parametrize("upper", ["affine", "perspective"])
def test_from_above_the_prior_is_the_solid_s(upper: str) -> None:
    """Each feature's posterior is the solid's Gaussian times the likelihood, its evidence their integral."""
    given, wide = parameters(upper_layer=upper, camera_noise=0.3), 10.0
    layer, state = upper_layer(upper, 0.3), begun("alpha-1", given)
    for frame in (1, 2, 3):
        prior = layer.project(layer.predict(apart(state).upper))
        evidence, expected = weighed(prior.positions, prior.variances, seen_at(frame), wide)
        state = stepped(state, "alpha-1", given, frame, noise_px=wide)
        features = apart(state).features
        assert state.feature_means == pytest.approx(expected, abs=0.5)
        known = np.sqrt(prior.variances * wide**2 / (prior.variances + wide**2))
        assert np.sqrt(features.variances) == pytest.approx(known, rel=0.08)
        assert features.log_evidences == pytest.approx(evidence, abs=0.2)
        assert features.upper_counts.tolist() == [MANY] * 8


def upper_layer(kind: str, noise: float = 1.0) -> AffineLayer | PerspectiveLayer:
    if kind == "affine":
        return AffineLayer(SOLID.points_mm, SOLID.reference, noise * np.array(ENTRY_NOISE))
    start = np.concatenate([np.zeros(3), PLACE])
    return PerspectiveLayer(SOLID.points_mm, FOCAL, start, PRINCIPAL, noise * np.array(POSE_NOISE))


def test_between_them_evidences_mix_by_alpha() -> None:
    """At alpha = 1/2 a feature's evidence is the mean of both, and its mean lies between theirs by their shares."""
    given, layer = parameters(initial_sd_px=2.0), upper_layer("affine")
    state = begun("pf-asd", given)
    above = layer.project(layer.predict(apart(state).upper))
    # At rest with the spread s, where a point will be has the variance s^2 + b^2: it moves as far as it is off.
    (up, from_above), (down, from_below) = (
        weighed(prior, variances, seen_at(1))
        for prior, variances in ((above.positions, above.variances), (AT_START, 2.0**2 + 4.0**2))
    )
    both = np.logaddexp(up, down) - np.log(2)
    share = np.exp(up - np.log(2) - both)[:, None]
    after = apart(stepped(state, "pf-asd", given, 1))
    assert after.features.log_evidences == pytest.approx(both, abs=0.15)
    assert after.features.means == pytest.approx(share * from_above + (1 - share) * from_below, abs=0.25)
    # What survives is the posterior, and so the mean responsibility is the posterior share of the solid.
    assert after.mixture.ratios == pytest.approx(np.clip(share[:, 0], 0.1, 0.9), abs=0.06)


@pytest.mark.parametrize("method", ["pf-asd", "alpha-1", "alpha-0"])
def test_features_are_handed_up_with_their_variances(method: pose.Method) -> None:
    """The camera is conditioned on the features' means with their variances, or the floor's if that is more."""
    given, layer = parameters(sample_count=100, sd_floor_px=1.5), upper_layer("affine")
    state = stepped(begun(method, given), method, given, 1)
    after = apart(stepped(state, method, given, 2))
    variances = np.maximum(after.features.variances, 1.5**2)
    assert (variances == 1.5**2).any() == (after.features.variances < 1.5**2).any()
    prior = layer.predict(apart(state).upper)
    expected = layer.update(prior, after.features.means, variances, Stream(0, 0, Purpose.TRACK))
    assert after.upper.mean == pytest.approx(expected.mean)
    assert after.upper.covariance == pytest.approx(expected.covariance)
    assert after.pose.mean == pytest.approx(expected.theta.mean)
    assert np.array_equal(after.pose.mean, after.upper.theta.mean)


def test_joint_particles_are_a_kalman_filter_of_the_camera() -> None:
    """Where the camera sees the vertices, and the evidence, are the Kalman filter's: to 0.4 px and 0.05."""
    wide, given, layer = 12.0, parameters(joint_sample_count=30_000), upper_layer("affine")
    state, exact = begun("rb-pf", given), layer.begin()
    assert state.belief.camera(SOLID) == pytest.approx(exact.camera)
    row, noise = np.column_stack([VERTICES_MM, np.ones(8)]), wide**2 + SCATTER_PX**2
    for frame in (1, 2, 3):
        predicted, evidence = layer.predict(exact), 16 * unnormalised(wide**2)
        for axis in range(2):
            spread = row @ predicted.covariance[axis, :4, :4] @ row.T + noise * np.eye(8)
            evidence += multivariate_normal(row @ predicted.mean[axis, :4], spread).logpdf(seen_at(frame)[:, axis])
        exact = layer.update(predicted, seen_at(frame), np.full((8, 2), noise), Stream(0, 0, Purpose.TRACK))
        state = stepped(state, "rb-pf", given, frame, noise_px=wide)
        assert isinstance(state.belief.kept, RaoBlackwell)
        assert state.log_evidence == pytest.approx(evidence, abs=0.05)
        seen, known = (row @ camera.T for camera in (state.belief.camera(SOLID), exact.camera))
        assert seen == pytest.approx(known, abs=0.4)


def test_counts_and_settings_may_change_in_mid_run() -> None:
    """The next frame has as many particles as are asked for, and ratios follow clip, forgetting and density."""
    fewer = revise(SMALL, {"sample_count": 13, "alpha_clip": 0.5, "joint_sample_count": 77})
    state = stepped(begun("pf-asd", SMALL), "pf-asd", SMALL, 1)
    changed, usual = (apart(stepped(state, "pf-asd", given, 2)) for given in (fewer, SMALL))
    for values in ({"forgetting": 0.9}, {"lower_density": "kernel"}):
        other = apart(stepped(state, "pf-asd", revise(SMALL, values), 2))
        assert not np.array_equal(other.mixture.ratios, usual.mixture.ratios)
    assert changed.features.positions.shape == (8, 13, 2)
    assert changed.mixture.ratios.tolist() == [0.5] * 8
    assert stepped(begun("rb-pf", SMALL), "rb-pf", fewer, 1).belief.positions.shape == (8, 77, 2)


def test_a_pose_that_is_poorly_known_begins_so() -> None:
    """Before a pinhole the angles begin as unsure as they are given, and never surer than a frame's own noise."""
    for sd in (0.2, 1e-4):
        known, given = Gaussian(np.array([0.1, 0.0, 0.0]), sd**2 * np.eye(3)), parameters(upper_layer="perspective")
        first = pose.begin(SOLID, AT_START, given, "pf-asd", Stream(7, 0, Purpose.START), theta=known)
        assert np.sqrt(first.pose.covariance.diagonal()) == pytest.approx([max(sd, POSE_NOISE[0])] * 3)
        assert first.pose.mean == pytest.approx([0.1, 0.0, 0.0])


# Beliefs in the points of a solid: each kind answers alike, and one method takes over what another believes.

THETA = np.array([0.15, -0.2, 0.1])
KNOWN = Gaussian(THETA, 1e-4 * np.eye(3))
KINDS: dict[str, tuple[pose.Method, str, type]] = {
    "affine layers": ("pf-asd", "affine", Layered),
    "perspective layers": ("pf-asd", "perspective", Layered),
    "joint particles": ("rb-pf", "affine", RaoBlackwell),
}


def beliefs_parameters(upper: str = "affine", **values: object) -> PoseTrackerParameters:
    chosen = {"upper_layer": upper, "joint_sample_count": 400, "sample_count": 60, **values}
    return revise(PoseTrackerParameters(), chosen)


PIXELS = pinhole(VERTICES_MM @ rotation(THETA).T + PLACE, FOCAL) + PRINCIPAL


def one_more(state: PoseState, method: pose.Method, values: PoseTrackerParameters, frame: int) -> PoseState:
    """Take a frame in which the features are where they are, to 1.5 px."""
    return after(state, lambda x: -0.5 * ((x - PIXELS[:, None]) ** 2).sum(axis=2) / 1.5**2, method, values, frame)


def beliefs_after(method: pose.Method, values: PoseTrackerParameters, frames: int) -> PoseState:
    state = begun(method, values, PIXELS, KNOWN)
    for frame in range(1, frames + 1):
        state = one_more(state, method, values, frame)
    return state


@pytest.mark.parametrize("kind", KINDS)
def test_means_and_covariances_are_moments_of_the_particles(kind: str) -> None:
    """Whatever the belief, its features' moments are the weighted moments of what `positions` and weights say."""
    method, upper, expected = KINDS[kind]
    belief = beliefs_after(method, beliefs_parameters(upper), 2).belief
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
    state = beliefs_after(method, beliefs_parameters(upper, initial_sd_px=0.2), 5)
    camera, off = state.belief.camera(SOLID), np.abs(state.project(VERTICES_MM) - PIXELS).max()
    seen = VERTICES_MM @ camera[:, :3].T + camera[:, 3]
    # The weak perspective of the camera leaves out that near corners look larger: up to a fifth of 25 mm here.
    assert seen.mean(axis=0) == pytest.approx(state.feature_means.mean(axis=0), abs=3.0)
    assert np.abs(seen - state.feature_means).max() < 25.0
    assert off < (25.0 if upper == "affine" else 2.0)
    assert upper == "affine" or state.translation_mm == pytest.approx(PLACE, abs=1.5)


def test_the_camera_of_a_pinhole_is_its_view_near_the_origin() -> None:
    """It places the origin where the pinhole does, and mm across there have the pinhole's size."""
    state = begun("pf-asd", beliefs_parameters("perspective"), PIXELS, KNOWN)
    camera, place, turn = state.belief.camera(SOLID), state.translation_mm, rotation(state.estimate)
    across = turn.T @ np.array([1e-4, 0.0, 0.0])
    origin, moved = pinhole(np.array([place, turn @ across + place]), FOCAL)
    assert camera[:, 3] == pytest.approx(origin + PRINCIPAL)
    assert camera[:, :3] @ across == pytest.approx(moved - origin, rel=1e-6)


@pytest.mark.parametrize(("before", "after"), list(pairwise([*METHODS, next(iter(METHODS))])))
def test_a_method_takes_over_pose_and_features(before: pose.Method, after: pose.Method) -> None:
    """Whichever method was at work, the next one goes on from its pose and its features."""
    values = beliefs_parameters()
    state = beliefs_after(before, values, 4)
    following = one_more(state, after, values, 5)
    assert isinstance(following.belief.kept, RaoBlackwell) == (after == "rb-pf")
    assert following.estimate == pytest.approx(state.estimate, abs=0.15)
    assert following.switched or (before == "rb-pf") == (after == "rb-pf")
    # An affine camera alone, without particles of each feature, is off by its weak perspective: up to 8 px here.
    assert np.abs(following.feature_means - state.feature_means).mean() < 8.0
    for frame in range(6, 10):
        following = one_more(following, after, values, frame)
    assert following.estimate == pytest.approx(THETA, abs=0.25)


@pytest.mark.parametrize("kind", KINDS)
def test_nothing_is_lost_where_nothing_changes(kind: str) -> None:
    """Moved to the same solid, an affine belief is the very same; with a pinhole it begins anew, in the same pose.

    From affine to pinhole the features' particles stay, and their places set the solid before the camera.
    """
    method, upper, _ = KINDS[kind]
    values = beliefs_parameters(upper)
    state = beliefs_after(method, values, 1)
    kept = pose.transfer(state, replace(SOLID), values)
    if upper == "perspective":
        assert kept.belief.place_mm is not None
        assert kept.translation_mm == pytest.approx(state.translation_mm, abs=1.0)
    else:
        assert kept.belief is state.belief
        changed = pose.transfer(state, SOLID, beliefs_parameters("perspective"))
        assert changed.translation_mm == pytest.approx(PLACE, abs=3.0)
    larger = pose.transfer(state, replace(SOLID, points_mm=1.1 * VERTICES_MM), values)
    assert larger.belief is not state.belief
    assert larger.feature_means == pytest.approx(state.feature_means)
    assert larger.estimate == pytest.approx(state.estimate)


@pytest.mark.parametrize("method", METHODS)
def test_what_is_reported_is_what_the_belief_has(method: pose.Method) -> None:
    """Floats of particles add up, the effective sample size lies between its bounds, and no series is undeclared.

    The deviation of a feature is that of one axis: the root of the mean of both variances.
    """
    values, series, joint = beliefs_parameters(), report(method, NAMES), method == "rb-pf"
    state = begun(method, values, PIXELS, KNOWN)
    for frame in range(1, 6):
        ratios = state.belief.alpha
        state = one_more(state, method, values, frame)
        found: dict[str, Any] = measurement(series)(state)
        assert found.keys() == {one.name for one in series}
        assert found["particles"] == (400 if joint else 480)
        variances = state.feature_covariances[:, [0, 1], [0, 1]]
        assert found["feature_sd_px"] == pytest.approx(np.sqrt(variances.mean(axis=1)))
        assert (1 if joint else 8) <= found["ess"] <= found["particles"]
        if joint:
            assert not {"alpha", "samples"} & found.keys()
            continue
        own, upper = found["samples"]
        assert own + upper == found["particles"]
        assert upper == sum(round(60 * float(ratio)) for ratio in ratios)  # type: ignore[union-attr]
        survivors = state.belief.kept.features.survivors  # type: ignore[union-attr] # these have layers
        assert found["unique_ancestors"] == sum(len(set(each.tolist())) for each in survivors) < found["particles"]
    shares = {"alpha-1": 1.0, "alpha-0": 0.0}
    assert method not in shares or set(found["alpha"]) == {shares[method]}
