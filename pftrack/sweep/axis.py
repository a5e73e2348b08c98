"""Axes: the parameters that a sweep varies, and their values.

An axis is a declared parameter of the scene or of the tracker, live or not, or `tracker`. It is written as
`name=start:stop:step`, with both ends included if they lie on the grid, or as `name=a,b,c`. Numbers are read as
decimals, so that the fourth value of `0:1:0.1` is exactly 0.3, however it is written.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from decimal import Decimal, InvalidOperation
from difflib import get_close_matches
from math import inf
from typing import Self

from pftrack.core.model.parameters import LONGEST_FILE, Declaration, Value, declarations, describe_allowed, parse
from pftrack.core.model.source import Kind
from pftrack.core.refusal import ParameterError
from pftrack.experiments.experiment import Experiment


class SweepError(Exception):
    """A sweep that cannot be made, resumed or read; the message says why, with the given and the expected value.

    It is not a ValueError, so that pydantic passes it on unchanged.

    Attributes:
        field: Field of the plan, such as `axes.0.values` or `values.sample_count`; empty if none is to blame.
        bound: Allowed values in words, if known.
        value: The given value.
    """

    def __init__(self, message: str, field: str = "", *, bound: str | None = None, value: object = None) -> None:
        super().__init__(message)
        self.field, self.bound, self.value = field, bound, value

    def within(self, field: str) -> Self:
        """Return this error with the parent of its field in front."""
        self.field = f"{field}.{self.field}".rstrip(".")
        return self


class SweepStopped(Exception):  # noqa: N818 - somebody asked for it
    """A sweep that was stopped on request; finished chunks are kept."""


MOST_RUNS = 2_000_000
"""Runs of the largest sweep, and so the most values of an axis."""

TRACKER = "tracker"

FORMS = "name=start:stop:step or name=a,b,c"


@dataclass(frozen=True, slots=True)
class Axis:
    """A parameter and its values in a sweep, in the order of a map."""

    name: str
    values: tuple[Value, ...]

    @property
    def numerical(self) -> bool:
        """Whether the values are numbers, so that a map or plot can have a scale."""
        return all(isinstance(value, (int, float)) and not isinstance(value, bool) for value in self.values)


@dataclass(frozen=True, slots=True)
class AxisRange:
    """An axis as a person writes it: from start to stop, both included if they lie on the grid."""

    name: str
    start: Decimal
    stop: Decimal
    step: Decimal


def parse_axis(experiment: Experiment, text: str, kind: Kind | None = None) -> Axis:
    """Read an axis from a command line.

    Args:
        experiment: The experiment with the parameters and trackers to vary.
        text: `name=start:stop:step` or `name=a,b,c`.
        kind: Kind of the swept recording; None for the simulated scene.

    Raises:
        SweepError: The parameter is unknown, or a value is of the wrong kind, out of bounds or given twice.
    """
    name, separator, given = text.partition("=")
    name, given = name.strip(), given.strip()
    if not (separator and name):
        raise SweepError(f"an axis is {FORMS}, got {text!r}")
    declaration = None if name == TRACKER else find_declaration(experiment, name, kind)
    if not given:
        raise SweepError(f"the axis {name} is empty; an axis is {FORMS}")
    if ":" in given and declaration is not None and declaration.kind in {"integer", "number"}:
        return check(experiment, _parse_range(name, given), kind)
    parts = [part.strip() for part in given.split(",")]
    if not all(parts):
        raise SweepError(f"the axis {name} has an empty value: {_short(given)}")
    if declaration is None:
        return check(experiment, Axis(name, tuple(parts)), kind)
    model = type(experiment.parameters_on(kind))
    try:
        return check(experiment, Axis(name, tuple(parse(model, name, part) for part in parts)), kind)
    except ParameterError as error:
        raise SweepError(f"the axis {error}") from None


def check(experiment: Experiment, axis: Axis | AxisRange, kind: Kind | None = None) -> Axis:
    """Return an axis with its values in the parameter's own kind.

    Raises:
        SweepError: As for `parse_axis`; its field names the faulty part of the axis.
    """
    declaration = None if axis.name == TRACKER else find_declaration(experiment, axis.name, kind)
    if isinstance(axis, AxisRange):
        if declaration is None or declaration.kind not in {"integer", "number"}:
            raise SweepError(f"{axis.name} has no numbers to step through; list its values", "values")
        axis = Axis(axis.name, _range_values(declaration, axis))
    if not axis.values:
        raise SweepError(f"the axis {axis.name} is empty; it needs at least one value", "values")
    if len(axis.values) > MOST_RUNS:
        raise SweepError(
            f"a sweep has at most {MOST_RUNS:,} runs; the axis {axis.name} has {len(axis.values):,} values", "values"
        )
    if declaration is None:
        values: Sequence[Value] = [_tracker(experiment, value) for value in axis.values]
    elif declaration.kind == "file":
        raise SweepError(
            f"{axis.name} is a file parameter, which cannot be varied; expected a parameter with numbers or choices",
            "name",
        )
    else:
        values = [value_of(declaration, value, "values") for value in axis.values]
    seen: set[Value] = set()
    for value in values:
        if value in seen:
            raise SweepError(f"the axis {axis.name} has the value {value} twice", "values", value=value)
        seen.add(value)
    return Axis(axis.name, tuple(values))


def find_declaration(experiment: Experiment, name: str, kind: Kind | None = None) -> Declaration:
    """Return the declaration of a parameter of an experiment's trackers or scene.

    Args:
        experiment: The experiment.
        name: Name of the parameter.
        kind: Kind of the swept recording; None for the simulated scene.

    Raises:
        SweepError: The parameter is unknown; the message suggests similar names.
    """
    try:
        known = {it.name: it for it in declarations(type(experiment.parameters_on(kind)))}
    except ParameterError as error:
        raise SweepError(str(error)) from None
    if name not in known:
        near = get_close_matches(name, [*known, TRACKER], n=3)
        hint = f"did you mean {' or '.join(near)}?" if near else f"`pftrack show {experiment.id}` lists them"
        where = "" if kind is None else " on a recording"
        raise SweepError(f"{experiment.id} has no parameter {_short(name)}{where}; {hint}", "name", value=name)
    return known[name]


def value_of(declaration: Declaration, value: object, field: str = "") -> Value:
    """Return a value in a parameter's own kind.

    Args:
        declaration: Declaration of the parameter.
        value: The given value.
        field: Field of the plan that holds it.

    Raises:
        SweepError: The value is of another kind or out of bounds.
    """
    match declaration.kind, value:
        case "boolean", bool():
            return value
        case "choice", str() if value in declaration.choices:
            return value
        case "colour", str() if re.fullmatch("#[0-9a-fA-F]{6}", value):
            return value
        case "file", str() if len(value) <= LONGEST_FILE:
            return value
        case ("integer" | "number") as kind, int() | float() if not isinstance(value, bool):
            low = -inf if declaration.minimum is None else declaration.minimum
            inside = low <= value <= (inf if declaration.maximum is None else declaration.maximum)
            if inside and (kind == "number" or float(value).is_integer()):
                return float(value) if kind == "number" else int(value)
    bound = describe_allowed(declaration)
    raise SweepError(f"{declaration.name} must be {bound}, got {_short(value)}", field, bound=bound, value=value)


def _parse_range(name: str, text: str) -> AxisRange:
    parts = text.split(":")
    if len(parts) != 3:
        raise SweepError(f"the axis {name} is start:stop:step, 3 numbers, got {len(parts)}: {_short(text)}")
    try:
        numbers = [Decimal(part.strip()) for part in parts]
    except InvalidOperation:
        raise SweepError(f"the axis {name} is start:stop:step, 3 numbers, got {_short(text)}") from None
    if not all(number.is_finite() for number in numbers):
        raise SweepError(f"the axis {name} is start:stop:step, 3 finite numbers, got {_short(text)}")
    return AxisRange(name, *numbers)


def _range_values(declaration: Declaration, axis: AxisRange) -> tuple[Value, ...]:
    """Return the values of a range, after a check of their number."""
    name, start, stop, step = axis.name, axis.start, axis.stop, axis.step
    if step == 0:
        raise SweepError(f"the step of the axis {name} must not be 0", "step")
    for field, end in (("start", start), ("stop", stop)):
        value_of(declaration, float(end) if declaration.kind == "number" or end != int(end) else int(end), field)
    if (stop - start) * step < 0:
        raise SweepError(f"the axis {name} never reaches {stop} from {start} in steps of {step}", "step")
    steps = (stop - start) / step
    if steps >= MOST_RUNS:
        many = f"the axis {name} has {int(steps) + 1:,} values"
        raise SweepError(f"a sweep has at most {MOST_RUNS:,} runs; {many}", "stop")
    values = (start + index * step for index in range(int(steps) + 1))
    if declaration.kind == "number":
        return tuple(float(value) for value in values)
    return tuple(int(value) if value == int(value) else float(value) for value in values)


def _tracker(experiment: Experiment, name: object) -> str:
    if not isinstance(name, str) or name not in experiment.trackers:
        known = f"one of {', '.join(experiment.trackers)}"
        message = f"a tracker of {experiment.id} is {known}, got {_short(name)}"
        raise SweepError(message, "values", bound=known, value=name)
    return name


def _short(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."
