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
from numpy.typing import NDArray
from scipy.stats import multivariate_normal, norm

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
from pftrack.filters.adaptive import Projection
from pftrack.filters.affine import ENTRY_NOISE, AffineLayer
from pftrack.filters.learning import mixture_em
from pftrack.filters.perspective import POSE_NOISE, PerspectiveLayer
from pftrack.filters.rao_blackwell import SCATTER_PX, RaoBlackwell
from tests.experiments.shared.always import always

FOCAL, PRINCIPAL, PLACE = 400.0, np.array([160.0, 120.0]), np.array([0.0, 0.0, 80.0])
SCALE = FOCAL / PLACE[2]
SOLID = Solid(VERTICES_MM, np.column_stack([SCALE * np.eye(2, 3), PRINCIPAL]), FOCAL, PRINCIPAL, PLACE)
AT_START = VERTICES_MM[:, :2] * SCALE + PRINCIPAL
DRIFT = np.array([2.0, -1.0])
NOISE_PX = 3.0
MANY = 5000


def parameters(**values: Value) -> PoseTrackerParameters:
    return revise(PoseTrackerParameters(), {**AS_PUBLISHED, "sample_count": MANY, "feature_noise_px": 4.0, **values})


def seen_at(frame: int, seed: int = 0) -> NDArray[np.float64]:
    """What is measured of vertices that drift away, with noise."""
    return AT_START + frame * DRIFT + NOISE_PX * np.random.default_rng((seed, frame)).standard_normal((8, 2))


def log_likelihood(frame: int, noise_px: float = NOISE_PX) -> "pose.FeatureLikelihood":
    seen = seen_at(frame)
    return lambda positions: -0.5 * ((positions - seen[:, None]) ** 2).sum(axis=2) / noise_px**2


def begun(method: pose.Method, given: PoseTrackerParameters) -> PoseState:
    belief = pose.begin(SOLID, AT_START, given, method, Stream(7, 0, Purpose.START))
    return PoseState(SOLID, belief, belief.pose, np.ones(8, np.bool_))


def stepped(
    state: PoseState, method: pose.Method, given: PoseTrackerParameters, frame: int, **more: float
) -> PoseState:
    rng = Stream(7, frame, Purpose.TRACK)
    belief = pose.advance(state, always(log_likelihood(frame, **more)), given, method, rng)
    return replace(state, belief=belief, pose=belief.pose)


def apart(state: PoseState) -> Layered[Any]:
    assert isinstance(state.belief.kept, Layered)
    return state.belief.kept


def unnormalised(variance: float) -> float:
    """Log of what a Gaussian likelihood without its constant leaves out, on one axis."""
    return 0.5 * float(np.log(2 * np.pi * variance))


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
        total = covariance[0, 0] + NOISE_PX**2
        evidence = norm.logpdf(seen, means[0], np.sqrt(total)) + unnormalised(NOISE_PX**2)
        gain = covariance[:, 0] / total
        means = means + gain[:, None, None] * (seen - means[0])
        covariance = covariance - np.outer(gain, covariance[0])
        assert state.feature_means == pytest.approx(means[0], abs=0.5)
        sigmas = np.sqrt(apart(state).features.variances)
        assert sigmas == pytest.approx(np.full((8, 2), np.sqrt(covariance[0, 0])), rel=0.08)
        assert apart(state).features.log_evidences == pytest.approx(evidence.sum(axis=1), abs=0.2)
        assert state.log_evidence == pytest.approx(evidence.sum(), abs=0.4)
        assert apart(state).features.upper_counts.tolist() == [0] * 8


