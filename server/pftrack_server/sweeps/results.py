"""Results: queries on the runs that a sweep has on disk so far, and from a row to a live session.

New files are counted once when they appear. Only sums are kept, so an unwatched sweep costs nothing, and a large one no
more than a small one. Answers hold the library's counts with titles and units, as JSON numbers. All methods block for
some milliseconds and are called in threads; those of `Results` may run concurrently. A session computes the same
numbers as its row and is paused shortly before the loss.
"""

import math
import threading
from collections.abc import Collection, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal, TypeAlias

from pydantic import BaseModel, BeforeValidator, Field

from pftrack.core.arrays import Floats
from pftrack.core.model.parameters import Value
from pftrack.core.model.recipe import Footage
from pftrack.core.refusal import ConflictError, ParameterError, RefusedError
from pftrack.runs.loss import APPROACH_FRAMES, approach
from pftrack.sweep import Plan, Result, compare, partial_of, read_chunk, rows_of
from pftrack.sweep.axis import SweepError, find_declaration
from pftrack.sweep.cells import (
    CellMap,
    Code,
    Correction,
    Counts,
    UsedTest,
    cells,
    count,
    count_result,
    quantities,
    samples,
)
from pftrack_server.core.errors import not_found
from pftrack_server.sessions.create import new_spec
from pftrack_server.sessions.spec import SessionSpec
from pftrack_server.store import Store
from pftrack_server.store.database import UploadRow

Verdict = Literal["first", "second", "none", "untested"]

Pair: TypeAlias = tuple[str | None, str | None]
"""Names of a map's x and y axes; None pools all values."""


def _numbers(values: Floats) -> list[float | None]:
    """Return numbers for JSON: six digits, null if not finite."""
    return [float(f"{value:.6g}") if math.isfinite(value) else None for value in values.ravel().tolist()]


Numbers: TypeAlias = Annotated[list[float | None], BeforeValidator(_numbers)]
Whole: TypeAlias = Annotated[list[int], BeforeValidator(lambda values: values.ravel().tolist())]


class AxisPublic(BaseModel):
    """An axis with its labels for a map."""

    name: str
    title: str
    unit: str
    kind: str
    values: list[Value]


class MapPublic(BaseModel):
    """The cells of one method, a list for each quantity.

    Each list has one entry per entry of a message's `at`, or per cell of the map, row after row of the y axis; unknown
    values are null. `error` is the mean over the successful runs; `measures` holds, by name, means over all runs.
    """

    tracker: str
    runs: Whole
    problems: Whole
    successes: list[int | None]
    rate: Numbers
    low: Numbers
    high: Numbers
    error: Annotated[Numbers, Field(validation_alias="mean_error")]
    lost_frames: Annotated[Numbers, Field(validation_alias="mean_lost_frames")]
    measures: dict[str, Numbers] = {}


class ComparisonPublic(BaseModel):
    """A comparison of two methods, cell by cell.

    `measure` is "success", "error" or the name of one of the sweep's measures. `difference` is positive where the first
    is better: the difference of success rates, of mean errors of successful runs, or of a measure's means over all
    runs. `paired` is the mean difference between runs on the same scenes, with its 95 % interval; `pairs` counts them.
    `verdict` is the outcome of the test; "untested" where its conditions do not hold.
    """

    first: str
    second: str
    measure: str
    test: UsedTest
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
    """A sweep over one or two of its axes; the others, and the trials, are pooled."""

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
    """Some runs of a cell, failures first, and the number of all."""

    total: int
    failures: int
    rows: list[RowPublic]


TOTAL: Pair = (None, None)


