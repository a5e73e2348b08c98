"""The sheet: plots of a run in one column over a common axis of frames, as wide as the text of a printed page.

Lengths are in inches, font sizes in points. Bands are grey where the target is hidden and red where it is lost.
"""

from collections.abc import Callable, Iterator, Mapping
from itertools import cycle
from typing import Any, TypeAlias

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from pftrack.core.arrays import Bools, Floats, Ints, spans
from pftrack.core.model import series
from pftrack.core.model.parameters import Declaration
from pftrack.core.model.series import Hypotheses, Plot, PlotKind, Series, SeriesRole
from pftrack.core.refusal import ConflictError
from pftrack.output.figures.style import CURVE_COLOURS, INK, LETTERS_PT, TWO_COLUMNS_IN, PictureForm, bare, encode
from pftrack.runs.loss import Loss
from pftrack.runs.manifest import extent_of, manifest_of, title_of
from pftrack.runs.run import Run

# Kinds of plot, each drawn into axes over the frames of a run.
#
# A kind is a function of the axes, the run and the declaration; the sheet adds shaded bands and the legend. As on the
# page, an axis of non-negative values begins at 0.


Draw: TypeAlias = Callable[[Axes, Run, Plot], None]

LINE, THIN = 1.2, 0.8
TRUTH: dict[str, Any] = {"color": INK["truth"], "linewidth": THIN, "linestyle": (0, (4, 3)), "label": "truth"}
AREA: dict[str, Any] = {"color": INK["estimate"], "alpha": 0.22, "linewidth": 0}
SHADES = {"hidden": 0.2, "lost": 0.16}
FAINTEST = 0.06
"""Smallest opacity, so that even improbable hypotheses are visible."""
FREE = 0.12
"""Share of a feature's row that stays free above and below its line."""


def frames(run: Run) -> Ints:
    """Return the (L,) indices of the computed frames."""
    return np.arange(run.computed + 1)


def errors(run: Run) -> Floats:
    """Return the (L,) distances of the estimate from the truth."""
    return np.array([np.nan if row.error is None else row.error for row in run.diagnostics])


def sigmas(run: Run) -> Floats:
    """Return the (L,) largest standard deviation of each frame."""
    return np.array([max(row.sigma, default=np.nan) for row in run.diagnostics])


def hidden_frames(run: Run) -> Bools:
    """Return for each frame (L,) whether the target is known to be out of sight."""
    return np.array([row.hidden is True for row in run.diagnostics])


def find_series(run: Run, name: str) -> Series:
    """Return the declaration of a series that a plot names."""
    return next(one for one in run.experiment.all_series() if one.name == name)


def of_role(run: Run, role: str) -> list[Series]:
    """Return the series of a role that have a value in any frame."""
    declared = [one for one in run.experiment.all_series() if one.role == role]
    return [one for one in declared if any(one.name in row.series for row in run.diagnostics)]


def measure(run: Run, name: str) -> Floats:
    """Return the values of a series: (L,) numbers, (L, d) vectors or intervals, or (L,) NaN without any value."""
    values = [row.series.get(name) for row in run.diagnostics]
    if not name or all(value is None for value in values):
        return np.full(len(values), np.nan)
    return series.columns(find_series(run, name), values)[name]


def hypotheses(run: Run, name: str) -> list[Hypotheses]:
    """Return the hypotheses of each frame, empty where it has none."""
    return [row.hypotheses(name) or Hypotheses((), ()) for row in run.diagnostics]


def thresholds(run: Run, of: str) -> Iterator[tuple[list[int], list[float]]]:
    """Yield for each parameter that limits a series its values and the frames from which they are in force."""
    changes = sorted({0, *(change.frame for change in run.timeline.changes if change.frame <= run.computed)})
    steps = [*changes, run.computed]
    for item in run.experiment.declarations(type(run.setup.parameters)):
        if item.role == "threshold" and item.threshold_of == of:
            values = [_in_force(run, item, frame) for frame in steps]
            if not np.isnan(values).all():
                yield steps, values


def _in_force(run: Run, item: Declaration, frame: int) -> float:
    if item.trackers and run.tracker_at(frame) not in item.trackers:
        return np.nan
    return float(getattr(run.parameters_at(frame), item.name))


def _error(axes: Axes, run: Run, _plot: Plot) -> None:
    _line(axes, run, errors(run))
    axes.set_ylim(bottom=0)


