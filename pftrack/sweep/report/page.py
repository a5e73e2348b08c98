"""The page of a report: one HTML file that needs nothing else, with tables and with maps that answer to the pointer."""

from collections.abc import Callable
from html import escape
from typing import Any

import numpy as np
from bokeh.embed import components
from bokeh.layouts import gridplot
from bokeh.models import BasicTicker, ColumnDataSource, FactorRange, HoverTool, LinearColorMapper
from bokeh.models.annotations import ColorBar
from bokeh.palettes import Viridis256
from bokeh.plotting import figure
from bokeh.resources import Resources
from matplotlib.colors import to_hex
from numpy.typing import NDArray

from pftrack.sweep.cells import CellMap, Code, Significance
from pftrack.sweep.report.colours import CODE_NAMES, CODES, GREYS, MISSING, diverging
from pftrack.sweep.report.study import Comparison, Study, label, shown
from pftrack.sweep.report.tables import Table

__all__ = ["page"]

SIDE_PX = 310
COLUMNS = 3

NOTES = {
    "significance": "Each cell is tested by itself, as in the document: of a hundred cells without any difference, "
    "about one comes out as significant at 0.01 by chance. Not applicable where an expected count is below 5.",
    "significance_holm": "Corrected for the number of cells: the level is the probability of any false alarm in the "
    "whole map.",
    "significance_error": "Errors of successful runs only. Where two trackers succeed in different runs they are "
    "judged by different runs, and the one that survives the harder ones may show the larger error.",
}

Plot = Any
"""A Bokeh figure; its classes are made at run time."""

STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; color: #222; background: #fff; margin: 2rem auto; max-width: 1160px;
  padding: 0 1rem; }
