"""Comparisons: two to four runs side by side on their common frames.

The runs may have different trackers, parameters, seeds and timelines, and belong to different experiments, as long as
their errors have the same unit. Runs on the same recording are aligned by its pictures, wherever each run began. All
other runs, in simulated scenes or on different recordings, are aligned by frame numbers.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any, Literal, Self, TypeAlias, cast

import numpy as np

from pftrack.core.arrays import Floats
from pftrack.core.entry_points import PRESENTERS, load
from pftrack.core.model.drawing import BRANCHES, hexadecimal
from pftrack.core.model.measures import Measure
from pftrack.core.model.parameters import Declaration, Value, declarations
from pftrack.core.model.series import Known, as_json
from pftrack.core.model.tracker import Diagnostics
from pftrack.core.numerics.statistics import dependent_mean_interval
from pftrack.core.refusal import RefusedError
from pftrack.runs.loss import Loss
from pftrack.runs.run import Run
from pftrack.runs.scoring import evaluated_run

MOST_RUNS = 4


@dataclass(frozen=True, slots=True)
class Alignment:
    """The common frames of runs, counted from 0.

    Attributes:
        frames: Number of common frames.
        firsts: Number of the first common frame in each run; at least one of them is 0.
    """

    frames: int
    firsts: tuple[int, ...]


def align(runs: Sequence[Run]) -> Alignment:
    """Return the common frames of runs.

    Args:
        runs: Two to four runs; their lengths count, computed or not.

    Raises:
        RefusedError: There are too few or too many runs, their units differ, or they have no common frame.
    """
    if not 2 <= len(runs) <= MOST_RUNS:
        raise RefusedError(f"expected two to four runs to compare, got {len(runs)}")
    _check_units(runs)
    starts = _starts(runs)
    begin, end = max(starts), min(start + run.frames for start, run in zip(starts, runs, strict=True))
    if begin >= end:
        pictures = ", ".join(f"{start} to {start + run.frames - 1}" for start, run in zip(starts, runs, strict=True))
        raise RefusedError(
            f"the runs have no picture of the recording in common: they show pictures {pictures}; compare runs that "
            "begin closer to each other, or that are longer"
        )
    return Alignment(end - begin, tuple(begin - start for start in starts))


def _check_units(runs: Sequence[Run]) -> None:
    first = runs[0].experiment
    for run in runs[1:]:
        other = run.experiment
        if other.judge.unit != first.judge.unit:
            raise RefusedError(
                f"errors of {first.title} are {_in_words(first.judge.unit)}, those of {other.title} "
                f"{_in_words(other.judge.unit)}; compare runs whose errors have one unit"
            )


def _in_words(unit: str) -> str:
    return f"in {unit}" if unit else "pure numbers"


def _starts(runs: Sequence[Run]) -> list[int]:
    """Return the number of each run's frame 0 on a common scale."""
    footage = [run.setup.footage for run in runs]
    known = [one for one in footage if one is not None]
    contents = {one.sha256 for one in known}
    if len(known) < len(runs) or len(contents) > 1 or None in contents:
        return [0] * len(runs)
    return [one.start for one in known]


# The frames of a run are not independent trials: an error that is large in one frame is large in the next. So the
# interval of the mean difference is computed from a few long stretches
# (`pftrack.core.numerics.statistics.dependent_mean_interval`). It holds for these two runs with their one seed; a sweep
# shows the effect of other seeds.

CONFIDENCE = 0.95


@dataclass(frozen=True, slots=True)
class Divergence:
    """The frame at which two runs diverge.

    Attributes:
        first: Index of one run in the comparison.
        second: Index of the other.
        frame: First frame in which their estimates differ by at least one bit; None if they never do.
    """

    first: int
    second: int
    frame: int | None


