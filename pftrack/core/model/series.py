"""Series: what is measured of every frame, declared as data.

What is measured is declared: a tracker what it reports of its own belief, an experiment what it compares with the
truth. Plots, readings, columns of sweeps and of saved files come from the declarations, and general code knows shapes
and roles, never a name. What a method does not have, it neither declares nor reports: a frame of a Kalman filter has no
effective sample size, not one of 0.

The shapes, and what a value of each is in Python, in JSON and in the columns of a file of L frames:

| shape | Python | JSON | columns |
|---|---|---|---|
| number | float | number | (L,) |
| vector | tuple of floats | list | (L, d) |
| interval | `Interval` | [low, high] | (L, 2) |
| hypotheses | `Hypotheses` | {"values": K lists of d, "weights": list} | (L, K, d), and (L, K) as `NAME_weights` |

Hypotheses that know from which of the frame before they come have a list of K "parents" in JSON as well, and (L, K) as
`NAME_parents` in columns.

A number that is not known is NaN in Python and in columns, and null in JSON. The number K of hypotheses, and the length
d of a vector, may vary from frame to frame; columns are then as wide as the widest, the rest of them NaN.
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
"""What general code may do with a series without knowing its name.

- "particles": a number, how many particles there are.
- "ess": a number, the effective sample size of these particles.
- "resampled": a number, 1 where parents were drawn and 0 where weights were only multiplied.
- "distinct": a number, how many of the particles differ in what no noise renews.
- "share": a vector, how many particles came from each sampler; the components are stacked.
- "flag": a number, or a vector of such, that is 1 where something holds and 0 where not.
- "event": a number, how often something happened in the frame; such frames are marked in the memory of a run.
- "extent": a vector, width and height in px of the box around the estimate that the target is believed to fill.
- "likeness": a number from 0 to 1, how like the tracker's model of the target that is which is at the estimate; or a
  vector of such, one for each part of the target.
- "model_likeness": a number from 0 to 1, or a vector of such, how like the first look of the target that model is.
- "misfit": a number, the share in % of what is seen by which that differs from what is believed.
- "visible": a vector, 1 for each part of the target that is to be seen in the picture, else 0, by the truth.
- "mirrored": a number, 1 where the estimate is nearer to a mirror image of the truth than to the truth, else 0.
- "mirror_gap": a number, how many of its stated deviations the estimate is from the nearest other pose that the camera
  shows alike; the tracker knows it without the truth.
- "measured": a vector, the numbers that were measured of the target in the frame; NaN of one that was not seen.
- "loss_probability": a number from 0 to 1, how probable it is that the target is lost; it is told from the rows of a
  run (`pftrack.experiments.shared.loss_probability`), and no tracker reports it.
- "excess": a number, the largest error of what is believed over its stated deviation; declared where the estimate is
  not all that is believed.
- "nis": a number, the normalised innovation squared: how far off the measurement of the frame was from what had been
  expected of it, in the deviations expected. If the model holds, it is a chi-square variable.
- "nis_freedom": a number, the degrees of freedom of that variable: how many numbers were measured in the frame.
- "nis_limit": a number, what that variable stays below with a probability of 95 %.
"""


class Interval(NamedTuple):
    """Where something lies, both ends included, in the unit of its series."""

    low: float
    high: float


@dataclass(frozen=True, slots=True)
class Hypotheses:
    """K possibilities of d numbers each, and how probable each is.

    Attributes:
        values: K tuples of d numbers, in the unit of the series.
        weights: K probabilities that sum to 1.
        parents: K places among the hypotheses of the frame before, -1 of one that begins; empty where not known.
    """

    values: tuple[tuple[float, ...], ...]
    weights: tuple[float, ...]
    parents: tuple[int, ...] = ()


SeriesValue: TypeAlias = float | tuple[float, ...] | Interval | Hypotheses


@with_config(CLOSED)
@dataclass(frozen=True, slots=True)
class Reduction:
    """One number that is kept of a series over a whole run, such as a column of a sweep.

    Frame 0, in which a tracker only begins, does not count.

    Attributes:
        name: Of the column.
        title: What it is, a few words.
        how: "mean" over the frames; "share", the mean over the frames of what part of a vector's sum one component is;
            "count" of the frames in which a flag is set.
        component: Of a "share", the component's name.
    """

    name: str
    title: str
    how: Literal["mean", "share", "count"]
    component: str = ""


@with_config(CLOSED)
@dataclass(frozen=True, slots=True)
class Series:
    """The declaration of something measured in every frame.

    Attributes:
        name: Key among the measurements of a frame.
        title: What it is, a few words.
        unit: Of its numbers; empty for pure numbers.
        shape: Of its values.
        role: What general code may do with it.
        components: Names of a vector's numbers, or of the d numbers of a hypothesis; empty where their number varies.
        colours: Names in the palette of the components of a "share", in their order; of an "event", one name.
        reductions: What is kept of it over a whole run.
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
    """Return all series that several declare, each once, in the order in which they come first.

    Raises:
        ValueError: Two different series have one name, or two reductions have.
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
"""Asked of each number of each frame, where a union would be made anew."""


def check_value(series: Series, value: SeriesValue) -> None:
    """Refuse a value that is not of the declared shape.

    Raises:
        ValueError: It is of another shape, or has another number of components than the declaration.
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
    """Return a value as JSON has it; numbers that are not finite become None."""
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
"""A number that may be unknown: NaN here, null in JSON, both ways."""


