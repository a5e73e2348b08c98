"""Results: questions about what a sweep has on the disk so far.

All methods block for some milliseconds, are called in threads, and may be called at once.
"""

import threading
from pathlib import Path
from typing import Any

from pftrack.sweep import Plan, Result, compare, read_result, rows_of
from pftrack.sweep.cells import Quantity, cells, quantities, samples
from pftrack_server.errors import NotFoundError, RefusedError
from pftrack_server.schemas.sweep_answers import NO_AXIS, cells_view, comparison_view
from pftrack_server.schemas.sweep_views import (
    CellsPublic,
    ComparisonPublic,
    Correction,
    Pair,
    RowPublic,
    RowsPublic,
    Test,
)
from pftrack_server.sweeps.tally import Tally


class Results:
    """The files of one sweep."""

    def __init__(self, plan: Plan, out: Path) -> None:
        self._plan = plan
        self._out = out
        self._lock = threading.Lock()
        self._tally = Tally(plan, out)
        self._views: dict[Pair, CellsPublic] = {}

    @property
    def totals(self) -> tuple[int, int, int]:
        """Numbers of runs computed, of successes, and of runs that could not be computed."""
        return self._tally.done, self._tally.successes, self._tally.problems

    def refresh(self) -> bool:
        """Count what has appeared since the last time; return whether there was anything."""
        with self._lock:
            news = self._tally.look()
            if news:
                self._views.clear()
            return news

    def cells(self, x: str | None, y: str | None) -> CellsPublic:
        """Return a map over one or two axes, over the first two if none is named.

        Raises:
            RefusedError: There is no such axis.
        """
        pair = self._pair(x, y)
        with self._lock:
            if pair not in self._views:
                maps = cells(self._tally.counts(pair))
                self._views[pair] = cells_view(self._plan, pair, maps, self._tally.done)
            return self._views[pair]

    def compare(
        self, x: str | None, y: str | None, first: str, second: str, measure: str, test: Test, level: float,
        correction: Correction,
    ) -> ComparisonPublic:  # fmt: skip
        """Return two methods against each other, cell by cell.

        Raises:
            RefusedError: There is no such axis, method or measure.
        """
        pair = self._pair(x, y)
        quantity = self._quantity(measure)
        for field, name in (("first", first), ("second", second)):
            self._check_tracker(name, field)
        with self._lock:
            maps = cells(self._tally.counts(pair))
            result = self._tally.result()
        values = samples(result, quantity, *pair)
        found = compare(quantity, maps, values, first, second, test="fisher" if test == "fisher" else "chi-square")
        return comparison_view(found, level, correction)

    def rows(
        self, x: str | None, y: str | None, place: tuple[int, int], tracker: str | None, offset: int, limit: int
    ) -> RowsPublic:
        """Return some runs of a cell, failures first.

        Args:
            x: Axis across.
            y: Axis down.
            place: Which of their values, from 0.
            tracker: Of which method; of all if None.
            offset: How many to pass over.
            limit: How many to return.

        Raises:
            RefusedError: There is no such axis, cell or method.
        """
        pair = self._pair(x, y)
        where: dict[str, Any] = {}
        for field, name, index in zip(("i", "j"), pair, place, strict=True):
            values = self._plan.axis(name).values if name else (None,)
            if index >= len(values):
                raise RefusedError(
                    f"{field} must be between 0 and {len(values) - 1}, got {index}.",
                    field=field, bound=f"between 0 and {len(values) - 1}", value=index,
                )  # fmt: skip
            if name:
                where[name] = values[index]
        if tracker is not None:
            self._check_tracker(tracker, "tracker")
            where["tracker"] = tracker
        self.refresh()
        with self._lock:
            maps = cells(self._tally.counts(pair))
            result = self._tally.result()
        chosen = [maps[name] for name in self._plan.trackers if tracker in {None, name}]
        at = (place[1], place[0])
        found = rows_of(result, where, limit=offset + limit)
        return RowsPublic(
            total=sum(int(one.runs[at]) for one in chosen),
            failures=sum(int(one.judged[at] - one.successes[at]) for one in chosen),
            rows=[self._row(row) for row in found[offset:]],
        )

    def row(self, run: int) -> RowPublic:
        """Return one run.

        Raises:
            NotFoundError: The sweep has no such run, or has not come to it yet.
        """
        self.refresh()
        with self._lock:
            result = self._tally.result()
        for found in rows_of(result, {"run": run}, limit=1):
            return self._row(found)
        if run < self._plan.runs:
            raise NotFoundError("This run has not been computed yet.")
        raise NotFoundError(f"There is no such run; the sweep has runs 0 to {self._plan.runs - 1}.")

    def result(self) -> Result:
        """Return what there is as the library has it.

        Raises:
            SweepError: The files cannot be read.
        """
        return read_result(self._out, self._plan)

    # ------------------------------------------------------------ names

    def _pair(self, x: str | None, y: str | None) -> Pair:
        names = [axis.name for axis in self._plan.axes]
        for field, name in (("x", x), ("y", y)):
            if name is not None and name != NO_AXIS and name not in names:
                known = ", ".join(names)
                raise RefusedError(
                    f"{field} must be an axis of the sweep ({known}), got {name}.",
                    field=field, bound=f"one of {known}", value=name,
                )  # fmt: skip
        across = x if x not in {None, NO_AXIS} else next((name for name in names if name != y), None)
        rest = [name for name in names if name != across]
        down = None if y == NO_AXIS else y or next(iter(rest), None)
        if across is not None and across == down:
            raise RefusedError(f"A map needs two different axes, got {across} twice.", field="y", value=down)
        return across, down

    def _quantity(self, name: str) -> Quantity:
        known = {quantity.name: quantity for quantity in quantities(self._plan)}
        if name not in known:
            names = ", ".join(known)
            raise RefusedError(
                f"measure must be one that the sweep has ({names}), got {name}.",
                field="measure", bound=f"one of {names}", value=name,
            )  # fmt: skip
        return known[name]

    def _check_tracker(self, name: str, field: str) -> None:
        if name not in self._plan.trackers:
            known = ", ".join(self._plan.trackers)
            raise RefusedError(
                f"{field} must be a method of the sweep ({known}), got {name}.",
                field=field, bound=f"one of {known}", value=name,
            )  # fmt: skip

    def _row(self, row: dict[str, Any]) -> RowPublic:
        known = {name: row[name] for name in RowPublic.model_fields if name in row}
        measures = {measure.name: row[measure.name] for measure in self._plan.measures}
        conditions = {axis.name: row[axis.name] for axis in self._plan.axes}
        return RowPublic(**known, conditions=conditions, measures=measures)