@dataclass(frozen=True, slots=True)
class Paired:
    """Mean difference of a quantity between the frames of two runs.

    Attributes:
        first: Index of one run in the comparison.
        second: Index of the other.
        name: Name of the quantity: "error", or a measure that is a share of frames.
        title: Title of the quantity.
        unit: Unit of the difference; empty for a pure number or a difference of shares.
        better: Whether a "higher" or a "lower" value is better.
        frames: Number of frames in which both runs have a value.
        mean: Mean over those frames of the second run's value minus the first's; NaN without such frames.
        low: Lower end of its 95 % interval; NaN if there is no interval.
        high: Upper end.
    """

    first: int
    second: int
    name: str
    title: str
    unit: str
    better: Literal["higher", "lower"]
    frames: int
    mean: Known
    low: Known
    high: Known


def find_divergence(one: Sequence[Sequence[float]], other: Sequence[Sequence[float]]) -> int | None:
    """Return the first frame in which estimates differ by at least one bit; None if all common ones are equal.

    Args:
        one: Estimates of one run, (d,) for each frame.
        other: Estimates of the other run, from the same frame on.
    """
    return next((frame for frame, pair in enumerate(zip(one, other, strict=False)) if not _same(*pair)), None)


def _same(one: Sequence[float], other: Sequence[float]) -> bool:
    return len(one) == len(other) and bool(np.array_equal(one, other, equal_nan=True))


def paired_difference(one: Floats, other: Floats) -> tuple[int, float, float, float]:
    """Return the number of frames with both values, the mean of `other` minus `one`, and its interval.

    Args:
        one: (L,) values of one run; non-finite values are left out.
        other: (L,) values of the other run.
    """
    known = np.isfinite(one) & np.isfinite(other)
    gains = other[known] - one[known]
    mean = float(gains.mean()) if len(gains) else np.nan
    return len(gains), mean, *dependent_mean_interval(gains, CONFIDENCE)


# A parameter may change during a run, so each run has a course of values of it. A parameter is listed as a difference
# if and only if these courses differ within the compared frames.

Steps: TypeAlias = tuple[tuple[int, Value], ...]
"""Pairs of a frame, counted among the compared ones, and the value in force from it on."""


@dataclass(frozen=True, slots=True)
class Setting:
    """A setting in which runs differ.

    Attributes:
        name: Name of the parameter, or "experiment", "recording", "start", "mark", "tracker", "seed" or "move".
        title: Title of the setting.
        values: Value of each run as text with its unit; None for a run without this setting.
    """

    name: str
    title: str
    values: tuple[str | None, ...]


def settings(runs: Sequence[Run], alignment: Alignment) -> tuple[Setting, ...]:
    """Return the settings in which runs differ: the source, then tracker and seed, then parameters as declared.

    A parameter is listed if its value in a run is not the default for that run's source. Differences that follow from
    another experiment or mark alone are left out, and so are drawing parameters.

    Args:
        runs: The runs.
        alignment: The compared frames; later changes do not count.
    """
    spans = [(first, alignment.frames) for first in alignment.firsts]
    rows = (
        Setting("experiment", "Experiment", tuple(run.experiment.title for run in runs)),
        *_of_recordings(runs),
        Setting("tracker", "Tracker", tuple(map(_trackers, runs, spans))),
        Setting("seed", "Seed", tuple(map(_seeds, runs, spans))),
        *_of_parameters(runs, spans),
        Setting("move", "Moved by hand", tuple(map(_moves, runs, spans))),
    )
    return tuple(row for row in rows if len(set(row.values)) > 1)


def _of_recordings(runs: Sequence[Run]) -> Iterator[Setting]:
    footage = [run.setup.footage for run in runs]
    names = ((one.name or "a recording") if one else "simulated" for one in footage)
    yield Setting("recording", "Recording", tuple(names))
    yield Setting("start", "Begins at picture", tuple(str(one.start) if one else None for one in footage))
    marks = [one.mark if one else None for one in footage]
    kinds = (None if mark is None else f"mark {marks.index(mark) + 1}" for mark in marks)
    yield Setting("mark", "Target", tuple(kinds))


def _trackers(run: Run, span: tuple[int, int]) -> str:
    titles = {name: tracker.title for name, tracker in run.experiment.trackers.items()}
    return _over_time(_course(((it.start, titles[it.tracker]) for it in run.timeline.segments), span), str)