def as_json(value: object) -> dict[str, Any]:
    """Return a dataclass or a pydantic model as JSON values; a `Known` number that is not finite becomes None."""
    adapter = _adapter_of(type(value))
    values: dict[str, Any] = adapter.dump_python(value, mode="json", by_alias=True)
    return values


_adapter_of: Callable[[type], TypeAdapter[Any]] = cache(TypeAdapter)


def columns(series: Series, values: Sequence[SeriesValue | None]) -> dict[str, Floats]:
    """Return the values of a series over L frames as arrays by name, None where a frame has no such measurement."""
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
    """Return what is kept of a series over a whole run, by the reductions' names.

    Args:
        series: A number or a vector.
        column: (L,) or (L, d) values of the frames after the first, NaN where there are none.

    Returns:
        A number each; None where no frame has a value.
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
    """Return numbers as (L,), or vectors as (L, the longest), the rest NaN."""
    width = max((len(value) for value in values if isinstance(value, tuple)), default=None)
    if width is None:
        return np.array(values, dtype=np.float64)
    padded = np.full((len(values), width), np.nan)
    for frame, value in enumerate(values):
        if isinstance(value, tuple):
            padded[frame, : len(value)] = value
    return padded


# What a page shows of every frame in curves and in figures, declared as data.
#
# An experiment lists its plots and its readings, as it lists its parameters; what shows them, a page or a notebook,
# needs to know the kinds below and nothing of the experiment. A plot is a view of the diagnostics of the frames: of
# their own columns, of the series that have a role, or of series by name. What no frame of a run has is not shown.

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

    Kinds that read the diagnostics' own columns are "error", shaded where the target is hidden or lost; and "sigma",
    the largest standard deviation beside the parameters that are thresholds of "sigma". Kinds that read the series of
    a role are "sample size", of the roles "ess" and "particles"; "samplers", of the role "share"; and "innovation", of
    the roles "nis" and "nis_limit". Kinds that read series by name:

    - "value": one number a frame;
    - "band": one number a frame, within a band of two standard deviations, and the truth;
    - "interval": the ends of one or several intervals a frame, and the truth;
    - "hypotheses": one component of K hypotheses a frame, the more opaque the greater their weights, and the truth;
    - "tree": hypotheses with their parents, a row for each place among those of a frame, the more opaque the greater
      their weights, and the way back along the parents from the most probable one of the newest frame;
    - "features": a vector of numbers from 0 to 1, a row each, shaded where the feature is hidden;
    - "frequency": of flags, how many were set up to each frame, beside the `levels` where that share should be.

    Attributes:
        id: Name among the experiment's plots.
        title: What it shows, a few words; with its unit it stands above the plot.
        kind: How it is drawn.
        description: What is to be seen, one sentence.
        unit: Of what it shows; errors and standard deviations have the experiment's.
        series: Names of the series that it draws.
        sd: Of a "band", the series of standard deviations.
        truth: Of a "band", an "interval" or "hypotheses", the series of the truth.
        component: Of "hypotheses", which of the d numbers is drawn.
        shown: Of a "tree", the parameter, a whole number of the role "drawing", that says which hypothesis of the frame
            is drawn, 1 the first: to click at one is to go to its frame and to set it. Empty where none is drawn.
        visible: Of "features", the series that is 0 where the truth says that a feature is hidden.
        recognised: Of "features", the series that is 0 where the tracker itself did not make a feature out.
        row_titles: Of "features", the rows' names written out, where these are short; in their order.
        levels: Of a "frequency", where the share of each series should be, 0..1.
        needs_truth: Whether there is nothing to draw where the truth is unknown.
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
        """Return the unit of its values, given that of the experiment's errors."""
        return self.unit or (unit if self.kind in {"error", "sigma"} else "")

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all series that it reads by name."""
        return (*self.series, *(name for name in (self.sd, self.truth, self.visible, self.recognised) if name))


@dataclass(frozen=True, slots=True)
class Reading:
    """A line of figures that belongs to one frame.

    "value", a number with its standard deviation, "interval", its two ends, "hypotheses", the most probable one, and
    "count", how many flags of a vector are set, read series by name; "particles" and "samplers" read series by role;
    all others read the diagnostics' own columns.

    Attributes:
        title: What it says, one or two words.
        kind: How it is written.
        unit: Of what a series by name is measured in.
        series: Name of the series that it writes.
        sd: Of a "value", the series of standard deviations.
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
"""The plots that suit every method: a method that has no particles, no choice between samplers, or no innovation shows
fewer."""

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
"""The readings of the same."""
