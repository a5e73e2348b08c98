"""Learned diffusion: how a body's motion and shape change from frame to frame, as one Gaussian.

A filter that perturbs every component independently tries many changes that no body makes, such as a fish that bends to
one side while it accelerates to the other. Here the perturbation is drawn from N(0, C), C being the covariance of the
changes in recorded tracks, each in the body's own frame (`charts`). Any matrix L of L L^T = C draws it; C's
eigenvectors are the modes of motion, the greatest first (eqs 15 and 18 of Mitsugami, Kakusho and Minoh 2009). Units are
mixed, px and rad, and stay so: nothing is standardised, and no component is dropped.

The learned motion is kept in a small JSON file, whose text is also the value of a parameter, so a run contains all of
it.
"""

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache, partial
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from pftrack.core.arrays import Floats, Ints
from pftrack.core.model.setup import Export
from pftrack.core.numerics.matrices import cholesky, eigenvalues, product
from pftrack.core.numerics.random import Generator
from pftrack.core.refusal import ConflictError, ParameterError, RefusedError
from pftrack.filters.learning.charts import Chart, Reading, advance_states, changes, steps

if TYPE_CHECKING:
    from pftrack.core.model.tracker import Diagnostics

VERSION: Literal[1] = 1

CHANGES_EACH = 5
"""Least number of changes for each component."""

SMALLEST, LARGEST = 1e-9, 1e6
"""Standard deviations, in the component's unit a frame, between which something changes in earnest."""

ROUNDING = 1e-9
"""Largest asymmetry of a correlation, and largest negative eigenvalue, that are attributed to rounding."""

Number: TypeAlias = Annotated[float, Field(allow_inf_nan=False, ge=-1e30, le=1e30)]


@dataclass(frozen=True, eq=False)
class Diffusion:
    """A Gaussian of changes, ready to be drawn from.

    Attributes:
        mean: (k,).
        covariance: C, (k, k).
    """

    mean: Floats
    covariance: Floats

    @cached_property
    def root(self) -> Floats:
        """(k, k) lower triangular L of L L^T = C."""
        return cholesky(self.covariance)

    @cached_property
    def sd(self) -> Floats:
        """(k,) standard deviations of the changes, one by one."""
        return np.sqrt(np.diagonal(self.covariance))

    @cached_property
    def correlation(self) -> Floats:
        """(k, k) correlations of the changes."""
        return self.covariance / np.multiply.outer(self.sd, self.sd)

    @cached_property
    def _eigen(self) -> tuple[Floats, Floats]:
        values, vectors = eigenvalues(self.covariance)
        greatest = vectors[np.abs(vectors).argmax(axis=0), np.arange(len(values))]
        return np.maximum(values, 0.0), vectors * np.where(greatest < 0.0, -1.0, 1.0)

    @property
    def eigenvalues(self) -> Floats:
        """(k,) variances along the modes, the greatest first."""
        return self._eigen[0]

    @property
    def modes(self) -> Floats:
        """(k, k) eigenvectors of C as columns; the greatest entry of each is positive."""
        return self._eigen[1]


