"""Cells show what counting the rows gives, and two trackers are compared from the rows that a cell pools."""

from dataclasses import replace

import numpy as np
import pytest

from pftrack.core.numerics.statistics import (
    chi_square,
    fisher_exact,
    holm,
    paired_mean_interval,
    paired_rate_interval,
    rank_sum,
    wilson,
)
from pftrack.sweep import Comparison, Plan, Result, compare
from pftrack.sweep.axis import SweepError
from pftrack.sweep.cells import CellMap, Code, cells, count, quantities, quantity_named, samples, significance

X, Y = "occlusion_width_px", "distracter_radius_px"


def test_a_cell_pools_its_runs(finished: Result, plan: Plan) -> None:
    """Runs, successes, rate, interval, error and lost frames are those of the rows of the cell."""
    maps = cells(finished, X, Y)
    assert list(maps) == list(plan.trackers)
    rows = finished.table.to_pylist()
    for tracker, found in maps.items():
        assert found.runs.shape == (2, 4)
        for (down, across), runs in np.ndenumerate(found.runs):
            values = plan.axis(X).values[across], plan.axis(Y).values[down]
            mine = [row for row in rows if row["tracker"] == tracker and (row[X], row[Y]) == values]
            won = [row for row in mine if row["success"]]
            assert runs == found.judged[down, across] == len(mine) == plan.trials
            assert found.successes[down, across] == len(won)
            assert found.rate[down, across] == pytest.approx(len(won) / len(mine))
            low, high = wilson(len(won), len(mine))
            assert (found.low[down, across], found.high[down, across]) == pytest.approx((float(low), float(high)))
            errors = [row["mean_error"] for row in won]
            expected = np.mean(errors) if errors else np.nan
            assert found.mean_error[down, across] == pytest.approx(expected, nan_ok=True)
            assert found.mean_lost_frames[down, across] == pytest.approx(np.mean([row["lost_frames"] for row in mine]))
            assert found.problems[down, across] == 0


def test_axes_can_be_left_out(finished: Result, plan: Plan) -> None:
    """With one axis or none the others are pooled: the sums are the same."""
    full, line, point = (cells(finished, *names)["h-spf"] for names in ((X, Y), (X,), ()))
    assert (line.runs.shape, point.runs.shape) == ((1, 4), (1, 1))
    assert (full.successes.sum(axis=0) == line.successes[0]).all()
    assert point.successes[0, 0] == full.successes.sum()
    assert point.runs[0, 0] == plan.runs / 2


def test_a_map_can_be_filled_piece_by_piece(finished: Result, plan: Plan) -> None:
    """Counting the rows in any pieces and adding up comes to the same cells."""
    total = count(plan, None, X, Y)
    assert not any(it.any() for it in total.sums.values())
    for start in range(0, plan.runs, 7):
        total += count(plan, finished.table.slice(start, 7), X, Y)
    for tracker, found in cells(total).items():
        expected = cells(finished, X, Y)[tracker]
        for name in ("runs", "successes", "rate", "low", "high", "mean_error", "mean_lost_frames"):
            assert getattr(found, name) == pytest.approx(getattr(expected, name), nan_ok=True), name


@pytest.mark.parametrize(("x", "y", "reason"), [("width", None, "no axis 'width'"), (X, X, "two different axes")])
def test_an_impossible_map_is_refused(x: str, y: str | None, reason: str, finished: Result) -> None:
    """Unknown and repeated axes are named."""
    with pytest.raises(SweepError, match=reason):
        cells(finished, x, y)


def of_counts(successes: list[int], runs: int) -> CellMap:
    """Cells in a row with given successes."""
    k = np.array([successes])
    n = np.full_like(k, runs)
    nothing = np.full(k.shape, np.nan)
    return CellMap(None, None, n, n, k, k / n, nothing, nothing, nothing, nothing, 0 * n)


def test_four_codes_say_which_is_better() -> None:
    """First better, second better, not significant, and not applicable where too little is expected."""
    first, second = of_counts([90, 10, 50, 0, 1], 100), of_counts([50, 60, 52, 0, 3], 100)
    found = significance(first, second)
    assert found.codes.tolist() == [
        [Code.FIRST_BETTER, Code.SECOND_BETTER, Code.NOT_SIGNIFICANT, Code.NOT_APPLICABLE, Code.NOT_APPLICABLE]
    ]
    expected = chi_square(first.successes, first.runs, second.successes, second.runs)
    assert found.p_values == pytest.approx(expected, nan_ok=True)
    assert found.effect[0] == pytest.approx([0.4, -0.5, -0.02, 0.0, -0.02])


def test_holm_is_stricter_and_fisher_is_always_applicable() -> None:
    """A cell that passes by itself may fail in its map; small counts are tested exactly."""
    first, second = of_counts([62, 50, 50, 1], 100), of_counts([43, 51, 49, 3], 100)
    alone, corrected = (significance(first, second, correction=it) for it in ("none", "holm"))
    assert alone.codes[0, 0] == Code.FIRST_BETTER
    assert corrected.codes[0, 0] == Code.NOT_SIGNIFICANT
    assert corrected.p_values == pytest.approx(holm(alone.p_values), nan_ok=True)
    exact = significance(first, second, test="fisher")
    assert exact.codes[0, 3] == Code.NOT_SIGNIFICANT
    assert exact.p_values == pytest.approx(fisher_exact(first.successes, first.runs, second.successes, second.runs))


# Comparisons: two trackers by any quantity, from the rows that a cell pools.

