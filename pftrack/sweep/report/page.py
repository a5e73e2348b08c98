"""The page of a report: one HTML file that needs nothing else, with tables and with maps that answer to the pointer.

Success and error are open, every other measure is a section of its own that a reader unfolds. Tables have success by
tracker, along every axis, and one tracker against another by every quantity.
"""

import json
from dataclasses import dataclass
from html import escape

import numpy as np

from pftrack.sweep.axis import Axis
from pftrack.sweep.cells import COMMON, CellMap, Code, Quantity, quantities
from pftrack.sweep.comparison import TEST_TITLES, Comparison
from pftrack.sweep.report.frame import CODE_NAMES, CODES, Frame, format_value, label, number
from pftrack.sweep.report.plots import code_maps, difference_maps, tracker_maps
from pftrack.sweep.report.study import Study


@dataclass(frozen=True)
class Table:
    """Text in rows and columns under a title.

    Attributes:
        title: Above it.
        columns: Their names.
        rows: As long as the columns.
        quantity: Name of the one that it compares by, if it does.
    """

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    quantity: str = ""

    @property
    def folded(self) -> bool:
        """Whether it is one of many that are looked at by those who want this measure."""
        return self.quantity not in ("", *COMMON)


def tables(study: Study) -> tuple[Table, ...]:
    """Return all tables."""
    along = tuple(_along(study, axis) for axis in study.result.plan.axes if len(axis.values) > 1)
    compared = tuple(_compare(study, quantity) for quantity in study.quantities if study.pairs)
    return (_by_tracker(study), *_measures(study), *along, *compared)


def _by_tracker(study: Study) -> Table:
    unit = study.result.plan.wiring.unit
    error = f"mean error, {unit}" if unit else "mean error"
    rows = []
    for name, total in study.totals.items():
        missing = int(total.problems[0, 0])
        rows.append(
            (
                name,
                f"{total.runs[0, 0]:,}",
                _rate(total, 0),
                _interval(total, 0),
                number(total.mean_error[0, 0]),
                number(total.mean_lost_frames[0, 0]),
                f"{missing:,}" if missing else "",
            )
        )
    columns = "tracker", "runs", "success", "95 % interval", error, "lost frames", "not computed"
    return Table("By tracker", columns, tuple(rows))


def _measures(study: Study) -> tuple[Table, ...]:
    """The means of the measures over all runs, by tracker, if there are any."""
    measures = [it for it in study.quantities if it.name not in COMMON]
    if not measures:
        return ()
    rows = [(name, *(number(it.means(total)[0, 0]) for it in measures)) for name, total in study.totals.items()]
    titles = (it.label[0].lower() + it.label[1:] for it in measures)
    return (Table("Measures, means over all runs", ("tracker", *titles), tuple(rows)),)


def _along(study: Study, axis: Axis) -> Table:
    """Success (or, where nothing is judged, the first quantity that is known) along one axis, all others pooled."""
    found = study.by_axis[axis.name]
    known = study.quantities or quantities(study.result.plan)[1:]
    rows = []
    for place, value in enumerate(axis.values):
        cells = (
            f"{_rate(cell, place)} ({_interval(cell, place)})"
            if cell.judged[0, place]
            else number(known[0].means(cell)[0, place])
            for cell in found.values()
        )
        rows.append((format_value(value), *cells))
    what = "Success (95 % interval)" if study.judged else known[0].label
    return Table(f"{what} by {label(study, axis)}", (axis.name, *study.trackers), tuple(rows))


def _compare(study: Study, quantity: Quantity) -> Table:
    """Every pair of trackers by one quantity: over all runs, and in how many cells one is better."""
    rows = [
        (*_pair(pair), *_over_all(pooled), *_test_columns(study, pair, pooled))
        for pair, pooled in zip(study.comparisons[quantity.name], study.pooled[quantity.name], strict=True)
    ]
    if quantity.name == "success":
        rows += [
            (*_pair(pair), "", "", "", *_test_columns(study, pair, pooled))
            for pair, pooled in zip(study.exact, study.pooled_exact, strict=True)
        ]
    columns = (
        "1 / 2",
        "difference",
        "on the same scenes (95 % interval)",
        "pairs",
        "test",
        "p of all",
        "cells 1 better",
        "2 better",
        "neither",
        "untested",
    )
    title = (
        f"{quantity.label} ({quantity.better} is better): difference, positive where 1 is better, and cells at "
        f"{study.level:g}, in brackets after Holm"
    )
    return Table(title, columns, tuple(rows), quantity.name)