class Spread(BaseModel):
    """Mean and covariance of the changes in one reading.

    Attributes:
        reading: Frame in which a place changes; "world" learns the same as "document".
        mean: (k,).
        covariance: (k, k).
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    reading: Reading
    mean: tuple[Number, ...]
    covariance: tuple[tuple[Number, ...], ...]


class Learned(BaseModel):
    """Motion learned from tracks, as a file holds it.

    Attributes:
        format: Distinguishes it from other files.
        version: Version of the format.
        experiment: Name of the experiment whose runs were used.
        chart: Meaning of the numbers of a recorded state.
        tracks: Number of its tracks.
        frames: Total number of their frames.
        step_mean: (d,) mean of the first differences of the recorded states, in the picture's frame.
        step_sd: (d,) standard deviations of these.
        spreads: The changes, by reading.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    format: Literal["pftrack-learned"] = "pftrack-learned"
    version: Literal[1] = 1
    experiment: Annotated[str, Field(min_length=1, max_length=64)]
    chart: Chart
    tracks: Annotated[int, Field(ge=1)]
    frames: Annotated[int, Field(ge=1)]
    step_mean: tuple[Number, ...]
    step_sd: tuple[Annotated[Number, Field(ge=0)], ...]
    spreads: tuple[Spread, ...]

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        size = len(self.chart.names)
        for name, given in ("step_mean", self.step_mean), ("step_sd", self.step_sd):
            if len(given) != size:
                raise ValueError(f"expected {size} numbers as {name}, got {len(given)}")
        if [spread.reading for spread in self.spreads] != _learned_readings(self.chart):
            raise ValueError(f"expected spreads of the readings {', '.join(_learned_readings(self.chart))}")
        for spread in self.spreads:
            _check_spread(spread, self.chart)
        for name, given in ("step_mean", self.step_mean), ("step_sd", self.step_sd):
            if max(map(abs, given)) > LARGEST:
                raise ValueError(f"expected at most {LARGEST:g} as {name}, got {max(map(abs, given)):.3g}")
        return self

    @classmethod
    def read(cls, text: str, *, experiment: str, chart: Chart) -> Self:
        """Read a learned file.

        Args:
            text: Its content.
            experiment: The experiment that is to use it.
            chart: The chart of that experiment.

        Raises:
            RefusedError: It is not such a file, was cut short, belongs to another version, experiment or chart, or its
                numbers are not a covariance.
        """
        raw = _parse(text)
        if raw.get("version") != VERSION:
            raise RefusedError(f"it has format {str(raw.get('version'))[:20]}, and this version of pftrack reads 1")
        if raw.get("experiment") != experiment:
            raise RefusedError(f"it was learned in {str(raw.get('experiment'))[:64]!r}, and this is {experiment!r}")
        try:
            learned = cls.model_validate(raw)
        except ValidationError as error:
            raise RefusedError(_sentence(error)) from None
        if learned.chart != chart:
            raise RefusedError(f"it was learned of {_describe(learned.chart)}, and {experiment} has {_describe(chart)}")
        return learned

    @property
    def text(self) -> str:
        """The file."""
        return json.dumps(self.model_dump(mode="json"), indent=1) + "\n"

    @property
    def origin(self) -> str:
        """Short description of the data that it was learned from."""
        return f"{_tracks(self.tracks)}, {self.frames} frames"

    def diffusion(
        self, reading: Reading, *, scale: float = 1.0, correlated: bool = True, drifting: bool = False
    ) -> Diffusion:
        """Return the Gaussian that changes are drawn from.

        Args:
            reading: Frame in which a place changes, one of the chart's.
            scale: Factor of all standard deviations.
            correlated: Whether changes keep their learned correlations; otherwise each is drawn independently, with the
                same standard deviation.
            drifting: Whether it keeps its mean, which is omitted otherwise.

        Raises:
            ValueError: The reading makes no sense for the chart.
        """
        return _diffusion(self, reading, scale, correlated, drifting)


def learn(tracks: Iterable[ArrayLike], chart: Chart, experiment: str) -> Learned:
    """Learn from tracks how motion and shape change.

    Args:
        tracks: (T, d) recorded states each; rows that are not finite are gaps.
        chart: Meaning of the numbers of a state.
        experiment: Name of the experiment that they come from.

    Raises:
        RefusedError: There are too few frames, or a component never changes or changes absurdly.
    """
    given = [np.array(track, np.float64) for track in tracks]
    readings = _learned_readings(chart)
    first = [changes(track, chart, readings[0]) for track in given]
    used = [track for track, found in zip(given, first, strict=True) if len(found)]
    count, least = sum(map(len, first)), CHANGES_EACH * len(chart.names)
    if count < least:
        before = "two frames" if chart.place else "a frame"
        raise RefusedError(
            f"expected at least {least} frames with {before} known before them, got {count} in {_tracks(len(used))}; "
            "learn from longer runs, or from more of them"
        )
    moved = np.vstack([steps(track, chart) for track in used])
    spreads = []
    for reading in readings:
        mean, covariance = _moments(np.vstack([changes(track, chart, reading) for track in used]))
        spreads.append({"reading": reading, "mean": mean.tolist(), "covariance": covariance.tolist()})
    mean, covariance = _moments(moved)
    try:
        return Learned.model_validate(
            {
                "experiment": experiment,
                "chart": chart,
                "tracks": len(used),
                "frames": sum(int(np.isfinite(track).all(axis=1).sum()) for track in used),
                "step_mean": mean.tolist(),
                "step_sd": np.sqrt(np.diagonal(covariance)).tolist(),
                "spreads": spreads,
            }
        )
    except ValidationError as error:
        raise RefusedError(_sentence(error)) from None


def _learned_readings(chart: Chart) -> list[Reading]:
    return [reading for reading in chart.readings if reading != "world"]


