"""Results: questions about what a sweep has on the disk so far, and from a row of it to a live session.

What lies on the disk is counted once when it appears. Only sums are kept, so that a sweep that nobody looks at costs
nothing and a large one no more than a small one. The library's counts are answered with titles and units added, as JSON
numbers. All methods block for some milliseconds and are called in threads; those of results may be called at once. A
session computes the same numbers as its row, and is paused shortly before the loss.
"""

import math
import threading
from pathlib import Path
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel

from pftrack.core.model.parameters import Value, declarations
from pftrack.core.model.recipe import Footage
from pftrack.core.refusal import ConflictError, RefusedError
from pftrack.runs.loss import APPROACH_FRAMES, approach
from pftrack.sweep import Comparison, Plan, Result, compare, partial_of, read_chunk, read_result, rows_of
from pftrack.sweep.axis import SweepError
from pftrack.sweep.cells import CellMap, Code, Counts, Quantity, cells, columns, count, quantities, samples
from pftrack_server.core.errors import NotFoundError
from pftrack_server.sessions.create import new_spec
from pftrack_server.sessions.spec import SessionSpec
from pftrack_server.store import Store
from pftrack_server.store.database import UploadRow

Test = Literal["chi-square", "fisher", "rank-sum"]

Correction = Literal["none", "holm"]

Verdict = Literal["first", "second", "none", "untested"]

Pair: TypeAlias = tuple[str | None, str | None]
"""Names of the axes of a map, across and up; None pools all values."""


class AxisPublic(BaseModel):
    """An axis with what a map needs to write beside it."""

    name: str
    title: str
    unit: str
    kind: str
    values: list[Value]


class MapPublic(BaseModel):
    """The cells of one method, a list for each quantity.

    The lists are as long as `at` of a message, or as the map has cells, row after row of the y axis. What is not known
    is null. `error` is the mean over the successful runs, and each of `measures` by its name that over all runs.
    """

    tracker: str
    runs: list[int]
    problems: list[int]
    successes: list[int | None]
    rate: list[float | None]
    low: list[float | None]
    high: list[float | None]
    error: list[float | None]
    lost_frames: list[float | None]
    measures: dict[str, list[float | None]] = {}


class ComparisonPublic(BaseModel):
    """Two methods against each other, cell by cell.

    `measure` is "success", "error" or the name of one of the sweep's measures. `difference` is positive where the first
    is better: that of the success rates, of the mean errors of successful runs, or of a measure's means over all runs.
    `paired` is the mean difference between runs on the same scenes, of which there are `pairs`, with its 95 % interval.
    `verdict` is the outcome of the test; "untested" where its conditions of use do not hold.
    """

    first: str
    second: str
    measure: str
    test: Test
    level: float
    correction: Correction
    difference: list[float | None]
    paired: list[float | None]
    paired_low: list[float | None]
    paired_high: list[float | None]
    pairs: list[int]
    verdict: list[Verdict]
    p_value: list[float | None]


class CellsPublic(BaseModel):
    """A sweep seen over one or two of its axes; the others, and the trials, are pooled."""

    x: AxisPublic
    y: AxisPublic | None
    planned: int
    done: int
    maps: list[MapPublic]
    comparison: ComparisonPublic | None = None


class RowPublic(BaseModel):
    """One run of a sweep."""

    run: int
    tracker: str
    trial: int
    seed: int
    conditions: dict[str, Value]
    success: bool | None
    mean_error: float | None
    lost_frames: int | None
    first_lost_frame: int | None
    measures: dict[str, float | None] = {}
    problem: str | None


class RowsPublic(BaseModel):
    """Some runs of a cell, failures first, and how many there are."""

    total: int
    failures: int
    rows: list[RowPublic]


TOTAL: Pair = (None, None)