def _sigma(axes: Axes, run: Run, _plot: Plot) -> None:
    _line(axes, run, sigmas(run), "largest standard deviation")
    for steps, values in thresholds(run, "sigma"):
        axes.step(steps, values, where="post", color=INK["truth"], linewidth=THIN, linestyle="--", label="threshold")
    axes.set_ylim(bottom=0)


def _sample_size(axes: Axes, run: Run, _plot: Plot) -> None:
    for role, look in {"particles": {"color": INK["outline"], "linewidth": THIN}, "ess": {}}.items():
        for found in of_role(run, role)[:1]:
            _line(axes, run, measure(run, found.name), found.title, **look)
    axes.set_ylim(bottom=0)


def _samplers(axes: Axes, run: Run, _plot: Plot) -> None:
    (found, *_) = of_role(run, "share")
    counts = np.nan_to_num(measure(run, found.name))
    edges = np.arange(len(counts) + 1) - 0.5
    tops = np.cumsum(counts, axis=1)
    for place, (name, colour) in enumerate(zip(found.components, found.colours, strict=True)):
        below = tops[:, place - 1] if place else np.zeros(len(counts))
        axes.stairs(tops[:, place], edges, baseline=below, fill=True, color=INK[colour], label=name)
    axes.set_ylim(bottom=0)


def _innovation(axes: Axes, run: Run, _plot: Plot) -> None:
    for role, look in {"nis_limit": {**TRUTH, "label": "limit of 95 %"}, "nis": {}}.items():
        for found in of_role(run, role)[:1]:
            _line(axes, run, measure(run, found.name), **look)
    axes.set_ylim(bottom=0)


def _value(axes: Axes, run: Run, plot: Plot) -> None:
    _line(axes, run, measure(run, plot.series[0]))


def _band(axes: Axes, run: Run, plot: Plot) -> None:
    value, sd, truth = (measure(run, name) for name in (plot.series[0], plot.sd, plot.truth))
    axes.fill_between(frames(run), value - 2 * sd, value + 2 * sd, **AREA, label="two standard deviations")
    _line(axes, run, value, "estimate")
    _truth(axes, run, truth)
    # The axis follows the estimate and the truth, however wide the band is.
    known = np.concatenate([value, truth])
    known = known[np.isfinite(known)]
    if len(known):
        room = 0.2 * float(np.ptp(known)) or 1.0
        axes.set_ylim(known.min() - room, known.max() + room)


def _interval(axes: Axes, run: Run, plot: Plot) -> None:
    several = plot.series if len(plot.series) > 1 else ()
    titles = {(name, 0): find_series(run, name).title for name in several}
    for name in plot.series:
        ends = measure(run, name)
        low, high = ends.T if ends.ndim > 1 else (ends, ends)
        axes.fill_between(frames(run), low, high, **AREA)
        for place, end in enumerate((low, high)):
            _line(axes, run, end, titles.get((name, place), ""), linewidth=THIN)
    _truth(axes, run, measure(run, plot.truth))


def _features(axes: Axes, run: Run, plot: Plot) -> None:
    names = plot.row_titles or find_series(run, plot.series[0]).components
    values = np.atleast_2d(measure(run, plot.series[0]).T)
    seen, made_out = (_rows(measure(run, name), values) for name in (plot.visible, plot.recognised))
    # Without a truth the tracker's own report is shown, in another colour because it is not the same.
    states = {"hidden": seen == 0, "lost": np.isnan(seen) & (made_out == 0)}
    labels = {"hidden": "hidden", "lost": "unrecognised"}
    x = frames(run)
    for place, row in enumerate(values):
        for name, where in states.items():
            if where[place].any():
                shade: dict[str, Any] = {"color": INK[name], "alpha": SHADES[name], "linewidth": 0, "step": "mid"}
                axes.fill_between(x, place, place + 1, where[place], **shade, label=labels.pop(name, ""))
        _line(axes, run, place + 1 - FREE - (1 - 2 * FREE) * row, linewidth=THIN)
    axes.set_ylim(len(values), 0)
    axes.set_yticks(np.arange(len(values)) + 0.5, names)
    axes.tick_params(axis="y", length=0)
    axes.grid(visible=False)
    axes.hlines(range(1, len(values)), -0.5, run.computed + 0.5, color=INK["grid"], linewidth=0.6)


