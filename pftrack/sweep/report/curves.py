"""Curves and boxes of a report, over one axis at a time, drawn by matplotlib."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from pftrack.figures.layout import APART_IN, LINE_IN, axes_at, draw_key, key_height, length, write
from pftrack.figures.style import CURVE_COLOURS, INK
from pftrack.sweep.axis import Axis
from pftrack.sweep.cells import CellMap, Code
from pftrack.sweep.comparison import TEST_TITLES
from pftrack.sweep.quantities import Quantity, samples
from pftrack.sweep.report.labels import format_value, label, ticks
from pftrack.sweep.report.study import Study

__all__ = ["along", "boxes", "curves"]

MOST_TICKS = 10
LEFT_IN, WIDE_IN, RIGHT_IN = 0.75, 3.3, 0.15
BOX_IN, NARROWEST_IN, WIDEST_IN = 0.35, 5.0, 16.0
TITLE_IN, HIGH_IN, BELOW_IN = 0.24, 2.5, 0.55
PERCENTILES = 5, 25, 50, 75, 95
"""Of a box: ends of the whiskers, edges of the box, and median."""

Key = list[Line2D]


def curves(study: Study, axes: Sequence[Axis]) -> Figure:
    """Draw the success with its interval along every axis, all others pooled; error where nothing is judged."""
    columns = min(len(axes), 3)
    rows = -(-len(axes) // columns)
    wide = max(WIDE_IN, NARROWEST_IN / columns)
    below = BELOW_IN + max(_upright(axis, wide / len(axis.values)) for axis in axes)
    key = _key(study)
    width = columns * (LEFT_IN + wide + RIGHT_IN)
    foot = _height(key, width)
    figure = Figure(figsize=(width, 2 * TITLE_IN + rows * (HIGH_IN + below) + foot))
    top = figure.get_figheight() - 2 * TITLE_IN
    write(figure, LEFT_IN, top + 0.1, "Success and its 95 % interval" if study.judged else "Mean error", 11)
    for place, axis in enumerate(axes):
        row, column = divmod(place, columns)
        bottom = top - row * (HIGH_IN + below) - HIGH_IN
        panel = axes_at(figure, column * (width / columns) + LEFT_IN, bottom, wide, HIGH_IN)
        positions = np.array(axis.values, dtype=float) if axis.numerical else np.arange(len(axis.values))
        _curves(panel, study, positions, study.by_axis[axis.name])
        if not axis.numerical:
            _write_values(panel, axis, wide)
        elif len(axis.values) <= MOST_TICKS:
            places = _apart(positions, max(length(format_value(value), 8) for value in axis.values) / wide)
            panel.set_xticks(positions[places], [format_value(axis.values[place]) for place in places], fontsize=8)
        _finish(panel, label(study, axis), "Success rate" if study.judged else "Mean error")
    draw_key(figure, key, LEFT_IN, foot)
    return figure


def boxes(study: Study, axis: Axis, quantity: Quantity) -> Figure:
    """Draw the runs' values of a quantity over one axis, a box a tracker and value; success is no such quantity."""
    part = f"{quantity.title}\n{_of_boxes()}", _key(study, of_boxes=True)
    figure, (panel,) = _stack(study, axis, [part])
    _boxes(panel, study, axis, quantity)
    return figure


def along(study: Study, axis: Axis, quantity: Quantity) -> Figure:
    """Draw a quantity over the only axis: boxes, or rates with their interval, above the differences of the pairs."""
    is_success = quantity.name == "success"
    better = f"{quantity.title}; {quantity.better} is better"
    parts = [(f"{better}\n{'95 % intervals' if is_success else _of_boxes()}", _key(study, of_boxes=not is_success))]
    if study.pairs:
        test = TEST_TITLES[study.comparisons[quantity.name][0].test]
        title = f"On the same scenes, 95 % intervals\nFilled where different, {test} test at {study.level:g}"
        parts.append((title, _key_of_pairs(study)))
    figure, panels = _stack(study, axis, parts)
    if is_success:
        _curves(panels[0], study, np.arange(len(axis.values)), study.maps)
        _finish(panels[0], label(study, axis), quantity.label)
    else:
        _boxes(panels[0], study, axis, quantity)
    if study.pairs:
        _differences(panels[1], study, axis, quantity)
    return figure