def _pair(pair: Comparison) -> tuple[str]:
    return (f"{pair.first} / {pair.second}",)


def _over_all(pooled: Comparison) -> tuple[str, str, str]:
    """Return the difference of the means, that on the same scenes with its interval, and how many pairs these are."""
    mean, low, high = (float(it[0, 0]) for it in (pooled.paired.mean, pooled.paired.low, pooled.paired.high))
    interval = "" if np.isnan(low) else f" ({number(low, '+')} to {number(high, '+')})"
    return number(pooled.difference[0, 0], "+"), number(mean, "+") + interval, f"{pooled.paired.pairs[0, 0]:,}"


def _test_columns(study: Study, pair: Comparison, pooled: Comparison) -> tuple[str, ...]:
    """Return the test, its p-value over all runs, and the cells by what it says, in brackets after Holm."""
    order = Code.FIRST_BETTER, Code.SECOND_BETTER, Code.NOT_SIGNIFICANT, Code.NOT_APPLICABLE
    alone, corrected = pair.significance(study.level).codes, pair.significance(study.level, "holm").codes
    *counts, untested = (int((alone == code).sum()) for code in order)
    kept = (int((corrected == code).sum()) for code in order[:-1])
    p_value = float(pooled.p_values[0, 0])
    return (
        TEST_TITLES[pair.test],
        "not applicable" if np.isnan(p_value) else f"{p_value:.2g}",
        *(f"{one} ({other})" for one, other in zip(counts, kept, strict=True)),
        str(untested),
    )


def _rate(cells: CellMap, place: int) -> str:
    return f"{cells.rate[0, place]:.3f}" if cells.judged[0, place] else ""


def _interval(cells: CellMap, place: int) -> str:
    return f"{cells.low[0, place]:.3f}-{cells.high[0, place]:.3f}" if cells.judged[0, place] else ""


ALONE = (
    "Each cell is tested by itself, with no correction for many: of the cells without any difference, up to {share:g} "
    "% come out as significant by chance."
)
APPLICABLE = "Not applicable where an expected count is below 5."
HOLM = "Corrected for the number of cells: the level is the probability of any false alarm in the whole map."
SURVIVORS = (
    "Errors of successful runs only. Where two trackers succeed in different runs they are judged by different runs, "
    "and the one that survives the harder ones may show the larger error."
)
DIFFERENCES = (
    "Positive, and blue, where the first tracker is better. Both met the same scenes: the difference between runs on "
    "the same scene has an interval, which the pointer shows."
)

STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; color: #222; background: #fff; margin: 2rem auto; max-width: 1160px;
  padding: 0 1rem; overflow-wrap: break-word; }