class Results:
    """The files of one sweep, and sums over them for every requested pair of axes.

    Attributes:
        done: Number of computed runs.
        successes: Number of successful runs.
        problems: Number of runs that could not be computed.
    """

    def __init__(self, plan: Plan, out: Path) -> None:
        self._plan = plan
        self._out = out
        self._lock = threading.RLock()
        self._files: set[Path] = set()
        self._complete = False
        self._counts: dict[Pair, Counts] = {TOTAL: count(plan, None, *TOTAL)}
        self._views: dict[Pair, CellsPublic] = {}
        self.done = self.successes = self.problems = 0

    def look(self) -> bool:
        """Count new results; return whether there were any.

        Raises:
            SweepError: The result is damaged.
        """
        with self._lock:
            news = self._look()
            if news:
                self._views.clear()
            return news

    def _look(self) -> bool:
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
            # Files were removed, and the sweep started again.
            self._files = set()
            self._counts = {pair: count(self._plan, None, *pair) for pair in self._counts}
        return self._add(sorted(there - self._files))

    def _maps(self, pair: Pair) -> dict[str, CellMap]:
        """Return the cells over a pair of axes."""
        if pair not in self._counts:
            found = count_result(self.result(), *pair)
            if _runs(found) < self.done and self._out.exists():
                # The chunks were merged into the result while they were counted.
                self._close()
                found = count_result(self.result(), *pair)
            self._counts[pair] = found
        return cells(self._counts[pair])

    def result(self) -> Result:
        """Return exactly the counted runs."""
        with self._lock:
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
                # Damaged, or just merged into the result: the next call of `look` shows which.
                continue
            self._files.add(path)
            self._counts = {pair: known + count(self._plan, table, *pair) for pair, known in self._counts.items()}
            news = True
        if news:
            self._total()
        return news

    def _close(self) -> None:
        """Switch from the chunks to the one file into which they were merged."""
        if self.done < self._plan.runs:
            result = Result(self._plan, (self._out,), complete=True)
            self._counts = {pair: count_result(result, *pair) for pair in self._counts}
            self._total()
        self._complete = True

    def _total(self) -> None:
        every = cells(self._counts[TOTAL]).values()
        self.done = _runs(self._counts[TOTAL])
        self.successes = sum(int(one.successes.sum()) for one in every)
        self.problems = sum(int(one.problems.sum()) for one in every)

    def cells(self, x: str | None, y: str | None) -> CellsPublic:
        """Return a map over one or two axes, by default the first two.

        Raises:
            RefusedError: The axis is unknown.
        """
        pair = self._pair(x, y)
        with self._lock:
            if pair not in self._views:
                across, down = pair
                shown = math.prod(len(self._plan.axis(name).values) for name in pair if name is not None)
                self._views[pair] = CellsPublic(
                    x=axis_view(self._plan, across) if across else ALL_RUNS,
                    y=axis_view(self._plan, down) if down else None,
                    planned=self._plan.conditions * self._plan.trials // shown,
                    done=self.done,
                    maps=[_map(name, one) for name, one in self._maps(pair).items()],
                )
            return self._views[pair]

    def compare(
        self, x: str | None, y: str | None, first: str, second: str, measure: str, test: UsedTest, level: float,
        correction: Correction,
    ) -> ComparisonPublic:  # fmt: skip
        """Return a comparison of two methods, cell by cell.

        Raises:
            RefusedError: The axis, method or measure is unknown.
        """
        pair = self._pair(x, y)
        known = {quantity.name: quantity for quantity in quantities(self._plan)}
        quantity = known[_one_of(known, measure, "measure")]
        for field, name in (("first", first), ("second", second)):
            _one_of(self._plan.trackers, name, field)
        with self._lock:
            maps, result = self._maps(pair), self.result()
        values = samples(result, quantity, *pair)
        found = compare(quantity, maps, values, first, second, test=test)
        tested = found.significance(level, correction)
        return ComparisonPublic(
            first=first,
            second=second,
            measure=measure,
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

    def rows(
        self, x: str | None, y: str | None, place: tuple[int, int], tracker: str | None, offset: int, limit: int
    ) -> RowsPublic:
        """Return some runs of a cell, failures first.

        Args:
            x: Name of the x axis.
            y: Name of the y axis.
            place: Indices of their values, from 0.
            tracker: Name of a method; None for all.
            offset: Number of runs to skip.
            limit: Most runs to return.

        Raises:
            RefusedError: The axis, cell or method is unknown.
        """
        pair = self._pair(x, y)
        where: dict[str, Any] = {}
        for field, name, index in zip(("i", "j"), pair, place, strict=True):
            values = self._plan.axis(name).values if name else (None,)
            if index >= len(values):
                raise ParameterError(field, index, f"between 0 and {len(values) - 1}")
            if name:
                where[name] = values[index]
        if tracker is not None:
            where["tracker"] = _one_of(self._plan.trackers, tracker, "tracker")
        self.look()
        with self._lock:
            maps, result = self._maps(pair), self.result()
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
            ApiError: The run does not exist, or has not been computed yet (404).
        """
        if run >= self._plan.runs:
            raise not_found(f"This run does not exist; the sweep has runs 0 to {self._plan.runs - 1}.")
        self.look()
        for found in rows_of(self.result(), {"run": run}, limit=1):
            return self._row(found)
        raise not_found("This run has not been computed yet.")

    # ------------------------------------------------------------ names

    def _pair(self, x: str | None, y: str | None) -> Pair:
        names = [axis.name for axis in self._plan.axes]
        for field, name in (("x", x), ("y", y)):
            if name not in {None, NO_AXIS}:
                _one_of(names, name, field)
        across = x if x not in {None, NO_AXIS} else next((name for name in names if name != y), None)
        rest = [name for name in names if name != across]
        down = None if y == NO_AXIS else y or next(iter(rest), None)
        if across is not None and across == down:
            raise RefusedError(f"A map needs two different axes, got {across} twice.", field="y", value=down)
        return across, down

    def _row(self, row: dict[str, Any]) -> RowPublic:
        known = {name: row[name] for name in RowPublic.model_fields if name in row}
        measures = {measure.name: row[measure.name] for measure in self._plan.measures}
        conditions = {axis.name: row[axis.name] for axis in self._plan.axes}
        return RowPublic(**known, conditions=conditions, measures=measures)


def _runs(counts: Counts) -> int:
    return sum(int(one.runs.sum()) for one in cells(counts).values())


NO_AXIS = "none"
"""Name in place of an axis that pools all values."""

ALL_RUNS = AxisPublic(name=NO_AXIS, title="All runs", unit="", kind="choice", values=[""])

VERDICTS: dict[int, Verdict] = {
    Code.NOT_APPLICABLE: "untested",
    Code.NOT_SIGNIFICANT: "none",
    Code.FIRST_BETTER: "first",
    Code.SECOND_BETTER: "second",
}


def _one_of(known: Collection[str], name: str, field: str) -> str:
    """Return a name after checking that it is known.

    Raises:
        ParameterError: The name is unknown; the message lists the known ones.
    """
    if name not in known:
        raise ParameterError(field, name, f"one of {', '.join(known)}")
    return name


def _described(plan: Plan, name: str, values: Sequence[Value]) -> AxisPublic:
    it = find_declaration(plan.wiring, name, plan.kind)
    return AxisPublic(name=name, title=it.title, unit=it.unit, kind=it.kind, values=list(values))


def axis_view(plan: Plan, name: str) -> AxisPublic:
    """Return an axis with its labels."""
    return _described(plan, name, plan.axis(name).values)


def fixed_views(plan: Plan) -> list[AxisPublic]:
    """Return the parameters that are the same in all runs, each as an axis of one value."""
    return [_described(plan, name, (value,)) for name, value in plan.values.items()]


def _map(tracker: str, one: CellMap) -> MapPublic:
    judged = zip(one.successes.ravel().tolist(), one.judged.ravel(), strict=True)
    successes = [value if known else None for value, known in judged]
    return MapPublic.model_validate({**vars(one), "tracker": tracker, "successes": successes})


def session_spec(store: Store, sweep: str, plan: Plan, results: Results, run: int, tracker: str | None) -> SessionSpec:
    """Return the spec of a session with one run of a sweep, or the same run with another method.

    The session begins at a held frame shortly before the first lost one; with another method that loses nothing, before
    the row's first loss. It is computed to ten frames after the loss, so that its cause can be asked at once.

    Raises:
        ApiError: The run does not exist (404).
        RefusedError: The method is unknown.
        ConflictError: The run could not be computed, or its recording no longer exists.
    """
    row = results.row(run)
    if row.problem is not None:
        raise ConflictError(f"This run could not be computed: {row.problem}.")
    method = tracker or row.tracker
    _one_of(plan.wiring.trackers, method, "tracker")
    single = plan.single(run)
    loss, last = _loss(plan, results, row, method), plan.frames - 1
    position, computed = (0, 0) if loss is None else (min(approach(loss), last), min(loss + APPROACH_FRAMES, last))
    recipe = single.recipe.model_copy(update={"tracker": method})
    upload = None if plan.footage is None else upload_of(store, plan.footage, "sweep").id
    return new_spec(recipe, sweep=sweep, upload=upload, position=position, computed=computed)


def upload_of(store: Store, footage: Footage, user: str) -> UploadRow:
    """Return the upload with the content of a clip.

    Args:
        store: Holds the uploads.
        footage: The clip, by its hash.
        user: Name for the message of what needs the clip: "run" or "sweep".

    Raises:
        ConflictError: The clip is not on this server.
    """
    found = store.upload_of(footage.sha256 or "")
    if found is None:
        clip = f"the clip {footage.name}" if footage.name else "a clip"
        raise ConflictError(f"This {user} needs {clip}, which is not on this server. Upload it first.")
    return found


def _loss(plan: Plan, results: Results, row: RowPublic, method: str) -> int | None:
    """Return the first lost frame of the opened run; if it loses nothing, that of the row."""
    if method == row.tracker or method not in plan.trackers:
        return row.first_lost_frame
    twin = row.run + plan.trackers.index(method) - plan.trackers.index(row.tracker)
    other = results.row(twin).first_lost_frame
    return row.first_lost_frame if other is None else other
