"""Statistics: exact known values, agreement with other implementations, and what holds for any counts."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from scipy import stats

from pftrack.core.numerics import statistics as ours
from pftrack.core.numerics.statistics import RankSum, chi_square, holm, mcnemar, rank_sum, signed_rank, wilson

counts = st.integers(1, 400).flatmap(lambda runs: st.tuples(st.integers(0, runs), st.just(runs)))
probabilities = st.lists(st.floats(0, 1) | st.just(np.nan), min_size=1, max_size=40)
errors = st.lists(st.integers(0, 50).map(float), min_size=1, max_size=30)


@given(counts, st.floats(0.5, 0.999))
def test_wilson_agrees_with_scipy(count: tuple[int, int], level: float) -> None:
    """The interval is SciPy's for the same counts and level, and the rate lies in it; without runs there is none."""
    successes, runs = count
    low, high = wilson(successes, runs, level)
    expected = stats.binomtest(successes, runs).proportion_ci(level, method="wilson")
    assert (float(low), float(high)) == pytest.approx((expected.low, expected.high), abs=1e-9)
    assert 0 <= low <= successes / runs <= high <= 1
    assert np.isnan(wilson(np.zeros((2, 3)), np.zeros((2, 3)))).all()


@given(counts, counts)
def test_chi_square_agrees_with_scipy_where_it_applies(first: tuple[int, int], second: tuple[int, int]) -> None:
    """It is Pearson's test without continuity correction, and not applicable where an expected count is below 5."""
    table = [[first[0], first[1] - first[0]], [second[0], second[1] - second[0]]]
    found = float(chi_square(*first, *second))
    if min(np.sum(table, axis=0)) == 0 or stats.contingency.expected_freq(table).min() < 5 - 1e-9:
        assert np.isnan(found)
    elif stats.contingency.expected_freq(table).min() > 5 + 1e-9:
        assert found == pytest.approx(stats.chi2_contingency(table, correction=False).pvalue, rel=1e-9, abs=1e-300)


@pytest.mark.parametrize(
    ("interval", "given", "sentence"),
    [
        (wilson, (3, 2, 0.95), "must be between"),
        (wilson, (-1, 2, 0.95), "must be between"),
        (wilson, (1, 2, 1.0), "must be between"),
        (ours.paired_rate_interval, (-1, 2, 5), "disagree must be between 0 and the number of pairs"),
        (ours.paired_rate_interval, (3, 3, 5), "disagree must be between 0 and the number of pairs"),
        (ours.paired_rate_interval, (1, 2, 9, 0.0), "the level must be between 0 and 1"),
        (ours.paired_mean_interval, (0.5, 0.1, 9, 1.0), "the level must be between 0 and 1"),
    ],
)
def test_impossible_counts_and_levels_are_refused(interval: Any, given: tuple[float, ...], sentence: str) -> None:
    """Negative counts, more successes or disagreements than there are, and levels that are not between 0 and 1."""
    with pytest.raises(ValueError, match=sentence):
        interval(*given)


def test_chi_square_applies_from_an_expected_count_of_five() -> None:
    """Expected counts of exactly 5 are enough, whatever the counts are."""
    assert not np.isnan(chi_square(3, 10, 7, 10))
    assert np.isnan(chi_square(3, 10, 6, 10))
    assert np.isnan(chi_square(0, 0, 5, 10))
    runs = np.arange(10, 60)  # counts that rounding takes to a little below 5
    first = np.full(50, 5)
    assert not np.isnan(chi_square(first, runs, first, runs)).any()


def test_rank_sum_gives_the_exact_value() -> None:
    """One of the 20 ways to rank three against three puts all of the first before the second: p = 2 / 20."""
    assert rank_sum([1, 2, 3], [4, 5, 6]) == RankSum(pytest.approx(0.1), 1.0)
    for first, second in (([], [1.0]), ([np.nan], [1.0]), ([1.0], [])):  # nothing to compare
        found = rank_sum(first, second)
        assert np.isnan([found.p_value, found.rank_biserial]).all()


def test_signed_rank_gives_the_exact_value() -> None:
    """Two of the 16 ways to sign four differences are as one-sided: p = 2 / 16; pairs that agree do not count."""
    assert signed_rank([1, 2, 3, 4, 9], [2, 4, 6, 8, 9]) == RankSum(pytest.approx(2 / 16), 1.0)
    assert signed_rank([1, 2], [1, 2]) == RankSum(1.0, 0.0)
    assert np.isnan(signed_rank([np.nan], [1.0]).p_value)


