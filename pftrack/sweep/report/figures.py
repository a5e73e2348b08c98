"""The figures of a report, drawn by matplotlib: maps, curves and boxes.

Cells are drawn in the order of their values, equally wide, since the values need not be equally spaced or be numbers.
Figures are made directly, without pyplot, so that nothing is kept in global state.
"""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, Literal

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.patches import Patch
from numpy.typing import NDArray

from pftrack.measures import Measure
from pftrack.parameters import with_role
from pftrack.sweep.axis import Axis, declared
from pftrack.sweep.cells import Code, errors_by_cell
from pftrack.sweep.report.colours import CODE_NAMES, CODES, GREYS, TRACKERS, diverging
from pftrack.sweep.report.study import Study, label, shown

__all__ = ["boxes", "curves", "error_maps", "figures", "significance_maps", "success_maps"]

PANEL_IN = 3.4
NARROWEST_IN = 5.6
MOST_TICKS = 10
MOST_BOXES = 16
MOST_COLUMNS = 4
WHISKERS = (5, 95)
TESTS = {"success": "Success, chi-square", "error": "Error, rank-sum"}


def figures(study: Study) -> dict[str, Callable[[], Figure]]:
    """Return how to draw each figure that a study has, by name."""
    wanted: dict[str, Callable[[], Figure]] = {}
    if study.y is not None:
        if study.judged:
            wanted["success"] = lambda: success_maps([study])
        wanted["error"] = lambda: error_maps([study])
        for measure in study.measures:
            wanted[measure.name] = partial(measure_maps, study, measure)
        if study.comparisons and study.judged:
            wanted["difference"] = lambda: _difference(study)
        if study.comparisons:
            kinds: list[Literal["success", "error"]] = ["success", "error"] if study.judged else ["error"]
            wanted["significance"] = lambda: significance_maps(study, kinds)
    several = [axis for axis in study.result.plan.axes if len(axis.values) > 1]
    if several:
        wanted["curves"] = lambda: curves(study, several)
    boxed = _boxed_axis(study)
    if boxed is not None:
        wanted["boxes"] = lambda: boxes(study, boxed)
    return wanted


def success_maps(studies: Sequence[Study]) -> Figure:
    """Draw the success rates of one or several studies on the same axes, on one colour scale."""
    panels = _panels(studies, "rate")
    return _maps(studies[0], panels, mpl.colormaps["viridis"], Normalize(0, 1), "Success rate")


def error_maps(studies: Sequence[Study]) -> Figure:
    """Draw the mean errors of one or several studies on the same axes, on one colour scale."""
    panels = _panels(studies, "mean_error")
    known = np.concatenate([panel[~np.isnan(panel)] for panel in panels.values()])
    scale = Normalize(0, float(known.max()) if len(known) else 1.0)
    unit = studies[0].result.plan.wiring.unit
    runs = " of successful runs" if studies[0].judged else ""
    title = f"Mean error{runs}{f', {unit}' if unit else ''}"
    return _maps(studies[0], panels, mpl.colormaps["viridis"], scale, title)


def measure_maps(study: Study, measure: Measure) -> Figure:
    """Draw the mean of a measure over all runs of each cell, on one colour scale; a share from 0 to 1."""
    panels = {study.title(name): cells.measures[measure.name] for name, cells in study.maps.items()}
    known = np.concatenate([panel[~np.isnan(panel)] for panel in panels.values()])
    most = 1.0 if measure.how == "share" else float(known.max(initial=0.0)) or 1.0
    title = f"{measure.title}{f', {measure.unit}' if measure.unit else ''}, mean of all runs"
    return _maps(study, panels, mpl.colormaps["viridis"], Normalize(0, most), title)


def _panels(studies: Sequence[Study], quantity: str) -> dict[str, NDArray[np.float64]]:
    """Return a map for each tracker of each study; several studies are distinguished by their fixed values."""
    return {
        "\n".join([study.title(name), *([_fixed(study)] if len(studies) > 1 else [])]): getattr(cells, quantity)
        for study in studies
        for name, cells in study.maps.items()
    }


def _fixed(study: Study) -> str:
    experiment = study.result.plan.wiring
    return ", ".join(
        f"{declared(experiment, name).title.lower()} {shown(value)}" for name, value in study.result.plan.values.items()
    )


def _difference(study: Study) -> Figure:
    panels = {
        f"{study.title(pair.first)}\nless {study.title(pair.second)}": pair.success.effect for pair in study.comparisons
    }
    most = max((float(np.nanmax(np.abs(panel), initial=0.0)) for panel in panels.values()), default=0.0) or 1.0
    return _maps(study, panels, diverging(), Normalize(-most, most), "Difference of success rates")