def _frequency(axes: Axes, run: Run, plot: Plot) -> None:
    for name, colour in zip(plot.series, cycle(CURVE_COLOURS), strict=False):
        flags = measure(run, name).reshape(run.computed + 1, -1)
        known = np.cumsum(np.isfinite(flags).sum(axis=1))
        share = np.cumsum(np.nansum(flags, axis=1)) / np.where(known > 0, known, np.nan)
        _line(axes, run, 100 * share, find_series(run, name).title, color=colour)
    percents = [100 * level for level in plot.levels]
    for level in percents:
        axes.axhline(level, **{**TRUTH, "label": ""})
    axes.set_yticks([0, *percents])
    axes.set_ylim(0, 105)


def _hypotheses(axes: Axes, run: Run, plot: Plot) -> None:
    known = hypotheses(run, plot.series[0])
    lines, colours = [], []
    for frame, here in enumerate(known):
        before = known[frame - 1].values if frame else ()
        for place, (value, weight) in enumerate(zip(here.values, here.weights, strict=True)):
            y = value[plot.component]
            # A hypothesis that begins in a frame starts halfway before it.
            begin = (frame - 1, before[place][plot.component]) if place < len(before) else (frame - 0.5, y)
            lines.append((begin, (frame, y)))
            colours.append(to_rgba(INK["estimate"], FAINTEST + (1 - FAINTEST) * weight))
    axes.add_collection(LineCollection(lines, colors=colours, linewidths=LINE))
    _truth(axes, run, measure(run, plot.truth))
    axes.autoscale_view()


def _tree(axes: Axes, run: Run, plot: Plot) -> None:
    known = hypotheses(run, plot.series[0])
    nodes = np.array([(frame, place + 1) for frame, it in enumerate(known) for place in range(len(it.weights))])
    weights = np.array([weight for it in known for weight in it.weights])
    edges = [
        ((frame - 1, parent + 1), (frame, place + 1))
        for frame, it in enumerate(known)
        for place, parent in enumerate(it.parents)
        if parent >= 0
    ]
    shares = [it.weights[place] for it in known for place, parent in enumerate(it.parents) if parent >= 0]
    way = _way_back(known)
    axes.plot(way[:, 0], way[:, 1], color=INK["frame"], linewidth=5, alpha=0.6, label="way back of the most probable")
    axes.add_collection(LineCollection(edges, colors=_fade(np.array(shares)), linewidths=THIN))
    axes.scatter(nodes[:, 0], nodes[:, 1], s=9, color=_fade(weights), linewidths=0, zorder=3)
    most = int(nodes[:, 1].max())
    axes.set_ylim(most + 0.6, 0.4)
    axes.set_yticks(range(1, most + 1))


def _way_back(known: list[Hypotheses]) -> Floats:
    """Return frame and row (n, 2) of the most probable hypothesis of the newest frame and of its ancestors."""
    way: list[tuple[int, int]] = []
    place = int(np.argmax(known[-1].weights)) if known[-1].weights else -1
    for frame in range(len(known) - 1, -1, -1):
        if place < 0:
            break
        way.append((frame, place + 1))
        parents = known[frame].parents
        place = parents[place] if place < len(parents) else -1
    return np.array(way, float).reshape(-1, 2)


def _fade(weights: Floats) -> Floats:
    """Return colours (n, 4), more opaque for greater weights."""
    colours = np.tile(to_rgba(INK["estimate"]), (len(weights), 1))
    colours[:, 3] = FAINTEST + (1 - FAINTEST) * weights
    return colours


def _rows(values: Floats, like: Floats) -> Floats:
    """Return the values (rows, L) of features, NaN where missing."""
    return values.T if values.ndim > 1 else np.full(like.shape, np.nan)


def _truth(axes: Axes, run: Run, values: Floats) -> None:
    if not np.isnan(values).all():
        axes.plot(frames(run), values, **TRUTH)


def _line(axes: Axes, run: Run, values: Floats, label: str = "", **look: Any) -> None:  # noqa: ANN401 - what matplotlib takes
    own: dict[str, Any] = {
        "color": INK["estimate"],
        "linewidth": LINE,
        "solid_joinstyle": "round",
        "label": label or "_",
    }
    # A single frame would be a line of zero length, so it is drawn as a point.
    axes.plot(frames(run), values, **{**own, "marker": "." if run.computed == 0 else "", **look})


KINDS: Mapping[PlotKind, Draw] = {
    "error": _error,
    "sigma": _sigma,
    "sample size": _sample_size,
    "samplers": _samplers,
    "innovation": _innovation,
    "value": _value,
    "band": _band,
    "interval": _interval,
    "features": _features,
    "frequency": _frequency,
    "hypotheses": _hypotheses,
    "tree": _tree,
}


