"""Signals: what a frame's own numbers say of whether the target is lost, without a look at the truth.

Everything is read from the rows of a run by what columns and series are declared to be, so that it is there of every
tracker, of those of other packages, and of runs that were saved long ago:

| signal | what it is |
|---|---|
| evidence | log evidence of the frame |
| spread | logarithm of the standard deviation, the root mean square of all components |
| step | ln(1 + distance of the estimate from the one before, in these deviations) |
| jump | ln(1 + distance of the estimate from where its last two put it, in these deviations) |
| searching | 1 where the tracker looks for its target, by its own account |
| ess | logarithm of the effective sample size over the number of particles, by the roles "ess" and "particles" |

and, under its name, each series of the role "share" (share of the first component), "flag" (mean of the flags), "event"
(1 where it happened), "extent" (logarithm of the area), "resampled", "likeness" and "model_likeness" (the number), and
what else of its series an experiment names: the number, the mean of a vector's components, of hypotheses one less the
sum of the squared weights (Gini's index).
"""

import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from pftrack.core.arrays import Floats
from pftrack.core.model.series import Hypotheses, Series, SeriesRole, SeriesValue
from pftrack.core.model.tracker import Diagnostics
from pftrack.core.numerics.elementary import logarithm

LEAST = 1e-9
"""What is smaller counts as this before its logarithm is taken."""

FARTHEST = 700.0
"""A log evidence counts as no further from zero."""

CUSTOMARY = ("resampled", "share", "flag", "event", "extent", "likeness", "model_likeness")
"""Roles of the series that are signals of every tracker that has them."""


def signal_names(series: Sequence[Series], *, searches: bool, more: Sequence[str] = ()) -> tuple[str, ...]:
    """Return the signals of a tracker.

    Args:
        series: That it declares.
        searches: Whether it may look for its target by its own account.
        more: Names of further series of these that are signals.
    """
    roles = {one.role for one in series}
    known = ["evidence", "spread", "step", "jump"]
    known += ["searching"] if searches else []
    known += ["ess"] if {"ess", "particles"} <= roles else []
    return (*known, *(one.name for one in series if one.role in CUSTOMARY or one.name in more))


def read_signals(
    names: Sequence[str],
    series: Mapping[str, Series],
    rows: Sequence[Diagnostics],
    before: Sequence[tuple[float, ...]] = (),
) -> Floats:
    """Return the signals of some frames, (L, S), NaN where one is not known.

    Args:
        names: Of the signals.
        series: All that may be in the rows, by name.
        rows: Of consecutive frames.
        before: Estimates of the frames before these, two at most.
    """
    by_role = {one.role: one.name for one in series.values()}
    deviations = np.maximum([_deviation(row) for row in rows], LEAST)
    steps, jumps = _moves([*before, *(row.estimate for row in rows)], len(rows))
    columns: dict[str, Floats] = {}
    for name in names:
        match name:
            case "evidence":
                columns[name] = np.clip([row.log_evidence for row in rows], -FARTHEST, FARTHEST)
            case "spread":
                columns[name] = _logarithm(deviations)
            case "step":
                columns[name] = _logarithm(1.0 + steps / deviations)
            case "jump":
                columns[name] = _logarithm(1.0 + jumps / deviations)
            case "searching":
                columns[name] = np.array([math.nan if row.searching is None else row.searching for row in rows], float)
            case "ess":
                some = [(row.number(by_role["ess"]), row.number(by_role["particles"])) for row in rows]
                columns[name] = _logarithm([size / count if count else math.nan for size, count in some])
            case _:
                numbers = [_number(series[name], row.series.get(name)) for row in rows]
                columns[name] = _logarithm(numbers) if series[name].role == "extent" else np.array(numbers)
    return np.column_stack([columns[name] for name in names])


def _logarithm(values: Sequence[float] | Floats) -> Floats:
    """Return ln of numbers that are not negative; NaN stays what it is."""
    return np.where(np.isnan(values), np.nan, logarithm(np.maximum(values, LEAST)))


def _deviation(row: Diagnostics) -> float:
    known = [value for value in row.sigma if math.isfinite(value)]
    return math.sqrt(math.fsum(value * value for value in known) / len(known)) if known else math.nan


def _moves(estimates: Sequence[tuple[float, ...]], count: int) -> tuple[Floats, Floats]:
    """Return how far the last `count` estimates are from the one before, and from where the last two put each; or 0."""
    moves = []
    for place in range(len(estimates) - count, len(estimates)):
        now, last, earlier = (estimates[max(place - back, 0)] for back in range(3))
        step = math.sqrt(math.fsum((a - b) * (a - b) for a, b in zip(now, last, strict=True)))
        bend = ((a - 2.0 * b + c) for a, b, c in zip(now, last, earlier, strict=True))
        moves.append((step, math.sqrt(math.fsum(value * value for value in bend)) if place > 1 else 0.0))
    steps, jumps = np.array(moves).T
    return np.nan_to_num(steps), np.nan_to_num(jumps)


def _number(series: Series, value: SeriesValue | None) -> float:
    if isinstance(value, Hypotheses):
        return 1.0 - math.fsum(weight * weight for weight in value.weights)
    given = value if isinstance(value, tuple) else () if value is None else (value,)
    numbers = [float(one) for one in given if math.isfinite(one)]
    return _AS_ROLE.get(series.role, _mean)(numbers) if numbers else math.nan


def _mean(numbers: Sequence[float]) -> float:
    return math.fsum(numbers) / len(numbers)


_AS_ROLE: Mapping[SeriesRole, Callable[[Sequence[float]], float]] = {
    "share": lambda numbers: numbers[0] / max(math.fsum(numbers), LEAST),
    "event": lambda numbers: float(numbers[0] > 0.0),
    "extent": math.prod,
}
"""What becomes of the numbers of a series, by its role; of all others, their mean."""