h1 { font-size: 1.6rem; margin-bottom: .2rem; } h2 { font-size: 1.15rem; margin: 2.2rem 0 .6rem; }
p { max-width: 70ch; color: #444; } dl { display: grid; grid-template-columns: max-content 1fr; gap: .2rem 1rem; }
dt { color: #666; } dd { margin: 0; } .wide { overflow-x: auto; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; font-size: 14px; }
th, td { text-align: left; padding: .25rem .9rem .25rem 0; border-bottom: 1px solid #e5e5e5; white-space: nowrap; }
.key span { display: inline-block; margin-right: 1.2rem; } .key i { display: inline-block; width: 1em; height: 1em;
  border: 1px solid #888; vertical-align: -.15em; margin-right: .4em; }
"""


def page(study: Study, tables: tuple[Table, ...]) -> str:
    """Return the page of a study as HTML."""
    plan = study.result.plan
    sections = _sections(study)
    script, divisions = components({name: plot for name, (_, plot) in sections.items()}) if sections else ("", {})
    resources = Resources(mode="inline", components=["bokeh"]).render() if sections else ""
    body = [f"<h1>{escape(plan.wiring.title)}: a sweep</h1>", f"<p>{escape(plan.wiring.question)}</p>", _plan(study)]
    body += [_table(tables[0])]
    for name, (title, _) in sections.items():
        body.append(f"<h2>{escape(title)}</h2>")
        body += [_note(NOTES[name]), _key()] if name in NOTES else []
        body.append(f'<div class="wide">{divisions[name]}</div>')
    body += [_table(table) for table in tables[1:]]
    return (
        f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
        f'<meta name="viewport" content="width=device-width"><title>{escape(plan.wiring.title)}: a sweep</title>'
        f"<style>{STYLE}</style>\n{resources}</head>\n<body>\n{_joined(body)}\n{script}\n</body></html>\n"
    )


def _sections(study: Study) -> dict[str, tuple[str, Plot]]:
    """Return title and plots of every map, by name."""
    if study.x is None:
        return {}
    sections: dict[str, tuple[str, Plot]] = {}
    unit = f", {study.result.plan.wiring.unit}" if study.result.plan.wiring.unit else ""
    if study.judged:
        plots = _of_trackers(study, lambda cells: cells.rate, 0.0, 1.0)
        sections["success"] = "Success rate", _side_by_side(plots)
    errors = np.array([cells.mean_error for cells in study.maps.values()])
    most = float(np.nanmax(errors, initial=0.0)) or 1.0
    of_which = " of successful runs" if study.judged else ""
    plots = _of_trackers(study, lambda cells: cells.mean_error, 0.0, most)
    sections["error"] = f"Mean error{of_which}{unit}", _side_by_side(plots)
    if study.comparisons and study.judged:
        plots = [_difference(study, pair) for pair in study.comparisons]
        sections["difference"] = "Difference of success rates", _side_by_side(plots)
        plots = [_codes(study, pair, pair.success) for pair in study.comparisons]
        sections["significance"] = f"Success, chi-square at {study.level:g}, each cell by itself", _side_by_side(plots)
        plots = [_codes(study, pair, pair.success_fisher) for pair in study.comparisons]
        title = f"Success, Fisher's exact test at {study.level:g}, Holm's correction over the map"
        sections["significance_holm"] = title, _side_by_side(plots)
    if study.comparisons:
        plots = [_codes(study, pair, pair.error) for pair in study.comparisons]
        sections["significance_error"] = (
            f"Error, rank-sum test at {study.level:g}, each cell by itself",
            _side_by_side(plots),
        )
    return sections


def _of_trackers(study: Study, of: Callable[[CellMap], NDArray[np.float64]], low: float, high: float) -> list[Plot]:
    mapper = LinearColorMapper(palette=Viridis256, low=low, high=high, nan_color=MISSING)
    return [
        _map(study, study.title(name), {"value": of(cells), **_figures(cells)}, mapper, _hover(study))
        for name, cells in study.maps.items()
    ]


def _difference(study: Study, pair: Comparison) -> Plot:
    found = pair.success
    most = max(float(np.nanmax(np.abs(it.success.effect), initial=0.0)) for it in study.comparisons) or 1.0
    palette = [to_hex(diverging()(step / 255)) for step in range(256)]
    mapper = LinearColorMapper(palette=palette, low=-most, high=most, nan_color=MISSING)
    hover = [("difference", "@value{+0.000}"), ("p (chi-square)", "@p")]
    title = f"{pair.first} less {pair.second}"
    return _map(study, title, {"value": found.effect, "p": _p_values(found)}, mapper, hover)


def _codes(study: Study, pair: Comparison, found: Significance) -> Plot:
    colours = np.array([CODES[code] for code in Code])[found.codes]
    names = [CODE_NAMES[code].format(first=study.title(pair.first), second=study.title(pair.second)) for code in Code]
    hover = [("", "@verdict"), ("p", "@p"), ("effect", "@effect{+0.000}")]
    columns = {"fill": colours, "verdict": np.array(names)[found.codes], "p": _p_values(found), "effect": found.effect}
    title = f"1: {pair.first}, 2: {pair.second}"
    return _map(study, title, columns, None, hover)


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


def _hover(study: Study) -> list[tuple[str, str]]:
    figures = [("mean error", "@error{0.00}"), ("mean lost frames", "@lost{0.0}"), ("runs", "@runs")]
    if not study.judged:
        return [figures[0], figures[2]]
    return [("success", "@rate{0.000}"), ("95 % interval", "@low{0.000} to @high{0.000}"), *figures]


def _figures(cells: CellMap) -> dict[str, NDArray[Any]]:
    return {
        "rate": cells.rate,
        "low": cells.low,
        "high": cells.high,
        "error": cells.mean_error,
        "lost": cells.mean_lost_frames,
        "runs": cells.runs,
    }


def _p_values(found: Significance) -> NDArray[Any]:
    texts = ["not applicable" if np.isnan(value) else f"{value:.2g}" for value in found.p_values.ravel()]
    return np.array(texts).reshape(found.p_values.shape)


def _side_by_side(plots: list[Plot]) -> Plot:
    return gridplot([plots[start : start + COLUMNS] for start in range(0, len(plots), COLUMNS)], toolbar_location=None)


def _plan(study: Study) -> str:
    plan = study.result.plan
    facts = {
        "Experiment": f"{plan.experiment} ({'; '.join(citation.short for citation in plan.wiring.references)})",
        "Runs": f"{sum(int(total.runs[0, 0]) for total in study.totals.values()):,} of {plan.runs:,}",
        "Trackers": ", ".join(plan.trackers),
        **{
            f"{label(study, axis)}": f"{', '.join(shown(value) for value in axis.values)} ({axis.name})"
            for axis in plan.axes
        },
        "Trials": f"{plan.trials} a tracker and condition, {plan.frames} frames each",
        "Fixed": ", ".join(f"{name} = {shown(value)}" for name, value in plan.values.items()) or "all as by default",
        "Seed": str(plan.seed),
    }
    return f"<dl>{''.join(f'<dt>{escape(name)}</dt><dd>{escape(fact)}</dd>' for name, fact in facts.items())}</dl>"


def _table(table: Table) -> str:
    head = "".join(f"<th>{escape(column)}</th>" for column in table.columns)
    rows = "".join(f"<tr>{''.join(f'<td>{escape(cell)}</td>' for cell in row)}</tr>" for row in table.rows)
    return f'<h2>{escape(table.title)}</h2>\n<div class="wide"><table><tr>{head}</tr>{rows}</table></div>'


def _key() -> str:
    entries = (
        f'<span><i style="background:{CODES[code]}"></i>{escape(name.format(first="1", second="2"))}</span>'
        for code, name in CODE_NAMES.items()
    )
    return f'<p class="key">{"".join(entries)}</p>'


def _note(text: str) -> str:
    return f"<p>{escape(text)}</p>"


def _joined(body: list[str]) -> str:
    return "\n".join(part for part in body if part)
