"""Curves and boxes of a report, over one axis at a time."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from pftrack.output.figures.panels import (
    BELOW_IN,
    HIGH_IN,
    LEFT_IN,
    RIGHT_IN,
    TITLE_IN,
    Values,
    axes_at,
    draw_boxes,
    draw_curve,
    draw_differences,
    draw_key,
    finish,
    foot_height,
    key_line,
    panels_below_each_other,
    write,
    write_numbers,
    write_values,
)
from pftrack.output.figures.style import CURVE_COLOURS, HEADING_PT
from pftrack.sweep.axis import Axis
from pftrack.sweep.cells import CellMap, Code, Quantity, samples
from pftrack.sweep.comparison import TEST_TITLES
from pftrack.sweep.report.frame import format_value, label
from pftrack.sweep.report.study import Study

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.lines import Line2D


WIDE_IN = 3.3
BOX_IN, NARROWEST_IN, WIDEST_IN = 0.35, 5.0, 16.0
PERCENTILES = 5, 25, 50, 75, 95
"""Of a box: ends of the whiskers, edges of the box, and median."""

Key = list["Line2D"]


def curves(study: Study, axes: Sequence[Axis]) -> Figure:
    """Draw the success with its interval along every axis, all others pooled; error where nothing is judged."""
    columns = min(len(axes), 3)
    rows = -(-len(axes) // columns)
    wide = max(WIDE_IN, NARROWEST_IN / columns)
    below = BELOW_IN + max(_values(axis).height(wide) for axis in axes)
    key = _key(study)
    width = columns * (LEFT_IN + wide + RIGHT_IN)
    foot = foot_height(key, width)
    figure = Figure(figsize=(width, 2 * TITLE_IN + rows * (HIGH_IN + below) + foot))
    top = figure.get_figheight() - 2 * TITLE_IN
    write(figure, LEFT_IN, top + 0.1, "Success and its 95 % interval" if study.judged else "Mean error", HEADING_PT)
    for place, axis in enumerate(axes):
        row, column = divmod(place, columns)
        bottom = top - row * (HIGH_IN + below) - HIGH_IN
        panel = axes_at(figure, column * (width / columns) + LEFT_IN, bottom, wide, HIGH_IN)
        positions = np.array(axis.values, dtype=float) if axis.numerical else np.arange(len(axis.values))
        _curves(panel, study, positions, study.by_axis[axis.name])
        if axis.numerical:
            write_numbers(panel, positions, _values(axis).texts, wide)
        else:
            write_values(panel, _values(axis), wide)
        finish(panel, label(study, axis), "Success rate" if study.judged else "Mean error")
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
        finish(panels[0], label(study, axis), quantity.label)
    else:
        _boxes(panels[0], study, axis, quantity)
    if study.pairs:
        _differences(panels[1], study, axis, quantity)
    return figure


def _of_boxes() -> str:
    low, lower, _, upper, high = PERCENTILES
    return f"Boxes {lower} to {upper} %, whiskers {low} to {high} %"


def _stack(study: Study, axis: Axis, parts: "Sequence[tuple[str, Key]]") -> "tuple[Figure, list[Axes]]":
    """Return panels over an axis below each other, each with its title and its key."""
    wide = min(max(BOX_IN * len(axis.values) * len(study.trackers), NARROWEST_IN), WIDEST_IN)
    return panels_below_each_other(_values(axis), wide, parts)


def _values(axis: Axis) -> Values:
    return Values(tuple(format_value(value) for value in axis.values), is_named=not axis.numerical)


def _curves(panel: "Axes", study: Study, positions: NDArray[Any], found: Mapping[str, CellMap]) -> None:
    for name, colour in zip(study.trackers, _colours(study), strict=True):
        cells = found[name]
        values = cells.rate[0] if study.judged else cells.mean_error[0]
        draw_curve(panel, positions, values, colour, (cells.low[0], cells.high[0]) if study.judged else None)
    panel.set_ylim(*((-0.02, 1.02) if study.judged else (0, None)))


def _boxes(panel: "Axes", study: Study, axis: Axis, quantity: Quantity) -> None:
    found = samples(study.result, quantity, axis.name).values
    panel.use_sticky_edges = False
    width = 0.8 / len(study.trackers)
    for place, (name, colour) in enumerate(zip(study.trackers, _colours(study), strict=True)):
        known = [index for index, values in enumerate(found[name]) if len(values)]
        if known:
            ends = np.array([np.percentile(found[name][index], PERCENTILES) for index in known]).T
            draw_boxes(panel, ends, np.array(known) + (place - (len(study.trackers) - 1) / 2) * width, width, colour)
    if all(values.min(initial=0.0) >= 0.0 for cells in found.values() for values in cells):
        panel.set_ylim(bottom=0)
    finish(panel, label(study, axis), quantity.label)


def _differences(panel: "Axes", study: Study, axis: Axis, quantity: Quantity) -> None:
    """Draw the differences on the same scenes with their intervals; filled where the test finds one better."""
    pairs = study.comparisons[quantity.name]
    width = 0.5 / len(pairs)
    for place, (pair, colour) in enumerate(zip(pairs, _colours_of_pairs(study), strict=True)):
        positions = np.arange(len(axis.values)) + (place - (len(pairs) - 1) / 2) * width
        codes = pair.significance(study.level).codes[0]
        better = (codes == Code.FIRST_BETTER) | (codes == Code.SECOND_BETTER)
        found = [it[0] for it in (pair.paired.mean, pair.paired.low, pair.paired.high)]
        draw_differences(panel, positions, found, better, colour)
    unit = f", {quantity.unit}" if quantity.unit else ""
    finish(panel, label(study, axis), f"Difference{unit}, + if 1 is better")


def _key(study: Study, *, of_boxes: bool = False) -> Key:
    lines = zip(study.trackers, _colours(study), strict=True)
    return [key_line(study.title(name), colour, is_box=of_boxes) for name, colour in lines]


def _key_of_pairs(study: Study) -> Key:
    titles = (f"1: {study.title(first)}, 2: {study.title(second)}" for first, second in study.pairs)
    return [key_line(title, colour, size=5) for title, colour in zip(titles, _colours_of_pairs(study), strict=True)]


def _colours(study: Study) -> list[str]:
    return [CURVE_COLOURS[place % len(CURVE_COLOURS)] for place in range(len(study.trackers))]


def _colours_of_pairs(study: Study) -> list[str]:
    return [CURVE_COLOURS[(len(study.trackers) + place) % len(CURVE_COLOURS)] for place in range(len(study.pairs))]
