"""Cells of a map; the counts behind them; the quantities, and comparisons of trackers by them.

A map spans two axes; all other axes and the trials are pooled in its cells. Counts add up, so that a map can be filled
chunk by chunk: `count` one table, add, and `cells` makes rates, intervals and means of the sums.

A quantity is success, the error, or any measure that the experiment declares. Its display, tests and tables are the
same on a sweep's page, in its report, and for code that uses the library.

Two trackers are compared by one quantity, cell by cell. A map shows the difference of the means. Both trackers saw the
same scenes, so the difference within pairs of runs, scene by scene, is more precise than either mean; its interval
shows the precision. The tests are of these pairs: McNemar's of success, the signed-rank test of all else. Those of
Bando 2007, ch. 3 sections 3.1 and 3.2, chi-square and rank-sum, take runs for independent; his figures need them.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import IntEnum
from functools import partial
from itertools import pairwise
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Floats, Ints
from pftrack.core.numerics import statistics
from pftrack.sweep import arrow
from pftrack.sweep.axis import Axis, SweepError
from pftrack.sweep.journal import Result
from pftrack.sweep.plan import Plan


@dataclass(frozen=True)
class Counts:
    """Sums over runs by tracker and cell.

    Attributes:
        plan: Plan of the sweep.
        x: Axis across, or None for a single column.
        y: Axis down, or None for a single row.
        sums: (trackers, values of y, values of x) each, by name: `runs` counts all; `NAME_count` and `NAME_sum` are
            of those that have a value in a column.
    """

    plan: Plan
    x: Axis | None
    y: Axis | None
    sums: Mapping[str, Floats]

    def __add__(self, other: "Counts") -> "Counts":
        return Counts(self.plan, self.x, self.y, {name: it + other.sums[name] for name, it in self.sums.items()})


def count(plan: Plan, table: arrow.Table | None, x: str | None, y: str | None = None) -> Counts:
    """Add up the runs of a table by tracker and cell.

    Args:
        plan: Plan of the sweep.
        table: Some of its rows; none gives sums of zero to begin with.
        x: Name of the axis across; all values are pooled if None.
        y: Name of the axis down; all values are pooled if None.

    Raises:
        SweepError: The sweep has no such axis, or both are the same.
    """
    if x is not None and x == y:
        raise SweepError(f"a map needs two different axes, got {x} twice")
    across, down = (None if name is None else plan.axis(name) for name in (x, y))
    shape = len(plan.trackers), len(down.values) if down else 1, len(across.values) if across else 1
    summed = ("success", "mean_error", "lost_frames", *(measure.name for measure in plan.measures))
    names = ("runs", "problem_count", *(f"{name}_{how}" for name in summed for how in ("count", "sum")))
    sums = {name: np.zeros(int(np.prod(shape))) for name in names}
    if table is not None and len(table):
        known = [name for name in summed if name in table.column_names]  # an earlier version lacks some measures
        how = [(name, each) for name in known for each in ("count", "sum")]
        # One whole number a cell groups seven times faster than a text and two numbers.
        placed = _of_successes(table).append_column("place", arrow.array(row_places(plan, table, across, down)))
        found = placed.group_by("place", use_threads=False).aggregate([*how, ("problem", "count"), ([], "count_all")])
        places = found["place"].to_numpy()
        for name, each in sums.items():
            column = "count_all" if name == "runs" else name
            if column in found.column_names:
                each[places] = floats(found[column])
    return Counts(plan, across, down, {name: it.reshape(shape) for name, it in sums.items()})


def count_result(result: Result, x: str | None, y: str | None = None) -> Counts:
    """Add up all runs of a result by tracker and cell; see `count`."""
    total = count(result.plan, None, x, y)
    for piece in result.pieces(columns(result.plan, x, y)):
        total += count(result.plan, piece, x, y)
    return total


def columns(plan: Plan, x: str | None, y: str | None) -> list[str]:
    """Return the columns that `count` reads; a result of an earlier version lacks some of the measures'."""
    measures = (measure.name for measure in plan.measures)
    return [*COLUMNS, *(name for name in (x, y) if name is not None), *measures]


