"""Comparisons: two to four runs beside each other on the frames that they have in common.

The runs may have different trackers, parameters, seeds and timelines, and belong to different experiments, as long as
their errors have one unit. Runs on the same recording belong together picture by picture, wherever in it each of them
began. All others, on scenes that are simulated or on different recordings, belong together by the frames' numbers.
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
    """The frames that runs have in common, counted from 0 on.

    Attributes:
        frames: How many they are.
        firsts: The number that each run has for the first of them; one of these numbers is 0.
    """

    frames: int
    firsts: tuple[int, ...]


def align(runs: Sequence[Run]) -> Alignment:
    """Return the frames that runs have in common.

    Args:
        runs: Two to four, computed or not: what counts is how long they are.

    Raises:
        RefusedError: There are too few or too many, their units differ, or they have no frame in common.
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
    """Return the number of each run's frame 0 among all that can be common to them."""
    footage = [run.setup.footage for run in runs]
    known = [one for one in footage if one is not None]
    contents = {one.sha256 for one in known}
    if len(known) < len(runs) or len(contents) > 1 or None in contents:
        return [0] * len(runs)
    return [one.start for one in known]


# The frames of a run are not independent trials: an error that is large in one frame is large in the next. So the
# interval of their mean difference is that of a few long stretches
# (`pftrack.core.numerics.statistics.dependent_mean_interval`). It speaks of these two runs, of their one seed; what
# other seeds would give is a question for a sweep.

CONFIDENCE = 0.95


@dataclass(frozen=True, slots=True)
class Divergence:
    """Where two runs part.

    Attributes:
        first: Place of one run in the comparison.
        second: Place of the other.
        frame: The first frame in which their estimates differ, if only in the last bit; None if they never do.
    """

    first: int
    second: int
    frame: int | None


@dataclass(frozen=True, slots=True)
class Paired:
    """How much one run's frames differ from another's in a quantity.

    Attributes:
        first: Place of one run in the comparison.
        second: Place of the other.
        name: Of the quantity: "error", or that of a measure which is a share of frames.
        title: What it is called.
        unit: Of the difference; empty for a pure number or a difference of shares.
        better: Whether a "higher" or a "lower" value is better.
        frames: In how many frames both runs have it.
        mean: Of the second run's value minus the first's, over those frames; NaN where there are none.
        low: Lower end of its 95 % interval; NaN where that is not applicable.
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
    """Return the first frame in which estimates differ to the bit; None if they agree as far as both are known.

    Args:
        one: Estimates of a run by frame, (d,) each.
        other: Those of the other run, from the same frame on.
    """
    return next((frame for frame, pair in enumerate(zip(one, other, strict=False)) if not _same(*pair)), None)


def _same(one: Sequence[float], other: Sequence[float]) -> bool:
    return len(one) == len(other) and bool(np.array_equal(one, other, equal_nan=True))


def paired_difference(one: Floats, other: Floats) -> tuple[int, float, float, float]:
    """Return how many frames two runs have a value in, the mean of the other's minus the one's, and its interval.

    Args:
        one: (L,) values of the frames of a run; what is not finite is left out.
        other: (L,) those of the other run.
    """
    known = np.isfinite(one) & np.isfinite(other)
    gains = other[known] - one[known]
    mean = float(gains.mean()) if len(gains) else np.nan
    return len(gains), mean, *dependent_mean_interval(gains, CONFIDENCE)


# A parameter may change in mid-run, so that what a run has of it is a course of values. It is listed among the
# differences where these courses differ within the frames that are compared, and only there.

Steps: TypeAlias = tuple[tuple[int, Value], ...]
"""Values by the frame from which on they are in force, as the frames that are compared are counted."""


@dataclass(frozen=True, slots=True)
class Setting:
    """Something in which runs differ.

    Attributes:
        name: The parameter's; "experiment", "recording", "start", "mark", "tracker", "seed" or "move" for others.
        title: What it is called.
        values: What each run has of it, in words with the unit; None for a run that knows no such thing.
    """

    name: str
    title: str
    values: tuple[str | None, ...]


def settings(runs: Sequence[Run], alignment: Alignment) -> tuple[Setting, ...]:
    """Return what differs between runs: what they are made on, then tracker and seed, then parameters as declared.

    A parameter is listed where a run has it at another value than suits what it is made on by itself; what follows from
    another experiment or another mark alone is not, and neither is what is only drawn.

    Args:
        runs: The runs.
        alignment: Which frames are compared; what changes after them does not count.
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
    """Return the course of a parameter that nobody has set: what suits the scene or the recording."""
    value = getattr(run.setup.parameters, name, None)
    return None if value is None else ((0, value),)