def _of_boxes() -> str:
    low, lower, _, upper, high = PERCENTILES
    return f"Boxes {lower} to {upper} %, whiskers {low} to {high} %"


def _stack(study: Study, axis: Axis, parts: Sequence[tuple[str, Key]]) -> tuple[Figure, list[Axes]]:
    """Return panels over an axis of equally spaced values below each other, each with its title and its key."""
    wide = min(max(BOX_IN * len(axis.values) * len(study.trackers), NARROWEST_IN), WIDEST_IN)
    width = LEFT_IN + wide + RIGHT_IN
    below = BELOW_IN + _upright(axis, wide / len(axis.values))
    heights = [2 * TITLE_IN + HIGH_IN + below + _height(key, width) for _, key in parts]
    figure, top, panels = Figure(figsize=(width, sum(heights))), sum(heights), []
    for (title, key), height in zip(parts, heights, strict=True):
        bottom = top - 2 * TITLE_IN - HIGH_IN
        panel = axes_at(figure, LEFT_IN, bottom, wide, HIGH_IN)
        panel.set_xlim(-0.6, len(axis.values) - 0.4)
        _write_values(panel, axis, wide)
        write(figure, LEFT_IN, bottom + HIGH_IN + 0.08, title, 9)
        draw_key(figure, key, LEFT_IN, bottom - below)
        panels.append(panel)
        top -= height
    return figure, panels


def _curves(panel: Axes, study: Study, positions: NDArray[Any], found: Mapping[str, CellMap]) -> None:
    for name, colour in zip(study.trackers, _colours(study), strict=True):
        cells = found[name]
        if study.judged:
            panel.fill_between(positions, cells.low[0], cells.high[0], color=colour, alpha=0.2, linewidth=0)
        values = cells.rate[0] if study.judged else cells.mean_error[0]
        panel.plot(positions, values, color=colour, marker="o", markersize=3, linewidth=1.5)
    panel.set_ylim(*((-0.02, 1.02) if study.judged else (0, None)))


def _boxes(panel: Axes, study: Study, axis: Axis, quantity: Quantity) -> None:
    found = samples(study.result, quantity, axis.name).values
    panel.use_sticky_edges = False
    width = 0.8 / len(study.trackers)
    for place, (name, colour) in enumerate(zip(study.trackers, _colours(study), strict=True)):
        known = [index for index, values in enumerate(found[name]) if len(values)]
        if known:
            ends = np.array([np.percentile(found[name][index], PERCENTILES) for index in known]).T
            _box(panel, ends, np.array(known) + (place - (len(study.trackers) - 1) / 2) * width, width, colour)
    if all(values.min(initial=0.0) >= 0.0 for cells in found.values() for values in cells):
        panel.set_ylim(bottom=0)
    _finish(panel, label(study, axis), quantity.label)


def _box(panel: Axes, ends: NDArray[np.float64], x: NDArray[np.float64], width: float, colour: str) -> None:
    """Draw a row of boxes, of which a handful of artists is drawn many times faster than one for every line."""
    low, lower, median, upper, high = ends
    panel.bar(x, upper - lower, 0.85 * width, lower, color=colour, alpha=0.6, edgecolor="black", linewidth=0.8)
    panel.vlines([*x, *x], [*low, *upper], [*lower, *high], color="black", linewidth=0.8)
    for middle, half, line in ((low, 0.2, 0.8), (median, 0.42, 1.4), (high, 0.2, 0.8)):
        panel.hlines(middle, x - half * width, x + half * width, color="black", linewidth=line)


