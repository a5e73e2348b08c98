"""Counts: the runs of a sweep added up by tracker and cell.

Sums add up, so that a map can be filled chunk by chunk; `cells` makes rates, intervals and means of them.
"""

from dataclasses import dataclass
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from pftrack.sweep import arrow
from pftrack.sweep.axis import Axis
from pftrack.sweep.errors import SweepError
from pftrack.sweep.plan import Plan

__all__ = ["OF_MEASURE", "SUMS", "Counts", "columns", "count", "floats", "nulls", "row_places"]

SUMS = ("runs", "judged", "successes", "measured", "error", "lost", "counted", "problems")
"""What is added up: runs; runs with a verdict and those that succeeded; runs whose error counts and their errors; lost
frames and the runs that know them; runs with a problem."""

COLUMNS = ("tracker", "success", "mean_error", "lost_frames", "problem")

OF_MEASURE = 2
"""After those, for each measure of the experiment: the sum over the runs that have it, and how many these are."""


@dataclass(frozen=True)
class Counts:
    """Sums over runs by tracker and cell.

    Attributes:
        plan: Of the sweep.
        x: Axis across, or None for a single column.
        y: Axis down, or None for a single row.
        sums: (sums, trackers, values of y, values of x), in the order of `SUMS`, then those of the measures.
    """

    plan: Plan
    x: Axis | None
    y: Axis | None
    sums: NDArray[np.float64]

    def __add__(self, other: "Counts") -> "Counts":
        return Counts(self.plan, self.x, self.y, self.sums + other.sums)


def count(plan: Plan, table: arrow.Table | None, x: str | None, y: str | None = None) -> Counts:
    """Add up the runs of a table by tracker and cell.

    Args:
        plan: Of the sweep.
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
    measures = plan.measures
    sums = np.zeros((len(SUMS) + OF_MEASURE * len(measures), *shape))
    if table is not None and len(table):
        place = row_places(plan, table, across, down)
        success = table["success"]
        judged, succeeded = (
            (~nulls(table, "success")).astype(float),
            floats(arrow.compute.cast(success, arrow.float64())),
        )
        error = floats(table["mean_error"])
        matters = ~nulls(table, "mean_error") & ((succeeded > 0) | (judged == 0))
        weights = (
            np.ones(len(table)),
            judged,
            succeeded,
            matters.astype(float),
            np.where(matters, error, 0.0),
            floats(arrow.compute.cast(table["lost_frames"], arrow.float64())),
            (~nulls(table, "lost_frames")).astype(float),
            (~nulls(table, "problem")).astype(float),
            *chain.from_iterable(_weights(table, measure.name) for measure in measures),
        )
        size = int(np.prod(shape))
        for index, weight in enumerate(weights):
            sums[index] = np.bincount(place, weight, size).reshape(shape)
    return Counts(plan, across, down, sums)


def columns(plan: Plan, x: str | None, y: str | None) -> list[str]:
    """Return the columns that `count` reads; a result of an earlier version lacks some of the measures'."""
    measures = (measure.name for measure in plan.measures)
    return [*COLUMNS, *(name for name in (x, y) if name is not None), *measures]


def row_places(plan: Plan, table: arrow.Table, x: Axis | None, y: Axis | None) -> NDArray[np.int64]:
    """Return for each row its flat index among tracker, y and x."""
    place = _index(table["tracker"], arrow.array(plan.trackers, arrow.string()))
    for axis in (y, x):
        if axis is not None:
            column = table[axis.name]
            place = place * len(axis.values) + _index(column, arrow.array(axis.values, column.type))
    return place


def _index(column: arrow.Array, values: arrow.Array) -> NDArray[np.int64]:
    found: NDArray[np.int64] = arrow.compute.index_in(column, value_set=values).to_numpy().astype(np.int64)
    return found


def _weights(table: arrow.Table, measure: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return for each row its value of a measure, 0 where there is none, and 1 where there is one."""
    if measure not in table.column_names:  # a table of an earlier version
        return np.zeros(len(table)), np.zeros(len(table))
    return floats(table[measure]), (~nulls(table, measure)).astype(float)


def nulls(table: arrow.Table, name: str) -> NDArray[np.bool_]:
    """Return which rows have no value in a column."""
    missing: NDArray[np.bool_] = arrow.compute.is_null(table[name]).to_numpy()
    return missing


def floats(column: arrow.Array) -> NDArray[np.float64]:
    """Return a column as numbers, 0 where there is none."""
    numbers: NDArray[np.float64] = arrow.compute.fill_null(column, 0.0).to_numpy()
    return numbers
