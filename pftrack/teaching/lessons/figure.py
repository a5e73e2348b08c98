"""The figure of a lesson as data: panels with axes, which hold a few kinds of trace.

A lesson computes numbers and declares their form: a curve, a histogram, stems. A browser, matplotlib or a notebook
draws them and computes nothing. Meaningful colours are names from the palette.

A YAML file next to the module that computes the numbers declares the look of a lesson's panels: titles, axes, colours,
and the sentences for people who cannot see them; and the names of the lesson's numbers. `look` reads that file,
`Look.draw` and `Look.show` add the numbers.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Final, Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, PlainSerializer, WithJsonSchema, computed_field

from pftrack.core.arrays import Floats
from pftrack.core.model.series import Known
from pftrack.core.texts import CLOSED, read_whole

DIGITS = 6
"""Significant digits that travel to a browser: a screen has no use for more."""
SHADE_DIGITS = 3
"""Decimal places of the largest amount of a map that travel, in its own power of ten."""
MOST_PLACES = 20
"""Decimals, so powers of ten are exact."""


def _numbers(values: ArrayLike) -> Floats:
    return np.asarray(values, dtype=np.float64)


def _to_json(values: Floats) -> list[Any]:
    """Return numbers as JSON has them, rounded; what is not finite is a gap."""
    finite = np.isfinite(values)
    sizes = np.abs(np.where(finite & (values != 0.0), values, 1.0))
    places = np.clip(DIGITS - 1 - np.floor(np.log10(sizes)), -MOST_PLACES, MOST_PLACES)
    finer, coarser = 10.0 ** np.maximum(places, 0.0), 10.0 ** np.maximum(-places, 0.0)
    rounded = (np.rint(np.where(finite, values, 0.0) * finer / coarser) * coarser / finer).astype(object)
    rounded[~finite] = None
    listed: list[Any] = rounded.tolist()
    return listed


def _shade(values: Floats) -> list[Any]:
    """Return amounts as JSON has them, to some thousandths of the largest: no colour shows more."""
    most = float(np.abs(values[np.isfinite(values)]).max(initial=0.0))
    unit = 10.0 ** (math.floor(math.log10(most)) - SHADE_DIGITS) if most > 0.0 else 1.0
    return _to_json(np.rint(values / unit) * unit)


_ITEM: dict[str, Any] = {"type": ["number", "null"]}

Numbers: TypeAlias = Annotated[
    Floats,
    BeforeValidator(_numbers),
    PlainSerializer(_to_json),
    WithJsonSchema({"type": "array", "items": _ITEM}),
]
"""An array (n,); NaN is a gap."""

Table: TypeAlias = Annotated[
    Floats,
    BeforeValidator(_numbers),
    PlainSerializer(_to_json),
    WithJsonSchema({"type": "array", "items": {"type": "array", "items": _ITEM}}),
]
"""An array (rows, columns)."""

Shades: TypeAlias = Annotated[
    Floats,
    BeforeValidator(_numbers),
    PlainSerializer(_shade),
    WithJsonSchema({"type": "array", "items": {"type": "array", "items": _ITEM}}),
]
"""An array (rows, columns) of what is shown as colours."""

Ink: TypeAlias = Literal["estimate", "truth", "prediction", "observation", "lost", "second", "hidden"]
"""A colour by its meaning, as `pftrack.core.model.drawing.COLOURS` has it: what is computed of samples is the
"estimate", what is exact the "truth", a prior or proposal the "prediction", a likelihood or measurement the
"observation"."""


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", arbitrary_types_allowed=True)


_NONE = np.empty(0)
"""The numbers of a trace that a file declares."""


class _Trace(_Part):
    """Common attributes of traces.

    Attributes:
        title: Its title, for the key and for people who cannot see it; empty without a key.
        ink: Its colour.
        reveals: Whether it shows the answer of the lesson's question, and is left out until that was answered.
    """

    title: str = ""
    ink: Ink = "estimate"
    reveals: bool = False


class Axis(_Part):
    """An axis.

    Attributes:
        title: The quantity.
        low: Lower end.
        high: Upper end.
        unit: Unit of the quantity; empty for a pure number.
        log: Whether it is logarithmic.
        names: Names in place of numbers, at 0, 1, 2, ...
        hidden: Whether its numbers are left out, since only the shape matters.
    """

    title: str
    low: float = 0.0
    high: float = 1.0
    unit: str = ""
    log: bool = False
    names: tuple[str, ...] = ()
    hidden: bool = False


class Curve(_Trace):
    """A line through points.

    Attributes:
        x: Coordinates of the points.
        y: Coordinates of the points.
        dashed: Whether it is dashed.
        area: From where to where in x the area below it is shaded; None for none.
    """

    kind: Literal["curve"] = "curve"
    x: Numbers = _NONE
    y: Numbers = _NONE
    dashed: bool = False
    area: tuple[float, float] | None = None


class Histogram(_Trace):
    """Adjoining bars over intervals.

    Attributes:
        edges: (n + 1,), ascending.
        heights: (n,).
    """

    kind: Literal["histogram"] = "histogram"
    edges: Numbers = _NONE
    heights: Numbers = _NONE


class HeatMap(_Trace):
    """Amounts over a plane, in viridis from nothing to the largest.

    Attributes:
        x: (columns,), middles of the cells, in equal steps.
        y: (rows,), likewise.
        values: (rows, columns), row 0 at the first y.
    """

    kind: Literal["heat map"] = "heat map"
    x: Numbers = _NONE
    y: Numbers = _NONE
    values: Shades = _NONE


class Stems(_Trace):
    """Lines from nothing up to points, such as draws with their weights.

    Attributes:
        x: Their places.
        y: Their heights.
    """

    kind: Literal["stems"] = "stems"
    x: Numbers = _NONE
    y: Numbers = _NONE


class Bars(_Trace):
    """Bars side by side, one per name of the axis; or stacked in one bar, as shares of a whole.

    Attributes:
        heights: (n,).
        stacked: Whether they lie end to end along x, each in its own shade.
    """

    kind: Literal["bars"] = "bars"
    heights: Numbers = _NONE
    stacked: bool = False


class Scatter(_Trace):
    """Points.

    Attributes:
        x: Coordinates of the points.
        y: Coordinates of the points.
        size_px: Diameter.
    """

    kind: Literal["scatter"] = "scatter"
    x: Numbers = _NONE
    y: Numbers = _NONE
    size_px: float = 5.0


class StripChart(_Trace):
    """A value over steps of time: a line with a dot at each step.

    Attributes:
        x: Number of the step.
        y: The value there; NaN where there is none.
    """

    kind: Literal["strip chart"] = "strip chart"
    x: Numbers = _NONE
    y: Numbers = _NONE


class Tree(_Trace):
    """Who descends from whom: a column for each generation, a row for each particle.

    Attributes:
        parents: (generations, n), row of each particle's parent in the generation before; NaN in the first.
        weights: (generations, n), 0..1 of the largest, as opacity.
    """

    kind: Literal["tree"] = "tree"
    parents: Table = _NONE
    weights: Table = _NONE


class Rule(_Trace):
    """A line across the panel at a value, such as a mean.

    Attributes:
        at: The value.
        along: Its axis.
        dashed: Whether it is dashed.
    """

    kind: Literal["rule"] = "rule"
    at: float = math.nan
    along: Literal["x", "y"] = "x"
    dashed: bool = False


Trace: TypeAlias = Annotated[
    Curve | Histogram | HeatMap | Stems | Bars | Scatter | StripChart | Tree | Rule,
    Field(discriminator="kind"),
]


class Handle(_Part):
    """A parameter of the lesson that is turned by dragging a line across the panel, or by the arrow keys on it.

    Attributes:
        parameter: Its name; its bounds and step are the parameter's.
        at: Its value.
        along: The axis on which the value is.
    """

    parameter: str
    at: float
    along: Literal["x", "y"] = "x"


class Panel(_Part):
    """One pair of axes with what is drawn in it.

    Attributes:
        id: Name among the figure's panels.
        title: Its title.
        x: The axis to the right.
        y: The axis upwards.
        traces: Traces, the first behind.
        handles: Handles that can be dragged.
        words: Description at these parameters, a sentence with the main numbers, for people who cannot see it.
        row: Its row of the figure, 0 the topmost; panels of a row are side by side.
        share: Relative height of its row, and relative width within the row.
    """

    id: str
    title: str
    x: Axis
    y: Axis
    traces: tuple[Trace, ...]
    handles: tuple[Handle, ...] = ()
    words: str = ""
    row: int = 0
    share: tuple[float, float] = (1.0, 1.0)


class Figure(_Part):
    """Panels in rows.

    Attributes:
        panels: In the order in which they are read.
    """

    panels: tuple[Panel, ...]

    def without_answer(self) -> "Figure":
        """Return it without what reveals the answer of the lesson's question, in traces or in words."""
        panels = []
        for panel in self.panels:
            traces = tuple(trace for trace in panel.traces if not trace.reveals)
            words = panel.words if len(traces) == len(panel.traces) else "Part of it is hidden until you have answered."
            panels.append(panel.model_copy(update={"traces": traces, "words": words}))
        return Figure(panels=tuple(panels))


