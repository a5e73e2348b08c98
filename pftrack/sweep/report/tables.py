"""Tables of a report: success by tracker and along every axis, and one tracker against another by every quantity."""

from dataclasses import dataclass

import numpy as np

from pftrack.sweep.axis import Axis
from pftrack.sweep.cells import COMMON, CellMap, Code, Quantity, quantities
from pftrack.sweep.comparison import TEST_TITLES, Comparison
from pftrack.sweep.report.study import Study, format_value, label, number


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
