"""Answers about a sweep: the library's counts with titles and units added, as JSON numbers."""

import math

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.parameters import Value, declarations
from pftrack.sweep import Comparison, Plan
from pftrack.sweep.cells import CellMap, Code
from pftrack_server.schemas.sweep_views import (
    AxisPublic,
    CellsPublic,
    ComparisonPublic,
    Correction,
    MapPublic,
    Pair,
    Verdict,
)

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
