"""Series: quantities measured in every frame, declared as data.

A tracker declares what it reports about its belief, an experiment what it compares with the truth. Plots, readings and
columns of sweeps and files follow from the declarations; general code uses shapes and roles, not names. A method omits
quantities that it does not have: a frame of a Kalman filter has no effective sample size, instead of one of 0.

The shapes, with their values in Python, in JSON and in the columns of a file of L frames:

| shape | Python | JSON | columns |
|---|---|---|---|
| number | float | number | (L,) |
| vector | tuple of floats | list | (L, d) |
| interval | `Interval` | [low, high] | (L, 2) |
| hypotheses | `Hypotheses` | {"values": K lists of d, "weights": list} | (L, K, d), and (L, K) as `NAME_weights` |

Hypotheses with known parents in the frame before also have a list of K "parents" in JSON, and (L, K) as `NAME_parents`
in columns.

An unknown number is NaN in Python and in columns, and null in JSON. The number K of hypotheses and the length d of a
vector may vary from frame to frame; columns then have the largest width and are filled with NaN.
"""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple, TypeAlias

import numpy as np
from pydantic import BeforeValidator, PlainSerializer, TypeAdapter, with_config

from pftrack.core.arrays import Floats
from pftrack.core.texts import CLOSED, read_as

SeriesShape: TypeAlias = Literal["number", "vector", "interval", "hypotheses"]

SeriesRole: TypeAlias = Literal[
    "",
    "particles",
    "ess",
    "resampled",
    "distinct",
    "share",
    "flag",
    "event",
    "extent",
    "likeness",
    "model_likeness",
    "misfit",
    "visible",
    "mirrored",
    "mirror_gap",
    "measured",
    "loss_probability",
    "excess",
    "nis",
    "nis_freedom",
    "nis_limit",
]
"""The meaning of a series for general code, which does not know its name.

- "particles": a number, the number of particles.
- "ess": a number, the effective sample size of these particles.
- "resampled": a number, 1 if resampling took place and 0 if weights were only multiplied.
- "distinct": a number, how many particles differ in components that have no process noise.
- "share": a vector, the number of particles from each proposal; plots stack the components.
- "flag": a number or a vector, 1 for true and 0 for false.
- "event": a number, how often something happened in the frame; the scrubber marks such frames.
- "extent": a vector, width and height in px of the estimated box around the estimate.
- "likeness": a number from 0 to 1, the similarity of the picture at the estimate to the tracker's model of the target;
  or a vector with one such number for each part of the target.
- "model_likeness": a number from 0 to 1, or a vector, the similarity of that model to the first look of the target.
- "misfit": a number, the difference between observation and belief, in % of the observation.
- "visible": a vector, 1 for each part of the target that is truly visible in the picture, else 0.
- "mirrored": a number, 1 if the estimate is nearer to a mirror image of the truth than to the truth, else 0.
- "mirror_gap": a number, the distance of the estimate from the nearest other pose with the same image, in stated
  standard deviations; it needs no truth.
- "measured": a vector, the measured numbers of the target in the frame; NaN for a number that was not seen.
- "loss_probability": a number from 0 to 1, the probability that the target is lost; it is computed from the rows of a
  run (`pftrack.experiments.shared.loss_probability`), and trackers do not report it.
- "excess": a number, the largest ratio of an error to its stated deviation, for beliefs that are more than the
  estimate.
- "nis": a number, the normalised innovation squared. If the model holds, it is a chi-square variable.
- "nis_freedom": a number, the degrees of freedom of that variable: how many numbers were measured in the frame.
- "nis_limit": a number, the 95 % quantile of that variable.
"""


class Interval(NamedTuple):
    """A closed interval in the unit of its series."""

    low: float
    high: float


@dataclass(frozen=True, slots=True)
class Hypotheses:
    """K hypotheses of d numbers each, with probabilities.

    Attributes:
        values: K tuples of d numbers, in the unit of the series.
        weights: K probabilities that sum to 1.
        parents: K indices among the hypotheses of the frame before, -1 for a new one; empty if unknown.
    """

    values: tuple[tuple[float, ...], ...]
    weights: tuple[float, ...]
    parents: tuple[int, ...] = ()


