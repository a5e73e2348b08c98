"""The sheet: plots of a run below each other over one axis of frames, as wide as the text of a printed page.

Lengths are inches, sizes of letters points. Bands are grey where the target is hidden and red where it is lost.
"""

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from pftrack.core.arrays import Bools
from pftrack.core.model.plot import Plot, PlotKind
from pftrack.core.model.series import SeriesRole
from pftrack.core.model.setup import ExportError
from pftrack.output.figures import panels as numbers
from pftrack.output.figures.kinds import KINDS, SHADES
from pftrack.output.figures.picture import PictureForm, encode
from pftrack.output.figures.style import INK, LETTERS_PT, TWO_COLUMNS_IN, bare
from pftrack.runs.manifest import extent_of, manifest_of, title_of
from pftrack.runs.run import Run

WIDE_IN, PANEL_IN, ALONE_IN, ROW_IN = TWO_COLUMNS_IN, 1.25, 2.4, 0.2
HEAD_IN, FOOT_IN, BETWEEN_IN = 0.2, 0.42, 0.34
LEFT_IN, LEFT_WITH_NAMES_IN, RIGHT_IN = 0.62, 1.25, 0.12
TITLE_PT = 9
MOST_MARKS = 200_000
"""So many nodes or segments are drawn; more can be neither told apart nor opened by another program."""

SHADED = {"error": ("hidden", "lost"), "band": ("lost",), "interval": ("lost",), "hypotheses": ("lost",)}
"""By kind, which bands are behind it."""


def drawable(run: Run) -> tuple[Plot, ...]:
    """Return the plots for which the frames of a run have something to draw, as the page shows them."""
    return tuple(plot for plot in run.experiment.plots if _has_numbers(run, plot))


def figure_of(run: Run, plot: str | None = None) -> Figure:
    """Draw a plot of a run, or all that it has something for below each other.

    Args:
        run: As far as it has been computed.
        plot: Id of the one that is wanted.

    Raises:
        ExportError: The experiment has no such plot, or the run has nothing for it.
    """
    known = {it.id: it for it in run.experiment.plots}
    if plot is not None and plot not in known:
        raise ExportError(f"{run.experiment.id} has no plot {plot!r}, only {', '.join(known)}")
    offered = drawable(run)
    shown = offered if plot is None else tuple(it for it in offered if it.id == plot)
    if not shown:
        there = ", ".join(it.id for it in offered) or "none"
        wanted = "no plot" if plot is None else f"nothing for the plot {plot!r}"
        raise ExportError(f"the frames of this run have {wanted}: what it shows was not measured; it has {there}")
    _check_amount(run, shown)
    heights = [_height(run, it, alone=plot is not None) for it in shown]
    high = HEAD_IN + sum(heights) + BETWEEN_IN * len(shown) + FOOT_IN
    left = LEFT_WITH_NAMES_IN if any(it.row_titles for it in shown) else LEFT_IN
    figure = Figure(figsize=(WIDE_IN, high))
    top = high - HEAD_IN
    figure.text(0.1 / WIDE_IN, 1 - 0.1 / high, _heading(run), fontsize=LETTERS_PT, va="top", color=INK["camera"])
    panels = []
    for it, height in zip(shown, heights, strict=True):
        top -= BETWEEN_IN + height
        place = (left / WIDE_IN, top / high, (WIDE_IN - left - RIGHT_IN) / WIDE_IN, height / high)
        panels.append(_panel(figure.add_axes(place), run, it))
    panels[-1].tick_params(labelbottom=True)
    panels[-1].set_xlabel("frame", fontsize=LETTERS_PT)
    return figure


def picture_of(run: Run, form: PictureForm, plot: str | None = None) -> bytes:
    """Return the same as the content of a file, which holds the run's manifest.

    Raises:
        ExportError: See `figure_of`.
    """
    return encode(figure_of(run, plot), form, _heading(run), manifest_of(run))


def _panel(axes: Axes, run: Run, plot: Plot) -> Axes:
    axes.set_xlim(-0.5, max(run.computed, 1) + 0.5)
    axes.margins(x=0)
    bare(axes, grid="y")
    axes.tick_params(labelsize=LETTERS_PT, color=INK["frame"], width=0.6, length=3, labelbottom=False)
    KINDS[plot.kind](axes, run, plot)
    handles, _ = axes.get_legend_handles_labels()
    bands = [_shade(axes, name, where) for name, where in _bands(run, plot).items()]
    keys = [*handles, *bands]
    if keys:
        axes.legend(
            handles=keys,
            loc="lower right",
            bbox_to_anchor=(1.0, 1.0),
            ncols=len(keys),
            fontsize=LETTERS_PT - 1,
            frameon=False,
            borderaxespad=0.1,
            handlelength=1.4,
            columnspacing=1.2,
        )
    unit = _unit(run, plot)
    axes.set_title(f"{plot.title}, {unit}" if unit else plot.title, loc="left", fontsize=TITLE_PT, pad=4)
    return axes


def _bands(run: Run, plot: Plot) -> dict[str, Bools]:
    known = {"hidden": numbers.hidden_frames(run), "lost": numbers.lost_frames(run)}
    return {name: known[name] for name in SHADED.get(plot.kind, ()) if known[name].any()}


def _shade(axes: Axes, name: str, where: Bools) -> Patch:
    """Shade the frames in which something holds, each as wide as it is; return what the key shows of it."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], where, [False]]).astype(int)))
    for begin, end in edges.reshape(-1, 2):
        axes.axvspan(begin - 0.5, end - 0.5, color=INK[name], alpha=SHADES[name], linewidth=0, zorder=0)
    return Patch(color=INK[name], alpha=SHADES[name], linewidth=0, label=name)


DRAWN_ROLE: Mapping[PlotKind, SeriesRole] = {"sample size": "ess", "samplers": "share", "innovation": "nis"}
"""Of kinds that read series by role, the one without which there is nothing to draw."""


def _has_numbers(run: Run, plot: Plot) -> bool:
    if plot.needs_truth and all(row.truth is None for row in run.diagnostics):
        return False
    match plot.kind:
        case "error":
            return not np.isnan(numbers.errors(run)).all()
        case "sigma":
            return True
        case "sample size" | "samplers" | "innovation":
            return bool(numbers.of_role(run, DRAWN_ROLE[plot.kind]))
        case _:
            return any(name in row.series for row in run.diagnostics for name in plot.series)


def _check_amount(run: Run, plots: tuple[Plot, ...]) -> None:
    for plot in plots:
        if plot.kind in {"tree", "hypotheses"}:
            marks = sum(len(it.weights) for it in numbers.hypotheses(run, plot.series[0]))
            if marks > MOST_MARKS:
                raise ExportError(
                    f"the plot {plot.id!r} of this run has {marks:,} marks, a picture shows at most {MOST_MARKS:,}; "
                    "export another plot, or the numbers"
                )


def _height(run: Run, plot: Plot, *, alone: bool) -> float:
    least = ALONE_IN if alone else PANEL_IN
    match plot.kind:
        case "features":
            rows = len(numbers.find_series(run, plot.series[0]).components)
        case "tree":
            rows = max(len(it.weights) for it in numbers.hypotheses(run, plot.series[0]))
        case _:
            rows = 0
    return max(least, ROW_IN * rows)


def _unit(run: Run, plot: Plot) -> str:
    if plot.kind == "frequency":
        return "%"
    return plot.unit or (run.experiment.unit if plot.kind in {"error", "sigma"} else "")


def _heading(run: Run) -> str:
    return f"{title_of(run)}; {extent_of(run)}"