NUMBERS: Final = frozenset({"x", "y", "edges", "heights", "values", "parents", "weights", "at"})
"""The fields of traces that a file does not declare."""
VALUES: Final = "value", "exact", "tolerance"
"""Those of a lesson's number, in the order in which they are given."""
Given: TypeAlias = tuple[Any, ...] | Mapping[str, Any]
"""Numbers of a trace, or of a number, in the order in which they are declared; or fields by their names."""


class Layout(_Part):
    """A panel as a file declares it, without its numbers.

    Titles and words name in braces what the numbers are, with a format: `the mean is {mean:.3g}`.

    Attributes:
        title: As `Panel.title`.
        x: The axis to the right; without bounds where the numbers give them.
        y: The axis upwards, likewise.
        traces: By name, the first behind.
        words: As `Panel.words`.
        handles: The axis on which each parameter that can be dragged has its value.
        row: As `Panel.row`.
        share: As `Panel.share`.
    """

    title: str
    x: Axis
    y: Axis
    traces: dict[str, Trace]
    words: str
    handles: dict[str, Literal["x", "y"]] = {}
    row: int = 0
    share: tuple[float, float] = (1.0, 1.0)


@dataclass(frozen=True, slots=True)
class Number:
    """A number that a lesson shows, with its exact value where that is known.

    Attributes:
        title: Its title.
        value: The computed value.
        exact: The exact value.
        tolerance: Expected distance from the exact value at these parameters.
        unit: Empty for a pure number.
        digits: Significant digits that are worth showing.
        reveals: Whether it gives the question's answer away, and is left out until that was answered.
    """

    __pydantic_config__ = CLOSED

    title: str
    value: Known = math.nan
    exact: Known | None = None
    tolerance: Known | None = None
    unit: str = ""
    digits: int = 4
    reveals: Annotated[bool, Field(exclude=True)] = False

    @computed_field(description="Whether the value is as close to the exact one as may be expected")  # type: ignore[prop-decorator]
    @property
    def within(self) -> bool | None:
        """Return whether the value is within the tolerance; None where that or the exact value is not known."""
        if self.exact is None or self.tolerance is None:
            return None
        return abs(self.value - self.exact) <= self.tolerance

    def __str__(self) -> str:
        """Return it as a line: "Mean: 0.982 m, exact 1 m, within 0.05 m"."""
        known = (("", self.value), ("exact ", self.exact), ("within ", self.tolerance))
        unit = f" {self.unit}" if self.unit else ""
        said = (f"{word}{value:.{self.digits}g}{unit}" for word, value in known if value is not None)
        return f"{self.title}: {', '.join(said)}"


