"""Cells show what counting the rows gives, and two trackers are compared from the rows that a cell pools."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from pftrack.core.numerics import statistics
from pftrack.core.numerics.statistics import chi_square, holm, mcnemar, rank_sum, signed_rank, wilson
from pftrack.sweep import Comparison, Plan, Result, compare
from pftrack.sweep.axis import SweepError
from pftrack.sweep.cells import Code, cells, count, quantities, quantity_named, samples

X, Y = "occlusion_width_px", "distracter_radius_px"


def test_a_cell_pools_its_runs(finished: Result, plan: Plan) -> None:
    """Runs, successes, rate, interval, error and lost frames are those of the rows of the cell.

    Success, the error and every measure are its quantities, with title, unit and direction as declared.
    """
    assert [it.name for it in quantities(plan)] == ["success", "error", *(it.name for it in plan.wiring.run_measures)]
    median = quantity_named(plan, "median_error_px")
    assert (median.label, median.better, median.share) == ("Median error, px", "lower", False)
    with pytest.raises(SweepError, match="no measure 'beauty'; it has success, error, "):
        quantity_named(plan, "beauty")
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


def test_axes_can_be_left_out(finished: Result, plan: Plan) -> None:
    """With one axis or none the others are pooled: the sums are the same; unknown and repeated axes are refused."""
    full, line, point = (cells(finished, *names)["h-spf"] for names in ((X, Y), (X,), ()))
    assert (line.runs.shape, point.runs.shape) == ((1, 4), (1, 1))
    assert (full.successes.sum(axis=0) == line.successes[0]).all()
    assert point.successes[0, 0] == full.successes.sum()
    assert point.runs[0, 0] == plan.runs / 2
    for wrong, reason in (("width", "no axis 'width'"), (X, "two different axes")):
        with pytest.raises(SweepError, match=reason):
            cells(finished, wrong, X)


def test_a_map_can_be_filled_piece_by_piece(finished: Result, plan: Plan) -> None:
    """Counting the rows in any pieces and adding up gives the same cells."""
    total = count(plan, None, X, Y)
    for start in range(0, plan.runs, 7):
        total += count(plan, finished.table.slice(start, 7), X, Y)
    for tracker, found in cells(total).items():
        expected = cells(finished, X, Y)[tracker]
        for name in ("runs", "successes", "rate", "low", "high", "mean_error", "mean_lost_frames"):
            assert getattr(found, name) == pytest.approx(getattr(expected, name), nan_ok=True), name


def test_four_codes_say_which_is_better(finished: Result) -> None:
    """First better, second better, not significant, and not applicable; Holm's correction is stricter."""
    p_values, effect = np.array([[0.001, 0.002, 0.3, np.nan, 0.009]]), np.array([[0.4, -0.5, -0.02, 0.0, 0.1]])
    pair = replace(compared(finished, "success", X), p_values=p_values, effect=effect)
    found, corrected = (pair.significance(correction=it) for it in ("none", "holm"))
    first, second, none, untested = Code.FIRST_BETTER, Code.SECOND_BETTER, Code.NOT_SIGNIFICANT, Code.NOT_APPLICABLE
    assert found.codes.tolist() == [[first, second, none, untested, first]]
    assert corrected.codes.tolist() == [[first, second, none, untested, none]]
    assert corrected.p_values == pytest.approx(holm(p_values), nan_ok=True)


# Comparisons: two trackers by any quantity, from the rows that a cell pools.

TRACKERS = "h-spf", "condensation"
SIGNS = {"success": 1, "error": -1, "inside_share": 1, "median_error_px": -1}


def rows_of(result: Result, name: str) -> list[dict[str, Any]]:
    """The rows that have a value of a quantity, with that as `it`."""
    rows = [row for row in result.table.to_pylist() if name != "error" or row["success"]]
    return [{**row, "it": float(row["mean_error" if name == "error" else name])} for row in rows]


def compared(result: Result, name: str, *axes: str) -> Comparison:
    quantity = quantity_named(result.plan, name)
    return compare(quantity, cells(result, *axes), samples(result, quantity, *(axes or (None,))), *TRACKERS)


