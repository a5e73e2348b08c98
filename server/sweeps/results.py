"""Results: what a sweep has on the disk so far, and questions about it.

Chunks are counted once, when they appear; only sums are kept, so that a sweep that nobody looks at costs nothing and a
large one no more than a small one. All methods block for some milliseconds, are called in threads, and may be called at
once.
"""

import math
import threading
from pathlib import Path
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from pftrack.parameters import Value, declarations
from pftrack.sweep import (
    CellMap,
    Code,
    Counts,
    Plan,
    Result,
    SweepError,
    cells,
    count,
    error_significance,
    partial_of,
    read_chunk,
    read_result,
    rows_of,
    significance,
)
from server.errors import NotFoundError, RefusedError
from server.sweeps.views import (
    AxisView,
    CellsView,
    ComparisonView,
    Correction,
    MapView,
    Measure,
    RowsView,
    RowView,
    Test,
    Verdict,
)

__all__ = ["NO_AXIS", "Results", "axis_view", "fixed_views"]

NO_AXIS = "none"
"""What is said for an axis to pool all of its values."""

ALL_RUNS = AxisView(name=NO_AXIS, title="All runs", unit="", kind="choice", values=[""])

VERDICTS: dict[int, Verdict] = {
    Code.NOT_APPLICABLE: "untested",
    Code.NOT_SIGNIFICANT: "none",
    Code.FIRST_BETTER: "first",
    Code.SECOND_BETTER: "second",
}
Pair: TypeAlias = tuple[str | None, str | None]
TOTAL: Pair = (None, None)


class Results:
    """The files of one sweep.

    Attributes:
        done: Runs that are there.
        successes: How many of them succeeded.
        problems: How many of them could not be computed.
    """

    def __init__(self, plan: Plan, out: Path) -> None:
        self._plan = plan
        self._out = out
        self._lock = threading.Lock()
        self._files: dict[Path, None] = {}
        self._complete = False
        self._counts: dict[Pair, Counts] = {TOTAL: count(plan, None, None)}
        self._views: dict[Pair, CellsView] = {}
        self.done = 0
        self.successes = 0
        self.problems = 0

    def refresh(self) -> bool:
        """Count what has appeared since the last time; return whether there was anything."""
        with self._lock:
            if self._complete:
                return False
            if self._out.exists():
                self._complete_now()
                return True
            return self._count_new()

    def cells(self, x: str | None, y: str | None) -> CellsView:
        """Return a map over one or two axes, over the first two if none is named.

        Raises:
            RefusedError: There is no such axis.
        """
        pair = self._pair(x, y)
        with self._lock:
            if pair not in self._views:
                self._views[pair] = self._view(pair)
            return self._views[pair]

    def compare(
        self, x: str | None, y: str | None, first: str, second: str, measure: Measure, test: Test, level: float,
        correction: Correction,
    ) -> ComparisonView:  # fmt: skip
        """Return two methods against each other, cell by cell.

        Raises:
            RefusedError: There is no such axis or method.
        """
        pair = self._pair(x, y)
        for field, name in (("first", first), ("second", second)):
            self._check_tracker(name, field)
        with self._lock:
            maps = cells(self._counted(pair))
            result = self._result()
        one, other = maps[first], maps[second]
        if measure == "success":
            counted: Literal["chi-square", "fisher"] = "fisher" if test == "fisher" else "chi-square"
            used: Test = counted
            found = significance(one, other, level=level, correction=correction, test=counted)
            difference = one.rate - other.rate
        else:
            used = "rank-sum"
            found = error_significance(result, first, second, *pair, level=level, correction=correction)
            difference = other.mean_error - one.mean_error
        return ComparisonView(
            first=first,
            second=second,
            measure=measure,
            test=used,
            level=level,
            correction=correction,
            difference=_numbers(difference),
            verdict=[VERDICTS[int(code)] for code in found.codes.ravel()],
            p_value=_numbers(found.p_values),
        )

    def rows(
        self, x: str | None, y: str | None, place: tuple[int, int], tracker: str | None, offset: int, limit: int
    ) -> RowsView:
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
            maps = cells(self._counted(pair))
            result = self._result()
        chosen = [maps[name] for name in self._plan.trackers if tracker in {None, name}]
        at = (place[1], place[0])
        found = rows_of(result, where, limit=offset + limit)
        return RowsView(
            total=sum(int(one.runs[at]) for one in chosen),
            failures=sum(int(one.judged[at] - one.successes[at]) for one in chosen),
            rows=[self._row(row) for row in found[offset:]],
        )

    def row(self, run: int) -> RowView:
        """Return one run.

        Raises:
            NotFoundError: The sweep has no such run, or has not come to it yet.
        """
        self.refresh()
        with self._lock:
            result = self._result()
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
        return read_result(self._out)

    # ------------------------------------------------------------ counting, under the lock

    def _count_new(self) -> bool:
        folder = partial_of(self._out)
        try:
            names = sorted(path for path in folder.iterdir() if path.suffix == ".parquet" and path.stem.isdecimal())
        except FileNotFoundError:
            return False
        news = False
        for path in names:
            if path in self._files:
                continue
            try:
                table = read_chunk(path)
            except (SweepError, OSError):
                # Damaged, or just moved into the final result: the next look will tell.
                continue
            self._files[path] = None
            for pair, known in self._counts.items():
                self._counts[pair] = known + count(self._plan, table, *pair)
            news = True
        if news:
            self._told()
        return news

    def _complete_now(self) -> None:
        """Go over from the chunks, which are gone, to the one file that was made of them."""
        if self.done < self._plan.runs:
            result = Result(self._plan, (self._out,), complete=True)
            self._counts = {pair: _sum(result, self._plan, pair) for pair in self._counts}
            self._told()
        self._complete = True

    def _told(self) -> None:
        self._views.clear()
        total = list(cells(self._counts[TOTAL]).values())
        self.done = _runs(self._counts[TOTAL])
        self.successes = sum(int(one.successes.sum()) for one in total)
        self.problems = sum(int(one.problems.sum()) for one in total)

    def _counted(self, pair: Pair) -> Counts:
        if pair not in self._counts:
            found = _sum(self._result(), self._plan, pair)
            if _runs(found) < self.done and self._out.exists():
                # The chunks went into the result while they were counted.
                self._complete_now()
                found = _sum(self._result(), self._plan, pair)
            self._counts[pair] = found
        return self._counts[pair]

    def _result(self) -> Result:
        """Return exactly what has been counted."""
        if self._complete:
            return Result(self._plan, (self._out,), complete=True)
        return Result(self._plan, tuple(sorted(self._files)), complete=False)

    def _view(self, pair: Pair) -> CellsView:
        maps = cells(self._counted(pair))
        x, y = pair
        plan = self._plan
        numbers = max(1, len(plan.axis(x).values) if x else 1) * max(1, len(plan.axis(y).values) if y else 1)
        return CellsView(
            x=axis_view(plan, x) if x else ALL_RUNS,
            y=axis_view(plan, y) if y else None,
            planned=plan.conditions * plan.trials // numbers,
            done=self.done,
            maps=[_map(name, one) for name, one in maps.items()],
        )

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

    def _check_tracker(self, name: str, field: str) -> None:
        if name not in self._plan.trackers:
            known = ", ".join(self._plan.trackers)
            raise RefusedError(
                f"{field} must be a method of the sweep ({known}), got {name}.",
                field=field, bound=f"one of {known}", value=name,
            )  # fmt: skip

    def _row(self, row: dict[str, Any]) -> RowView:
        known = {name: row[name] for name in RowView.model_fields if name in row}
        return RowView(**known, conditions={axis.name: row[axis.name] for axis in self._plan.axes})