def _seeds(run: Run, span: tuple[int, int]) -> str:
    seeds = ((it.start, run.seed if it.seed is None else it.seed) for it in run.timeline.segments)
    return _over_time(_course(seeds, span), str)


def _moves(run: Run, span: tuple[int, int]) -> str:
    first, count = span
    moved = ((move.words, it.start - first) for it in run.timeline.segments for move in it.moves)
    return ", ".join(f"{words} before frame {frame}" for words, frame in moved if 0 < frame < count) or "nothing"


def _of_parameters(runs: Sequence[Run], spans: Sequence[tuple[int, int]]) -> Iterator[Setting]:
    declared = [_declarations(run) for run in runs]
    every = {name: declaration for known in declared for name, declaration in known.items()}
    for name, declaration in every.items():
        courses = [
            _values(run, name, span) if name in known else None
            for run, known, span in zip(runs, declared, spans, strict=True)
        ]
        if all(course in {None, _usual(run, name)} for run, course in zip(runs, courses, strict=True)):
            continue
        yield Setting(
            name,
            declaration.title,
            tuple(None if course is None else _course_in_words(declaration, course) for course in courses),
        )


def _declarations(run: Run) -> Mapping[str, Declaration]:
    return {it.name: it for it in declarations(type(run.setup.parameters)) if it.role != "drawing"}


def _usual(run: Run, name: str) -> Steps | None:
    """Return the default course of a parameter for the scene or the recording."""
    value = getattr(run.setup.parameters, name, None)
    return None if value is None else ((0, value),)


def _values(run: Run, name: str, span: tuple[int, int]) -> Steps:
    return _course(((it.start, getattr(it.parameters, name)) for it in run.timeline.segments), span)


def _course(steps: Iterable[tuple[int, Value]], span: tuple[int, int]) -> Steps:
    """Return the steps within a span (first frame, length), counted from its start, without repetitions of a value."""
    first, count = span
    kept: list[tuple[int, Value]] = []
    for frame, value in steps:
        at = max(0, frame - first)
        if kept and kept[-1][0] == at:
            kept.pop()
        if at < count and not (kept and kept[-1][1] == value):
            kept.append((at, value))
    return tuple(kept)


def _course_in_words(declaration: Declaration, steps: Steps) -> str:
    """Return the values of a parameter over time as text: "800, 200 from frame 57 on"."""
    return _over_time(steps, lambda value: _format_value(declaration, value))


def _over_time(steps: Steps, said: Callable[[Value], str]) -> str:
    begin, *later = steps
    return ", ".join([said(begin[1]), *(f"{said(value)} from frame {frame} on" for frame, value in later)])


def _format_value(declaration: Declaration, value: Value) -> str:
    if isinstance(value, bool):
        return "on" if value else "off"
    if declaration.kind == "file":
        return f"a file of {len(str(value))} characters" if value else "none"
    text = f"{value:.6g}" if isinstance(value, int | float) else value or "none"
    return f"{text} {declaration.unit}".strip()


TOLD_SETTINGS = 2
"""Most settings in the name of a run."""

