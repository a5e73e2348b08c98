"""The maps on the page of a report, which tell the figures of a cell under the pointer."""

from typing import Any

import numpy as np
from bokeh.layouts import gridplot
from bokeh.models import BasicTicker, ColumnDataSource, FactorRange, HoverTool, LinearColorMapper
from bokeh.models.annotations import ColorBar
from bokeh.palettes import Viridis256
from bokeh.plotting import figure
from matplotlib.colors import to_hex
from numpy.typing import NDArray

from pftrack.statistics import holm
from pftrack.sweep.cells import CellMap, Code, Correction
from pftrack.sweep.comparison import Comparison
from pftrack.sweep.quantities import COMMON, Quantity
from pftrack.sweep.report.colours import CODE_NAMES, CODES, GREYS, MISSING, diverging, largest_difference, scale_of
from pftrack.sweep.report.study import Study, label, shown

__all__ = ["Plot", "code_maps", "difference_maps", "tracker_maps"]

SIDE_PX = 310
COLUMNS = 3

Plot = Any
"""A Bokeh figure; its classes are made at run time."""


def tracker_maps(study: Study, quantity: Quantity) -> Plot:
    """Return each tracker's mean of a quantity, on one colour scale; what is better is bright."""
    means = np.array([quantity.means(cells) for cells in study.maps.values()])
    low, high = scale_of(quantity, means)
    palette = Viridis256 if quantity.better == "higher" else Viridis256[::-1]
    mapper = LinearColorMapper(palette=palette, low=low, high=high, nan_color=MISSING)
    return _side_by_side(
        [
            _map(study, study.title(name), {"value": values, **_figures(cells)}, mapper, _hover(study, quantity))
            for (name, cells), values in zip(study.maps.items(), means, strict=True)
        ]
    )


def difference_maps(study: Study, quantity: Quantity) -> Plot:
    """Return the difference of every pair, positive where the first is better, with that on the same scenes."""
    pairs = study.comparisons[quantity.name]
    most = largest_difference(pairs)
    palette = [to_hex(diverging()(step / 255)) for step in range(256)]
    mapper = LinearColorMapper(palette=palette, low=-most, high=most, nan_color=MISSING)
    hover = [
        ("difference", "@value{+0.000}"),
        ("on the same scenes", "@paired{+0.000}"),
        ("95 % interval", "@low{+0.000} to @high{+0.000}"),
        ("pairs", "@pairs"),
        (f"p ({pairs[0].test})", "@p"),
    ]
    return _side_by_side(
        [
            _map(
                study,
                f"1: {pair.first}, 2: {pair.second}",
                {
                    "value": pair.difference,
                    "paired": pair.paired.mean,
                    "low": pair.paired.low,
                    "high": pair.paired.high,
                    "pairs": pair.paired.pairs,
                    "p": _p_values(pair.p_values),
                },
                mapper,
                hover,
            )
            for pair in pairs
        ]
    )


def code_maps(study: Study, pairs: tuple[Comparison, ...], correction: Correction) -> Plot:
    """Return where the test finds one tracker of a pair better, in four colours."""
    hover = [("", "@verdict"), ("p", "@p"), ("p after Holm", "@holm"), ("effect", "@effect{+0.000}")]
    plots = []
    for pair in pairs:
        found = pair.significance(study.level, correction)
        first, second = study.title(pair.first), study.title(pair.second)
        names = [CODE_NAMES[code].format(first=first, second=second) for code in Code]
        columns = {
            "fill": np.array([CODES[code] for code in Code])[found.codes],
            "verdict": np.array(names)[found.codes],
            "p": _p_values(pair.p_values),
            "holm": _p_values(holm(pair.p_values)),
            "effect": found.effect,
        }
        plots.append(_map(study, f"1: {pair.first}, 2: {pair.second}", columns, None, hover))
    return _side_by_side(plots)


def _map(
    study: Study,
    title: str,
    columns: dict[str, NDArray[Any]],
    mapper: LinearColorMapper | None,
    hover: list[tuple[str, str]],
) -> Plot:
    """Return one map: a rectangle a cell, coloured by `value` through the mapper or by `fill`."""
    across = [shown(value) for value in study.x.values] if study.x else [""]
    down = [shown(value) for value in study.y.values] if study.y else [""]
    rows, places = np.indices((len(down), len(across)))
    data = {
        "x": [across[place] for place in places.ravel()],
        "y": [down[row] for row in rows.ravel()],
        **{name: values.ravel() for name, values in columns.items()},
    }
    height = SIDE_PX if study.y else 150
    plot: Plot = figure(
        x_range=FactorRange(factors=across),
        y_range=FactorRange(factors=down),
        width=SIDE_PX + (65 if mapper else 0),
        height=height,
        title=title,
        toolbar_location=None,
    )
    fill: Any = {"field": "value", "transform": mapper} if mapper else {"field": "fill"}
    line = None if mapper else GREYS["separator"]
    plot.rect("x", "y", 1, 1, source=ColumnDataSource(data), fill_color=fill, line_color=line)
    if mapper:
        bar = ColorBar(color_mapper=mapper, ticker=BasicTicker(), width=10, border_line_color=None)
        plot.add_layout(bar, "right")
    named = [(label(study, axis), f"@{name}") for axis, name in ((study.x, "x"), (study.y, "y")) if axis is not None]
    plot.add_tools(HoverTool(tooltips=[*named, *hover]))
    for axis, line_of in ((study.x, plot.xaxis), (study.y, plot.yaxis)):
        line_of.axis_label = label(study, axis) if axis is not None else ""
        if axis is not None and len(axis.values) > 12:
            line_of.major_label_overrides = {
                shown(value): "" for place, value in enumerate(axis.values) if place % -(-len(axis.values) // 8)
            }
    plot.xaxis.major_label_orientation = 0.8
    plot.grid.grid_line_color = None
    plot.outline_line_color = None
    return plot


def _hover(study: Study, quantity: Quantity) -> list[tuple[str, str]]:
    success = [("success", "@rate{0.000}"), ("95 % interval", "@low{0.000} to @high{0.000}")] if study.judged else []
    error, lost, runs = ("mean error", "@error{0.00}"), ("mean lost frames", "@lost{0.0}"), ("runs", "@runs")
    if quantity.name in COMMON:
        return [*success, error, lost, runs] if study.judged else [error, runs]
    return [(quantity.label, "@value{0.000}"), *success, error, runs]


def _figures(cells: CellMap) -> dict[str, NDArray[Any]]:
    return {
        "rate": cells.rate,
        "low": cells.low,
        "high": cells.high,
        "error": cells.mean_error,
        "lost": cells.mean_lost_frames,
        "runs": cells.runs,
    }


def _p_values(p_values: NDArray[np.float64]) -> NDArray[Any]:
    texts = ["not applicable" if np.isnan(value) else f"{value:.2g}" for value in p_values.ravel()]
    return np.array(texts).reshape(p_values.shape)


def _side_by_side(plots: list[Plot]) -> Plot:
    return gridplot([plots[start : start + COLUMNS] for start in range(0, len(plots), COLUMNS)], toolbar_location=None)
