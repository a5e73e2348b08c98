"""The normalised innovation squared as a series: what Gaussian filters of signals, balls and chains tell of a frame."""

import numpy as np
import pytest
from numpy.typing import NDArray

from pftrack.experiments import find
from pftrack.output.figures.sheet import figure_of
from pftrack.runs.many import outcomes
from pftrack.runs.run import Run
from pftrack.runs.table import table_of
from tests.making import whole_run


def numbers(run: Run, role: str) -> NDArray[np.float64]:
    """The values of the series of a role in all frames after the first."""
    (name,) = (series.name for series in run.experiment.all_series(run.tracker) if series.role == role)
    return np.array([row.number(name) for row in run.diagnostics[1:]])


@pytest.mark.parametrize(("assumed", "expected", "above"), [(0.1, 1.0, 0.05), (0.2, 0.25, 0.0), (0.05, 4.0, 0.33)])
def test_it_tells_whether_the_assumed_noise_is_right(assumed: float, expected: float, above: float) -> None:
    """It is 1 of one number measured where the noise is right, and 4 where half of it is assumed."""
    values = {"assumed_noise_sd": assumed, "process_noise_sd": 0.003}
    run = whole_run(find("sine"), values=values, tracker="kalman", seed=1, frames=301)
    found, limits = numbers(run, "nis"), numbers(run, "nis_limit")
    assert found.mean() == pytest.approx(expected, rel=0.15)
    assert (found > limits).mean() == pytest.approx(above, abs=0.05)
    assert set(limits) == {3.841459}


@pytest.mark.parametrize("tracker", ["ekf", "ekf-mirrors", "ukf"])
def test_a_chain_has_a_number_for_each_that_was_seen(tracker: str) -> None:
    """Its degrees of freedom are the coordinates that were seen, and regions have no innovation."""
    run = whole_run(find("linkage"), tracker=tracker, seed=1, frames=12)
    assert set(numbers(run, "nis_freedom")) == {3.0}
    assert ((numbers(run, "nis") > 0.0) & (numbers(run, "nis") < numbers(run, "nis_limit"))).all()
    roles = {series.role for series in run.experiment.all_series("ellipsoids")}
    assert "nis" not in roles


def test_it_stands_in_tables_sweeps_and_plots() -> None:
    """A column of a table, a mean over the run for the trackers that have it, and a plot with its limit."""
    ball = find("ball")
    run = whole_run(ball, tracker="kalman", seed=1, frames=12)
    table = table_of(run)
    assert np.isnan(table["series_nis"].to_numpy()[0])
    assert table["series_nis"].to_pylist()[1:] == numbers(run, "nis").tolist()
    ((kalman, particles),) = outcomes(
        ball, ball.simulate(), values={}, trackers=("kalman", "h-spf"), seeds=(1,), frames=12
    )
    assert kalman.reductions["mean_nis"] == pytest.approx(numbers(run, "nis").mean())
    assert kalman.reductions["mean_nis_freedom"] == 2.0
    assert particles.reductions.get("mean_nis") is None
    (axes,) = figure_of(run, "innovation").axes
    limit, line = axes.lines
    np.testing.assert_array_equal(np.asarray(line.get_ydata())[1:], numbers(run, "nis"))
    np.testing.assert_array_equal(np.asarray(limit.get_ydata())[1:], numbers(run, "nis_limit"))
