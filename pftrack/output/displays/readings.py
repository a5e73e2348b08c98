"""Readings in words: what is said of one frame in a line of figures, each with its unit.

An experiment declares its readings (`pftrack.core.model.plot`); a run has those that its tracker measures. A number
that is not known is a dash. Signals and shares are written to a thousandth, other quantities to a tenth.
"""

import math
from collections.abc import Callable, Sequence

from pftrack.core.model.diagnostics import Diagnostics
from pftrack.core.model.plot import Reading, ReadingKind
from pftrack.core.model.series import Interval, SeriesRole
from pftrack.experiments.experiment import Experiment

__all__ = ["MISSING", "format_reading", "quantity", "readings_of"]

MISSING = "–"
DECIMALS = {"": 3, "frames": 0}
"""Of quantities, by unit; one decimal in other units."""


def quantity(value: float | None, unit: str) -> str:
    """Return a number of a unit in words, without the unit."""
    if value is None or not math.isfinite(value):
        return MISSING
    is_count = not unit and value == int(value) and abs(value) > 1.0
    words = f"{value:.{0 if is_count else DECIMALS.get(unit, 1)}f}"
    return words if float(words) else words.removeprefix("-")


def readings_of(experiment: Experiment, rows: Sequence[Diagnostics]) -> tuple[Reading, ...]:
    """Return the readings of an experiment of which any of these frames has something."""
    return tuple(reading for reading in experiment.readings if _is_measured(experiment, reading, rows))


def format_reading(experiment: Experiment, reading: Reading, row: Diagnostics) -> str:
    """Return what a reading says of a frame."""
    return _SAYS[reading.kind](experiment, reading, row)


def _is_measured(experiment: Experiment, reading: Reading, rows: Sequence[Diagnostics]) -> bool:
    if reading.kind == "error":
        return any(row.error is not None for row in rows)
    if reading.kind == "particles":
        return any(_of_role(experiment, role, row) is not None for role in ("particles", "ess") for row in rows)
    if reading.kind == "samplers":
        names = _names(experiment, "share")
        return any(name in row.series for name in names for row in rows)
    return not reading.series or any(reading.series in row.series for row in rows)


def _names(experiment: Experiment, role: SeriesRole) -> list[str]:
    return [series.name for series in experiment.all_series() if series.role == role]


def _of_role(experiment: Experiment, role: SeriesRole, row: Diagnostics) -> float | None:
    values = (row.series.get(name) for name in _names(experiment, role))
    return next((float(value) for value in values if isinstance(value, int | float)), None)


def _several(values: Sequence[float], unit: str) -> str:
    return _with_unit(", ".join(quantity(value, unit) for value in values), unit)


def _with_unit(words: str, unit: str) -> str:
    return f"{words} {unit}" if unit and words != MISSING else words


def _particles(experiment: Experiment, _reading: Reading, row: Diagnostics) -> str:
    count, ess = (_of_role(experiment, role, row) for role in ("particles", "ess"))
    parts = (f"{count:g}" if count is not None else "", f"ESS {ess:.0f}" if ess is not None else "")
    return ", ".join(filter(None, parts)) or MISSING


def _samplers(experiment: Experiment, _reading: Reading, row: Diagnostics) -> str:
    for series in experiment.all_series():
        counts = row.vector(series.name) if series.role == "share" else None
        if counts is not None:
            used = [(name, count) for name, count in zip(series.components, counts, strict=False) if count > 0]
            return ", ".join(f"{name} {count:.0f}" for name, count in used) or MISSING
    return MISSING


def _value(_experiment: Experiment, reading: Reading, row: Diagnostics) -> str:
    spread = row.number(reading.sd) if reading.sd else math.nan
    words = quantity(row.number(reading.series), reading.unit)
    if math.isfinite(spread) and words != MISSING:
        words += f" ± {quantity(spread, reading.unit)}"
    return _with_unit(words, reading.unit)


def _interval(_experiment: Experiment, reading: Reading, row: Diagnostics) -> str:
    value = row.series.get(reading.series)
    if not isinstance(value, Interval):
        return MISSING
    ends = (quantity(end, reading.unit) for end in value)
    return _with_unit(" to ".join(ends), reading.unit)


def _count(_experiment: Experiment, reading: Reading, row: Diagnostics) -> str:
    flags = row.vector(reading.series)
    return f"{sum(flag == 1 for flag in flags)} of {len(flags)}" if flags else MISSING


def _most_probable(_experiment: Experiment, reading: Reading, row: Diagnostics) -> str:
    known = row.hypotheses(reading.series)
    if known is None or not known.weights:
        return MISSING
    best = max(range(len(known.weights)), key=known.weights.__getitem__)
    value = _with_unit(quantity(known.values[best][0], reading.unit), reading.unit)
    return f"{value}, {100 * known.weights[best]:.0f} %, one of {len(known.weights)}"


_SAYS: dict[ReadingKind, Callable[[Experiment, Reading, Diagnostics], str]] = {
    "estimate": lambda experiment, _, row: _several(row.estimate, experiment.unit),
    "sigma": lambda experiment, _, row: _several(row.sigma, experiment.unit),
    "error": lambda experiment, _, row: _with_unit(quantity(row.error, experiment.unit), experiment.unit),
    "evidence": lambda _experiment, _, row: f"{row.log_evidence:.2f}" if math.isfinite(row.log_evidence) else MISSING,
    "time": lambda _experiment, _, row: f"{row.step_ms:.2f} ms",
    "particles": _particles,
    "samplers": _samplers,
    "value": _value,
    "interval": _interval,
    "hypotheses": _most_probable,
    "count": _count,
}