SeriesValue: TypeAlias = float | tuple[float, ...] | Interval | Hypotheses


@with_config(CLOSED)
@dataclass(frozen=True, slots=True)
class Reduction:
    """One number that summarises a series over a complete run, such as a column of a sweep.

    Frame 0, the start of a tracker, does not count.

    Attributes:
        name: Name of the column.
        title: Title in a few words.
        how: "mean" over the frames; "share", the mean over the frames of one component divided by the sum of the
            vector; or "count" of the frames in which a flag is set.
        component: Name of the component for "share".
    """

    name: str
    title: str
    how: Literal["mean", "share", "count"]
    component: str = ""


@with_config(CLOSED)
@dataclass(frozen=True, slots=True)
class Series:
    """The declaration of a quantity measured in every frame.

    Attributes:
        name: Key among the values of a frame.
        title: Title in a few words.
        unit: Unit of its numbers; empty for pure numbers.
        shape: Shape of its values.
        role: Meaning for general code.
        components: Names of a vector's components, or of the d numbers of a hypothesis; empty if their number varies.
        colours: Names in the palette for the components of a "share", in order; one name for an "event".
        reductions: Its summaries over a complete run.
    """

    name: str
    title: str
    unit: str = ""
    shape: SeriesShape = "number"
    role: SeriesRole = ""
    components: tuple[str, ...] = ()
    colours: tuple[str, ...] = ()
    reductions: tuple[Reduction, ...] = ()


def join(*declared: Iterable[Series]) -> tuple[Series, ...]:
    """Return all declared series, each once, in the order of their first declaration.

    Raises:
        ValueError: Two different series or two reductions have the same name.
    """
    known: dict[str, Series] = {}
    kept: set[str] = set()
    for series in (one for some in declared for one in some):
        if known.setdefault(series.name, series) != series:
            raise ValueError(f"two different series are called {series.name!r}")
    for series in known.values():
        for reduction in series.reductions:
            if reduction.name in kept:
                raise ValueError(f"two reductions are called {reduction.name!r}")
            kept.add(reduction.name)
    return tuple(known.values())


_NUMBER = int, float
"""Types of numbers; a constant, because a union would be made anew for each number of each frame."""


def check_value(series: Series, value: SeriesValue) -> None:
    """Refuse a value of another shape than the declared one.

    Raises:
        ValueError: The value has another shape or another number of components than declared.
    """
    match series.shape:
        case "number":
            fits = isinstance(value, _NUMBER)
        case "vector":
            fits = _is_vector(value, series.components)
        case "interval":
            fits = isinstance(value, Interval) and not value.low > value.high
        case "hypotheses":
            fits = (
                isinstance(value, Hypotheses)
                and len(value.values) == len(value.weights)
                and all(_is_vector(one, series.components) for one in value.values)
                and math.isclose(sum(value.weights), 1.0, abs_tol=1e-6)
                and len(value.parents) in {0, len(value.values)}
                and all(parent >= -1 for parent in value.parents)
            )
    if not fits:
        of = f" of {', '.join(series.components)}" if series.components else ""
        raise ValueError(f"{series.name} is declared as {series.shape}{of}, got {value!r}")


def to_json(value: SeriesValue) -> Any:  # noqa: ANN401 - JSON
    """Return a value for JSON, with None for numbers that are not finite."""
    if isinstance(value, Hypotheses):
        known = {"values": [to_json(one) for one in value.values], "weights": to_json(value.weights)}
        return {**known, "parents": list(value.parents)} if value.parents else known
    if isinstance(value, tuple):
        return [to_json(number) for number in value]
    return value if math.isfinite(value) else None


Known: TypeAlias = Annotated[
    float,
    BeforeValidator(lambda value: math.nan if value is None else value),
    PlainSerializer(lambda value: value if math.isfinite(value) else None, return_type=float | None),
]
"""A number that may be unknown: NaN in Python, null in JSON."""