COLUMNS = ("tracker", "success", "mean_error", "lost_frames", "problem")


def _of_successes(table: arrow.Table) -> arrow.Table:
    """Return a table in which runs that failed have no error."""
    counts = arrow.compute.fill_null(table["success"], True)
    errors = arrow.compute.if_else(counts, table["mean_error"], arrow.scalar(None, table["mean_error"].type))
    return table.set_column(table.column_names.index("mean_error"), "mean_error", errors)


def row_places(plan: Plan, table: arrow.Table, x: Axis | None, y: Axis | None) -> Ints:
    """Return for each row its flat index among tracker, y and x."""
    place = _index(table["tracker"], arrow.array(plan.trackers, arrow.string()))
    for axis in (y, x):
        if axis is not None:
            column = table[axis.name]
            place = place * len(axis.values) + _index(column, arrow.array(axis.values, column.type))
    return place


def _index(column: arrow.Array, values: arrow.Array) -> Ints:
    found: Ints = arrow.compute.index_in(column, value_set=values).to_numpy().astype(np.int64)
    return found


def floats(column: arrow.Array) -> Floats:
    """Return a column as numbers, 0 where there is none."""
    numbers: Floats = arrow.compute.fill_null(arrow.compute.cast(column, arrow.float64()), 0.0).to_numpy()
    return numbers


CONFIDENCE = 0.95

Correction: TypeAlias = Literal["none", "holm"]


class Code(IntEnum):
    """The four colours of a significance map (Bando 2007, fig. 3.6)."""

    NOT_APPLICABLE = 0
    NOT_SIGNIFICANT = 1
    FIRST_BETTER = 2
    SECOND_BETTER = 3


@dataclass(frozen=True)
class CellMap:
    """One tracker's cells; every array is (values of y, values of x).

    Attributes:
        x: Axis across, or None for a single column.
        y: Axis down, or None for a single row.
        runs: Number of runs.
        judged: Number of runs with a verdict, success or not.
        successes: Number of successes.
        rate: Rate of success, NaN without a verdict.
        low: Lower end of its 95 % Wilson interval.
        high: Upper end.
        mean_error: Mean over the successful runs, or over all without verdicts; NaN without runs.
        mean_lost_frames: Mean over all runs.
        problems: Number of runs that could not be computed.
        measures: Mean over all runs that have it, of each measure by its name; NaN where there are none.
    """

    x: Axis | None
    y: Axis | None
    runs: Ints
    judged: Ints
    successes: Ints
    rate: Floats
    low: Floats
    high: Floats
    mean_error: Floats
    mean_lost_frames: Floats
    problems: Ints
    measures: Mapping[str, Floats] = field(default_factory=dict)


@dataclass(frozen=True)
class Significance:
    """The better of two trackers in each cell; arrays (values of y, values of x).

    Attributes:
        codes: Values of `Code`.
        p_values: As tested, adjusted if a correction was asked for; NaN where not applicable.
    """

    codes: NDArray[np.uint8]
    p_values: Floats


def cells(source: Result | Counts, x: str | None = None, y: str | None = None) -> dict[str, CellMap]:
    """Return each tracker's cells.

    Args:
        source: A result, or counts that were added up already (then `x` and `y` are theirs).
        x: Name of the axis across; all values are pooled if None.
        y: Name of the axis down; all values are pooled if None.

    Raises:
        SweepError: The sweep has no such axis, or both are the same.
    """
    counts = source if isinstance(source, Counts) else count_result(source, x, y)
    return {name: _map(counts, place) for place, name in enumerate(counts.plan.trackers)}


