"""Quantities: what the trackers of a sweep are compared by, and the values that the runs have of one.

They are success, the error, and every measure that the experiment declares. What is shown of one, tested and written
down is the same wherever a sweep is looked at: on its page, in its report, and by who asks the library.
"""

from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from pftrack.sweep import arrow
from pftrack.sweep.cells import CellMap
from pftrack.sweep.counts import count, floats, nulls, row_places
from pftrack.sweep.errors import SweepError
from pftrack.sweep.plan import Plan
from pftrack.sweep.result import Result

__all__ = ["COMMON", "Quantity", "Samples", "quantities", "quantity_named", "samples"]

COMMON = SUCCESS, ERROR = "success", "error"
"""Names of the quantities that do not hang on the experiment: no measure may be called so."""


@dataclass(frozen=True, slots=True)
class Quantity:
    """Something that every run has one number of, unless it lacks what that needs.

    Attributes:
        name: "success", "error", or that of a measure.
        title: What it is, a few words.
        description: Its definition, one sentence.
        unit: Of the number; empty for a share, 0..1, or a pure number.
        better: Whether a "higher" or a "lower" number is better.
        share: Whether it is between 0 and 1.
        column: Of the sweep's table.
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
        """Title and unit, as an axis or a column says them."""
        return f"{self.title}, {self.unit}" if self.unit else self.title

    def means(self, cells: CellMap) -> NDArray[np.float64]:
        """Return the mean over the runs of each cell, NaN where none has it."""
        match self.name:
            case "success":
                return cells.rate
            case "error":
                return cells.mean_error
            case _:
                return cells.measures[self.name]

    def gain(self, first: NDArray[np.float64], second: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return by how much the first numbers are better than the second."""
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

    values: dict[str, list[NDArray[np.float64]]]
    scenes: dict[str, list[NDArray[np.int64]]]
    shape: tuple[int, ...]


def quantities(plan: Plan) -> tuple[Quantity, ...]:
    """Return what the trackers of a sweep can be compared by: success, the error, and the measures as declared."""
    judged = plan.wiring.judges_loss
    error = "Mean error of successful runs" if judged else "Mean error"
    return (
        Quantity(
            SUCCESS, "Success rate", "Share of the runs that succeeded.", "", "higher", share=True, column=SUCCESS
        ),
        Quantity(
            ERROR,
            error,
            f"Mean over the frames of {'a run that succeeded' if judged else 'a run'}.",
            plan.wiring.unit,
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
        result: Of the sweep; one of an earlier version may lack a measure.
        quantity: Of the sweep.
        x: Name of the axis across; all values are pooled if None.
        y: Name of the axis down; all values are pooled if None.

    Raises:
        SweepError: The sweep has no such axis, both are the same, or its files are damaged.
    """
    plan, column = result.plan, quantity.column
    empty = count(plan, None, x, y)
    shape = empty.sums.shape[2:]
    wanted = ["run", "tracker", "success", column, *(name for name in (x, y) if name is not None)]
    places, scenes, values = [np.zeros(0, np.int64)], [np.zeros(0, np.int64)], [np.zeros(0)]
    for piece in result.pieces(list(dict.fromkeys(wanted))):
        if column not in piece.column_names:
            continue
        matters = ~nulls(piece, column)
        if quantity.successful:
            matters &= nulls(piece, "success") | (floats(arrow.compute.cast(piece["success"], arrow.float64())) > 0)
        places.append(row_places(plan, piece, empty.x, empty.y)[matters])
        # Runs are numbered by condition, trial and tracker, in this order.
        scenes.append(piece["run"].to_numpy()[matters] // len(plan.trackers))
        values.append(floats(arrow.compute.cast(piece[column], arrow.float64()))[matters])
    place, scene, value = np.concatenate(places), np.concatenate(scenes), np.concatenate(values)
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