class Tally:
    """Sums over the files of one sweep, for every pair of axes that somebody has asked for.

    Attributes:
        done: Runs that are there.
        successes: How many of them succeeded.
        problems: How many of them could not be computed.
    """

    def __init__(self, plan: Plan, out: Path) -> None:
        self._plan = plan
        self._out = out
        self._files: set[Path] = set()
        self._complete = False
        self._counts: dict[Pair, Counts] = {TOTAL: count(plan, None, *TOTAL)}
        self.done = self.successes = self.problems = 0

    def look(self) -> bool:
        """Count what has appeared since the last time; return whether there was anything.

        Raises:
            SweepError: The result is damaged.
        """
        if self._complete:
            return False
        if self._out.exists():
            self._close()
            return True
        there = self._there()
        if not self._files <= there:
            if self._out.exists():
                self._close()
                return True
            # Somebody took files away, and the sweep started again.
            self._files = set()
            self._counts = {pair: count(self._plan, None, *pair) for pair in self._counts}
        return self._add(sorted(there - self._files))

    def counts(self, pair: Pair) -> Counts:
        """Return the sums for a pair of axes.

        Raises:
            SweepError: The result is damaged.
        """
        if pair not in self._counts:
            found = self._sum(self.result(), pair)
            if _runs(found) < self.done and self._out.exists():
                # The chunks went into the result while they were counted.
                self._close()
                found = self._sum(self.result(), pair)
            self._counts[pair] = found
        return self._counts[pair]

    def result(self) -> Result:
        """Return exactly what has been counted."""
        if self._complete:
            return Result(self._plan, (self._out,), complete=True)
        return Result(self._plan, tuple(sorted(self._files)), complete=False, place=partial_of(self._out))

    def _there(self) -> set[Path]:
        try:
            every = partial_of(self._out).iterdir()
            return {path for path in every if path.suffix == ".parquet" and path.stem.isdecimal()}
        except FileNotFoundError:
            return set()

    def _add(self, paths: list[Path]) -> bool:
        news = False
        for path in paths:
            try:
                table = read_chunk(path)
            except (SweepError, OSError):
                # Damaged, or just gone into the result: the next look will tell.
                continue
            self._files.add(path)
            self._counts = {pair: known + count(self._plan, table, *pair) for pair, known in self._counts.items()}
            news = True
        if news:
            self._total()
        return news

    def _close(self) -> None:
        """Go over from the chunks, which are gone, to the one file that was made of them."""
        if self.done < self._plan.runs:
            result = Result(self._plan, (self._out,), complete=True)
            self._counts = {pair: self._sum(result, pair) for pair in self._counts}
            self._total()
        self._complete = True

    def _total(self) -> None:
        every = cells(self._counts[TOTAL]).values()
        self.done = _runs(self._counts[TOTAL])
        self.successes = sum(int(one.successes.sum()) for one in every)
        self.problems = sum(int(one.problems.sum()) for one in every)

    def _sum(self, result: Result, pair: Pair) -> Counts:
        total = count(self._plan, None, *pair)
        for piece in result.pieces(columns(self._plan, *pair)):
            total += count(self._plan, piece, *pair)
        return total


def _runs(counts: Counts) -> int:
    return sum(int(one.runs.sum()) for one in cells(counts).values())


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


NO_AXIS = "none"
"""The name that stands for no axis, so that all values are pooled."""

ALL_RUNS = AxisPublic(name=NO_AXIS, title="All runs", unit="", kind="choice", values=[""])

VERDICTS: dict[int, Verdict] = {
    Code.NOT_APPLICABLE: "untested",
    Code.NOT_SIGNIFICANT: "none",
    Code.FIRST_BETTER: "first",
    Code.SECOND_BETTER: "second",
}


def axis_view(plan: Plan, name: str) -> AxisPublic:
    """Return an axis with what is to be written beside it."""
    return _describe(plan, name, plan.axis(name).values)


def fixed_views(plan: Plan) -> list[AxisPublic]:
    """Return the parameters that have the same value in all runs, each like an axis of one value."""
    return [_describe(plan, name, (value,)) for name, value in plan.values.items()]


def cells_view(plan: Plan, pair: Pair, maps: dict[str, CellMap], done: int) -> CellsPublic:
    """Return the maps of all methods over a pair of axes."""
    x, y = pair
    cells = math.prod(len(plan.axis(name).values) for name in pair if name is not None)
    return CellsPublic(
        x=axis_view(plan, x) if x else ALL_RUNS,
        y=axis_view(plan, y) if y else None,
        planned=plan.conditions * plan.trials // cells,
        done=done,
        maps=[_map(name, one) for name, one in maps.items()],
    )