def summary(result: Result) -> dict[str, Any]:
    """Return the runs, those with a problem, and the success rate over all and by tracker; rates null if not judged."""
    totals = cells(result)
    judged, successes = (
        {name: int(getattr(one, which)[0, 0]) for name, one in totals.items()} for which in ("judged", "successes")
    )
    total = sum(judged.values())
    return {
        "runs": sum(int(one.runs[0, 0]) for one in totals.values()),
        "problems": sum(int(one.problems[0, 0]) for one in totals.values()),
        "success_rate": sum(successes.values()) / total if total else None,
        "success_rate_by_tracker": {name: successes[name] / count if count else None for name, count in judged.items()},
    }


def _map(counts: Counts, tracker: int) -> CellMap:
    sums = {name: it[tracker] for name, it in counts.sums.items()}
    low, high = statistics.wilson(sums["success_sum"], sums["success_count"], CONFIDENCE)
    names = ("success", "mean_error", "lost_frames", *(measure.name for measure in counts.plan.measures))
    with np.errstate(invalid="ignore", divide="ignore"):
        means = {name: sums[f"{name}_sum"] / sums[f"{name}_count"] for name in names}
    runs, judged, successes, problems = (
        sums[name].astype(np.int64) for name in ("runs", "success_count", "success_sum", "problem_count")
    )
    rate, error, lost = (means.pop(name) for name in names[:3])
    return CellMap(counts.x, counts.y, runs, judged, successes, rate, low, high, error, lost, problems, means)


COMMON = SUCCESS, ERROR = "success", "error"
"""Names of the quantities that do not hang on the experiment: no measure may be called so."""


@dataclass(frozen=True, slots=True)
class Quantity:
    """Something that every run has one number of, unless it lacks what that needs.

    Attributes:
        name: "success", "error", or that of a measure.
        title: Its title, a few words.
        description: Its definition, one sentence.
        unit: Unit of the number; empty for a share, 0..1, or a pure number.
        better: Whether a "higher" or a "lower" number is better.
        share: Whether it is between 0 and 1.
        column: Column of the sweep's table.
        successful: Whether the runs that failed are left out.
    """

    name: str
    title: str
    description: str
    unit: str
    better: Literal["higher", "lower"]
    share: bool
    column: str
    successful: bool = False

    @property
    def label(self) -> str:
        """Title and unit, as on an axis or a column."""
        return f"{self.title}, {self.unit}" if self.unit else self.title

    def means(self, cells: CellMap) -> Floats:
        """Return the mean over the runs of each cell, NaN where none has it."""
        match self.name:
            case "success":
                return cells.rate
            case "error":
                return cells.mean_error
            case _:
                return cells.measures[self.name]

    def gain(self, first: Floats, second: Floats) -> Floats:
        """Return the advantage of the first numbers over the second."""
        return first - second if self.better == "higher" else second - first


@dataclass(frozen=True)
class Samples:
    """The values of a quantity that the runs of every cell have; cells are in row-major order, y before x.

    Attributes:
        values: By tracker, (n,) for each cell, by number of the run.
        scenes: By tracker, (n,) for each cell: the scenes that these runs met. Runs of different trackers with the same
            number met the same scene.
        shape: (values of y, values of x).
    """

    values: dict[str, list[Floats]]
    scenes: dict[str, list[Ints]]
    shape: tuple[int, ...]


def quantities(plan: Plan) -> tuple[Quantity, ...]:
    """Return what the trackers of a sweep can be compared by: success, the error, and the measures as declared."""
    judged = plan.wiring.judge.has_loss
    error = "Mean error of successful runs" if judged else "Mean error"
    return (
        Quantity(
            SUCCESS, "Success rate", "Share of the runs that succeeded.", "", "higher", share=True, column=SUCCESS
        ),
        Quantity(
            ERROR,
            error,
            f"Mean over the frames of {'a run that succeeded' if judged else 'a run'}.",
            plan.wiring.judge.unit,
            "lower",
            share=False,
            column="mean_error",
            successful=True,
        ),
        *(
            Quantity(it.name, it.title, it.description, it.unit, it.better, share=it.how == "share", column=it.name)
            for it in plan.measures
        ),
    )