@lru_cache(maxsize=64)
def _diffusion(learned: Learned, reading: Reading, scale: float, correlated: bool, drifting: bool) -> Diffusion:
    learned.chart.check_reading(reading)
    wanted = "document" if reading == "world" else reading
    spread = next(spread for spread in learned.spreads if spread.reading == wanted)
    covariance = np.array(spread.covariance) * scale * scale
    if not correlated:
        covariance = np.diag(np.diagonal(covariance))
    return Diffusion(np.array(spread.mean) if drifting else np.zeros(len(covariance)), covariance)


def _moments(rows: Floats) -> tuple[Floats, Floats]:
    """Return mean (k,) and covariance (k, k) of rows (n, k), n > 1."""
    count = len(rows)
    mean = product(np.ones(count), rows) / count
    centred = rows - mean
    return mean, product(centred.T, centred) / (count - 1)


def _check_spread(spread: Spread, chart: Chart) -> None:
    """Refuse numbers that are not a covariance, and components that hardly change."""
    size = len(chart.names)
    if len(spread.mean) != size or [len(row) for row in spread.covariance] != [size] * size:
        raise ValueError(f"expected {size} means and {size} x {size} covariances of the reading {spread.reading}")
    for i, (name, unit) in enumerate(zip(chart.change_names, chart.change_units, strict=True)):
        variance = spread.covariance[i][i]
        if variance < 0.0:
            raise ValueError(f"expected a covariance, got a variance of {variance:g} of {name}")
        if variance < SMALLEST**2:
            raise ValueError(
                f"{chart.names[i]!r} never changes in it, so no particle would ever change it either; learn from "
                "runs in which it does"
            )
        if variance > LARGEST**2 or abs(spread.mean[i]) > LARGEST:
            raise ValueError(
                f"expected at most {LARGEST:g} {unit} as {name}, got {spread.mean[i]:.3g} with a standard deviation of "
                f"{math.sqrt(variance):.3g}"
            )
    covariance = np.array(spread.covariance)
    sd = np.sqrt(np.diagonal(covariance))
    correlation = covariance / np.multiply.outer(sd, sd)
    if np.abs(correlation - correlation.T).max() > ROUNDING:
        raise ValueError(f"expected a symmetric covariance of the reading {spread.reading}")
    least = eigenvalues(correlation)[0][-1]
    if least < -size * ROUNDING:
        raise ValueError(
            f"expected a covariance of the reading {spread.reading}, got one by which some change would have a "
            f"variance below 0 (the least eigenvalue of its correlations is {least:.3g})"
        )


def _parse(text: str) -> dict[str, Any]:
    """Return the JSON object of a learned file."""
    try:
        raw = json.loads(text)
    except json.JSONDecodeError as error:
        cut = text.lstrip().startswith("{") and error.pos >= len(text.rstrip()) - 1
        raise RefusedError("it was cut short" if cut else f"it is not JSON ({error})") from None
    except (RecursionError, ValueError):
        raise RefusedError("it is not the JSON of a learned motion") from None
    if not isinstance(raw, dict) or raw.get("format") != "pftrack-learned":
        raise RefusedError("it is not a learned motion, as `pftrack learn` writes it")
    return raw


def _sentence(error: ValidationError) -> str:
    """Return the first error, in one sentence."""
    first = error.errors()[0]
    cause = first.get("ctx", {}).get("error")
    if isinstance(cause, ValueError):
        return str(cause)
    place = ".".join(map(str, first["loc"]))
    return f"{place}: {first['msg'][:1].lower()}{first['msg'][1:]}"


def _tracks(count: int) -> str:
    return f"{count} {'track' if count == 1 else 'tracks'}"


def _describe(chart: Chart) -> str:
    named: Sequence[str] = [
        f"{name} ({unit})" if unit else name for name, unit in zip(chart.names, chart.units, strict=True)
    ]
    return ", ".join(named)


# Guidance: an experiment offers its recorded states for learning, and the learned motion guides its particles.
#
# An experiment whose states have a place, a heading or a shape declares how to read them (`Guidance`). `pftrack learn`
# and the page of a session need nothing more to learn from its runs (`pftrack.filters.learning.diffusion`). The text of
# a learned file is the value of a parameter of its trackers (`pftrack.experiments.shared.reports.learned_motion`), so a
# run, a sweep, a session and a share link contain all of it.


