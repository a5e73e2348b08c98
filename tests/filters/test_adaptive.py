"""Features from two predictions: where particles come from, what is learned of both, and what outlying ones count."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pftrack.core.numerics.random import Gaussian, Purpose, Stream, log_density
from pftrack.filters import adaptive, kalman
from pftrack.filters.adaptive import Projection
from pftrack.filters.agreement import (
    LEAST_AGREEMENT,
    NOTHING_KNOWN_PX2,
    agreeing,
    excess_variance,
    fit_covariance,
    fit_gain,
    middle,
)
from pftrack.filters.dynamics import autoregression
from pftrack.filters.learning import mixture_em
from pftrack.filters.learning.mixture_em import Mixture, Settings
from pftrack.filters.particles import ParticleSet

PLACES = np.array([[10.0, 20.0], [-30.0, 5.0], [100.0, -100.0]])
SPREAD = np.array([[4.0, 3.0], [3.0, 9.0]])


def rng(frame: int = 1) -> Stream:
    return Stream(5, frame, Purpose.TRACK)


def from_above(means: np.ndarray = PLACES) -> Projection:
    both = np.stack([means, means - 2.0], axis=2)
    return Projection(both, np.broadcast_to(SPREAD, (len(means), 2, 2, 2)).copy())


def drawn(ratio: float, count: int = 40_000) -> adaptive.Draw:
    features = adaptive.begin(PLACES, 1.0, count, rng(0))
    return adaptive.draw(features, from_above(PLACES + 500.0), np.full(3, ratio), 5.0, count, rng())


def test_from_above_comes_the_joint_prediction() -> None:
    """With a ratio of 1, positions now and a frame ago have the projection's mean and covariance, each axis apart."""
    cloud = drawn(1.0)
    assert cloud.upper_counts.tolist() == [40_000] * 3
    for n in range(3):
        for axis in range(2):
            pairs = cloud.coordinates[n, [axis, 2 + axis]]
            assert np.allclose(pairs.mean(axis=1), PLACES[n, axis] + [500.0, 498.0], atol=0.1)
            assert np.allclose(np.cov(pairs), SPREAD, atol=0.3)
        assert abs(np.corrcoef(cloud.coordinates[n, :2])[0, 1]) < 0.03


def test_parents_are_where_particles_were() -> None:
    """A particle from below was, in the last frame, where its parent is; one from above has no parent."""
    features = adaptive.weigh(drawn(0.5, 30), np.random.default_rng(3).normal(size=(3, 30)), rng())
    cloud = adaptive.draw(features, from_above(), np.array([0.2, 0.0, 1.0]), 5.0, 20, rng(2))
    assert [np.count_nonzero(row < 0) for row in cloud.parents] == [4, 0, 20]
    positions = features.positions.reshape(-1, 2)
    for n in range(3):
        below = cloud.parents[n] >= 0
        assert not below[: cloud.upper_counts[n]].any()
        assert np.array_equal(positions[cloud.parents[n, below]], cloud.coordinates[n, 2:, below])
        assert np.isin(cloud.parents[n, below], 30 * n + features.survivors[n]).all()
    assert np.array_equal(adaptive.weigh(cloud, np.zeros((3, 20)), rng()).parents, cloud.parents)


def test_what_is_held_is_its_own_parent() -> None:
    """Without a draw each particle is what it was; of another filter's particles none descends."""
    features = adaptive.begin(PLACES, 1.0, 4, rng(0))
    held = adaptive.hold(features)
    assert held.parents.tolist() == [[0, 1, 2, 3], [4, 5, 6, 7], [8, 9, 10, 11]]
    assert ((features.parents == -1) & (adaptive.orphan(held).parents == -1)).all()


def test_features_are_resampled_apart() -> None:
    """Each feature has its own random offset: equal weights do not make equal parents."""
    count = 50
    places = np.random.default_rng(2).normal(size=(8, 4, count))
    cloud = adaptive.Draw(places, np.zeros(8, np.int64), np.full((8, count), -1))
    scores = np.tile(np.linspace(-3.0, 0.0, count), (8, 1))
    parents = {tuple(survivors) for survivors in adaptive.weigh(cloud, scores, rng()).survivors.tolist()}
    assert len(parents) > 4