@pytest.mark.parametrize("upper", ["affine", "perspective"])
def test_from_above_the_prior_is_the_solid_s(upper: str) -> None:
    """Each feature's posterior is the solid's Gaussian times the likelihood, its evidence their integral."""
    given = parameters(upper_layer=upper, camera_noise=0.3)
    layer = upper_layer(upper, 0.3)
    state, wide = begun("alpha-1", given), 10.0
    for frame in (1, 2, 3):
        projection = layer.project(layer.predict(apart(state).upper))
        prior, variances, seen = projection.positions, projection.variances, seen_at(frame)
        gain = variances / (variances + wide**2)
        evidence = norm.logpdf(seen, prior, np.sqrt(variances + wide**2)) + unnormalised(wide**2)
        state = stepped(state, "alpha-1", given, frame, noise_px=wide)
        assert state.feature_means == pytest.approx(prior + gain * (seen - prior), abs=0.5)
        known = np.sqrt(variances * (1 - gain))
        assert np.sqrt(apart(state).features.variances) == pytest.approx(known, rel=0.08)
        assert apart(state).features.log_evidences == pytest.approx(evidence.sum(axis=1), abs=0.2)
        assert apart(state).features.upper_counts.tolist() == [MANY] * 8


def upper_layer(kind: str, noise: float = 1.0) -> AffineLayer | PerspectiveLayer:
    if kind == "affine":
        return AffineLayer(SOLID.points_mm, SOLID.reference, noise * np.array(ENTRY_NOISE))
    start = np.concatenate([np.zeros(3), PLACE])
    return PerspectiveLayer(SOLID.points_mm, FOCAL, start, PRINCIPAL, noise * np.array(POSE_NOISE))


def test_between_them_evidences_mix_by_alpha() -> None:
    """At alpha = 1/2 a feature's evidence is the mean of both, and its mean lies between theirs by their shares."""
    given = parameters(initial_sd_px=2.0)
    state = begun("pf-asd", given)
    layer = upper_layer("affine")
    projection: Projection = layer.project(layer.predict(apart(state).upper))
    # At rest with the spread s, where a point will be has the variance s^2 + b^2: it moves as far as it is off.
    below = (AT_START, np.full((8, 2), 2.0**2 + 4.0**2))
    seen = seen_at(1)
    parts = []
    for prior, variances in ((projection.positions, projection.variances), below):
        gain = variances / (variances + NOISE_PX**2)
        evidence = norm.logpdf(seen, prior, np.sqrt(variances + NOISE_PX**2)) + unnormalised(NOISE_PX**2)
        parts.append((evidence.sum(axis=1), prior + gain * (seen - prior)))
    both = np.logaddexp(parts[0][0], parts[1][0]) - np.log(2)
    share = np.exp(parts[0][0] - np.log(2) - both)[:, None]
    after = apart(stepped(state, "pf-asd", given, 1))
    assert after.features.log_evidences == pytest.approx(both, abs=0.15)
    assert after.features.means == pytest.approx(share * parts[0][1] + (1 - share) * parts[1][1], abs=0.25)
    # What survives is the posterior, and so the mean responsibility is the posterior share of the solid.
    assert after.mixture.ratios == pytest.approx(np.clip(share[:, 0], 0.1, 0.9), abs=0.06)


def test_what_is_learned_of_alpha_follows_the_settings() -> None:
    """The ratios are adapted with the forgetting, the clip and the density that the parameters name."""
    for values in ({"forgetting": 0.9}, {"alpha_clip": 0.3}, {"lower_density": "kernel"}, {"feature_noise_px": 9.0}):
        given = parameters(**{"sample_count": 60, **values})
        state = stepped(stepped(begun("pf-asd", given), "pf-asd", given, 1), "pf-asd", given, 2)
        after = apart(stepped(state, "pf-asd", given, 3))
        before, features = apart(state), after.features
        assert after.projection is not None
        settings = mixture_em.Settings(given.forgetting, given.alpha_clip, given.lower_density)
        survivors = np.take_along_axis(features.coordinates[:, :2], features.survivors[:, None], axis=2)
        parents = np.take_along_axis(before.features.coordinates, before.features.survivors[:, None], axis=2)
        projected = after.projection
        expected = mixture_em.adapt(
            before.mixture,
            survivors,
            (projected.positions, projected.variances),
            2 * parents[:, :2] - parents[:, 2:],
            given.feature_noise_px,
            settings,
        )
        assert after.mixture.ratios == pytest.approx(expected.ratios, abs=1e-9)
        assert after.mixture.ratios.min() >= given.alpha_clip
        assert after.mixture.ratios.max() <= 1 - given.alpha_clip