def as_json(value: object) -> dict[str, Any]:
    """Return a dataclass or a pydantic model as JSON values, with None for a `Known` number that is not finite."""
    adapter = _adapter_of(type(value))
    values: dict[str, Any] = adapter.dump_python(value, mode="json", by_alias=True)
    return values


_adapter_of: Callable[[type], TypeAdapter[Any]] = cache(TypeAdapter)


def columns(series: Series, values: Sequence[SeriesValue | None]) -> dict[str, Floats]:
    """Return the values of a series over L frames (None in frames without a value) as arrays by name."""
    if series.shape != "hypotheses":
        return {series.name: _pad([math.nan if value is None else value for value in values])}
    known = [value for value in values if isinstance(value, Hypotheses)]
    count = max((len(value.weights) for value in known), default=0)
    width = max((len(one) for value in known for one in value.values), default=len(series.components))
    places = np.full((len(values), count, width), np.nan)
    weights, parents = np.full((2, len(values), count), np.nan)
    for frame, value in enumerate(values):
        if isinstance(value, Hypotheses):
            weights[frame, : len(value.weights)] = value.weights
            parents[frame, : len(value.parents)] = value.parents
            for place, one in enumerate(value.values):
                places[frame, place, : len(one)] = one
    found = {series.name: places, f"{series.name}_weights": weights}
    return {**found, f"{series.name}_parents": parents} if any(value.parents for value in known) else found


def reduce(series: Series, column: Floats) -> dict[str, float | int | None]:
    """Return the reductions of a series over a complete run, by name.

    Args:
        series: A series of numbers or vectors.
        column: (L,) or (L, d) values of the frames after the first, NaN where missing.

    Returns:
        One number for each reduction; None if no frame has a value.
    """
    known = column[~np.isnan(column).reshape(len(column), -1).any(axis=1)] if len(column) else column
    return {reduction.name: _reduce(series, reduction, known) for reduction in series.reductions}


def _reduce(series: Series, reduction: Reduction, known: Floats) -> float | int | None:
    if not len(known):
        return None
    match reduction.how:
        case "mean":
            return float(known.mean())
        case "share":
            return float((known[:, series.components.index(reduction.component)] / known.sum(axis=1)).mean())
        case "count":
            return int(np.count_nonzero(known))


def _is_vector(value: object, components: tuple[str, ...]) -> bool:
    return (
        isinstance(value, tuple)
        and not isinstance(value, Interval)
        and len(value) == (len(components) or len(value))
        and all(isinstance(number, _NUMBER) for number in value)
    )


def _pad(values: Sequence[Any]) -> Floats:
    """Return numbers as (L,), or vectors as (L, longest) filled with NaN."""
    width = max((len(value) for value in values if isinstance(value, tuple)), default=None)
    if width is None:
        return np.array(values, dtype=np.float64)
    padded = np.full((len(values), width), np.nan)
    for frame, value in enumerate(values):
        if isinstance(value, tuple):
            padded[frame, : len(value)] = value
    return padded


# Plots and readings, declared as data.
#
# An experiment lists its plots and readings, as it lists its parameters; pages and notebooks know only the kinds below.
# A plot shows diagnostics of the frames: their own columns, series of a role, or series by name. Plots without any
# value are not shown.

PlotKind: TypeAlias = Literal[
    "error",
    "sigma",
    "sample size",
    "samplers",
    "innovation",
    "value",
    "band",
    "interval",
    "features",
    "frequency",
    "hypotheses",
    "tree",
]
ReadingKind: TypeAlias = Literal[
    "estimate",
    "error",
    "sigma",
    "particles",
    "samplers",
    "evidence",
    "time",
    "value",
    "interval",
    "count",
    "hypotheses",
]