def _differences(panel: Axes, study: Study, axis: Axis, quantity: Quantity) -> None:
    """Draw the differences on the same scenes with their intervals; filled where the test finds one better."""
    pairs = study.comparisons[quantity.name]
    width = 0.5 / len(pairs)
    for place, (pair, colour) in enumerate(zip(pairs, _colours_of_pairs(study), strict=True)):
        positions = np.arange(len(axis.values)) + (place - (len(pairs) - 1) / 2) * width
        mean, low, high = (it[0] for it in (pair.paired.mean, pair.paired.low, pair.paired.high))
        panel.vlines(positions, low, high, color=colour, linewidth=1.2)
        codes = pair.significance(study.level).codes[0]
        better = (codes == Code.FIRST_BETTER) | (codes == Code.SECOND_BETTER)
        panel.plot(positions, mean, "o", markerfacecolor="white", color=colour, markersize=5)
        panel.plot(positions[better], mean[better], "o", color=colour, markersize=5)
    panel.axhline(0, color=INK["frame"], linewidth=0.8)
    unit = f", {quantity.unit}" if quantity.unit else ""
    _finish(panel, label(study, axis), f"Difference{unit}, + if 1 is better")


def _write_values(panel: Axes, axis: Axis, wide: float) -> None:
    """Write the values of an axis at equal distances, upright if they are names that need the room."""
    step, texts = wide / len(axis.values), [format_value(value) for value in axis.values]
    upright = _upright(axis, step) > 0
    needed = LINE_IN if upright else max(length(text, 8) for text in texts) + APART_IN
    places, kept = zip(*ticks(texts, step, needed), strict=True)
    panel.set_xticks(places, kept, fontsize=8, rotation=90 if upright else 0)


def _upright(axis: Axis, step: float) -> float:
    """Return the room that names of choices need below where they are written upright, 0 where they are not."""
    longest = max(length(format_value(value), 8) for value in axis.values)
    return longest if not axis.numerical and longest + APART_IN > step else 0.0


def _apart(positions: NDArray[Any], share: float) -> list[int]:
    """Return which of ascending or descending positions can carry a label of a length without touching another."""
    least = (share + 0.02) * float(np.ptp(positions))
    kept: list[int] = []
    for place in range(len(positions)):
        if not kept or abs(positions[place] - positions[kept[-1]]) >= least:
            kept.append(place)
    return kept


def _finish(panel: Axes, across: str, up: str) -> None:
    panel.set_xlabel(across)
    panel.set_ylabel(up)
    panel.grid(axis="y", color=INK["grid"], linewidth=0.6)
    panel.set_axisbelow(True)
    panel.spines[["top", "right"]].set_visible(False)


def _key(study: Study, *, of_boxes: bool = False) -> Key:
    lines = zip(study.trackers, _colours(study), strict=True)
    key = [Line2D([], [], color=colour, label=study.title(name), marker="o", markersize=3) for name, colour in lines]
    for line in key if of_boxes else ():
        line.set(linewidth=6, alpha=0.6, marker="")
    return key


def _key_of_pairs(study: Study) -> Key:
    titles = (f"1: {study.title(first)}, 2: {study.title(second)}" for first, second in study.pairs)
    lines = zip(titles, _colours_of_pairs(study), strict=True)
    return [Line2D([], [], color=colour, label=title, marker="o", markersize=5) for title, colour in lines]


def _height(key: Key, width: float) -> float:
    return key_height([str(line.get_label()) for line in key], width) + 0.1


def _colours(study: Study) -> list[str]:
    return [CURVE_COLOURS[place % len(CURVE_COLOURS)] for place in range(len(study.trackers))]


def _colours_of_pairs(study: Study) -> list[str]:
    return [CURVE_COLOURS[(len(study.trackers) + place) % len(CURVE_COLOURS)] for place in range(len(study.pairs))]