@given(st.floats(0, 1), st.integers(1, 60))
def test_the_ratio_is_a_division_not_a_draw(ratio: float, count: int) -> None:
    """Of N particles round(alpha N) come from above, and they are the first."""
    cloud = drawn(ratio, count)
    expected = int(np.rint(ratio * count))
    assert cloud.upper_counts.tolist() == [expected] * 3
    assert (cloud.coordinates[0, 0, :expected] > 300).all()
    assert (cloud.coordinates[0, 0, expected:] < 300).all()


def test_the_weight_is_the_likelihood_alone() -> None:
    """Weights, moments and evidence are those of a particle set weighed by the likelihood."""
    cloud = drawn(0.4, 50)
    scores = np.random.default_rng(0).normal(size=(3, 50))
    features = adaptive.weigh(cloud, scores, rng())
    for n in range(3):
        exact = np.exp(scores[n]) / np.exp(scores[n]).sum()
        assert np.allclose(np.exp(features.log_weights[n]), exact)
        alike = ParticleSet(cloud.positions[n], features.log_weights[n], np.arange(50))
        assert np.allclose(features.means[n], alike.mean)
        assert np.allclose(features.covariances[n], alike.covariance)
        assert features.log_evidences[n] == pytest.approx(np.log(np.exp(scores[n]).mean()))
        copies = np.bincount(features.survivors[n], minlength=50)
        assert (np.abs(copies - 50 * exact) < 1).all()
    assert np.array_equal(features.variances, features.covariances[:, [0, 1], [0, 1]])
    assert features.particles.shape == (3, 50, 4)
    assert np.array_equal(features.positions, features.particles[..., :2])


def test_what_cannot_be_keeps_the_prediction() -> None:
    """A feature whose particles are all impossible, or have no number for a score, keeps them equally."""
    cloud = drawn(0.5, 50)
    scores = np.zeros((3, 50))
    scores[0], scores[1], scores[2, 1:] = -np.inf, np.nan, -np.inf
    features = adaptive.weigh(cloud, scores, rng())
    assert np.allclose(np.exp(features.log_weights[:2]), 1 / 50)
    assert features.log_evidences[:2].tolist() == [-np.inf, -np.inf]
    assert np.allclose(features.means[2], cloud.positions[2, 0])
    assert not features.survivors[2].any()


def test_alone_it_is_a_bootstrap_filter() -> None:
    """From below only, on Gaussian measurements, mean and covariance come to the Kalman filter's (tolerance 3 %)."""
    one = np.eye(1)
    model = autoregression(2 * one, -one, np.zeros(1), 5 * one)
    exact = Gaussian(np.zeros(2), np.ones((2, 2)))
    features = adaptive.begin(np.zeros((1, 2)), 1.0, 100_000, rng(0))
    for t in range(1, 6):
        seen = 4.0 * t
        exact, _ = kalman.update(kalman.predict(exact, model), np.array([seen]), np.eye(1, 2), 9 * one)
        cloud = adaptive.draw(features, from_above(np.zeros((1, 2))), np.zeros(1), 5.0, 100_000, rng(t))
        scores = -0.5 * ((cloud.positions - seen) ** 2).sum(axis=2) / 9
        features = adaptive.weigh(cloud, scores, rng(t))
        assert np.allclose(features.means[0], exact.mean[0], atol=0.15)
        assert np.allclose(features.variances[0], exact.covariance[0, 0], rtol=0.03)


RNG = np.random.default_rng(0)
ABOVE = (np.array([[2.0, 1.0]]), np.array([[4.0, 9.0]]))
CENTRES = RNG.normal(size=(1, 2, 30)) * [[6.0], [3.0]] + 5.0
POINTS = RNG.normal(size=(1, 2, 40)) * 4.0


def test_eta_settles_at_a_half() -> None:
    """With lambda = 0.5 eta is 1, 2/3, 4/7, ... and tends to 0.5 (eq. A.30)."""
    mixture, etas = mixture_em.begin(1), []
    for _ in range(30):
        mixture = mixture_em.adapt(mixture, POINTS, ABOVE, CENTRES, 5.0, Settings(0.5))
        etas.append(mixture.eta)
    assert etas[:3] == pytest.approx([1, 2 / 3, 4 / 7])
    assert etas[-1] == pytest.approx(0.5)


def test_densities_are_what_they_say() -> None:
    """The Gaussian and the kernel mixture have the densities computed one by one."""
    points, covariance = POINTS[0], np.array([[4.0, 1.5], [1.5, 3.0]])
    ours = mixture_em.gaussian_log_density(points, ABOVE[0][0], covariance)
    assert np.allclose(ours, log_density(points.T, ABOVE[0], covariance))
    each = log_density(points.T[:, None], CENTRES[0].T[None], 25.0 * np.eye(2))
    assert np.allclose(mixture_em.kernel_log_density(points, CENTRES[0], 5.0), np.log(np.exp(each).mean(axis=1)))
    far = mixture_em.kernel_log_density(points + 1e4, CENTRES[0], 5.0)
    assert np.isfinite(far).all()