@pytest.mark.parametrize("method", ["pf-asd", "alpha-1", "alpha-0"])
def test_features_are_handed_up_with_their_variances(method: pose.Method) -> None:
    """The camera is conditioned on the features' means with their variances, or the floor's if that is more."""
    given = parameters(sample_count=100, sd_floor_px=1.5)
    state = stepped(begun(method, given), method, given, 1)
    after = apart(stepped(state, method, given, 2))
    layer = upper_layer("affine")
    variances = np.maximum(after.features.variances, 1.5**2)
    assert (variances == 1.5**2).any() == (after.features.variances < 1.5**2).any()
    expected = layer.update(
        layer.predict(apart(state).upper), after.features.means, variances, Stream(0, 0, Purpose.TRACK)
    )
    assert after.upper.mean == pytest.approx(expected.mean)
    assert after.upper.covariance == pytest.approx(expected.covariance)
    assert after.pose.mean == pytest.approx(expected.theta.mean)
    assert np.array_equal(after.pose.mean, after.upper.theta.mean)


def test_joint_particles_are_a_kalman_filter_of_the_camera() -> None:
    """Where the camera sees the vertices, and the evidence, are the Kalman filter's: to 0.4 px and 0.05."""
    wide = 12.0
    given = parameters(joint_sample_count=30_000)
    layer = upper_layer("affine")
    state, exact = begun("rb-pf", given), layer.begin()
    assert state.belief.camera(SOLID) == pytest.approx(exact.camera)
    row = np.column_stack([VERTICES_MM, np.ones(8)])
    for frame in (1, 2, 3):
        predicted = layer.predict(exact)
        noise = wide**2 + SCATTER_PX**2
        evidence = 0.0
        for axis in range(2):
            spread = row @ predicted.covariance[axis, :4, :4] @ row.T + noise * np.eye(8)
            density = multivariate_normal(row @ predicted.mean[axis, :4], spread)
            evidence += density.logpdf(seen_at(frame)[:, axis]) + 8 * unnormalised(wide**2)
        exact = layer.update(predicted, seen_at(frame), np.full((8, 2), noise), Stream(0, 0, Purpose.TRACK))
        state = stepped(state, "rb-pf", given, frame, noise_px=wide)
        assert isinstance(state.belief.kept, RaoBlackwell)
        assert state.log_evidence == pytest.approx(evidence, abs=0.05)
        seen, known = (row @ camera.T for camera in (state.belief.camera(SOLID), exact.camera))
        assert seen == pytest.approx(known, abs=0.4)


@pytest.mark.parametrize("method", ["pf-asd", "alpha-1", "alpha-0", "rb-pf"])
def test_a_constant_of_the_likelihood_goes_to_the_evidence(method: pose.Method) -> None:
    """What is added to a feature's log likelihoods changes no particle, no pose, and the evidence by as much."""
    given = parameters(sample_count=60, joint_sample_count=500)
    state = stepped(begun(method, given), method, given, 1)
    more = np.linspace(-30.0, 40.0, 8)
    score = log_likelihood(2)
    plain, raised = (
        pose.advance(state, always(likelihood), given, method, Stream(7, 2, Purpose.TRACK))
        for likelihood in (score, lambda positions: score(positions) + more[:, None])
    )
    assert raised.means == pytest.approx(plain.means, abs=1e-9)
    assert raised.log_weights == pytest.approx(plain.log_weights, abs=1e-9)
    assert raised.pose.mean == pytest.approx(plain.pose.mean, abs=1e-9)
    assert raised.log_evidence - plain.log_evidence == pytest.approx(more.sum())


