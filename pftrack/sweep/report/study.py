"""The content of a report: a result, the two axes of its maps, the quantities of comparison; and its tables.

There are tables of success by tracker and along every axis, and of one tracker against another by every quantity.
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import combinations, compress
from math import isnan
from typing import Literal

import numpy as np

from pftrack.core.model.parameters import Value
from pftrack.sweep.axis import Axis, SweepError, find_declaration
from pftrack.sweep.cells import (
    COMMON,
    TEST_TITLES,
    CellMap,
    Code,
    Comparison,
    Quantity,
    UsedTest,
    cells,
    compare,
    quantities,
    samples,
)
from pftrack.sweep.journal import Result

MOST_PAIRS = 6
"""With more trackers than four, each is compared with the first alone."""

FLATTEST, TALLEST = 0.6, 1.4
"""The least and the greatest height of a map over its width."""


@dataclass(frozen=True)
class Study:
    """A result and its view.

    Attributes:
        result: Result of the sweep.
        x: Axis across the maps; None if nothing was varied.
        y: Axis down the maps; None if a single axis was varied.
        level: Level of significance.
    """

    result: Result
    x: Axis | None
    y: Axis | None
    level: float

    @classmethod
    def of(cls, result: Result, *, x: str | None = None, y: str | None = None, level: float = 0.01) -> "Study":
        """Choose the axes: those named, or the first two with several numbers, in the order of the plan.

        A single axis runs across, even if it was named to go down.

        Raises:
            SweepError: The sweep has no such axis, or both are the same.
        """
        plan = result.plan
        if x is not None and x == y:
            raise SweepError(f"a map needs two different axes, got {x} twice")
        named = [plan.axis(name) for name in (x, y) if name is not None]
        several = [axis for axis in plan.axes if len(axis.values) > 1 and axis not in named]
        free = sorted(several, key=lambda axis: not axis.numerical)
        across = plan.axis(x) if x is not None else free.pop(0) if free else None
        down = plan.axis(y) if y is not None else free.pop(0) if free and across is not None else None
        return cls(result, across or down, down if across else None, level)

    @property
    def trackers(self) -> tuple[str, ...]:
        """Names of the trackers, in the order of the plan."""
        return self.result.plan.trackers

    @cached_property
    def proportion(self) -> float:
        """Height of a map over its width: cells are squares unless it would be too flat or too tall."""
        columns, rows = (len(axis.values) if axis else 1 for axis in (self.x, self.y))
        return min(max(rows / columns, FLATTEST), TALLEST)

    @cached_property
    def names(self) -> tuple[str | None, str | None]:
        """Names of the axes across and down."""
        return self.x.name if self.x else None, self.y.name if self.y else None

    @cached_property
    def maps(self) -> dict[str, CellMap]:
        """Each tracker's cells."""
        return cells(self.result, *self.names)

    @cached_property
    def totals(self) -> dict[str, CellMap]:
        """Each tracker's runs, all pooled in one cell."""
        return cells(self.result)

    @cached_property
    def quantities(self) -> tuple[Quantity, ...]:
        """The quantities of every run: success, the error, then the measures in the order of their declaration."""
        known = quantities(self.result.plan)
        return tuple(it for it in known if any(np.isfinite(it.means(one)).any() for one in self.totals.values()))

    @cached_property
    def judged(self) -> bool:
        """Whether the experiment defines success."""
        return any(total.judged.any() for total in self.totals.values())

    @cached_property
    def pairs(self) -> tuple[tuple[str, str], ...]:
        """Every two trackers, or each with the first where those would be too many."""
        pairs = list(combinations(self.trackers, 2))
        return tuple(pairs[: len(self.trackers) - 1] if len(pairs) > MOST_PAIRS else pairs)

    @cached_property
    def comparisons(self) -> dict[str, tuple[Comparison, ...]]:
        """Each pair, cell by cell, by name of the quantity."""
        return {it.name: self._compare(it, self.maps, *self.names) for it in self.quantities if self.pairs}

    def published(self, quantity: Quantity) -> tuple[Comparison, ...]:
        """Return each pair, cell by cell, by the tests of Bando 2007, which take all runs for independent."""
        return self._compare(quantity, self.maps, *self.names, test="chi-square")

    @cached_property
    def pooled(self) -> dict[str, tuple[Comparison, ...]]:
        """Each pair with all runs in one cell, by name of the quantity."""
        return {it.name: self._compare(it, self.totals, None, None) for it in self.quantities if self.pairs}

    @cached_property
    def by_axis(self) -> dict[str, dict[str, CellMap]]:
        """Each tracker's cells along every axis of several values, all others pooled, by name of the axis."""
        return {axis.name: cells(self.result, axis.name) for axis in self.result.plan.axes if len(axis.values) > 1}

    def title(self, tracker: str) -> str:
        """Return what a tracker is called."""
        return self.result.plan.wiring.trackers[tracker].title

    def _compare(
        self, quantity: Quantity, maps: dict[str, CellMap], x: str | None, y: str | None, test: UsedTest = "mcnemar"
    ) -> tuple[Comparison, ...]:
        values = samples(self.result, quantity, x, y)
        return tuple(compare(quantity, maps, values, *pair, test=test) for pair in self.pairs)


