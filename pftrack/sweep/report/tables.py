"""The tables of a report: success by tracker, along every axis, and of one tracker against another."""

from dataclasses import dataclass

import numpy as np

from pftrack.statistics import chi_square, fisher_exact
from pftrack.sweep.axis import Axis
from pftrack.sweep.cells import CellMap, Code, Significance
from pftrack.sweep.report.study import Comparison, Study, label, shown

__all__ = ["Table", "tables"]


@dataclass(frozen=True)
class Table:
    """Text in rows and columns under a title."""

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


def tables(study: Study) -> tuple[Table, ...]:
    """Return all tables."""
    along = tuple(_along(study, axis) for axis in study.result.plan.axes if len(axis.values) > 1)
    measures = (_measures(study),) if study.measures else ()
    return (_by_tracker(study), *along, *((_compared(study),) if study.comparisons else ()), *measures)


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
                _number(total.mean_error[0, 0]),
                _number(total.mean_lost_frames[0, 0]),
                f"{missing:,}" if missing else "",
            )
        )
    columns = "tracker", "runs", "success", "95 % interval", error, "lost frames", "not computed"
    return Table("By tracker", columns, tuple(rows))


def _measures(study: Study) -> Table:
    """The means of the measures over all runs, by tracker."""
    rows = [
        (name, *(_number(total.measures[it.name][0, 0]) for it in study.measures))
        for name, total in study.totals.items()
    ]
    titles = (f"{it.title.lower()}, {it.unit}" if it.unit else it.title.lower() for it in study.measures)
    return Table("Measures, means over all runs", ("tracker", *titles), tuple(rows))


def _along(study: Study, axis: Axis) -> Table:
    """Success (or error, where nothing is judged) along one axis, all others pooled."""
    found = study.by_axis(axis)
    rows = []
    for place, value in enumerate(axis.values):
        cells = (
            f"{_rate(cell, place)} ({_interval(cell, place)})"
            if cell.judged[0, place]
            else _number(cell.mean_error[0, place])
            for cell in found.values()
        )
        rows.append((shown(value), *cells))
    what = "Success (95 % interval)" if study.judged else "Mean error"
    return Table(f"{what} by {label(study, axis)}", (axis.name, *study.trackers), tuple(rows))


def _compared(study: Study) -> Table:
    rows: list[tuple[str, ...]] = []
    for pair in study.comparisons:
        names = f"{pair.first} / {pair.second}"
        if study.judged:
            rows += [
                (names, "success, chi2", *_tallied(pair.success), _pooled(study, pair)),
                (names, "success, chi2, Holm", *_tallied(pair.success_holm), ""),
                (names, "success, Fisher, Holm", *_tallied(pair.success_fisher), _pooled(study, pair, exact=True)),
            ]
        rows += [
            (names, "error, rank-sum", *_tallied(pair.error), ""),
            (names, "error, rank-sum, Holm", *_tallied(pair.error_holm), ""),
        ]
    columns = "1 / 2", "test", "1 better", "2 better", "neither", "untested", "pooled p"
    return Table(f"Cells in which tracker 1 or 2 is better, at a level of {study.level:g}", columns, tuple(rows))


def _tallied(found: Significance) -> tuple[str, ...]:
    order = Code.FIRST_BETTER, Code.SECOND_BETTER, Code.NOT_SIGNIFICANT, Code.NOT_APPLICABLE
    return tuple(str(int((found.codes == code).sum())) for code in order)


def _pooled(study: Study, pair: Comparison, *, exact: bool = False) -> str:
    one, other = study.totals[pair.first], study.totals[pair.second]
    test = fisher_exact if exact else chi_square
    p_value = float(test(one.successes, one.judged, other.successes, other.judged)[0, 0])
    return "not applicable" if np.isnan(p_value) else f"{p_value:.2g}"


def _rate(cells: CellMap, place: int) -> str:
    return f"{cells.rate[0, place]:.3f}" if cells.judged[0, place] else ""


def _interval(cells: CellMap, place: int) -> str:
    return f"{cells.low[0, place]:.3f}-{cells.high[0, place]:.3f}" if cells.judged[0, place] else ""


def _number(value: float) -> str:
    return "" if np.isnan(value) else f"{value:.3g}"