h1 { font-size: 1.6rem; margin-bottom: .2rem; } h2 { font-size: 1.15rem; margin: 2.2rem 0 .6rem; }
h3 { font-size: 1rem; margin: 1.4rem 0 .3rem; } p { max-width: 70ch; color: #444; }
dl { display: grid; grid-template-columns: max-content 1fr; gap: .2rem 1rem; } dt { color: #666; } dd { margin: 0; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; font-size: 14px; }
th, td { text-align: left; padding: .25rem .9rem .25rem 0; border-bottom: 1px solid #e5e5e5; white-space: nowrap; }
th { white-space: normal; vertical-align: bottom; }
.key span { display: inline-block; margin-right: 1.2rem; } .key i { display: inline-block; width: 1em; height: 1em;
  border: 1px solid #888; vertical-align: -.15em; margin-right: .4em; }
.scale { font-size: 13px; } .scale i { display: inline-block; width: 8rem; height: .8em; margin: 0 .3rem; }
.scale span, summary span { white-space: nowrap; } .scale span { margin-left: .5rem; }
.maps { display: flex; flex-wrap: wrap; gap: .8rem 1.4rem; } figure { margin: 0; max-width: 100%; }
figcaption { font-size: 13px; font-weight: 600; } svg { display: block; max-width: 100%; font-size: 11px; fill: #444; }
path { shape-rendering: crispEdges; }
details { border-top: 1px solid #e5e5e5; margin-top: 1.6rem; padding-top: .6rem; } summary { cursor: pointer; }
summary h2 { display: inline; } summary p { margin: .2rem 0 .2rem 1.1rem; }
#cell { position: fixed; z-index: 1; margin: 0; padding: .4rem .6rem; gap: 0 .7rem; font-size: 13px; background: #fff;
  border: 1px solid #aaa; border-radius: 4px; box-shadow: 0 2px 8px #0003; pointer-events: none; max-width: 92vw; }
#cell[hidden] { display: none; }
@media (max-width: 600px) { .plan { grid-template-columns: 1fr; gap: 0; } .plan dd { margin-bottom: .5rem; } }
"""

SCRIPT = """
const axes = JSON.parse(document.getElementById("axes").textContent);
const [columns, rows] = [axes[0][1].length, axes[1]?.[1].length ?? 1];
const shown = document.getElementById("cell");
const element = (kind, text) => Object.assign(document.createElement(kind), { textContent: text });

function show(event) {
  const map = event.target instanceof Element ? event.target.closest("figure") : null;
  const ground = map?.querySelector("rect").getBoundingClientRect();
  const column = map ? Math.floor((columns * (event.clientX - ground.left)) / ground.width) : -1;
  const row = map ? Math.floor((rows * (ground.bottom - event.clientY)) / ground.height) : -1;
  shown.hidden = column < 0 || column >= columns || row < 0 || row >= rows;
  if (shown.hidden) return;
  const figures = Object.entries(JSON.parse(map.querySelector("script").textContent));
  const told = [
    ...axes.map(([name, values], which) => [name, values[which ? row : column]]),
    ...figures.map(([name, texts]) => [name, texts[row * columns + column]]),
  ].filter(([, text]) => text);
  shown.replaceChildren(...told.flatMap(([name, text]) => [element("dt", name), element("dd", text)]));
  const { width, height } = shown.getBoundingClientRect();
  const right = document.documentElement.clientWidth - width - 4;
  shown.style.left = `${Math.max(4, Math.min(event.clientX + 14, right))}px`;
  shown.style.top = `${event.clientY + 14 + height > innerHeight ? event.clientY - 14 - height : event.clientY + 14}px`;
}

for (const kind of ["pointermove", "pointerdown"]) document.addEventListener(kind, show);
document.addEventListener("scroll", () => (shown.hidden = true));
"""


def page(study: Study, tables: tuple[Table, ...]) -> str:
    """Return the page of a study as HTML."""
    plan = study.result.plan
    title = f"{escape(plan.wiring.title)}: a sweep"
    by_tracker, *others = (table for table in tables if not table.quantity)
    body = [f"<h1>{title}</h1>", f"<p>{escape(plan.wiring.question)}</p>", _plan(study), _table(by_tracker)]
    frame = Frame.of(study) if study.x else None
    sections = [_section(study, frame, quantity, tables) for quantity in study.quantities]
    main = sum(quantity.name in COMMON for quantity in study.quantities)
    body += [*sections[:main], *map(_table, others), *sections[main:]]
    body += [_pointer(study)] if study.x else []
    return (
        f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
        f'<meta name="viewport" content="width=device-width"><title>{title}</title>'
        f"<style>{STYLE}</style></head>\n<body>\n{_join(body)}\n</body></html>\n"
    )


def _section(study: Study, frame: Frame | None, quantity: Quantity, tables: tuple[Table, ...]) -> str:
    """Return all of one quantity: maps of the trackers, and of the pairs difference and significance."""
    parts = [_note(f"{quantity.description} {quantity.better.capitalize()} is better.")]
    if quantity.name == "error" and study.judged:
        parts.append(_note(SURVIVORS))
    if frame is not None:
        parts.append(tracker_maps(study, frame, quantity))
    if frame is not None and study.pairs:
        pairs = study.comparisons[quantity.name]
        at = f"{study.level:g}"
        parts += ["<h3>Difference</h3>", _note(DIFFERENCES)]
        parts.append(difference_maps(study, frame, quantity))
        parts += [f"<h3>{TEST_TITLES[pairs[0].test]} test at {at}, each cell by itself</h3>"]
        alone = ALONE.format(share=100 * study.level)
        parts += [_note(f"{alone} {APPLICABLE}" if pairs[0].test == "chi-square" else alone), _key()]
        parts.append(code_maps(study, frame, pairs, "none"))
        if quantity.name == "success":
            parts += [f"<h3>{TEST_TITLES['fisher']} test at {at}, Holm's correction over the map</h3>", _note(HOLM)]
            parts.append(code_maps(study, frame, study.exact, "holm"))
    parts += [_table(table, level=3) for table in tables if table.quantity == quantity.name]
    is_open = " open" if quantity.name in COMMON else ""
    summary = f"<summary><h2>{escape(quantity.label)}</h2>{_verdict(study, quantity)}</summary>"
    return f'<details id="{escape(quantity.name)}"{is_open}>{summary}\n{_join(parts)}</details>'


def _verdict(study: Study, quantity: Quantity) -> str:
    """Return in how many cells which tracker is better, for a reader who decides whether to unfold the section."""
    if not study.pairs or study.x is None:
        return ""
    said = []
    for pair in study.comparisons[quantity.name]:
        codes = pair.significance(study.level).codes
        first, second = (int((codes == code).sum()) for code in (Code.FIRST_BETTER, Code.SECOND_BETTER))
        tested = int((codes != Code.NOT_APPLICABLE).sum())
        said.append(f"<span>{escape(f'{pair.first} {first}, {pair.second} {second} of {tested} tested')}</span>")
    return f"<p>Cells in which one is significantly better: {'; '.join(said)}</p>"


def _pointer(study: Study) -> str:
    """Return what shows the figures of the cell under the pointer."""
    axes = [(label(study, axis), [format_value(value) for value in axis.values]) for axis in (study.x, study.y) if axis]
    told = json.dumps(axes).replace("<", "\\u003c")  # which could end the script
    data = f'<script type="application/json" id="axes">{told}</script>'
    return f'<dl id="cell" hidden></dl>\n{data}\n<script>{SCRIPT}</script>'


def _plan(study: Study) -> str:
    plan = study.result.plan
    facts = {
        "Experiment": f"{plan.experiment} ({'; '.join(citation.short for citation in plan.wiring.references)})",
        "Runs": f"{sum(int(total.runs[0, 0]) for total in study.totals.values()):,} of {plan.runs:,}",
        "Trackers": ", ".join(plan.trackers),
        **{
            f"{label(study, axis)}": f"{', '.join(format_value(value) for value in axis.values)} ({axis.name})"
            for axis in plan.axes
        },
        "Trials": f"{plan.trials} a tracker and condition, {plan.frames} frames each",
        "Fixed": ", ".join(f"{name} = {format_value(value)}" for name, value in plan.values.items())
        or "all as by default",
        "Seed": str(plan.seed),
    }
    told = "".join(f"<dt>{escape(name)}</dt><dd>{escape(fact)}</dd>" for name, fact in facts.items())
    return f'<dl class="plan">{told}</dl>'


def _table(table: Table, level: int = 2) -> str:
    head = "".join(f"<th>{escape(column)}</th>" for column in table.columns)
    rows = "".join(f"<tr>{''.join(f'<td>{escape(cell)}</td>' for cell in row)}</tr>" for row in table.rows)
    return f'<h{level}>{escape(table.title)}</h{level}>\n<div class="wide"><table><tr>{head}</tr>{rows}</table></div>'


def _key() -> str:
    entries = (
        f'<span><i style="background:{CODES[code]}"></i>{escape(name.format(first="1", second="2"))}</span>'
        for code, name in CODE_NAMES.items()
    )
    return f'<p class="key">{"".join(entries)}</p>'


def _note(text: str) -> str:
    return f"<p>{escape(text)}</p>"


def _join(body: list[str]) -> str:
    return "\n".join(part for part in body if part)
