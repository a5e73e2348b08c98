"""Features of which some are elsewhere: what those say that agree with the solid."""

import numpy as np
import pytest

from pftrack.filters.agreement import LEAST_AGREEMENT, NOTHING_KNOWN_PX2, agreeing, middle


def clouds(*middles: tuple[float, float], spread: float = 1.0, count: int = 400) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(1)
    positions = np.array(middles)[:, None] + spread * rng.standard_normal((len(middles), count, 2))
    return positions, np.full((len(middles), count), 1.0 / count)


def test_where_all_agree_it_is_the_mean_of_the_particles() -> None:
    positions, weights = clouds((10.0, 20.0), (50.0, 5.0))
    means, variances = agreeing(positions, weights, positions.mean(axis=1), np.ones(2), 100.0, 0.1)
    assert means == pytest.approx(positions.mean(axis=1), abs=1e-3)
    assert variances == pytest.approx(positions.var(axis=1), rel=0.01)


def test_the_further_away_the_less_a_feature_is_believed() -> None:
    positions, weights = clouds((0.0, 0.0), (8.0, 0.0), (40.0, 0.0), (4000.0, 0.0), spread=0.2)
    _, variances = agreeing(positions, weights, np.zeros((4, 2)), np.ones(4), 8.0, 0.5)
    floor = 0.25
    tails = [1.0, (1 + 0.5) ** 2, (1 + 12.5) ** 2, 1 / LEAST_AGREEMENT]
    assert variances[:, 0] == pytest.approx(floor * np.array(tails), rel=0.02)


def test_of_two_places_that_fit_the_nearer_one_counts() -> None:
    """Half of the particles are on the feature, half on what looks like it: their mean would be neither."""
    positions, weights = clouds((0.0, 0.0), spread=0.5)
    positions[0, 200:, 0] += 60.0
    means, variances = agreeing(positions, weights, np.array([[2.0, 0.0]]), np.ones(1), 6.0, 0.5)
    assert abs(means[0, 0]) < 1.0
    assert variances[0, 0] < 30.0


def test_the_floor_holds() -> None:
    positions, weights = clouds((5.0, 5.0), spread=0.0)
    _, variances = agreeing(positions, weights, np.array([[5.0, 5.0]]), np.ones(1), 3.0, 0.5)
    assert variances == pytest.approx(np.full((1, 2), 0.25))


def test_what_is_doubted_counts_for_less_and_what_says_nothing_for_none() -> None:
    positions, weights = clouds((5.0, 5.0), (7.0, 7.0), (9.0, 9.0), spread=0.0)
    _, variances = agreeing(positions, weights, positions[:, 0], np.array([1.0, 4.0, np.inf]), 3.0, 0.5)
    assert variances[:2, 0] == pytest.approx([0.25, 1.0])
    assert (variances[2] == NOTHING_KNOWN_PX2).all()


@pytest.mark.parametrize("shape", [(1,), (6,), (7,), (2, 3), (5, 2)])
def test_the_middle_is_the_median(shape: tuple[int, ...]) -> None:
    values = np.random.default_rng(2).standard_normal(shape)
    assert np.array_equal(middle(values), np.median(values, axis=0))