@pytest.mark.parametrize("method", ["pf-asd", "alpha-1", "alpha-0", "rb-pf"])
@pytest.mark.parametrize("upper", ["affine", "perspective"])
def test_what_says_nothing_leaves_the_prediction(method: pose.Method, upper: str) -> None:
    """Impossible particles, and likelihoods that are no numbers, leave equal weights and finite numbers."""
    given = parameters(sample_count=60, joint_sample_count=300, upper_layer=upper)
    state = begun(method, given)
    for frame, worst in enumerate((-np.inf, np.nan, np.nan, -np.inf), 1):
        rng = Stream(7, frame, Purpose.TRACK)
        belief = pose.advance(state, always(lambda x, worst=worst: np.full(x.shape[:2], worst)), given, method, rng)
        state = replace(state, belief=belief, pose=belief.pose)
        assert belief.log_evidence == -np.inf
        assert np.ptp(belief.log_weights) == 0
        assert np.exp(belief.log_weights).sum(axis=-1) == pytest.approx(1.0)
        for values in (state.estimate, state.sigma, state.feature_means, state.translation_mm):
            assert np.isfinite(values).all()
    good = stepped(state, method, given, 5)
    assert np.isfinite(good.log_evidence)


@pytest.mark.parametrize("method", ["pf-asd", "alpha-1", "rb-pf"])
def test_a_feature_that_is_hidden_is_where_the_solid_has_it(method: pose.Method) -> None:
    """With one vertex unseen for some frames its mean stays near the solid's prediction, and grows no surer."""
    given = parameters(sample_count=200, joint_sample_count=5000)
    state = begun(method, given)
    hidden = 3
    for frame in range(1, 7):
        score = log_likelihood(frame, 3.0)
        blind = np.where(np.arange(8) == hidden, 0.0, 1.0)[:, None]
        rng = Stream(7, frame, Purpose.TRACK)
        belief = pose.advance(state, always(lambda x, score=score, blind=blind: blind * score(x)), given, method, rng)
        state = replace(state, belief=belief, pose=belief.pose)
    sigma = np.sqrt(np.trace(state.feature_covariances, axis1=1, axis2=2))
    where = (AT_START + 6 * DRIFT)[hidden]
    assert np.abs(state.feature_means[hidden] - where).max() < 8.0
    if method != "rb-pf":
        assert sigma[hidden] == max(sigma)


def test_counts_and_settings_may_change_in_mid_run() -> None:
    """The next frame has as many particles as are asked for, and a narrower clip moves ratios that were beyond it."""
    given = parameters(sample_count=60, joint_sample_count=300, alpha_clip=0.05)
    state = begun("pf-asd", given)
    for frame in range(1, 5):
        state = stepped(state, "pf-asd", given, frame)
    assert apart(state).mixture.ratios.max() > 0.6
    fewer = revise(given, {"sample_count": 13, "alpha_clip": 0.5, "joint_sample_count": 77})
    after = apart(stepped(state, "pf-asd", fewer, 5))
    assert after.features.positions.shape == (8, 13, 2)
    assert after.features.upper_counts.tolist() == [6] * 8
    assert after.mixture.ratios.tolist() == [0.5] * 8
    joint = stepped(begun("rb-pf", given), "rb-pf", fewer, 1).belief
    assert joint.positions.shape == (8, 77, 2)


@pytest.mark.parametrize("method", ["pf-asd", "rb-pf"])
def test_the_deviation_of_a_feature_is_that_of_one_axis(method: pose.Method) -> None:
    """What is reported is the root of the mean of both axes' variances, not of their sum."""
    given = parameters(sample_count=60, joint_sample_count=500)
    state = stepped(begun(method, given), method, given, 1)
    found = measurement(report(method, NAMES))(state)["feature_sd_px"]
    variances = state.feature_covariances[:, [0, 1], [0, 1]]
    assert found == pytest.approx(np.sqrt(variances.mean(axis=1)))