def axis_view(plan: Plan, name: str) -> AxisView:
    """Return an axis with what is to be written beside it."""
    return _described(plan, name, plan.axis(name).values)


def fixed_views(plan: Plan) -> list[AxisView]:
    """Return the parameters that have the same value in all runs, each like an axis of one value."""
    return [_described(plan, name, (value,)) for name, value in plan.values.items()]


def _described(plan: Plan, name: str, values: tuple[Value, ...]) -> AxisView:
    known = {it.name: it for it in declarations(type(plan.wiring.simulate().parameters))}
    it = known[name]
    return AxisView(name=name, title=it.title, unit=it.unit, kind=it.kind, values=list(values))


def _sum(result: Result, plan: Plan, pair: Pair) -> Counts:
    total = count(plan, None, *pair)
    columns = ["tracker", "success", "mean_error", "lost_frames", "problem", *(name for name in pair if name)]
    for piece in result.pieces(columns):
        total += count(plan, piece, *pair)
    return total


def _runs(counts: Counts) -> int:
    return sum(int(one.runs.sum()) for one in cells(counts).values())


def _map(tracker: str, one: CellMap) -> MapView:
    judged = one.judged.ravel()
    return MapView(
        tracker=tracker,
        runs=one.runs.ravel().tolist(),
        problems=one.problems.ravel().tolist(),
        successes=[int(value) if known else None for value, known in zip(one.successes.ravel(), judged, strict=True)],
        rate=_numbers(one.rate),
        low=_numbers(one.low),
        high=_numbers(one.high),
        error=_numbers(one.mean_error),
        lost_frames=_numbers(one.mean_lost_frames),
    )


def _numbers(values: NDArray[np.float64]) -> list[float | None]:
    """Return numbers as JSON can say them: six digits, null for none."""
    return [float(f"{value:.6g}") if math.isfinite(value) else None for value in values.ravel().tolist()]