def label(study: Study, axis: Axis) -> str:
    """Return what an axis is called, with its unit."""
    declaration = find_declaration(study.result.plan.wiring, axis.name, study.result.plan.kind)
    return f"{declaration.title}, {declaration.unit}" if declaration.unit else declaration.title


LONGEST_SHOWN = 60
"""Characters of a value."""


def format_value(value: Value) -> str:
    """Return a value as a tick or a table shows it."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str) and len(value) > LONGEST_SHOWN:
        return "own file"  # nothing else is as long
    return f"{value:g}" if isinstance(value, float) else str(value)


def number(value: float, sign: Literal["", "+"] = "") -> str:
    """Return a result to three digits, whole from 1,000 on; nothing for NaN.

    Args:
        value: The result.
        sign: "+" to write it of positive values too.
    """
    if isnan(value):
        return ""
    return f"{value:{sign},.0f}" if abs(value) >= 999.5 else f"{value:{sign}.3g}"


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
    return (*totals(study), *along, *compared)


def totals(study: Study) -> tuple[Table, ...]:
    """Return the tables of what came of each tracker, over all runs."""
    return (_by_tracker(study), *_measures(study))


def _by_tracker(study: Study) -> Table:
    unit = study.result.plan.wiring.judge.unit
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
    titles = "tracker", "runs", "success", "95 % interval", error, "lost frames", "not computed"
    kept = [any(texts) for texts in zip(*rows, strict=True)]
    columns, *shown = (tuple(compress(line, kept)) for line in (titles, *rows))
    return Table("By tracker", columns, tuple(shown))


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
    """Every pair of trackers by one quantity: over all runs, and the numbers of cells in which one is better."""
    rows = [
        (*_pair(pair), *_over_all(pooled), *_test_columns(study, pair, pooled))
        for pair, pooled in zip(study.comparisons[quantity.name], study.pooled[quantity.name], strict=True)
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
    """Return the difference of the means, that on the same scenes with its interval, and the number of pairs."""
    mean, low, high = (float(it[0, 0]) for it in (pooled.paired.mean, pooled.paired.low, pooled.paired.high))
    interval = "" if np.isnan(low) else f" ({number(low, '+')} to {number(high, '+')})"
    return number(pooled.difference[0, 0], "+"), number(mean, "+") + interval, f"{pooled.paired.pairs[0, 0]:,}"


def _test_columns(study: Study, pair: Comparison, pooled: Comparison) -> tuple[str, ...]:
    """Return the test, its p-value over all runs, and the numbers of cells by verdict, in brackets after Holm."""
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