def comparison_view(found: Comparison, level: float, correction: Correction) -> ComparisonPublic:
    """Return two methods against each other, tested at a level."""
    tested = found.significance(level, correction)
    return ComparisonPublic(
        first=found.first,
        second=found.second,
        measure=found.quantity.name,
        test=found.test,
        level=level,
        correction=correction,
        difference=_numbers(found.difference),
        paired=_numbers(found.paired.mean),
        paired_low=_numbers(found.paired.low),
        paired_high=_numbers(found.paired.high),
        pairs=found.paired.pairs.ravel().tolist(),
        verdict=[VERDICTS[int(code)] for code in tested.codes.ravel()],
        p_value=_numbers(tested.p_values),
    )


def _describe(plan: Plan, name: str, values: tuple[Value, ...]) -> AxisPublic:
    known = {it.name: it for it in declarations(type(plan.parameters))}
    it = known[name]
    return AxisPublic(name=name, title=it.title, unit=it.unit, kind=it.kind, values=list(values))


def _map(tracker: str, one: CellMap) -> MapPublic:
    judged = one.judged.ravel()
    return MapPublic(
        tracker=tracker,
        runs=one.runs.ravel().tolist(),
        problems=one.problems.ravel().tolist(),
        successes=[int(value) if known else None for value, known in zip(one.successes.ravel(), judged, strict=True)],
        rate=_numbers(one.rate),
        low=_numbers(one.low),
        high=_numbers(one.high),
        error=_numbers(one.mean_error),
        lost_frames=_numbers(one.mean_lost_frames),
        measures={name: _numbers(means) for name, means in one.measures.items()},
    )


def _numbers(values: NDArray[np.float64]) -> list[float | None]:
    """Return numbers as JSON can say them: six digits, null for none."""
    return [float(f"{value:.6g}") if math.isfinite(value) else None for value in values.ravel().tolist()]


def session_spec(store: Store, sweep: str, plan: Plan, results: Results, run: int, tracker: str | None) -> SessionSpec:
    """Return the spec of a session with exactly one run of a sweep, or the same with another method.

    The session stands ten frames before the first lost frame; with another method that lost nothing, where the run of
    the row would. It is computed to ten frames after it, so that one can ask at once why it was lost.

    Raises:
        NotFoundError: The sweep has no such run.
        RefusedError: It has no such method.
        ConflictError: The run could not be computed, or its recording is no longer here.
    """
    row = results.row(run)
    if row.problem is not None:
        raise ConflictError(f"This run could not be computed: {row.problem}.")
    method = tracker or row.tracker
    if method not in plan.wiring.trackers:
        known = ", ".join(plan.wiring.trackers)
        raise RefusedError(
            f"tracker must be one of {known}, got {method}.", field="tracker", bound=f"one of {known}", value=method
        )
    single = plan.single(run)
    loss, last = _loss(plan, results, row, method), plan.frames - 1
    position, computed = (0, 0) if loss is None else (min(approach(loss), last), min(loss + APPROACH_FRAMES, last))
    recipe = single.recipe.model_copy(update={"tracker": method})
    upload = None if plan.footage is None else upload_of(store, plan).id
    return new_spec(recipe, sweep=sweep, upload=upload, position=position, computed=computed)


def upload_of(store: Store, plan: Plan) -> UploadRow:
    """Return the upload on which the runs of a plan are.

    Raises:
        ConflictError: It is no longer here.
    """
    footage = plan.footage or Footage()
    found = store.upload_of(footage.sha256 or "")
    if found is None:
        name = footage.name or "a recording"
        raise ConflictError(f"The sweep is on {name}, which is no longer on this server; upload it first.")
    return found


def _loss(plan: Plan, results: Results, row: RowPublic, method: str) -> int | None:
    """Return the first lost frame of the run that is opened; if it loses nothing, that of the row."""
    if method == row.tracker or method not in plan.trackers:
        return row.first_lost_frame
    twin = row.run + plan.trackers.index(method) - plan.trackers.index(row.tracker)
    other = results.row(twin).first_lost_frame
    return row.first_lost_frame if other is None else other