@dataclass(frozen=True, slots=True)
class Shown:
    """Results of a demonstration at some parameters.

    Attributes:
        figure: The figure.
        numbers: The one that counts first.
    """

    figure: Figure
    numbers: tuple[Number, ...]


class Look(_Part):
    """A file's declarations of a lesson's figure and numbers.

    Attributes:
        panels: By id, in the order in which they are read.
        numbers: By name, the one that counts first, without their values.
    """

    panels: dict[str, Layout]
    numbers: dict[str, Number]

    def draw(
        self,
        panel: str,
        traces: Mapping[str, Given],
        *,
        turned: BaseModel | None = None,
        x: tuple[float, float] | None = None,
        y: tuple[float, float] | None = None,
        **said: object,
    ) -> Panel:
        """Return a panel with its numbers.

        Args:
            panel: Its id.
            traces: Numbers of each trace by its name, in the order in which its kind declares them, or by the fields'
                names; a trace without numbers is left out.
            turned: Parameters with the values of the handles; without them there are none.
            x: Bounds of the axis to the right, where the file has none.
            y: Bounds of the axis upwards, where the file has none.
            **said: Values in titles and words.
        """
        layout = self.panels[panel]
        handles = layout.handles.items() if turned is not None else ()
        return Panel(
            id=panel,
            title=layout.title.format(**said),
            x=_axis(layout.x, x),
            y=_axis(layout.y, y),
            traces=tuple(_trace(each, traces[name], said) for name, each in layout.traces.items() if name in traces),
            handles=tuple(
                Handle(parameter=name, at=float(getattr(turned, name)), along=along) for name, along in handles
            ),
            words=layout.words.format(**said),
            row=layout.row,
            share=layout.share,
        )

    def show(
        self,
        panels: Iterable[Panel],
        numbers: Mapping[str, tuple[float | None, ...] | Mapping[str, Any]],
        **said: object,
    ) -> Shown:
        """Return panels and numbers.

        Args:
            panels: In the order in which they are read.
            numbers: Value, exact value and tolerance of each number by its name, or some of its fields by theirs.
            **said: Values in their titles.
        """
        shown = []
        for name, each in self.numbers.items():
            given = numbers[name]
            known = dict(zip(VALUES, given, strict=False)) if isinstance(given, tuple) else given
            shown.append(replace(each, title=each.title.format(**said), **known))
        return Shown(Figure(panels=tuple(panels)), tuple(shown))