def quantity_named(plan: Plan, name: str) -> Quantity:
    """Return a quantity by name.

    Raises:
        SweepError: The sweep has none of that name.
    """
    known = {quantity.name: quantity for quantity in quantities(plan)}
    if name not in known:
        raise SweepError(f"the sweep has no measure {name!r}; it has {', '.join(known)}")
    return known[name]


def samples(result: Result, quantity: Quantity, x: str | None, y: str | None = None) -> Samples:
    """Return the values of a quantity by tracker and cell.

    Args:
        result: Result of the sweep; one of an earlier version may lack a measure.
        quantity: Quantity of the sweep.
        x: Name of the axis across; all values are pooled if None.
        y: Name of the axis down; all values are pooled if None.

    Raises:
        SweepError: The sweep has no such axis, both are the same, or its files are damaged.
    """
    plan, column = result.plan, quantity.column
    empty = count(plan, None, x, y)
    shape = empty.sums["runs"].shape[1:]
    wanted = ["run", "tracker", "success", column, *(name for name in (x, y) if name is not None)]
    parts = [(np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros(0))]
    for piece in result.pieces(list(dict.fromkeys(wanted))):
        if column not in piece.column_names:
            continue
        known = _of_successes(piece) if quantity.successful else piece
        known = known.filter(arrow.compute.is_valid(known[column]))
        # Runs are numbered by condition, trial and tracker, in this order.
        scenes = known["run"].to_numpy() // len(plan.trackers)
        parts.append((row_places(plan, known, empty.x, empty.y), scenes, floats(known[column])))
    place, scene, value = (np.concatenate(each) for each in zip(*parts, strict=True))
    order = np.argsort(place, kind="stable")
    width = int(np.prod(shape))
    edges = np.searchsorted(place[order], np.arange(width * len(plan.trackers) + 1))
    cells = [order[start:stop] for start, stop in pairwise(edges)]
    mine = {name: cells[index * width : (index + 1) * width] for index, name in enumerate(plan.trackers)}
    return Samples(
        {name: [value[rows] for rows in found] for name, found in mine.items()},
        {name: [scene[rows] for rows in found] for name, found in mine.items()},
        shape,
    )


UsedTest: TypeAlias = Literal["chi-square", "rank-sum", "mcnemar", "signed-rank"]

TEST_TITLES: dict[UsedTest, str] = {
    "mcnemar": "Exact McNemar",
    "signed-rank": "Signed-rank",
    "chi-square": "Chi-square",
    "rank-sum": "Rank-sum",
}
"""Names of the tests; "test" follows."""


@dataclass(frozen=True)
class Paired:
    """Differences between runs on the same scenes; every array is (values of y, values of x).

    Attributes:
        mean: Positive where the first tracker is better; NaN without pairs.
        low: Lower end of its 95 % interval, NaN where that is not applicable.
        high: Upper end.
        pairs: Number of scenes with the quantity in both runs.
    """

    mean: Floats
    low: Floats
    high: Floats
    pairs: Ints


@dataclass(frozen=True)
class Comparison:
    """Two trackers by one quantity; every array is (values of y, values of x).

    Attributes:
        quantity: By what.
        first: Name of one tracker.
        second: Name of the other.
        difference: Difference of the means over the runs that have the quantity, positive where the first is better.
        paired: Difference within pairs on the same scenes.
        test: The one that was used.
        p_values: As tested; NaN where not applicable.
        effect: Difference of the success rates, or rank-biserial correlation; positive where the first is better.
    """

    quantity: Quantity
    first: str
    second: str
    difference: Floats
    paired: Paired
    test: UsedTest
    p_values: Floats
    effect: Floats

    def significance(self, level: float = 0.01, correction: Correction = "none") -> Significance:
        """Mark the cells in which one tracker is better.

        Args:
            level: Level of significance.
            correction: "holm" for the whole map at the level, "none" for every cell by itself, as Bando has it.
        """
        p_values = statistics.holm(self.p_values) if correction == "holm" else self.p_values
        codes = np.full(p_values.shape, Code.NOT_SIGNIFICANT, dtype=np.uint8)
        codes[np.isnan(p_values)] = Code.NOT_APPLICABLE
        significant = p_values < level
        codes[significant & (self.effect > 0)] = Code.FIRST_BETTER
        codes[significant & (self.effect < 0)] = Code.SECOND_BETTER
        return Significance(codes, p_values)


