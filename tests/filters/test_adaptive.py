"""Features from two predictions: where particles come from, what is learned of both, and what outlying ones count."""

import numpy as np
import pytest

from pftrack.core.numerics.random import Purpose, Stream, log_density
from pftrack.filters import adaptive, agreement
from pftrack.filters.adaptive import Projection
from pftrack.filters.learning import mixture_em
from pftrack.filters.learning.mixture_em import Mixture, Settings

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
    """A particle from below was, in the last frame, where its parent is; one from above has no parent.

    One that is held is its own parent, and no particle descends from those of another filter.
    """
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
    held = adaptive.hold(adaptive.begin(PLACES, 1.0, 4, rng(0)))
    assert held.parents.tolist() == [[0, 1, 2, 3], [4, 5, 6, 7], [8, 9, 10, 11]]
    assert (adaptive.orphan(held).parents == -1).all()


RNG = np.random.default_rng(0)
ABOVE = (np.array([[2.0, 1.0]]), np.array([[4.0, 9.0]]))
CENTRES = RNG.normal(size=(1, 2, 30)) * [[6.0], [3.0]] + 5.0
POINTS = RNG.normal(size=(1, 2, 40)) * 4.0


@pytest.mark.parametrize("density", ["gaussian", "kernel"])
def test_the_first_step_is_the_mean_responsibility(density: str) -> None:
    """In the first frame the ratio becomes the mean share that the upper density has in each survivor.

    With lambda = 0.5 eta is 1, 2/3, 4/7, ... and tends to 0.5 (eq. A.30).
    """
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
    etas = [ours.eta]
    for _ in range(30):
        ours = mixture_em.adapt(ours, POINTS, ABOVE, CENTRES, 5.0, settings)
        etas.append(ours.eta)
    assert [*etas[:3], etas[-1]] == pytest.approx([1, 2 / 3, 4 / 7, 0.5])


# Features that agree with the solid count, and others the less the further away they are.


def clouds(*middles: float, spread: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    """Return equally weighed particles about places on the diagonal."""
    around = np.random.default_rng(1).standard_normal((len(middles), 400, 2))
    return np.array(middles)[:, None, None] + spread * around, np.full((len(middles), 400), 1.0 / 400)


def test_where_all_agree_it_is_the_mean_of_the_particles() -> None:
    positions, weights = clouds(10.0, 50.0)
    means, variances = agreement.agreeing(positions, weights, positions.mean(axis=1), np.ones(2), 100.0, 0.1)
    assert means == pytest.approx(positions.mean(axis=1), abs=1e-3)
    assert variances == pytest.approx(positions.var(axis=1), rel=0.01)


def test_distance_and_doubt_make_a_feature_count_less() -> None:
    """By the tails of a t distribution, and by the factor of its doubt; without doubt the floor is its variance."""
    places, weights = clouds(0.0, 0.0, 0.0, 0.0, spread=0.2)
    places[:, :, 0] += np.array([[0.0], [8.0], [40.0], [4000.0]])
    _, variances = agreement.agreeing(places, weights, np.zeros((4, 2)), np.ones(4), 8.0, 0.5)
    tails = [1.0, (1 + 0.5) ** 2, (1 + 12.5) ** 2, 1 / agreement.LEAST_AGREEMENT]
    assert variances[:, 0] == pytest.approx(0.25 * np.array(tails), rel=0.02)
    places, weights = clouds(5.0, 7.0, 9.0, spread=0.0)
    _, variances = agreement.agreeing(places, weights, places[:, 0], np.array([1.0, 4.0, np.inf]), 3.0, 0.5)
    assert variances == pytest.approx(np.repeat([[0.25], [1.0], [agreement.NOTHING_KNOWN_PX2]], 2, axis=1))


def test_of_two_places_that_fit_the_nearer_one_counts() -> None:
    """Half of the particles are on the feature, half on what looks like it: their mean would be neither."""
    positions, weights = clouds(0.0, spread=0.5)
    positions[0, 200:, 0] += 60.0
    means, variances = agreement.agreeing(positions, weights, np.array([[2.0, 0.0]]), np.ones(1), 6.0, 0.5)
    assert abs(means[0, 0]) < 1.0
    assert variances[0, 0] < 30.0


@pytest.mark.parametrize("shape", [(1,), (6,), (7,), (5, 2)])
def test_the_middle_is_the_median(shape: tuple[int, ...]) -> None:
    values = np.random.default_rng(2).standard_normal(shape)
    assert np.array_equal(agreement.middle(values), np.median(values, axis=0))


# The variance that measurements have beyond their own, and what a fit is then worth.

JACOBIAN = np.random.default_rng(1).standard_normal((16, 5))
RESIDUALS, VARIANCES = 5.0 * RNG.standard_normal(16), RNG.uniform(0.1, 4.0, 16)
ALL = np.ones(16)


def test_the_weighted_residuals_of_the_fit_have_their_expected_sum() -> None:
    """At the excess that is found the squared residuals, weighted, add up to measurements less unknowns."""
    excess = agreement.excess_variance(RESIDUALS, JACOBIAN, VARIANCES, ALL)
    weights = 1.0 / (VARIANCES + excess)
    roots = np.sqrt(weights)
    fitted = np.linalg.lstsq(roots[:, None] * JACOBIAN, roots * RESIDUALS, rcond=None)[0]
    assert excess > 0.0
    assert (weights * (RESIDUALS - JACOBIAN @ fitted) ** 2).sum() == pytest.approx(11.0, rel=1e-5)


def test_what_is_missing_is_not_counted_as_fitting() -> None:
    """The excess of ten measurements is the same with six more that nobody has seen and that fit by themselves."""
    missing = np.arange(16) >= 10
    alone = agreement.excess_variance(RESIDUALS[:10], JACOBIAN[:10].copy(), VARIANCES[:10], ALL[:10])
    variances, shown = np.where(missing, 1e9, VARIANCES), np.where(missing, 0.0, 1.0)
    assert agreement.excess_variance(RESIDUALS, JACOBIAN, variances, shown) == pytest.approx(alone, rel=1e-4)
    shown[5:10] = 0.0
    assert np.isnan(agreement.excess_variance(RESIDUALS, JACOBIAN, variances, shown))


def test_the_covariance_is_that_of_the_fit() -> None:
    """With the weights of the variances it is (J^T W J)^-1; doubled variances double it."""
    gain, regular = agreement.fit_gain(JACOBIAN, 1.0 / VARIANCES)
    covariance = agreement.fit_covariance(gain, VARIANCES)
    assert regular
    assert covariance == pytest.approx(np.linalg.inv(JACOBIAN.T @ (JACOBIAN / VARIANCES[:, None])), rel=1e-9)
    assert agreement.fit_covariance(gain, 2.0 * VARIANCES) == pytest.approx(2.0 * covariance)