@pytest.mark.parametrize("density", ["gaussian", "kernel"])
def test_the_first_step_is_the_mean_responsibility(density: str) -> None:
    """In the first frame the ratio becomes the mean share that the upper density has in each survivor."""
    above = np.exp(log_density(POINTS[0].T, ABOVE[0], np.diag(ABOVE[1][0])))
    if density == "kernel":
        below = np.exp(log_density(POINTS[0].T[:, None], CENTRES[0].T[None], 25.0 * np.eye(2))).mean(axis=1)
    else:
        matched = np.cov(CENTRES[0], bias=True) + 25.0 * np.eye(2)
        below = np.exp(log_density(POINTS[0].T, CENTRES[0].mean(axis=1), matched))
    expected = (0.3 * above / (0.3 * above + 0.7 * below)).mean()
    settings = Settings(0.5, 0.0, density)
    ours = mixture_em.adapt(Mixture(np.array([0.3]), np.zeros(1), 0.0), POINTS, ABOVE, CENTRES, 5.0, settings)
    assert ours.ratios[0] == pytest.approx(expected)


def test_saying_nothing_teaches_nothing() -> None:
    """With the exact density an observation that says nothing leaves the ratio as it is on average (a martingale)."""
    features, count = 2000, 50
    before = adaptive.begin(np.zeros((features, 2)), 4.0, count, Stream(1, 0, Purpose.START))
    spread = np.broadcast_to(9.0 * np.eye(2), (features, 2, 2, 2)).copy()
    above, settings = Projection(np.full((features, 2, 2), 3.0), spread), Settings(0.5, 0.0, "kernel")
    for ratio in (0.3, 0.8):
        ratios = np.full(features, ratio)
        cloud = adaptive.draw(before, above, ratios, 5.0, count, Stream(1, 1, Purpose.TRACK))
        after = adaptive.surviving(adaptive.weigh(cloud, np.zeros((features, count)), Stream(1, 1, Purpose.TRACK)))
        known, upper = Mixture(ratios, ratios, 0.0), (above.positions, above.variances)
        mixture = mixture_em.adapt(known, after, upper, adaptive.propagate(before), 5.0, settings)
        error = mixture.responsibilities.std() / np.sqrt(features)
        assert mixture.responsibilities.mean() == pytest.approx(ratio, abs=4 * error)


@pytest.mark.parametrize(("offset", "expected"), [(0.0, 0.9), (1000.0, 0.1)])
@pytest.mark.parametrize("density", ["gaussian", "kernel"])
def test_clear_cases_go_to_the_clip(offset: float, expected: float, density: str) -> None:
    """When all survivors come from one of two far predictions, the ratio goes to the clip on its side and stays."""
    survivors = ABOVE[0][:, :, None] + RNG.normal(size=(1, 2, 50)) + offset
    centres = ABOVE[0][:, :, None] + RNG.normal(size=(1, 2, 50)) + 1000.0
    mixture = mixture_em.begin(1)
    for _ in range(10):
        mixture = mixture_em.adapt(mixture, survivors, ABOVE, centres, 5.0, Settings(0.5, 0.1, density))
    assert mixture.ratios[0] == pytest.approx(expected)


# Features of which some are elsewhere: what those say that agree with the solid.


