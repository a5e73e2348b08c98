"""Plots and readings that experiments declare: what they name is there to be drawn."""

from itertools import combinations

import pytest

from pftrack.experiments import EXPERIMENTS, Experiment
from pftrack.plot import STANDARD_PLOTS, Plot
from pftrack.runs.diagnostics import Diagnostics
from pftrack.runs.run import Run
from pftrack.series import check_value


@pytest.fixture(scope="module", params=EXPERIMENTS)
def begun(request: pytest.FixtureRequest) -> tuple[Experiment, Diagnostics]:
    """An experiment, and the numbers of one of its frames."""
    experiment = EXPERIMENTS[request.param]
    return experiment, Run(experiment, experiment.simulate(), frames=3).finish().diagnostics


SHAPES = {
    "band": {"number"},
    "features": {"vector"},
    "frequency": {"number", "vector"},
    "interval": {"interval"},
    "hypotheses": {"hypotheses"},
}


def test_series_have_the_shape_that_their_plot_draws(begun: tuple[Experiment, Diagnostics]) -> None:
    """A band is one number a frame, features have one each between 0 and 1, a frequency counts flags."""
    experiment, row = begun
    declared = {series.name: series for series in experiment.declared()}
    for plot in experiment.plots:
        for name in plot.series:
            assert declared[name].shape in SHAPES[plot.kind]
            check_value(declared[name], row.series[name])
            if plot.kind == "features":
                assert declared[name].components
                assert all(0 <= value <= 1 for value in row.vector(name) or ())
            if plot.kind == "frequency":
                assert declared[name].role == "flag"


def test_declarations_are_complete(begun: tuple[Experiment, Diagnostics]) -> None:
    """Each plot says in a sentence what is to be seen, has a name of its own, and the series that its kind needs."""
    experiment, _ = begun
    assert experiment.target != "target"
    assert experiment.readings
    for one, other in combinations(experiment.plots, 2):
        assert one.id != other.id
    for plot in experiment.plots:
        assert plot.title
        assert plot.description.endswith(".")
        assert bool(plot.series) == (plot.kind in SHAPES)
        assert len(plot.levels) == (len(plot.series) if plot.kind == "frequency" else 0)
        assert bool(plot.sd and plot.truth) == (plot.kind == "band")
        assert bool(plot.visible and plot.recognised) == (plot.kind == "features")


def test_the_ball_keeps_its_four() -> None:
    """Error, sigma, effective sample size and proposals are what a tracker of a point shows."""
    assert [plot.kind for plot in EXPERIMENTS["ball"].plots] == ["error", "sigma", "sample size", "samplers"]
    assert EXPERIMENTS["sine"].plots == STANDARD_PLOTS


def test_names_are_those_of_the_fields() -> None:
    """A plot reads the series it draws and those beside them, and none that it leaves out."""
    band = Plot("yaw", "yaw", "band", "It turns.", series=("yaw_deg",), sd="yaw_sd")
    assert band.names == ("yaw_deg", "yaw_sd")
