"""What a report is about: a result, the two axes its maps span, and every comparison of two trackers."""

from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np

from pftrack.measures import Measure
from pftrack.parameters import Value
from pftrack.sweep.axis import Axis, declared
from pftrack.sweep.cells import CellMap, Significance, cells, error_significance, significance
from pftrack.sweep.errors import SweepError
from pftrack.sweep.result import Result

__all__ = ["Comparison", "Study", "label", "shown"]

MOST_PAIRS = 6
"""With more trackers than four, each is compared with the first alone."""


@dataclass(frozen=True)
class Comparison:
    """Two trackers, cell by cell.

    Attributes:
        first: Name of one tracker.
        second: Name of the other.
        success: By the chi-square test, each cell by itself, as in document 1.
        success_holm: The same, corrected over the map.
        success_fisher: By Fisher's exact test, which small counts permit, corrected over the map.
        error: By the rank-sum test on successful runs, each cell by itself.
        error_holm: The same, corrected over the map.
    """

    first: str
    second: str
    success: Significance
    success_holm: Significance
    success_fisher: Significance
    error: Significance
    error_holm: Significance


@dataclass(frozen=True)
class Study:
    """A result and how it is looked at.

    Attributes:
        result: Of the sweep.
        x: Axis across the maps; None if nothing was varied.
        y: Axis down the maps; None if a single axis was varied.
        level: Of significance.
    """

    result: Result
    x: Axis | None
    y: Axis | None
    level: float

    @classmethod
    def of(cls, result: Result, *, x: str | None = None, y: str | None = None, level: float = 0.01) -> "Study":
        """Choose the axes: those named, or the first two with several numbers, in the order of the plan.

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
        return cls(result, across, down, level)

    @property
    def trackers(self) -> tuple[str, ...]:
        """Names of the trackers, in the order of the plan."""
        return self.result.plan.trackers

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
    def measures(self) -> tuple[Measure, ...]:
        """Those that any run has."""
        declared = self.result.plan.wiring.run_measures
        return tuple(
            it for it in declared if any(np.isfinite(one.measures[it.name]).any() for one in self.totals.values())
        )

    @cached_property
    def judged(self) -> bool:
        """Whether the experiment tells success from failure."""
        return any(total.judged.any() for total in self.totals.values())

    @cached_property
    def comparisons(self) -> tuple[Comparison, ...]:
        """Every pair of trackers, or each with the first where those would be too many."""
        pairs = list(combinations(self.trackers, 2))
        if len(pairs) > MOST_PAIRS:
            pairs = pairs[: len(self.trackers) - 1]
        return tuple(self._compared(first, second) for first, second in pairs)

    def by_axis(self, axis: Axis) -> dict[str, CellMap]:
        """Return each tracker's cells along one axis, all others pooled."""
        return cells(self.result, axis.name)

    def title(self, tracker: str) -> str:
        """Return what a tracker is called."""
        return self.result.plan.wiring.trackers[tracker].title

    def _compared(self, first: str, second: str) -> Comparison:
        one, other = self.maps[first], self.maps[second]
        return Comparison(
            first,
            second,
            significance(one, other, level=self.level),
            significance(one, other, level=self.level, correction="holm"),
            significance(one, other, level=self.level, correction="holm", test="fisher"),
            error_significance(self.result, first, second, *self.names, level=self.level),
            error_significance(self.result, first, second, *self.names, level=self.level, correction="holm"),
        )


def label(study: Study, axis: Axis) -> str:
    """Return what an axis is called, with its unit."""
    declaration = declared(study.result.plan.wiring, axis.name)
    return f"{declaration.title}, {declaration.unit}" if declaration.unit else declaration.title


def shown(value: Value) -> str:
    """Return a value as a tick or a table shows it."""
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:g}" if isinstance(value, float) else str(value)
