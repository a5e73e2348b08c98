"""Figures: every kind of plot shows the run's own numbers."""

from typing import get_args

import numpy as np
import pytest
from matplotlib.figure import Figure

from pftrack.core.model.recipe import Change
from pftrack.core.model.series import PlotKind
from pftrack.core.refusal import ConflictError
from pftrack.experiments import EXPERIMENTS, find
from pftrack.output.figures import sheet
from pftrack.output.figures.sheet import KINDS, drawable, figure_of
from pftrack.runs.run import Run
from tests.making import whole_run


@pytest.fixture(scope="module")
def ball() -> Run:
    """Return a run of twelve frames with another threshold from frame 6 on."""
    return finished("ball", 12, seed=7, timeline=(Change(6, {"gamma_px": 9.0}),))


def titles(figure: Figure) -> list[str]:
    """Return the titles of the panels."""
    return [axes.get_title("left") for axes in figure.axes]


def finished(name: str, frames: int, **more: object) -> Run:
    return whole_run(find(name), frames=frames, **more)


def test_every_kind_is_drawn_by_some_experiment() -> None:
    """The table has all kinds, so every declared plot has a picture."""
    declared = {plot.kind for experiment in EXPERIMENTS.values() for plot in experiment.display.plots}
    assert declared == set(KINDS) == set(get_args(PlotKind))


def test_lines_are_the_numbers_of_the_frames(ball: Run) -> None:
    """Error and effective sample size are plotted over the frame, the samplers' shares stacked up to all particles."""
    figure = figure_of(ball)
    assert titles(figure) == ["error, px", "ESS", "sigma, px", "proposals"]
    error, ess, sigma, proposals = figure.axes
    np.testing.assert_array_equal(error.lines[0].get_xydata()[:, 1], [row.error for row in ball.diagnostics])
    np.testing.assert_array_equal(ess.lines[-1].get_ydata(), [row.number("ess") for row in ball.diagnostics])
    tops = proposals.patches[-1].get_data().values  # type: ignore[attr-defined] - of stairs
    np.testing.assert_array_equal(tops, [row.number("particles") for row in ball.diagnostics])
    threshold = sigma.lines[-1]
    np.testing.assert_array_equal(threshold.get_ydata(), [5.0, 9.0, 9.0])
    assert list(threshold.get_xdata()) == [0, 6, 11]


def test_bands_are_as_wide_as_the_frames_that_they_shade(ball: Run) -> None:
    """A band begins half a frame before the first hidden or lost frame, and ends half a frame after the last."""
    (axes,) = figure_of(ball, "error").axes
    shaded = {round(span.get_x() + 0.5) + at for span in axes.patches for at in range(round(span.get_width()))}  # type: ignore[attr-defined]
    hidden = {row.frame for row in ball.diagnostics if row.hidden}
    assert hidden
    assert shaded == hidden | {row.frame for row in ball.diagnostics if row.is_lost}


@pytest.mark.parametrize("name", ["linkage", "prism", "hand"])
def test_plots_of_all_other_kinds_are_drawn(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Bands, intervals, trees, hypotheses, features and frequencies have titles and content.

    The line of a tree leads from the most probable hypothesis to its parents; a tree with too many marks is refused.
    """
    run = finished(name, 4)
    shown = drawable(run)
    figure = figure_of(run)
    assert [title.split(",")[0] for title in titles(figure)] == [plot.title for plot in shown]
    assert all(axes.lines or axes.collections for axes in figure.axes)
    if name == "hand":
        known = [row.hypotheses("hands") for row in run.diagnostics]
        place, way = int(np.argmax(known[-1].weights)), []
        for frame in range(3, -1, -1):
            way.append([frame, place + 1])
            place = known[frame].parents[place] if known[frame].parents else -1
        (axes,) = (axes for axes, plot in zip(figure.axes, shown, strict=True) if plot.id == "hands")
        assert axes.lines[0].get_xydata().tolist() == way
        monkeypatch.setattr(sheet, "MOST_MARKS", 2)
        with pytest.raises(ConflictError, match=r"has [0-9]+ marks, a picture shows at most 2; export another plot"):
            figure_of(run, "hands")


def test_an_impossible_figure_is_refused(ball: Run) -> None:
    """So are an unknown plot, and one without measurements of the tracker."""
    with pytest.raises(ConflictError, match="ball has no plot 'gain', only error, ess, sigma, proposals"):
        figure_of(ball, "gain")
    kalman = finished("sine", 2, tracker="kalman")
    with pytest.raises(ConflictError, match=r"nothing for the plot 'ess'.*; it has error, sigma"):
        figure_of(kalman, "ess")