TRACKERS = "h-spf", "condensation"
SIGNS = {"success": 1, "error": -1, "inside_share": 1, "median_error_px": -1}


def compared(result: Result, name: str, *axes: str) -> Comparison:
    quantity = quantity_named(result.plan, name)
    return compare(quantity, cells(result, *axes), samples(result, quantity, *(axes or (None,))), *TRACKERS)


def test_success_error_and_every_measure_can_be_compared(plan: Plan) -> None:
    """They come in this order, with title, unit and direction as declared."""
    known = quantities(plan)
    assert [it.name for it in known] == ["success", "error", *(it.name for it in plan.wiring.run_measures)]
    assert [it.better for it in known[:2]] == ["higher", "lower"]
    median = quantity_named(plan, "median_error_px")
    assert (median.label, median.better, median.share) == ("Median error, px", "lower", False)
    assert quantity_named(plan, "inside_share").share
    with pytest.raises(SweepError, match="no measure 'beauty'; it has success, error, "):
        quantity_named(plan, "beauty")


@pytest.mark.parametrize("name", SIGNS)
def test_a_difference_is_positive_where_the_first_is_better(finished: Result, plan: Plan, name: str) -> None:
    """It is that of the means of the cell's runs; the paired one that of the runs on the same seeds."""
    found, column = compared(finished, name, X, Y), {"error": "mean_error"}.get(name, name)
    rows = [row for row in finished.table.to_pylist() if name != "error" or row["success"]]
    for down, across in np.ndindex(2, 4):
        values = plan.axis(X).values[across], plan.axis(Y).values[down]
        mine = [row for row in rows if (row[X], row[Y]) == values]
        first, second = ({row["seed"]: float(row[column]) for row in mine if row["tracker"] == it} for it in TRACKERS)
        apart = np.mean([*first.values()]) - np.mean([*second.values()]) if first and second else np.nan
        assert found.difference[down, across] == pytest.approx(SIGNS[name] * apart, nan_ok=True)
        gains = [SIGNS[name] * (first[seed] - second[seed]) for seed in first.keys() & second.keys()]
        assert found.paired.pairs[down, across] == len(gains)
        assert found.paired.mean[down, across] == pytest.approx(np.mean(gains) if gains else np.nan, nan_ok=True)
        if name == "success":
            ends = paired_rate_interval(gains.count(1.0), gains.count(-1.0), len(gains))
        else:
            spread = np.std(gains, ddof=1) if len(gains) > 1 and np.ptp(gains) > 1e-9 else 0.0
            ends = paired_mean_interval(np.mean(gains) if gains else np.nan, spread, len(gains))
        shown = found.paired.low[down, across], found.paired.high[down, across]
        assert shown == pytest.approx(tuple(map(float, ends)), nan_ok=True)


@pytest.mark.parametrize("name", [name for name in SIGNS if name != "success"])
def test_all_but_success_is_tested_by_ranks(finished: Result, plan: Plan, name: str) -> None:
    """Each cell's rank-sum test has the values of its runs, errors of the successful ones alone."""
    found = compared(finished, name, X)
    column = {"error": "mean_error"}.get(name, name)
    rows = [row for row in finished.table.to_pylist() if name != "error" or row["success"]]
    assert found.test == "rank-sum"
    codes = found.significance(0.3).codes[0]
    for place, width in enumerate(plan.axis(X).values):
        first, second = ([r[column] for r in rows if (r["tracker"], r[X]) == (it, width)] for it in TRACKERS)
        tested = rank_sum(first, second)
        assert found.p_values[0, place] == pytest.approx(tested.p_value, nan_ok=True)
        assert found.effect[0, place] == pytest.approx(-SIGNS[name] * tested.rank_biserial, nan_ok=True)
        assert (codes[place] in {Code.FIRST_BETTER, Code.SECOND_BETTER}) == (tested.p_value < 0.3)


def test_success_is_tested_by_its_counts(finished: Result) -> None:
    """The codes are those of the cells' own test, by both tests and with Holm's correction."""
    maps = cells(finished, X, Y)
    quantity = quantity_named(finished.plan, "success")
    values = samples(finished, quantity, X, Y)
    for test in ("chi-square", "fisher"):
        found = compare(quantity, maps, values, *TRACKERS, test=test)
        for correction in ("none", "holm"):
            expected = significance(*(maps[name] for name in TRACKERS), level=0.2, correction=correction, test=test)
            assert (found.significance(0.2, correction).codes == expected.codes).all()
    with pytest.raises(SweepError, match="no tracker 'apf'"):
        compare(quantity, maps, values, "apf", "h-spf")


def test_a_tracker_that_lacks_a_measure_is_not_compared_by_it(finished: Result) -> None:
    """Without values there is neither difference nor interval, and the test is not applicable."""
    quantity = quantity_named(finished.plan, "inside_share")
    whole, maps = samples(finished, quantity, X, Y), cells(finished, X, Y)
    lacking = replace(
        whole,
        values={**whole.values, "condensation": [np.zeros(0)] * 8},
        scenes={**whole.scenes, "condensation": [np.zeros(0, np.int64)] * 8},
    )
    nothing = {**maps["condensation"].measures, "inside_share": np.full((2, 4), np.nan)}
    maps["condensation"] = replace(maps["condensation"], measures=nothing)
    found = compare(quantity, maps, lacking, *TRACKERS)
    assert np.isnan([found.difference, found.paired.mean, found.paired.low, found.p_values]).all()
    assert not found.paired.pairs.any()
    assert (found.significance(0.2).codes == Code.NOT_APPLICABLE).all()