def significance_maps(study: Study, kinds: Sequence[Literal["success", "error"]]) -> Figure:
    """Draw four-colour maps of what is significant: a row a kind, a column a pair; of a single pair all in one row.

    Args:
        study: What is looked at.
        kinds: "success" by the chi-square test, "error" of successful runs by the rank-sum test.
    """
    wanted = [(kind, pair) for kind in kinds for pair in study.comparisons]
    columns = len(study.comparisons) if len(study.comparisons) > 1 else len(kinds)
    figure, panels = _grid(len(wanted) // columns, columns, study)
    colours = ListedColormap([CODES[code] for code in Code])
    places = [axes for row in panels for axes in row]
    for axes, (kind, pair) in zip(places, wanted, strict=True):
        codes = getattr(pair, kind).codes
        _draw(axes, study, codes.astype(float), colours, BoundaryNorm(np.arange(-0.5, 4.5), 4))
        axes.set_title(f"{TESTS[kind]}\n1: {study.title(pair.first)}\n2: {study.title(pair.second)}", fontsize=9)
    names = {code: name.format(first="1", second="2") for code, name in CODE_NAMES.items()}
    handles = [Patch(facecolor=CODES[code], edgecolor=GREYS["outline"], label=name) for code, name in names.items()]
    figure.legend(handles=handles, loc="outside lower center", ncols=4, frameon=False, fontsize=9)
    figure.suptitle(f"Significance at {study.level:g}, each cell by itself", fontsize=11)
    return figure


def curves(study: Study, axes_: Sequence[Axis]) -> Figure:
    """Draw the success with its interval along every axis, all others pooled; error where nothing is judged."""
    columns = min(len(axes_), 3)
    rows = -(-len(axes_) // columns)
    figure = Figure(figsize=(max(4.2 * columns, 5.6), 3.2 * rows), layout="constrained")
    for place, axis in enumerate(axes_):
        panel = figure.add_subplot(rows, columns, place + 1)
        positions = np.array(axis.values, dtype=float) if axis.numerical else np.arange(len(axis.values))
        for name, colour in zip(study.trackers, _colours(study), strict=True):
            found = study.by_axis(axis)[name]
            if study.judged:
                panel.fill_between(positions, found.low[0], found.high[0], color=colour, alpha=0.2, linewidth=0)
            values = found.rate[0] if study.judged else found.mean_error[0]
            panel.plot(
                positions, values, color=colour, marker="o", markersize=3, linewidth=1.5, label=study.title(name)
            )
        if not axis.numerical or len(axis.values) <= MOST_TICKS:
            places = _apart(positions)
            panel.set_xticks(positions[places], [shown(axis.values[place]) for place in places], fontsize=8)
        panel.set_xlabel(label(study, axis))
        panel.set_ylabel("Success rate" if study.judged else "Mean error")
        panel.set_ylim(*((-0.02, 1.02) if study.judged else (0, None)))
        panel.grid(color=GREYS["grid"], linewidth=0.6)
        panel.spines[["top", "right"]].set_visible(False)
    handles, names = figure.axes[0].get_legend_handles_labels()
    figure.legend(handles, names, loc="outside lower center", ncols=min(len(names), 5), frameon=False)
    figure.suptitle("Success and its 95 % interval" if study.judged else "Mean error", fontsize=11)
    return figure


def _apart(positions: NDArray[Any]) -> list[int]:
    """Return which of ascending or descending positions can carry a label without touching the one before."""
    least = 0.07 * float(np.ptp(positions))
    kept: list[int] = []
    for place in range(len(positions)):
        if not kept or abs(positions[place] - positions[kept[-1]]) >= least:
            kept.append(place)
    return kept


def boxes(study: Study, axis: Axis) -> Figure:
    """Draw the errors of successful runs over one axis, a box a tracker and value."""
    found = errors_by_cell(study.result, axis.name)
    width = 0.8 / len(study.trackers)
    figure = Figure(figsize=(max(1.2 + 0.35 * len(axis.values) * len(study.trackers), 5), 4), layout="constrained")
    panel = figure.add_subplot()
    centres = np.arange(len(axis.values))
    for place, (name, colour) in enumerate(zip(study.trackers, _colours(study), strict=True)):
        positions = centres + (place - (len(study.trackers) - 1) / 2) * width
        _box(panel, found[name], positions, width, colour)
        panel.plot([], [], color=colour, linewidth=6, alpha=0.6, label=study.title(name))
    panel.set_xticks(centres, [shown(value) for value in axis.values])
    panel.set_xlabel(label(study, axis))
    unit = study.result.plan.wiring.unit
    panel.set_ylabel(f"Mean error{f', {unit}' if unit else ''}")
    panel.set_ylim(bottom=0)
    panel.grid(axis="y", color=GREYS["grid"], linewidth=0.6)
    panel.spines[["top", "right"]].set_visible(False)
    figure.legend(loc="outside lower center", ncols=min(len(study.trackers), 5), frameon=False)
    runs = "successful runs" if study.judged else "runs"
    figure.suptitle(f"Error of {runs}: quartiles, whiskers from 5 % to 95 %", fontsize=11)
    return figure


def _box(
    panel: Axes, samples: list[NDArray[np.float64]], positions: NDArray[np.floating[Any]], width: float, colour: str
) -> None:
    panel.boxplot(
        samples,
        positions=positions,
        widths=0.85 * width,
        whis=WHISKERS,
        showfliers=False,
        patch_artist=True,
        manage_ticks=False,
        boxprops={"facecolor": colour, "alpha": 0.6, "linewidth": 0.8},
        medianprops={"color": "black", "linewidth": 1.4},
        whiskerprops={"linewidth": 0.8},
        capprops={"linewidth": 0.8},
    )


def _boxed_axis(study: Study) -> Axis | None:
    """Return the axis that boxes are drawn over: the number of particles, or the only one with several numbers."""
    several = [axis for axis in study.result.plan.axes if axis.numerical and 1 < len(axis.values) <= MOST_BOXES]
    model = type(study.result.plan.wiring.simulate().parameters)
    particles = {declaration.name for declaration in with_role(model, "particles")}
    counts = [axis for axis in several if axis.name in particles]
    return counts[0] if counts else several[0] if len(several) == 1 else None


def _maps(study: Study, panels: dict[str, NDArray[np.float64]], colours: Any, scale: Normalize, title: str) -> Figure:  # noqa: ANN401 - either of two kinds of colour map
    """Draw maps side by side on one colour scale."""
    columns = len(panels) if len(panels) <= MOST_COLUMNS else 3
    figure, grid = _grid(-(-len(panels) // columns), columns, study)
    places = [axes for row in grid for axes in row]
    image = None
    for axes, (name, values) in zip(places, panels.items(), strict=False):
        image = _draw(axes, study, values, colours, scale)
        axes.set_title(name, fontsize=10)
    for place in range(len(panels), len(places)):
        above = places[place - columns]
        above.tick_params(labelbottom=True)
        above.set_xlabel(places[place].get_xlabel())
        places[place].remove()
    if image is not None:
        bar = figure.colorbar(image, ax=places[: len(panels)], shrink=0.9, pad=0.02)
        bar.set_label(title)
        bar.outline.set_visible(False)
    return figure


def _grid(rows: int, columns: int, study: Study) -> tuple[Figure, list[list[Axes]]]:
    across, down = (len(axis.values) if axis else 1 for axis in (study.x, study.y))
    height = PANEL_IN * min(max(down / across, 0.6), 1.4)
    figure = Figure(
        figsize=(max(PANEL_IN * columns + 1.0, NARROWEST_IN), (height + 0.6) * rows + 0.4), layout="constrained"
    )
    panels = figure.subplots(rows, columns, squeeze=False, sharex=True, sharey=True)
    for row in range(rows):
        for column in range(columns):
            axes = panels[row][column]
            if row == rows - 1 and study.x:
                axes.set_xlabel(label(study, study.x))
            if column == 0 and study.y:
                axes.set_ylabel(label(study, study.y))
    return figure, [list(row) for row in panels]


def _draw(axes: Axes, study: Study, values: NDArray[np.float64], colours: Any, scale: Normalize) -> AxesImage:  # noqa: ANN401 - see _maps
    axes.patch.set(facecolor="white", edgecolor=GREYS["hatching"], hatch="////", linewidth=0)  # where nothing is known
    masked = np.ma.masked_invalid(values)
    image = axes.imshow(masked, cmap=colours, norm=scale, origin="lower", aspect="auto", interpolation="nearest")
    for axis, ticks in ((study.x, axes.set_xticks), (study.y, axes.set_yticks)):
        if axis is not None:
            stride = -(-len(axis.values) // MOST_TICKS)
            places = range(0, len(axis.values), stride)
            ticks(list(places), [shown(axis.values[place]) for place in places])
    axes.tick_params(length=2, labelsize=8)
    axes.spines[:].set(color=GREYS["frame"], linewidth=0.6)
    return image


def _colours(study: Study) -> list[str]:
    return [TRACKERS[place % len(TRACKERS)] for place in range(len(study.trackers))]