TOLD_BARE = {"experiment", "recording", "tracker"}
"""Settings whose values need no title."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """The result of one run in the compared frames.

    Attributes:
        mean_error: Mean error over the frames with known truth, in the comparison's unit; NaN if there are none, or an
            estimate is not finite.
        success_share: Value in these frames of the measure that decides on success; NaN where it is unknown.
        lost_frames: Number of lost frames (`pftrack.runs.loss`); None where nobody judges.
        first_lost_frame: First lost frame; None if there is none.
    """

    mean_error: Known
    success_share: Known
    lost_frames: int | None
    first_lost_frame: int | None

    def as_dict(self) -> dict[str, Any]:
        """Return the outcome as JSON values, with None for NaN."""
        return as_json(self)


@dataclass(frozen=True, slots=True)
class ComparisonOutline:
    """A comparison before anything is computed.

    Attributes:
        unit: Unit of the errors of all runs.
        frames: Number of common frames.
        firsts: Number of the first common frame in each run.
        names: Name of each run.
        colours: Colour of each run, "#rrggbb".
        settings: Settings in which the runs differ.
    """

    unit: str
    frames: int
    firsts: tuple[int, ...]
    names: tuple[str, ...]
    colours: tuple[str, ...]
    settings: tuple[Setting, ...]


@dataclass(frozen=True, slots=True)
class ComparisonResult:
    """A comparison of computed runs.

    Attributes:
        frames: Number of compared frames.
        outcomes: Result of each run.
        partings: Divergence of each pair of runs.
        first_difference: First frame in which any two runs diverge.
        before_loss: Frame from which to watch the first loss of any run.
        paired: Differences of each other run from the first.
    """

    frames: int
    outcomes: tuple[Outcome, ...]
    partings: tuple[Divergence, ...]
    first_difference: int | None
    before_loss: int | None
    paired: tuple[Paired, ...]


@dataclass(frozen=True)
class Comparison:
    """Two to four runs side by side.

    Its frames are the common frames that all runs have computed, counted from 0.

    Attributes:
        runs: The runs; the first is the reference for the others.
        alignment: Correspondence of their frames.
    """

    runs: tuple[Run, ...]
    alignment: Alignment

    @classmethod
    def of(cls, *runs: Run) -> Self:
        """Return the comparison of runs, computed or not; see `finish`.

        Raises:
            RefusedError: There are too few or too many runs, their units differ, or they have no common frame.
        """
        return cls(runs, align(runs))

    def finish(self) -> Self:
        """Compute all common frames, and return this comparison."""
        for _ in self.computing():
            pass
        return self

    def computing(self) -> Iterator[tuple[int, int]]:
        """Compute all common frames run by run, and yield the number of frames done and the total."""
        lasts = [first + self.alignment.frames - 1 for first in self.alignment.firsts]
        done = 0
        for run, last in zip(self.runs, lasts, strict=True):
            for step in run.seeking(last) if run.computed < last else ():
                yield done + step.diagnostics.frame + 1, sum(lasts) + len(lasts)
            done += last + 1

    @property
    def unit(self) -> str:
        """Unit of the errors of all runs."""
        return self.runs[0].experiment.judge.unit

    @property
    def frames(self) -> int:
        """Number of frames that can be compared so far."""
        return min(map(len, self._compute_rows()))

    @property
    def settings(self) -> tuple[Setting, ...]:
        """Settings in which the runs differ."""
        return settings(self.runs, self.alignment)

    @property
    def names(self) -> tuple[str, ...]:
        """Name of each run: the fewest settings that distinguish it from the others."""
        told = [setting for setting in self.settings if None not in setting.values][:TOLD_SETTINGS]
        names = [""] * len(self.runs)
        for count in range(1, len(told) + 1):
            names = [", ".join(_describe(each, place) for each in told[:count]) for place in range(len(self.runs))]
            if len(set(names)) == len(names):
                return tuple(names)
        return tuple(f"{name or 'Run'} ({place})" for place, name in enumerate(names, 1))

    @property
    def colours(self) -> tuple[str, ...]:
        """Colour of each run, "#rrggbb"; colour-blind people can distinguish them."""
        return tuple(map(hexadecimal, BRANCHES[: len(self.runs)]))

    @property
    def rows(self) -> tuple[list[Diagnostics], ...]:
        """Diagnostics of each run in the compared frames."""
        return tuple(rows[: self.frames] for rows in self._compute_rows())

    @property
    def losses(self) -> tuple[Loss, ...]:
        """Losses of each run in the compared frames."""
        return tuple(map(Loss.of, self.rows))

    @property
    def partings(self) -> tuple[Divergence, ...]:
        """Divergence of each pair of runs."""
        estimates = [[row.estimate for row in rows] for rows in self.rows]
        pairs = combinations(range(len(self.runs)), 2)
        return tuple(Divergence(one, other, find_divergence(estimates[one], estimates[other])) for one, other in pairs)

    @property
    def first_difference(self) -> int | None:
        """First frame in which the estimates of any two runs differ; None if there is none."""
        return min((it.frame for it in self.partings if it.frame is not None), default=None)

    @property
    def outcomes(self) -> tuple[Outcome, ...]:
        """Result of each run."""
        return tuple(map(_outcome, self.runs, self.rows, self.losses))

    @property
    def success_title(self) -> str:
        """Title of the measure that decides on success, or a general one if the runs use several."""
        titles = {_decisive(run).title for run in self.runs}
        return titles.pop() if len(titles) == 1 else "Share of successful frames"

    @property
    def before_loss(self) -> int | None:
        """Frame from which to watch the first loss of any run; None without a loss."""
        found = [
            loss.approach([bool(row.hidden) for row in rows], loss.first_lost_frame)
            for rows, loss in zip(self.rows, self.losses, strict=True)
            if loss.first_lost_frame is not None
        ]
        return min((frame for frame in found if frame is not None), default=None)

    @property
    def paired(self) -> tuple[Paired, ...]:
        """Difference of each other run from the first, in the error and in the measure that decides on success.

        The measure is left out if two runs use different ones, or if it is unknown.
        """
        return tuple(each for other in range(1, len(self.runs)) for each in self._pair(other))

    @property
    def outline(self) -> ComparisonOutline:
        """The comparison before anything is computed."""
        alignment = self.alignment
        return ComparisonOutline(self.unit, alignment.frames, alignment.firsts, self.names, self.colours, self.settings)

    @property
    def result(self) -> ComparisonResult:
        """The comparison over the frames that all runs have computed."""
        return ComparisonResult(
            self.frames, self.outcomes, self.partings, self.first_difference, self.before_loss, self.paired
        )

    def as_dict(self) -> dict[str, Any]:
        """Return outline and result as JSON values."""
        return {**as_json(self.outline), **as_json(self.result)}

    def _repr_html_(self) -> str:
        """Return the HTML that a notebook shows: settings, results and differences."""
        return cast("str", load(PRESENTERS, "comparison_html")(self))

    def _compute_rows(self) -> Iterator[list[Diagnostics]]:
        """Yield for each run the computed rows of the common frames."""
        for run, first in zip(self.runs, self.alignment.firsts, strict=True):
            yield run.diagnostics[first : first + self.alignment.frames]

    def _pair(self, other: int) -> Iterator[Paired]:
        runs, rows = (self.runs[0], self.runs[other]), (self.rows[0], self.rows[other])
        if not rows[0]:
            return
        yield Paired(0, other, "error", "Error", self.unit, "lower", *paired_difference(*map(_errors, rows)))
        measure = _decisive(runs[0])
        if measure.name == _decisive(runs[1]).name:
            found = paired_difference(*(_decisive_values(run, each) for run, each in zip(runs, rows, strict=True)))
            if found[0]:
                yield Paired(0, other, measure.name, measure.title, "", measure.better, *found)


def _describe(setting: Setting, place: int) -> str:
    value = setting.values[place]
    return str(value) if setting.name in TOLD_BARE else f"{setting.title} {value}"


def _outcome(run: Run, rows: Sequence[Diagnostics], loss: Loss) -> Outcome:
    if not rows:
        return Outcome(np.nan, np.nan, None, None)
    errors, values = _errors(rows), _decisive_values(run, rows)
    known, counted = errors[~np.isnan(errors)], values[~np.isnan(values)]
    return Outcome(
        float(known.mean()) if len(known) and np.isfinite(known).all() else np.nan,
        float(counted.mean()) if len(counted) else np.nan,
        loss.lost_frames,
        loss.first_lost_frame,
    )


def _errors(rows: Sequence[Diagnostics]) -> Floats:
    return np.array([np.nan if row.error is None else row.error for row in rows])


def _decisive(run: Run) -> Measure:
    """Return the measure that decides on the success of a run: a share of its frames."""
    return run.experiment.measure_named(run.setup.success)


def _decisive_values(run: Run, rows: Sequence[Diagnostics]) -> Floats:
    """Return the value of that measure in each frame, 1 or 0, or NaN if unknown."""
    course = evaluated_run(run.experiment, rows)
    return _decisive(run).values(course)
