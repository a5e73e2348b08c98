"""Cells: what a map shows.

A map spans two axes; all other axes and the trials are pooled in its cells. Counts add up, so that a map can be filled
chunk by chunk: `count` one table, add, and `cells` makes rates, intervals and means of the sums.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import IntEnum
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from pftrack.core.numerics.statistics import chi_square, fisher_exact, holm, wilson
from pftrack.sweep.axis import Axis
from pftrack.sweep.counts import OF_MEASURE, SUMS, Counts, columns, count
from pftrack.sweep.result import Result

__all__ = [
    "CellMap",
    "Code",
    "Significance",
    "cells",
    "code_significance",
    "significance",
]

CONFIDENCE = 0.95

Correction: TypeAlias = Literal["none", "holm"]
Test: TypeAlias = Literal["chi-square", "fisher"]


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
        runs: How many runs there are.
        judged: How many of them have a verdict, success or not.
        successes: How many succeeded.
        rate: Of success, NaN where there is no verdict.
        low: Lower end of its 95 % Wilson interval.
        high: Upper end.
        mean_error: Of the successful runs, or of all where there are no verdicts; NaN where there are none.
        mean_lost_frames: Of all runs.
        problems: How many runs could not be computed.
        measures: Mean over all runs that have it, of each measure by its name; NaN where there are none.
    """

    x: Axis | None
    y: Axis | None
    runs: NDArray[np.int64]
    judged: NDArray[np.int64]
    successes: NDArray[np.int64]
    rate: NDArray[np.float64]
    low: NDArray[np.float64]
    high: NDArray[np.float64]
    mean_error: NDArray[np.float64]
    mean_lost_frames: NDArray[np.float64]
    problems: NDArray[np.int64]
    measures: Mapping[str, NDArray[np.float64]] = field(default_factory=dict)


@dataclass(frozen=True)
class Significance:
    """Which of two trackers is better in which cell; arrays (values of y, values of x).

    Attributes:
        codes: Of `Code`.
        p_values: As tested, adjusted if a correction was asked for; NaN where not applicable.
        effect: Difference of the success rates, or rank-biserial correlation; positive where the first is better.
    """

    codes: NDArray[np.uint8]
    p_values: NDArray[np.float64]
    effect: NDArray[np.float64]


def cells(source: Result | Counts, x: str | None = None, y: str | None = None) -> dict[str, CellMap]:
    """Return each tracker's cells.

    Args:
        source: A result, or counts that were added up already (then `x` and `y` are theirs).
        x: Name of the axis across; all values are pooled if None.
        y: Name of the axis down; all values are pooled if None.

    Raises:
        SweepError: The sweep has no such axis, or both are the same.
    """
    counts = source if isinstance(source, Counts) else _count(source, x, y)
    return {name: _map(counts, place) for place, name in enumerate(counts.plan.trackers)}


def significance(
    first: CellMap, second: CellMap, *, level: float = 0.01, correction: Correction = "none", test: Test = "chi-square"
) -> Significance:
    """Say in which cells one tracker succeeds more often than another.

    Args:
        first: Cells of one.
        second: Cells of the other, on the same axes.
        level: Of significance.
        correction: "holm" for the whole map at the level, "none" for every cell by itself, as Bando has it.
        test: "chi-square" as in Bando 2007, "fisher" for small counts too.
    """
    tested = chi_square if test == "chi-square" else fisher_exact
    p_values = tested(first.successes, first.judged, second.successes, second.judged)
    return code_significance(p_values, first.rate - second.rate, level=level, correction=correction)


def code_significance(
    p_values: NDArray[np.float64], effect: NDArray[np.float64], *, level: float = 0.01, correction: Correction = "none"
) -> Significance:
    """Say in which cells one tracker is better, of what a test came to.

    Args:
        p_values: Of each cell; NaN where the test is not applicable.
        effect: Positive where the first is better.
        level: Of significance.
        correction: See `significance`.
    """
    if correction == "holm":
        p_values = holm(p_values)
    codes = np.full(p_values.shape, Code.NOT_SIGNIFICANT, dtype=np.uint8)
    codes[np.isnan(p_values)] = Code.NOT_APPLICABLE
    significant = p_values < level
    codes[significant & (effect > 0)] = Code.FIRST_BETTER
    codes[significant & (effect < 0)] = Code.SECOND_BETTER
    return Significance(codes, p_values, effect)


def _count(result: Result, x: str | None, y: str | None) -> Counts:
    total = count(result.plan, None, x, y)
    for piece in result.pieces(columns(result.plan, x, y)):
        total += count(result.plan, piece, x, y)
    return total


def _map(counts: Counts, tracker: int) -> CellMap:
    of_tracker = counts.sums[:, tracker]
    sums: Mapping[str, NDArray[np.float64]] = dict(zip(SUMS, of_tracker, strict=False))
    names = [measure.name for measure in counts.plan.measures]
    low, high = wilson(sums["successes"], sums["judged"], CONFIDENCE)
    with np.errstate(invalid="ignore", divide="ignore"):
        rate = sums["successes"] / sums["judged"]
        mean_error, mean_lost = sums["error"] / sums["measured"], sums["lost"] / sums["counted"]
        means = of_tracker[len(SUMS) :: OF_MEASURE] / of_tracker[len(SUMS) + 1 :: OF_MEASURE]
    measures = dict(zip(names, means, strict=True))
    runs, judged, successes, problems = (
        sums[name].astype(np.int64) for name in ("runs", "judged", "successes", "problems")
    )
    return CellMap(
        counts.x, counts.y, runs, judged, successes, rate, low, high, mean_error, mean_lost, problems, measures
    )