def compare(
    quantity: Quantity,
    maps: Mapping[str, CellMap],
    samples: Samples,
    first: str,
    second: str,
    *,
    test: UsedTest = "mcnemar",
) -> Comparison:
    """Compare two trackers by a quantity.

    Runs on the same scenes are tested in pairs: success by McNemar's test, all else by the signed-rank test, the error
    where both succeeded, a measure where both have it. Bando's tests, on request, have all runs of both.

    Args:
        quantity: Quantity of the sweep.
        maps: Cells of its trackers.
        samples: The quantity's, on the same axes.
        first: Name of one tracker.
        second: Name of the other.
        test: Test: "chi-square" or "rank-sum" for those of Bando 2007, any other for the paired ones.

    Raises:
        SweepError: The sweep has no such tracker.
    """
    for name in (first, second):
        if name not in maps:
            raise SweepError(f"the sweep has no tracker {name!r}; it has {', '.join(maps)}")
    one, other = maps[first], maps[second]
    difference = quantity.gain(quantity.means(one), quantity.means(other))
    pairs = [*map(_on_the_same, *(it[name] for name in (first, second) for it in (samples.values, samples.scenes)))]
    gains = [quantity.gain(*pair) for pair in pairs]
    won, lost = (np.array([int((sign * each > 0).sum()) for each in gains]).reshape(samples.shape) for sign in (1, -1))
    paired = _paired(quantity, gains, won, lost)
    made = partial(Comparison, quantity, first, second, difference, paired)
    is_published = test in {"chi-square", "rank-sum"}
    if quantity.name == "success" and is_published:
        counts = (one.successes, one.judged, other.successes, other.judged)
        return made("chi-square", statistics.chi_square(*counts), difference)
    if quantity.name == "success":
        return made("mcnemar", np.where(paired.pairs > 0, statistics.mcnemar(won, lost), np.nan), paired.mean)
    ranked = statistics.signed_rank
    if is_published:
        pairs, ranked = [*zip(samples.values[first], samples.values[second], strict=True)], statistics.rank_sum
    found = [ranked(*pair) for pair in pairs]
    # The effect is positive where the first values are smaller.
    p_values, effect = (
        np.array([getattr(each, name) for each in found]).reshape(samples.shape)
        for name in ("p_value", "rank_biserial")
    )
    effect = -effect if quantity.better == "higher" else effect
    return made("rank-sum" if is_published else "signed-rank", p_values, effect)


def _on_the_same(first: Floats, scenes: Ints, second: Floats, other_scenes: Ints) -> tuple[Floats, Floats]:
    """Return the values of runs on the scenes that both lists have."""
    _, in_first, in_second = np.intersect1d(scenes, other_scenes, assume_unique=True, return_indices=True)
    return first[in_first], second[in_second]


def _paired(quantity: Quantity, gains: Sequence[Floats], won: Ints, lost: Ints) -> Paired:
    pairs = np.array([len(each) for each in gains], dtype=np.int64).reshape(won.shape)
    mean = np.array([each.mean() if len(each) else np.nan for each in gains]).reshape(won.shape)
    if quantity.name == "success":
        return Paired(mean, *statistics.paired_rate_interval(won, lost, pairs, CONFIDENCE), pairs)
    deviation = np.array([_deviation(each) for each in gains]).reshape(won.shape)
    return Paired(mean, *statistics.paired_mean_interval(mean, deviation, pairs, CONFIDENCE), pairs)


def _deviation(values: Floats) -> float:
    if len(values) < 2:
        return np.nan
    # Differences of shares that are equal differ in their last digits.
    return 0.0 if np.allclose(values, values[0], rtol=1e-9, atol=1e-12) else float(values.std(ddof=1))