def test_a_pose_that_is_poorly_known_begins_so() -> None:
    """Before a pinhole the angles begin as unsure as they are given, and never surer than a frame's own noise."""
    for sd in (0.2, 1e-4):
        known = Gaussian(np.array([0.1, 0.0, 0.0]), sd**2 * np.eye(3))
        begun = pose.begin(
            SOLID, AT_START, parameters(upper_layer="perspective"), "pf-asd", Stream(7, 0, Purpose.START), theta=known
        )
        assert np.sqrt(begun.pose.covariance.diagonal()) == pytest.approx([max(sd, POSE_NOISE[0])] * 3)
        assert begun.pose.mean == pytest.approx([0.1, 0.0, 0.0])


# Beliefs in the points of a solid: each kind answers alike, and one method takes over what another believes.

THETA = np.array([0.15, -0.2, 0.1])
KNOWN = Gaussian(THETA, 1e-4 * np.eye(3))
KINDS = {
    "affine layers": ("pf-asd", "affine", Layered),
    "perspective layers": ("pf-asd", "perspective", Layered),
    "joint particles": ("rb-pf", "affine", RaoBlackwell),
}
METHODS: tuple[pose.Method, ...] = ("pf-asd", "alpha-1", "alpha-0", "rb-pf")


def beliefs_parameters(upper: str = "affine", **values: object) -> PoseTrackerParameters:
    chosen = {"upper_layer": upper, "joint_sample_count": 400, "sample_count": 60, **values}
    return revise(PoseTrackerParameters(), chosen)


def pixels(shift: tuple[float, float] = (0.0, 0.0)) -> NDArray[np.float64]:
    return pinhole(VERTICES_MM @ rotation(THETA).T + PLACE, FOCAL) + PRINCIPAL + shift


def around(seen: NDArray[np.float64], sd_px: float = 1.5) -> "pose.FeatureLikelihood":
    """A likelihood that is a Gaussian around known places."""
    return lambda positions: -0.5 * ((positions - seen[:, None]) ** 2).sum(axis=2) / sd_px**2


def beliefs_begun(
    method: pose.Method, values: PoseTrackerParameters, solid: Solid = SOLID, shift: float = 0.0
) -> PoseState:
    belief = pose.begin(solid, pixels((shift, shift)), values, method, Stream(5, 0, Purpose.START), theta=KNOWN)
    return PoseState(solid, belief, belief.pose, np.ones(8, np.bool_))


