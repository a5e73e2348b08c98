"""Plots and readings that experiments declare: what they name is there to be drawn."""

import pytest

from pftrack.core.model.series import STANDARD_PLOTS
from pftrack.core.model.tracker import Diagnostics
from pftrack.experiments import EXPERIMENTS, find
from pftrack.experiments.experiment import Experiment
from pftrack.runs.run import Run


@pytest.fixture(scope="module", params=EXPERIMENTS)
def begun(request: pytest.FixtureRequest) -> tuple[Experiment, Diagnostics]:
    """An experiment, and the numbers of one of its frames."""
    experiment = EXPERIMENTS[request.param]
    return experiment, Run(experiment, experiment.simulate(), frames=3).finish().diagnostics


def test_series_have_the_values_that_their_plot_draws(begun: tuple[Experiment, Diagnostics]) -> None:
    """Features have a number each between 0 and 1, and a frequency counts flags."""
    experiment, row = begun
    declared = {series.name: series for series in experiment.all_series()}
    for plot in experiment.display.plots:
        for name in plot.series:
            if plot.kind == "features":
                assert declared[name].components
                assert all(0 <= value <= 1 for value in row.vector(name) or ())
            if plot.kind == "frequency":
                assert declared[name].role == "flag"


def test_the_ball_keeps_its_five() -> None:
    """Error, effective sample size, sigma, proposals and innovation are what a tracker of a point shows."""
    kinds = ["error", "sample size", "sigma", "samplers", "innovation"]
    assert [plot.kind for plot in EXPERIMENTS["ball"].display.plots] == kinds
    assert EXPERIMENTS["sine"].display.plots == STANDARD_PLOTS


def test_short_names_of_features_are_written_out() -> None:
    """Each row of the head's features has words for what people call it."""
    head = find("head")
    (plot,) = (plot for plot in head.display.plots if plot.kind == "features")
    (series,) = (series for series in head.all_series() if series.name == plot.series[0])
    assert dict(zip(series.components, plot.row_titles, strict=True))["lmc"] == "left eye, inner corner"