@with_config(CLOSED)
@dataclass(frozen=True, slots=True)
class Plot:
    """A plot over the frames of a run.

    Some kinds read columns of the diagnostics: "error", shaded where the target is hidden or lost; and "sigma", the
    largest standard deviation with the parameters that are its thresholds. Some read series by role: "sample size"
    (roles "ess" and "particles"), "samplers" (role "share") and "innovation" (roles "nis" and "nis_limit"). The others
    read series by name:

    - "value": one number per frame;
    - "band": one number per frame in a band of two standard deviations, and the truth;
    - "interval": the ends of one or several intervals per frame, and the truth;
    - "hypotheses": one component of K hypotheses per frame, more opaque for greater weights, and the truth;
    - "tree": hypotheses with their parents, one row per index, more opaque for greater weights, and the path of the
      newest frame's most probable hypothesis back through its ancestors;
    - "features": a vector of numbers from 0 to 1, one row each, shaded where the feature is hidden;
    - "frequency": the share of set flags up to each frame, with its expected `levels`.

    Attributes:
        id: Name among the experiment's plots.
        title: Title in a few words; it is shown above the plot with the unit.
        kind: Kind of plot.
        description: Content in one sentence.
        unit: Unit of the values; errors and standard deviations have the experiment's unit.
        series: Names of the drawn series.
        sd: For a "band", the series of standard deviations.
        truth: For a "band", an "interval" or "hypotheses", the series of the truth.
        component: For "hypotheses", the index of the drawn number.
        shown: For a "tree", the integer parameter of the role "drawing" that chooses the drawn hypothesis, from 1. A
            click on a hypothesis goes to its frame and sets the parameter. Empty if none is drawn.
        visible: For "features", the series that is 0 where a feature is truly hidden.
        recognised: For "features", the series that is 0 where the tracker did not recognise a feature.
        row_titles: For "features", full titles of the rows in order, if their names are abbreviated.
        levels: For a "frequency", the expected share of each series, 0..1.
        needs_truth: Whether the plot is empty without a truth.
    """

    id: str
    title: str
    kind: PlotKind
    description: str
    unit: str = ""
    series: tuple[str, ...] = ()
    sd: str = ""
    truth: str = ""
    component: int = 0
    shown: str = ""
    visible: str = ""
    recognised: str = ""
    row_titles: tuple[str, ...] = ()
    levels: tuple[float, ...] = ()
    needs_truth: bool = False

    def unit_beside(self, unit: str) -> str:
        """Return the unit of its values, given the unit of the experiment's errors."""
        return self.unit or (unit if self.kind in {"error", "sigma"} else "")

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all series that it reads by name."""
        return (*self.series, *(name for name in (self.sd, self.truth, self.visible, self.recognised) if name))


@dataclass(frozen=True, slots=True)
class Reading:
    """A line of numbers about one frame.

    The kinds "value" (a number with its standard deviation), "interval" (two ends), "hypotheses" (the most probable
    one) and "count" (the number of set flags) read series by name; "particles" and "samplers" read series by role; all
    others read columns of the diagnostics.

    Attributes:
        title: Title of one or two words.
        kind: Kind of reading.
        unit: Unit of a series by name.
        series: Name of the series.
        sd: For a "value", the series of standard deviations.
    """

    title: str
    kind: ReadingKind
    unit: str = ""
    series: str = ""
    sd: str = ""

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all series that it reads by name."""
        return tuple(name for name in (self.series, self.sd) if name)


def read_plots(path: Path) -> Mapping[str, Plot]:
    """Return the plots of a YAML file, which maps their ids to their fields.

    Raises:
        ValueError: The file is not YAML, or a plot lacks a field or has an unknown one; it names file and line.
    """
    return {plot.id: plot for plot in read_as(Plot, path, "id")}


STANDARD_PLOTS = tuple(read_plots(Path(__file__).with_name("plots.yaml")).values())
"""Plots for every method; a method without particles, without several proposals or without innovations shows fewer."""

ERROR, SIGMA, SAMPLE_SIZE, SAMPLERS, INNOVATION = STANDARD_PLOTS

PARTICLES, STEP_TIME = Reading("particles", "particles"), Reading("step", "time")

STANDARD_READINGS = (
    Reading("estimate", "estimate"),
    Reading("error", "error"),
    Reading("sigma", "sigma"),
    PARTICLES,
    Reading("proposal", "samplers"),
    Reading("log evidence", "evidence"),
    STEP_TIME,
)
"""Readings for every method."""