WIDE_IN, PANEL_IN, ALONE_IN, ROW_IN = TWO_COLUMNS_IN, 1.25, 2.4, 0.2
HEAD_IN, FOOT_IN, BETWEEN_IN = 0.2, 0.42, 0.34
LEFT_IN, LEFT_WITH_NAMES_IN, RIGHT_IN = 0.62, 1.25, 0.12
TITLE_PT = 9
MOST_MARKS = 200_000
"""Most nodes or segments in a picture; more cannot be distinguished, or opened by other programs."""

SHADED = {"error": ("hidden", "lost"), "band": ("lost",), "interval": ("lost",), "hypotheses": ("lost",)}
"""Shaded bands behind each kind of plot."""


def drawable(run: Run) -> tuple[Plot, ...]:
    """Return the plots for which a run has values, in the order of the page."""
    return tuple(plot for plot in run.experiment.display.plots if _has_numbers(run, plot))


def figure_of(run: Run, plot: str | None = None) -> Figure:
    """Draw one plot of a run, or all plots with values in one column.

    Args:
        run: The run; its computed part is drawn.
        plot: Id of the one plot to draw (default: all).

    Raises:
        ConflictError: The experiment has no such plot, or the run has no values for it.
    """
    known = {it.id: it for it in run.experiment.display.plots}
    if plot is not None and plot not in known:
        raise ConflictError(f"{run.experiment.id} has no plot {plot!r}, only {', '.join(known)}")
    offered = drawable(run)
    shown = offered if plot is None else tuple(it for it in offered if it.id == plot)
    if not shown:
        there = ", ".join(it.id for it in offered) or "none"
        wanted = "no plot" if plot is None else f"nothing for the plot {plot!r}"
        raise ConflictError(f"the frames of this run have {wanted}: what it shows was not measured; it has {there}")
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
    """Return the figure as the content of a file with the run's manifest.

    Raises:
        ConflictError: See `figure_of`.
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
    unit = "%" if plot.kind == "frequency" else plot.unit_beside(run.experiment.judge.unit)
    axes.set_title(f"{plot.title}, {unit}" if unit else plot.title, loc="left", fontsize=TITLE_PT, pad=4)
    return axes


def _bands(run: Run, plot: Plot) -> dict[str, Bools]:
    known = {"hidden": hidden_frames(run), "lost": Loss.of(run.diagnostics).lost}
    return {name: known[name] for name in SHADED.get(plot.kind, ()) if known[name].any()}


def _shade(axes: Axes, name: str, where: Bools) -> Patch:
    """Shade some frames, each one frame wide, and return the entry for the legend."""
    for first, last in spans(where):
        axes.axvspan(first - 0.5, last + 0.5, color=INK[name], alpha=SHADES[name], linewidth=0, zorder=0)
    return Patch(color=INK[name], alpha=SHADES[name], linewidth=0, label=name)


DRAWN_ROLE: Mapping[PlotKind, SeriesRole] = {"sample size": "ess", "samplers": "share", "innovation": "nis"}
"""The role of series that a kind of plot needs, for kinds that read series by role."""


def _has_numbers(run: Run, plot: Plot) -> bool:
    if plot.needs_truth and all(row.truth is None for row in run.diagnostics):
        return False
    match plot.kind:
        case "error":
            return not np.isnan(errors(run)).all()
        case "sigma":
            return True
        case "sample size" | "samplers" | "innovation":
            return bool(of_role(run, DRAWN_ROLE[plot.kind]))
        case _:
            return any(name in row.series for row in run.diagnostics for name in plot.series)


def _check_amount(run: Run, plots: tuple[Plot, ...]) -> None:
    for plot in plots:
        if plot.kind in {"tree", "hypotheses"}:
            marks = sum(len(it.weights) for it in hypotheses(run, plot.series[0]))
            if marks > MOST_MARKS:
                raise ConflictError(
                    f"the plot {plot.id!r} of this run has {marks:,} marks, a picture shows at most {MOST_MARKS:,}; "
                    "export another plot, or the numbers"
                )


def _height(run: Run, plot: Plot, *, alone: bool) -> float:
    least = ALONE_IN if alone else PANEL_IN
    match plot.kind:
        case "features":
            rows = len(find_series(run, plot.series[0]).components)
        case "tree":
            rows = max(len(it.weights) for it in hypotheses(run, plot.series[0]))
        case _:
            rows = 0
    return max(least, ROW_IN * rows)


def _heading(run: Run) -> str:
    return f"{title_of(run)}; {extent_of(run)}"