def _values(run: Run, name: str, span: tuple[int, int]) -> Steps:
    return _course(((it.start, getattr(it.parameters, name)) for it in run.timeline.segments), span)


def _course(steps: Iterable[tuple[int, Value]], span: tuple[int, int]) -> Steps:
    """Return the steps within a span (first frame, how many), counted from there, without those that change nothing."""
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
    """Return the values of a parameter over time: "800, 200 from frame 57 on"."""
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
"""A run is called by so many of its settings at most."""

TOLD_BARE = {"experiment", "recording", "tracker"}
"""Settings whose values say by themselves what they are."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """What came of one of the runs in the frames that are compared.

    Attributes:
        mean_error: Over the frames whose truth is known, in the comparison's unit; NaN where there are none, or an
            estimate is not finite.
        success_share: Share of these frames that the measure counts which decides on success; NaN where it is not
            known.
        lost_frames: In how many frames the target is lost (`pftrack.runs.loss`); None where nobody says.
        first_lost_frame: The first of them; None where it never is.
    """

    mean_error: Known
    success_share: Known
    lost_frames: int | None
    first_lost_frame: int | None

    def as_dict(self) -> dict[str, Any]:
        """Return it as JSON values; what is not a number becomes None."""
        return as_json(self)


@dataclass(frozen=True, slots=True)
class ComparisonOutline:
    """What is known of a comparison before anything is computed.

    Attributes:
        unit: Of the errors of all runs.
        frames: How many the runs have in common.
        firsts: The number that each run has for the first of them.
        names: What to call each run.
        colours: A colour for each, "#rrggbb".
        settings: What differs, and that alone.
    """

    unit: str
    frames: int
    firsts: tuple[int, ...]
    names: tuple[str, ...]
    colours: tuple[str, ...]
    settings: tuple[Setting, ...]


@dataclass(frozen=True, slots=True)
class ComparisonResult:
    """What is known of a comparison once its runs have been computed.

    Attributes:
        frames: How many were compared.
        outcomes: What came of each run.
        partings: Where each pair of runs parts.
        first_difference: The first frame in which any two runs part.
        before_loss: The frame from which to watch the first loss of any run.
        paired: How much each other run differs from the first.
    """

    frames: int
    outcomes: tuple[Outcome, ...]
    partings: tuple[Divergence, ...]
    first_difference: int | None
    before_loss: int | None
    paired: tuple[Paired, ...]


@dataclass(frozen=True)
class Comparison:
    """Two to four runs beside each other.

    Its frames are those that all runs have in common, counted from 0 on, as far as all of them have been computed.

    Attributes:
        runs: The runs; the others are measured against the first.
        alignment: Which of their frames belong together.
    """

    runs: tuple[Run, ...]
    alignment: Alignment

    @classmethod
    def of(cls, *runs: Run) -> Self:
        """Return the comparison of runs, which need not have been computed; see `finish`.

        Raises:
            RefusedError: They are too few or too many, their units differ, or they have no frame in common.
        """
        return cls(runs, align(runs))

    def finish(self) -> Self:
        """Compute what is missing of the frames that the runs have in common, and return this very comparison."""
        for _ in self.computing():
            pass
        return self

    def computing(self) -> Iterator[tuple[int, int]]:
        """Do the same run by run, and yield how many frames are done and how many there are to do."""
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
        """How many frames can be compared so far."""
        return min(map(len, self._compute_rows()))

    @property
    def settings(self) -> tuple[Setting, ...]:
        """What differs between the runs, and that alone."""
        return settings(self.runs, self.alignment)

    @property
    def names(self) -> tuple[str, ...]:
        """What to call each run: what is special about it, as few of its settings as tell it from the others."""
        told = [setting for setting in self.settings if None not in setting.values][:TOLD_SETTINGS]
        names = [""] * len(self.runs)
        for count in range(1, len(told) + 1):
            names = [", ".join(_describe(each, place) for each in told[:count]) for place in range(len(self.runs))]
            if len(set(names)) == len(names):
                return tuple(names)
        return tuple(f"{name or 'Run'} ({place})" for place, name in enumerate(names, 1))

    @property
    def colours(self) -> tuple[str, ...]:
        """A colour for each run, "#rrggbb", that can be told from the others without red and green."""
        return tuple(map(hexadecimal, BRANCHES[: len(self.runs)]))

    @property
    def rows(self) -> tuple[list[Diagnostics], ...]:
        """The diagnostics of each run in the frames that can be compared."""
        return tuple(rows[: self.frames] for rows in self._compute_rows())

    @property
    def losses(self) -> tuple[Loss, ...]:
        """In which of the frames that can be compared each run has lost its target."""
        return tuple(map(Loss.of, self.rows))

    @property
    def partings(self) -> tuple[Divergence, ...]:
        """Where each pair of runs parts."""
        estimates = [[row.estimate for row in rows] for rows in self.rows]
        pairs = combinations(range(len(self.runs)), 2)
        return tuple(Divergence(one, other, find_divergence(estimates[one], estimates[other])) for one, other in pairs)

    @property
    def first_difference(self) -> int | None:
        """The first frame in which any two runs have other estimates; None where there is none."""
        return min((it.frame for it in self.partings if it.frame is not None), default=None)

    @property
    def outcomes(self) -> tuple[Outcome, ...]:
        """What came of each run."""
        return tuple(map(_outcome, self.runs, self.rows, self.losses))

    @property
    def success_title(self) -> str:
        """Title of the measure that decides on success, where it is the same one for all runs."""
        titles = {_decisive(run).title for run in self.runs}
        return titles.pop() if len(titles) == 1 else "Share of successful frames"

    @property
    def before_loss(self) -> int | None:
        """The frame from which to watch the first loss of any run; None where none loses its target."""
        found = [
            loss.approach([bool(row.hidden) for row in rows], loss.first_lost_frame)
            for rows, loss in zip(self.rows, self.losses, strict=True)
            if loss.first_lost_frame is not None
        ]
        return min((frame for frame in found if frame is not None), default=None)

    @property
    def paired(self) -> tuple[Paired, ...]:
        """How much each other run differs from the first: in its error, and in the measure that decides on success.

        The measure is left out where two runs are judged by different ones, or nothing is known of it.
        """
        return tuple(each for other in range(1, len(self.runs)) for each in self._pair(other))

    @property
    def outline(self) -> ComparisonOutline:
        """What is known before anything is computed."""
        alignment = self.alignment
        return ComparisonOutline(self.unit, alignment.frames, alignment.firsts, self.names, self.colours, self.settings)

    @property
    def result(self) -> ComparisonResult:
        """What is known of the frames that all runs have computed."""
        return ComparisonResult(
            self.frames, self.outcomes, self.partings, self.first_difference, self.before_loss, self.paired
        )

    def as_dict(self) -> dict[str, Any]:
        """Return all that is known of it as JSON values."""
        return {**as_json(self.outline), **as_json(self.result)}

    def _repr_html_(self) -> str:
        """Return what a notebook shows: what differs, what came of each run, and what one gains."""
        return cast("str", load(PRESENTERS, "comparison_html")(self))

    def _compute_rows(self) -> Iterator[list[Diagnostics]]:
        """Yield what each run has computed of the frames that they have in common."""
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
    """Return what that measure says of each frame, 1 or 0, NaN where it is not known."""
    course = evaluated_run(run.experiment, rows)
    return _decisive(run).values(course)