def clouds(*middles: float, spread: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    """Return equally weighed particles about places on the diagonal."""
    around = np.random.default_rng(1).standard_normal((len(middles), 400, 2))
    return np.array(middles)[:, None, None] + spread * around, np.full((len(middles), 400), 1.0 / 400)


def test_where_all_agree_it_is_the_mean_of_the_particles() -> None:
    positions, weights = clouds(10.0, 50.0)
    means, variances = agreeing(positions, weights, positions.mean(axis=1), np.ones(2), 100.0, 0.1)
    assert means == pytest.approx(positions.mean(axis=1), abs=1e-3)
    assert variances == pytest.approx(positions.var(axis=1), rel=0.01)


def test_the_further_away_the_less_a_feature_is_believed() -> None:
    places, weights = clouds(0.0, 0.0, 0.0, 0.0, spread=0.2)
    places[:, :, 0] += np.array([[0.0], [8.0], [40.0], [4000.0]])
    _, variances = agreeing(places, weights, np.zeros((4, 2)), np.ones(4), 8.0, 0.5)
    tails = [1.0, (1 + 0.5) ** 2, (1 + 12.5) ** 2, 1 / LEAST_AGREEMENT]
    assert variances[:, 0] == pytest.approx(0.25 * np.array(tails), rel=0.02)


def test_of_two_places_that_fit_the_nearer_one_counts() -> None:
    """Half of the particles are on the feature, half on what looks like it: their mean would be neither."""
    positions, weights = clouds(0.0, spread=0.5)
    positions[0, 200:, 0] += 60.0
    means, variances = agreeing(positions, weights, np.array([[2.0, 0.0]]), np.ones(1), 6.0, 0.5)
    assert abs(means[0, 0]) < 1.0
    assert variances[0, 0] < 30.0


def test_what_is_doubted_counts_for_less_and_what_says_nothing_for_none() -> None:
    """What is not doubted has the variance of the floor at least."""
    positions, weights = clouds(5.0, 7.0, 9.0, spread=0.0)
    _, variances = agreeing(positions, weights, positions[:, 0], np.array([1.0, 4.0, np.inf]), 3.0, 0.5)
    assert variances == pytest.approx(np.repeat([[0.25], [1.0], [NOTHING_KNOWN_PX2]], 2, axis=1))


@pytest.mark.parametrize("shape", [(1,), (6,), (7,), (2, 3), (5, 2)])
def test_the_middle_is_the_median(shape: tuple[int, ...]) -> None:
    values = np.random.default_rng(2).standard_normal(shape)
    assert np.array_equal(middle(values), np.median(values, axis=0))


# The variance that measurements have beyond their own, and what a fit is then worth.

JACOBIAN = np.random.default_rng(1).standard_normal((16, 5))
RESIDUALS, VARIANCES = 5.0 * RNG.standard_normal(16), RNG.uniform(0.1, 4.0, 16)
ALL = np.ones(16)


def test_what_the_unknowns_explain_leaves_no_excess() -> None:
    """Numbers that fit exactly have none; with as many unknowns as measurements every error is explained."""
    assert excess_variance(JACOBIAN @ np.arange(5.0), JACOBIAN, np.full(16, 0.25), ALL) == 0.0
    assert np.isnan(excess_variance(np.ones(5), JACOBIAN[:5].copy(), np.ones(5), np.ones(5)))


def test_the_weighted_residuals_of_the_fit_have_their_expected_sum() -> None:
    """At the excess that is found the squared residuals, weighted, add up to measurements less unknowns."""
    excess = excess_variance(RESIDUALS, JACOBIAN, VARIANCES, ALL)
    weights = 1.0 / (VARIANCES + excess)
    roots = np.sqrt(weights)
    fitted = np.linalg.lstsq(roots[:, None] * JACOBIAN, roots * RESIDUALS, rcond=None)[0]
    assert excess > 0.0
    assert (weights * (RESIDUALS - JACOBIAN @ fitted) ** 2).sum() == pytest.approx(11.0, rel=1e-5)


def test_what_is_missing_is_not_counted_as_fitting() -> None:
    """The excess of ten measurements is the same with six more that nobody has seen and that fit by themselves."""
    missing = np.arange(16) >= 10
    alone = excess_variance(RESIDUALS[:10], JACOBIAN[:10].copy(), VARIANCES[:10], ALL[:10])
    variances, shown = np.where(missing, 1e9, VARIANCES), np.where(missing, 0.0, 1.0)
    assert excess_variance(RESIDUALS, JACOBIAN, variances, shown) == pytest.approx(alone, rel=1e-4)
    shown[5:10] = 0.0
    assert np.isnan(excess_variance(RESIDUALS, JACOBIAN, variances, shown))


def test_the_covariance_is_that_of_the_fit() -> None:
    """With the weights of the variances it is (J^T W J)^-1; doubled variances double it."""
    gain, regular = fit_gain(JACOBIAN, 1.0 / VARIANCES)
    covariance = fit_covariance(gain, VARIANCES)
    assert regular
    assert covariance == pytest.approx(np.linalg.inv(JACOBIAN.T @ (JACOBIAN / VARIANCES[:, None])), rel=1e-9)
    assert fit_covariance(gain, 2.0 * VARIANCES) == pytest.approx(2.0 * covariance)