@dataclass(frozen=True)
class Guidance:
    """How an experiment's runs are learned from.

    Attributes:
        experiment: Its name.
        chart: Meaning of the numbers of a recorded state.
        built_in: Text of the default learned file.
        parameter: Name of the parameter whose value is the text of a learned file.
        series: Name of the vector of numbers that a row's recorded state is; empty for the estimate.
        scale: Divisors that convert a row's numbers to the chart's units; 180/pi for angles in degrees.
    """

    experiment: str
    chart: Chart
    built_in: str
    parameter: str = "learned"
    series: str = ""
    scale: float = 1.0

    def parse(self, text: str) -> Learned:
        """Return the learned motion of a file; for an empty text, the built-in one.

        Raises:
            ParameterError: It is not a learned file, or belongs to another experiment, chart or version.
        """
        try:
            return _read(text or self.built_in, self.experiment, self.chart)
        except RefusedError as error:
            raise ParameterError(self.parameter, text, f"a learned motion ({error})") from None

    def states(self, rows: Sequence["Diagnostics"]) -> Floats:
        """Return the recorded states of a run (L, d), NaN where the target was lost or searched.

        Users inspect tracks before learning from them; where the truth is known, it replaces the inspection.

        Raises:
            RefusedError: A row holds another number of values than a state has.
        """
        states = np.full((len(rows), len(self.chart.names)), np.nan)
        for frame, row in enumerate(rows):
            recorded = row.vector(self.series) if self.series else row.estimate
            if recorded is not None and len(recorded) != states.shape[1]:
                raise RefusedError(
                    f"frame {row.frame} must hold a state of {', '.join(self.chart.names)} to learn from, "
                    f"{states.shape[1]} numbers, got {len(recorded)}"
                )
            if recorded is not None and not row.searching and not row.is_lost:
                states[frame] = np.array(recorded) / self.scale
        return states

    def saved_states(self, columns: Mapping[str, NDArray[Any]], name: str) -> Floats:
        """Return the same from the columns of a saved run, given the name of its file.

        Raises:
            RefusedError: The file has no such states.
        """
        recorded = columns.get(f"series_{self.series}" if self.series else "estimate")
        wanted = len(self.chart.names)
        if recorded is None or recorded.dtype.kind != "f" or recorded.shape[1:] != (wanted,):
            raise RefusedError(f"{name} holds no states of {', '.join(self.chart.names)} to learn from; save it again")
        states: Floats = np.array(recorded, np.float64) / self.scale
        for gone in (columns.get("lost"), columns.get("searching")):
            if gone is not None and gone.shape == states.shape[:1]:
                states[gone == 1] = np.nan
        return states

    def learn(self, tracks: Iterable[Floats]) -> Learned:
        """Return the motion learned from the recorded states of one or several runs.

        Raises:
            RefusedError: They are too few, or something never changes in them.
        """
        return learn(tracks, self.chart, self.experiment)

    @property
    def export(self) -> Export:
        """The file learned from the computed part of the run."""
        return Export("learned", "Learned motion", "learned.json", "application/json", partial(_export, self))


def _export(guidance: Guidance, state: Any, rows: Sequence["Diagnostics"]) -> bytes:  # noqa: ANN401 - of any tracker
    del state
    try:
        return guidance.learn([guidance.states(rows)]).text.encode()
    except RefusedError as error:
        raise ConflictError(str(error)) from None


@lru_cache(maxsize=32)
def _read(text: str, experiment: str, chart: Chart) -> Learned:
    return Learned.read(text, experiment=experiment, chart=chart)


@dataclass(frozen=True, eq=False)
class GuidedDynamics:
    """p(x' | x) by which motion and shape change as they did in recorded tracks.

    Attributes:
        diffusion: The changes.
        chart: Meaning of a state's numbers; a state is the place, its velocity, then heading, angles and numbers.
        reading: Frame in which a place changes.
    """

    diffusion: Diffusion
    chart: Chart
    reading: Reading

    def predict(self, states: Floats) -> Floats:
        """Return the states (N, D) as they are: the drawn turn sets the direction of the velocity."""
        return states

    def diffuse(self, rng: Generator, means: Floats, ancestors: Ints) -> Floats:
        """Draw next states (n, D) of the ancestors (n,) chosen among the states (N, D)."""
        normals = rng.standard_normal((len(self.diffusion.mean), len(ancestors)))
        return advance_states(
            means, ancestors, normals, self.diffusion.root, self.diffusion.mean, self.chart, self.reading
        )
