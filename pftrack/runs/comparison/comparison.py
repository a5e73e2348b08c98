"""A comparison: runs beside each other, frame by frame, as far as they have been computed."""

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from itertools import combinations
from typing import Any, Self, cast

import numpy as np
from numpy.typing import NDArray

from pftrack.core.entry_points import PRESENTERS, load
from pftrack.core.model.diagnostics import Diagnostics
from pftrack.core.model.measures import Measure
from pftrack.core.model.palette import BRANCHES, hexadecimal
from pftrack.core.model.series import to_json
from pftrack.runs.comparison.alignment import Alignment, align
from pftrack.runs.comparison.paired import Divergence, Paired, find_divergence, paired_difference
from pftrack.runs.comparison.settings import Setting, settings
from pftrack.runs.loss_intervals import before_loss
from pftrack.runs.lost_frames import find_lost_frames
from pftrack.runs.run import Run
from pftrack.runs.scoring import evaluated_run

__all__ = ["Comparison", "Outcome"]

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
        kept: Share of these frames that the measure counts which decides on success; NaN where it is not known.
        first_lost: The first frame in which the target is lost, by the truth or by the tracker's own account; None
            where it never is.
        lost_frames: In how many it is.
    """

    mean_error: float
    kept: float
    first_lost: int | None
    lost_frames: int

    def as_dict(self) -> dict[str, Any]:
        """Return it as JSON values; what is not a number becomes None."""
        return {name: to_json(value) if isinstance(value, float) else value for name, value in asdict(self).items()}


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
            ComparisonError: They are too few or too many, their units differ, or they have no frame in common.
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
        return self.runs[0].experiment.unit

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
    def lost(self) -> tuple[NDArray[np.bool_], ...]:
        """(frames,) of each run, whether its target is lost, in the frames that can be compared."""
        placed = zip(self.runs, self.alignment.firsts, strict=True)
        return tuple(find_lost_frames(run).lost[first : first + self.frames] for run, first in placed)

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
        return tuple(map(_outcome, self.runs, self.rows, self.lost))

    @property
    def before_loss(self) -> int | None:
        """The frame from which to watch the first loss of any run; None where none loses its target."""
        found = [
            before_loss(lost.tolist(), [bool(row.hidden) for row in rows], outcome.first_lost)
            for rows, lost, outcome in zip(self.rows, self.lost, self.outcomes, strict=True)
            if outcome.first_lost is not None
        ]
        return min((frame for frame in found if frame is not None), default=None)

    @property
    def paired(self) -> tuple[Paired, ...]:
        """How much each other run differs from the first: in its error, and in the measure that decides on success.

        The measure is left out where two runs are judged by different ones, or nothing is known of it.
        """
        return tuple(each for other in range(1, len(self.runs)) for each in self._pair(other))

    def as_dict(self) -> dict[str, Any]:
        """Return all that is known of it as JSON values."""
        first_difference, outcomes = self.first_difference, self.outcomes
        return {
            "unit": self.unit,
            "frames": self.frames,
            "firsts": list(self.alignment.firsts),
            "names": list(self.names),
            "colours": list(self.colours),
            "settings": [each.as_dict() for each in self.settings],
            "outcomes": [each.as_dict() for each in outcomes],
            "partings": [each.as_dict() for each in self.partings],
            "first_difference": first_difference,
            "before_loss": self.before_loss,
            "paired": [each.as_dict() for each in self.paired],
        }

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
            found = paired_difference(*(_values(run, each) for run, each in zip(runs, rows, strict=True)))
            if found[0]:
                yield Paired(0, other, measure.name, measure.title, "", measure.better, *found)


def _describe(setting: Setting, place: int) -> str:
    value = setting.values[place]
    return str(value) if setting.name in TOLD_BARE else f"{setting.title} {value}"


def _outcome(run: Run, rows: Sequence[Diagnostics], lost: NDArray[np.bool_]) -> Outcome:
    if not rows:
        return Outcome(np.nan, np.nan, None, 0)
    errors, values = _errors(rows), _values(run, rows)
    known, counted = errors[~np.isnan(errors)], values[~np.isnan(values)]
    gone = np.flatnonzero(lost)
    return Outcome(
        float(known.mean()) if len(known) and np.isfinite(known).all() else np.nan,
        float(counted.mean()) if len(counted) else np.nan,
        int(gone[0]) if len(gone) else None,
        len(gone),
    )


def _errors(rows: Sequence[Diagnostics]) -> NDArray[np.float64]:
    return np.array([np.nan if row.error is None else row.error for row in rows])


def _decisive(run: Run) -> Measure:
    """Return the measure that decides on the success of a run: a share of its frames."""
    return run.experiment.measure_named(run.setup.success)


def _values(run: Run, rows: Sequence[Diagnostics]) -> NDArray[np.float64]:
    """Return what that measure says of each frame, 1 or 0, NaN where it is not known."""
    course = evaluated_run(run.experiment, rows)
    return _decisive(run).values(course)