@given(errors, errors)
@example([0.0], [0.0])
def test_rank_sum_turns_around(first: list[float], second: list[float]) -> None:
    """Swapped samples have the same p-value and the opposite effect, which is the share of pairs that it says."""
    one, other = rank_sum(first, second), rank_sum(second, first)
    assert one.p_value == pytest.approx(other.p_value)
    assert one.rank_biserial == pytest.approx(-other.rank_biserial)
    pairs = np.subtract.outer(first, second)
    assert one.rank_biserial == pytest.approx((pairs < 0).mean() - (pairs > 0).mean())


@given(st.integers(0, 60), st.integers(0, 60))
def test_mcnemar_is_the_binomial_test_of_a_fair_coin(won: int, lost: int) -> None:
    """It agrees with SciPy's, and neither method is favoured; negative counts are a mistake of the caller."""
    expected = stats.binomtest(won, won + lost, 0.5).pvalue if won + lost else 1.0
    assert float(mcnemar(won, lost)) == pytest.approx(expected, rel=1e-9)
    assert float(mcnemar(lost, won)) == float(mcnemar(won, lost))
    with pytest.raises(ValueError, match="must not be negative"):
        mcnemar(-1 - won, lost)


@given(probabilities)
@example([0.01, 0.04, 0.03, 0.005])
def test_holm_keeps_order_and_leaves_out_what_was_not_tested(p_values: list[float]) -> None:
    """By hand: 4 x .005, 3 x .01, 2 x .03, then never less than before; the order stays, and NaN stays NaN."""
    assert holm([0.01, 0.04, 0.03, 0.005]) == pytest.approx([0.03, 0.06, 0.06, 0.02])
    given_values = np.array(p_values)
    adjusted, tested = holm(given_values), ~np.isnan(given_values)
    assert (np.isnan(adjusted) == ~tested).all()
    known, found = given_values[tested], adjusted[tested]
    assert ((found >= known) & (found <= np.minimum(tested.sum() * known, 1) + 1e-12)).all()
    assert (np.diff(found[np.argsort(known, kind="stable")]) >= 0).all()
    assert holm(np.append(given_values, np.nan))[:-1] == pytest.approx(adjusted, nan_ok=True)


def test_the_interval_of_paired_values_agrees_with_scipy() -> None:
    """It is that of the one-sample t-test; of fewer than two pairs, or of equal differences, nothing is known."""
    gains = np.random.default_rng(4).normal(0.3, 2.0, 17)
    expected = stats.ttest_1samp(gains, 0).confidence_interval(0.9)
    found = ours.paired_mean_interval(gains.mean(), gains.std(ddof=1), 17, 0.9)
    assert np.array(found) == pytest.approx([expected.low, expected.high])
    low, high = ours.paired_mean_interval([np.nan, 0.5, 0.5, 0.5], [np.nan, np.nan, 0.0, 0.1], [0, 1, 9, 9])
    assert np.isnan([low[:3], high[:3]]).all()
    assert low[3] < 0.5 < high[3]


def test_the_interval_of_paired_rates_gives_the_known_one() -> None:
    """21 pairs with 1 and 7 that disagree, by hand: -6 / 23 and 1.96 standard errors of 0.12627.

    The interval does not collapse where the methods agree, stays within -1 and 1, and there is none without pairs.
    """
    assert np.array(ours.paired_rate_interval(1, 7, 21)) == pytest.approx([-0.5083, -0.0134], abs=1e-4)
    low, high = ours.paired_rate_interval([0, 5, 0], [0, 0, 0], [10, 5, 0])
    assert low[0] < 0 < high[0]
    assert high[1] == 1.0
    assert np.isnan([low[2], high[2]]).all()


def test_the_interval_of_dependent_values_is_that_of_six_stretches() -> None:
    """It is the one of the t-test of their means; too few values, and equal ones, have none."""
    values = np.random.default_rng(3).normal(0.4, 1.0, 60)
    expected = stats.ttest_1samp(values.reshape(6, 10).mean(axis=1), 0).confidence_interval(0.9)
    assert ours.dependent_mean_interval(values, 0.9) == pytest.approx((expected.low, expected.high))
    assert np.isnan(ours.dependent_mean_interval(values[:29])).all()
    assert np.isnan(ours.dependent_mean_interval(np.full(60, 0.3))).all()


def test_limits_of_chi_square() -> None:
    """With one degree of freedom the limit is the square of a normal one, with two it has a closed form."""
    assert ours.chi_square_limit(1) == pytest.approx(1.959963984540054**2)
    assert ours.chi_square_limit(2, 0.99) == pytest.approx(-2.0 * math.log(0.01))
    for freedom, level in ((0, 0.95), (2, 1.0)):
        with pytest.raises(ValueError, match="expected a level"):
            ours.chi_square_limit(freedom, level)