@pytest.mark.parametrize("name", SIGNS)
def test_a_difference_is_positive_where_the_first_is_better(finished: Result, plan: Plan, name: str) -> None:
    """It is that of the means of the cell's runs; the paired one that of the runs on the same seeds."""
    found, rows = compared(finished, name, X, Y), rows_of(finished, name)
    for down, across in np.ndindex(2, 4):
        values = plan.axis(X).values[across], plan.axis(Y).values[down]
        mine = [row for row in rows if (row[X], row[Y]) == values]
        first, second = ({row["seed"]: row["it"] for row in mine if row["tracker"] == it} for it in TRACKERS)
        apart = np.mean([*first.values()]) - np.mean([*second.values()]) if first and second else np.nan
        assert found.difference[down, across] == pytest.approx(SIGNS[name] * apart, nan_ok=True)
        gains = [SIGNS[name] * (first[seed] - second[seed]) for seed in first.keys() & second.keys()]
        assert found.paired.pairs[down, across] == len(gains)
        assert found.paired.mean[down, across] == pytest.approx(np.mean(gains) if gains else np.nan, nan_ok=True)
        if name == "success":
            ends = statistics.paired_rate_interval(gains.count(1.0), gains.count(-1.0), len(gains))
        else:
            spread = np.std(gains, ddof=1) if len(gains) > 1 and np.ptp(gains) > 1e-9 else 0.0
            ends = statistics.paired_mean_interval(np.mean(gains) if gains else np.nan, spread, len(gains))
        shown = found.paired.low[down, across], found.paired.high[down, across]
        assert shown == pytest.approx(tuple(map(float, ends)), nan_ok=True)


@pytest.mark.parametrize("name", SIGNS)
def test_runs_on_the_same_scenes_are_tested_in_pairs(finished: Result, plan: Plan, name: str) -> None:
    """Success by McNemar's test, all else by the signed-rank test, and errors where both succeeded."""
    found, rows = compared(finished, name, X), rows_of(finished, name)
    assert found.test == ("mcnemar" if name == "success" else "signed-rank")
    codes = found.significance(0.3).codes[0]
    for place, width in enumerate(plan.axis(X).values):
        of = [{(r[Y], r["seed"]): r["it"] for r in rows if (r["tracker"], r[X]) == (it, width)} for it in TRACKERS]
        first, second = (np.array([one[scene] for scene in of[0].keys() & of[1].keys()]) for one in of)
        tested = signed_rank(first, second)
        p_value, effect = tested.p_value, -SIGNS[name] * tested.rank_biserial
        if name == "success":
            p_value = float(mcnemar((first > second).sum(), (first < second).sum()))
            effect = (first - second).mean()
        shown = found.p_values[0, place], found.effect[0, place]
        assert shown == pytest.approx((p_value, effect), nan_ok=True)
        assert (codes[place] in {Code.FIRST_BETTER, Code.SECOND_BETTER}) == (p_value < 0.3)


def test_published_tests_take_runs_for_independent(finished: Result) -> None:
    """They are the chi-square test of the counts and the rank-sum test of all values, for figures of others."""
    maps = cells(finished, X, Y)
    for name in ("success", "error"):
        quantity = quantity_named(finished.plan, name)
        values = samples(finished, quantity, X, Y)
        found = compare(quantity, maps, values, *TRACKERS, test="chi-square")
        first, second = (maps[it] for it in TRACKERS)
        expected = chi_square(first.successes, first.judged, second.successes, second.judged).ravel()
        if name == "error":
            pairs = zip(*(values.values[it] for it in TRACKERS), strict=True)
            expected = np.array([rank_sum(*pair).p_value for pair in pairs])
        assert found.test == {"success": "chi-square", "error": "rank-sum"}[name]
        assert found.p_values.ravel() == pytest.approx(expected, nan_ok=True)
    with pytest.raises(SweepError, match="no tracker 'apf'"):
        compare(quantity, maps, values, "apf", "h-spf")
