"""Curves and boxes of a report, over one axis at a time, drawn by matplotlib."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from pftrack.sweep.axis import Axis
from pftrack.sweep.cells import Code
from pftrack.sweep.comparison import TEST_TITLES
from pftrack.sweep.quantities import Quantity, samples
from pftrack.sweep.report.colours import GREYS, TRACKERS
from pftrack.sweep.report.study import Study, label, shown

__all__ = ["along", "boxes", "curves"]

MOST_TICKS = 10
MOST_BOXES = 16
NARROWEST_IN = 5.6
WHISKERS = (5, 95)


def curves(study: Study, axes_: Sequence[Axis]) -> Figure:
    """Draw the success with its interval along every axis, all others pooled; error where nothing is judged."""
    columns = min(len(axes_), 3)
    rows = -(-len(axes_) // columns)
    figure = Figure(figsize=(max(4.2 * columns, 5.6), 3.2 * rows), layout="constrained")
    for place, axis in enumerate(axes_):
        panel = figure.add_subplot(rows, columns, place + 1)
        positions = np.array(axis.values, dtype=float) if axis.numerical else np.arange(len(axis.values))
        for name, colour in zip(study.trackers, _colours(study), strict=True):
            found = study.by_axis[axis.name][name]
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


def boxes(study: Study, axis: Axis, quantity: Quantity) -> Figure:
    """Draw the runs' values of a quantity over one axis, a box a tracker and value; success is no such quantity."""
    width = max(1.2 + 0.35 * len(axis.values) * len(study.trackers), 5)
    figure = Figure(figsize=(width, 4), layout="constrained")
    _boxes(figure.add_subplot(), study, axis, quantity)
    figure.legend(loc="outside lower center", ncols=min(len(study.trackers), 5), frameon=False)
    figure.suptitle(f"{quantity.title}: quartiles, whiskers from 5 % to 95 %", fontsize=11)
    return figure


def along(study: Study, axis: Axis, quantity: Quantity) -> Figure:
    """Draw a quantity over the only axis: boxes, or rates with their interval, above the differences of the pairs."""
    rows = 2 if study.pairs else 1
    width = max(1.2 + 0.35 * len(axis.values) * len(study.trackers), NARROWEST_IN)
    figure = Figure(figsize=(width, 3.6 * rows), layout="constrained")
    panels = figure.subplots(rows, 1, squeeze=False)[:, 0]
    if quantity.name == "success":
        _rates(panels[0], study, axis)
    else:
        _boxes(panels[0], study, axis, quantity)
    panels[0].legend(fontsize=8, framealpha=0.8, edgecolor="none")
    title = quantity.title if quantity.name == "success" else f"{quantity.title}: quartiles, whiskers from 5 % to 95 %"
    panels[0].set_title(f"{title}; {quantity.better} is better", fontsize=10)
    if study.pairs:
        _differences(panels[1], study, axis, quantity)
    return figure


def _rates(panel: Axes, study: Study, axis: Axis) -> None:
    places = np.arange(len(axis.values))
    for name, colour in zip(study.trackers, _colours(study), strict=True):
        found = study.maps[name]
        panel.fill_between(places, found.low[0], found.high[0], color=colour, alpha=0.2, linewidth=0)
        panel.plot(places, found.rate[0], color=colour, marker="o", markersize=3, label=study.title(name))
    panel.set_ylim(-0.02, 1.02)
    _ticked(panel, study, axis, "Success rate")


def _boxes(panel: Axes, study: Study, axis: Axis, quantity: Quantity) -> None:
    found = samples(study.result, quantity, axis.name).values
    width = 0.8 / len(study.trackers)
    centres = np.arange(len(axis.values))
    for place, (name, colour) in enumerate(zip(study.trackers, _colours(study), strict=True)):
        positions = centres + (place - (len(study.trackers) - 1) / 2) * width
        _box(panel, found[name], positions, width, colour)
        panel.plot([], [], color=colour, linewidth=6, alpha=0.6, label=study.title(name))
    if all(values.min(initial=0.0) >= 0.0 for cells in found.values() for values in cells):
        panel.set_ylim(bottom=0)
    _ticked(panel, study, axis, quantity.label)


def _differences(panel: Axes, study: Study, axis: Axis, quantity: Quantity) -> None:
    """Draw the differences on the same scenes with their intervals; filled where the test finds one better."""
    pairs = study.comparisons[quantity.name]
    width = 0.5 / len(pairs)
    for place, pair in enumerate(pairs):
        positions = np.arange(len(axis.values)) + (place - (len(pairs) - 1) / 2) * width
        colour = TRACKERS[(len(study.trackers) + place) % len(TRACKERS)]
        mean, low, high = (it[0] for it in (pair.paired.mean, pair.paired.low, pair.paired.high))
        panel.vlines(positions, low, high, color=colour, linewidth=1.2)
        codes = pair.significance(study.level).codes[0]
        better = (codes == Code.FIRST_BETTER) | (codes == Code.SECOND_BETTER)
        name = f"1: {study.title(pair.first)}, 2: {study.title(pair.second)}"
        panel.plot(positions, mean, "o", markerfacecolor="white", color=colour, markersize=5)
        panel.plot(positions[better], mean[better], "o", color=colour, markersize=5)
        panel.plot([], [], "o-", color=colour, markersize=5, label=name)
    panel.axhline(0, color=GREYS["frame"], linewidth=0.8)
    panel.legend(fontsize=8, framealpha=0.8, edgecolor="none")
    unit = f", {quantity.unit}" if quantity.unit else ""
    _ticked(panel, study, axis, f"Difference{unit}, + if 1 is better")
    tested = f"{TEST_TITLES[pairs[0].test]} test at {study.level:g}"
    panel.set_title(f"On the same scenes, 95 % intervals; filled where different,\n{tested}", fontsize=9)


def _ticked(panel: Axes, study: Study, axis: Axis, title: str) -> None:
    stride = -(-len(axis.values) // MOST_BOXES)
    places = range(0, len(axis.values), stride)
    panel.set_xticks(list(places), [shown(axis.values[place]) for place in places])
    panel.set_xlim(-0.6, len(axis.values) - 0.4)
    panel.set_xlabel(label(study, axis))
    panel.set_ylabel(title)
    panel.grid(axis="y", color=GREYS["grid"], linewidth=0.6)
    panel.spines[["top", "right"]].set_visible(False)


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


def _colours(study: Study) -> list[str]:
    return [TRACKERS[place % len(TRACKERS)] for place in range(len(study.trackers))]