def look(module: str) -> Look:
    """Return the declarations of the YAML file next to a module on its figure.

    Args:
        module: Path of the module, its `__file__`.

    Raises:
        ValueError: Something is wrong with the file; the sentence names it and the line.
    """
    return read_whole(Look, Path(module).with_suffix(".yaml"))


def _axis(axis: Axis, bounds: tuple[float, float] | None) -> Axis:
    return axis if bounds is None else axis.model_copy(update={"low": bounds[0], "high": bounds[1]})


def _trace(layout: Any, numbers: Given, said: Mapping[str, object]) -> Any:  # noqa: ANN401 - one of `Trace`
    kind = type(layout)
    names = [name for name, each in kind.model_fields.items() if name in NUMBERS and each.default is not None]
    given = dict(zip(names, numbers, strict=True)) if isinstance(numbers, tuple) else numbers
    if missing := set(names) - set(given):
        raise ValueError(f"a {layout.kind} needs {' and '.join(sorted(missing))}")
    declared = {**layout.model_dump(exclude_unset=True), "title": layout.title.format(**said)}
    return kind(**{**declared, **given})


def ceiling(value: float) -> float:
    """Return the next of 1, 1.5, 2, 3, 5, 7 and their powers of ten that is at least a positive value."""
    power = 10.0 ** math.floor(math.log10(value))
    return next(factor * power for factor in (1.0, 1.5, 2.0, 3.0, 5.0, 7.0, 10.0) if value <= factor * power)
