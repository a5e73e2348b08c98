"""Cells: what a map shows is what counting the rows gives, however the rows arrive."""

import numpy as np
import pytest

from pftrack.core.numerics.statistics import chi_square, fisher_exact, holm, wilson
from pftrack.sweep import Plan, Result
from pftrack.sweep.axis import SweepError
from pftrack.sweep.cells import CellMap, Code, cells, count, significance

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