def beliefs_stepped(
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
    values = beliefs_parameters(upper)
    state = beliefs_begun(method, values)  # type: ignore[arg-type] # one of the methods
    for frame in (1, 2, 3):
        state = beliefs_stepped(state, method, values, frame)  # type: ignore[arg-type]
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
    values = beliefs_parameters(upper, initial_sd_px=0.2)
    state = beliefs_begun(method, values)  # type: ignore[arg-type]
    for frame in range(1, 6):
        state = beliefs_stepped(state, method, values, frame)  # type: ignore[arg-type]
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
    values = beliefs_parameters("perspective")
    state = beliefs_begun("pf-asd", values)
    camera, place = state.belief.camera(SOLID), state.translation_mm
    assert camera[:, 3] == pytest.approx(pinhole(place[None], FOCAL)[0] + PRINCIPAL)
    turn = rotation(state.estimate)
    across = turn.T @ np.array([1e-4, 0.0, 0.0])
    moved = pinhole((turn @ across + place)[None], FOCAL)[0] - pinhole(place[None], FOCAL)[0]
    assert camera[:, :3] @ across == pytest.approx(moved, rel=1e-6)


@pytest.mark.parametrize("method", METHODS)
def test_a_shift_of_the_picture_leaves_the_pose_alone(method: pose.Method) -> None:
    """With an affine camera and the same random numbers, angles are the same wherever the solid is in the picture."""
    values = beliefs_parameters()
    reference = SOLID.reference + np.array([[0.0, 0.0, 0.0, 32.0]] * 2)
    moved = replace(SOLID, reference=reference, principal_px=PRINCIPAL + 32.0)
    here, there = beliefs_begun(method, values), beliefs_begun(method, values, moved, 32.0)
    for frame in range(1, 8):
        here, there = beliefs_stepped(here, method, values, frame), beliefs_stepped(there, method, values, frame, 32.0)
        assert there.estimate == pytest.approx(here.estimate, abs=1e-7)
        assert there.sigma == pytest.approx(here.sigma, abs=1e-7)
        assert there.feature_means - here.feature_means == pytest.approx(np.full((8, 2), 32.0), abs=1e-6)
        assert there.log_evidence == pytest.approx(here.log_evidence, abs=1e-5)


@pytest.mark.parametrize(("before", "after"), list(pairwise([*METHODS, next(iter(METHODS))])))
def test_a_method_takes_over_pose_and_features(before: pose.Method, after: pose.Method) -> None:
    """Whichever method was at work, the next one goes on from its pose and its features."""
    values = beliefs_parameters()
    state = beliefs_begun(before, values)
    for frame in range(1, 5):
        state = beliefs_stepped(state, before, values, frame)
    following = beliefs_stepped(state, after, values, 5)
    assert isinstance(following.belief.kept, RaoBlackwell) == (after == "rb-pf")
    assert following.estimate == pytest.approx(state.estimate, abs=0.15)
    if (before == "rb-pf") != (after == "rb-pf"):
        assert following.switched
    # An affine camera alone, without particles of each feature, is off by its weak perspective: up to 8 px here.
    assert np.abs(following.feature_means - state.feature_means).mean() < 8.0
    for frame in range(6, 12):
        following = beliefs_stepped(following, after, values, frame)
    assert following.estimate == pytest.approx(THETA, abs=0.25)


@pytest.mark.parametrize("kind", KINDS)
def test_nothing_is_lost_where_nothing_changes(kind: str) -> None:
    """Moved to the same solid, an affine belief is the very same; with a pinhole it begins anew, in the same pose."""
    method, upper, _ = KINDS[kind]
    values = beliefs_parameters(upper)
    state = beliefs_stepped(beliefs_begun(method, values), method, values, 1)  # type: ignore[arg-type]
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
    values = beliefs_parameters("affine")
    state = beliefs_stepped(beliefs_begun("pf-asd", values), "pf-asd", values, 1)
    changed = pose.transfer(state, SOLID, beliefs_parameters("perspective"))
    assert (state.belief.place_mm is None, changed.belief.place_mm is None) == (True, False)
    assert changed.belief.kept.features is state.belief.kept.features
    assert changed.translation_mm == pytest.approx(PLACE, abs=3.0)


@pytest.mark.parametrize("method", METHODS)
def test_what_is_reported_is_what_the_belief_has(method: pose.Method) -> None:
    """Numbers of particles add up, the effective sample size lies between its bounds, and no series is undeclared."""
    values, series = beliefs_parameters(), report(method, NAMES)
    measure = measurement(series)
    state = beliefs_begun(method, values)
    for frame in range(1, 6):
        ratios = state.belief.alpha
        state = beliefs_stepped(state, method, values, frame)
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
    values = beliefs_parameters()
    ones, zeros = beliefs_begun("alpha-1", values), beliefs_begun("alpha-0", values)
    assert pose.has_switched(ones.belief, zeros.belief)
    assert not pose.has_switched(ones.belief, beliefs_stepped(ones, "alpha-1", values, 1).belief)
    assert not pose.has_switched(zeros.belief, beliefs_stepped(zeros, "alpha-0", values, 1).belief)
    joint = beliefs_begun("rb-pf", values)
    assert pose.has_switched(ones.belief, joint.belief)
    assert not pose.has_switched(joint.belief, beliefs_stepped(joint, "rb-pf", values, 1).belief)
