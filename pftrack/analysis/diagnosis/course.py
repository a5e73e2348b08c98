"""The course of a run: what its rows say over time, by what series are declared to be.

Rules of diagnosis read these columns and nothing else, so that they hold for whatever tracker, plug-in or recording: a
column is there if the run has it, and NaN where a frame does not. Nothing here knows the name of a series.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.diagnostics import Diagnostics
from pftrack.core.model.loss_witness import Witness
from pftrack.core.model.series import Series, SeriesRole
from pftrack.runs.lost_frames import judge_rows

__all__ = ["COLUMNS", "Column", "Course", "course_of"]

Numbers: TypeAlias = NDArray[np.float64]
Flags: TypeAlias = NDArray[np.bool_]


MOST_HIDDEN = 1.0 / 3.0
"""Share of the parts of a target that are to be seen, at most, where it counts as hidden."""


@dataclass(frozen=True, slots=True)
class Column:
    """What a column of a course is.

    Attributes:
        name: Attribute of `Course`.
        title: What it is, a few words.
        unit: Of its numbers; "run" for the run's own unit, empty for pure numbers.
        is_flag: Whether it is 0 or 1 in each frame.
    """

    name: str
    title: str
    unit: str = ""
    is_flag: bool = False


COLUMNS = {
    column.name: column
    for column in (
        Column("error", "distance from the truth", "run"),
        Column("deviation", "stated deviation", "run"),
        Column("excess", "error over the stated deviation"),
        Column("fit", "fit to the picture"),
        Column("ess_share", "ESS over the particles"),
        Column("distinct", "different particles"),
        Column("kept", "model's likeness to the first look"),
        Column("misfit", "difference from what is seen", "%"),
        Column("nis", "normalised innovation squared"),
        Column("hidden", "out of sight", is_flag=True),
        Column("searching", "searching", is_flag=True),
        Column("mirrored", "mirror image", is_flag=True),
        Column("mirror_gap", "from the mirror image, in deviations"),
        Column("outside", "beyond the picture", is_flag=True),
        Column("step", "way of the estimate a frame", "run"),
        Column("true_step", "way of the target a frame", "run"),
    )
}
"""What evidence is shown from, by name."""

BY_WORD: tuple[Witness, ...] = ("truth", "tracker")
"""Witnesses, whose word counts more first."""


@dataclass(frozen=True, eq=False)
class Course:
    """A run of L frames in columns; NaN where a frame does not have the number.

    Attributes:
        unit: Of estimates.
        estimates: (L, d).
        truths: (L, d).
        error: (L,) distance of the estimate from the truth.
        deviation: (L,) root mean square of the posterior standard deviations that are in the run's unit.
        sigmas: (L, d) posterior standard deviations; NaN of a number in another unit.
        excess: (L,) largest error of a component, or of what else is believed, over its standard deviation.
        lost: (L,) whether the target is lost.
        witnesses: Who says so of each frame.
        hidden: (L,) 1 where the target, or nearly all of its parts, are known to be out of sight, else 0.
        searching: (L,) 1 where the tracker looks for the target by its own account, else 0.
        evidence: (L,) log evidence of each frame; NaN of a tracker that knows of none.
        likeness: (L,) how like the model that is which is at the estimate, 0..1.
        kept: (L,) how like the first look the model is, 0..1.
        misfit: (L,) share of what is seen by which that differs from what is believed, %.
        nis: (L,) normalised innovation squared.
        nis_limit: (L,) what that stays below with a probability of 95 %.
        particles: (L,) number of them.
        ess: (L,) effective sample size.
        distinct: (L,) how many of the particles differ in what no noise renews.
        resampled: (L,) 1 where parents were drawn, else 0.
        mirrored: (L,) 1 where the estimate is nearer to a mirror image of the truth than to the truth, else 0.
        mirror_gap: (L,) deviations from the estimate to the nearest other pose that the camera shows alike.
        outside: (L,) 1 where the target, or where no truth is known the estimate, is beyond the picture, else 0.
        parts: (L, P) likeness of each part, where the target has parts.
        measured: (L, m) numbers that were measured.
    """

    unit: str
    estimates: Numbers
    truths: Numbers
    error: Numbers
    deviation: Numbers
    sigmas: Numbers
    excess: Numbers
    lost: Flags
    witnesses: tuple[Witness, ...]
    hidden: Numbers
    searching: Numbers
    evidence: Numbers
    likeness: Numbers
    kept: Numbers
    misfit: Numbers
    nis: Numbers
    nis_limit: Numbers
    particles: Numbers
    ess: Numbers
    distinct: Numbers
    resampled: Numbers
    mirrored: Numbers
    mirror_gap: Numbers
    outside: Numbers
    parts: Numbers
    measured: Numbers

    def __len__(self) -> int:
        """Return the number of frames L."""
        return len(self.error)

    def unit_of(self, name: str) -> str:
        """Return the unit of a column (`COLUMNS`); empty for pure numbers."""
        unit = COLUMNS[name].unit
        return self.unit if unit == "run" else unit

    @property
    def witness(self) -> Witness:
        """Who says most: the truth where it is known of any frame, else the tracker, or nobody."""
        said = set(self.witnesses)
        return next((one for one in BY_WORD if one in said), "")

    @cached_property
    def ess_share(self) -> Numbers:
        """(L,) effective sample size over the number of particles."""
        return self.ess / self.particles

    @cached_property
    def fit(self) -> Numbers:
        """(L,) how well the picture fits what is believed: the likeness where one is reported, else the evidence."""
        return self.likeness if np.isfinite(self.likeness).any() else self.evidence

    @cached_property
    def step(self) -> Numbers:
        """(L,) how far the estimate went since the frame before."""
        return _steps(self.estimates)

    @cached_property
    def true_step(self) -> Numbers:
        """(L,) how far the target went since the frame before."""
        return _steps(self.truths)


def course_of(
    rows: Sequence[Diagnostics],
    declared: Sequence[Series],
    *,
    unit: str,
    size: tuple[int, int] | None = None,
) -> Course:
    """Return the course of a run.

    Args:
        rows: Of its frames, from 0 on, at least one.
        declared: Series that they may have.
        unit: Of its estimates.
        size: Width and height of the picture, px, where estimates are places in it.
    """
    unknown = (np.nan,) * len(rows[0].estimate)
    truths = np.array([row.truth or unknown for row in rows], dtype=np.float64)
    estimates = np.array([row.estimate for row in rows], dtype=np.float64)
    found = judge_rows(rows)
    evidence = np.array([row.log_evidence for row in rows])
    seen = np.where(np.isfinite(truths), truths, estimates) if truths.shape == estimates.shape else estimates

    def numbers(role: SeriesRole) -> Numbers:
        chosen = [series for series in declared if series.role == role and series.shape in {"number", "vector"}]
        values = np.array([[_number(row, series) for row in rows] for series in chosen]).reshape(len(chosen), len(rows))
        known = np.isfinite(values)
        least = np.where(known, values, np.inf).min(axis=0, initial=np.inf)
        return np.where(known.any(axis=0), least, np.nan)

    told = numbers("excess")
    return Course(
        unit=unit,
        estimates=estimates,
        truths=truths,
        error=_optional([row.error for row in rows]),
        deviation=_deviations(rows),
        sigmas=_matrix([row.sigma for row in rows], estimates.shape[1])[:, : estimates.shape[1]],
        excess=np.where(np.isfinite(told), told, _excess(rows)),
        lost=found.lost,
        witnesses=found.witnesses,
        hidden=np.where(numbers("visible") <= MOST_HIDDEN, 1.0, _optional([row.hidden for row in rows])),
        searching=_optional([row.searching for row in rows]),
        evidence=evidence if evidence.any() else np.full(len(rows), np.nan),  # who knows of none says 0
        likeness=numbers("likeness"),
        misfit=numbers("misfit"),
        kept=numbers("model_likeness"),
        nis=numbers("nis"),
        nis_limit=numbers("nis_limit"),
        particles=numbers("particles"),
        ess=numbers("ess"),
        distinct=numbers("distinct"),
        resampled=numbers("resampled"),
        mirrored=numbers("mirrored"),
        mirror_gap=numbers("mirror_gap"),
        outside=_outside(seen, size),
        parts=_vectors(rows, declared, "likeness"),
        measured=_vectors(rows, declared, "measured"),
    )


def _number(row: Diagnostics, series: Series) -> float:
    """Return what a series says of a frame; the mean of the parts of a vector that are known."""
    if series.shape == "number":
        return row.number(series.name)
    known = [one for one in row.vector(series.name) or () if np.isfinite(one)]
    return float(np.mean(known)) if known else np.nan


def _vectors(rows: Sequence[Diagnostics], declared: Sequence[Series], role: SeriesRole) -> Numbers:
    """Return the vectors (L, n) of the series of a role, beside each other."""
    names = [series.name for series in declared if series.role == role and series.shape == "vector"]
    return _matrix([[number for name in names for number in row.vector(name) or ()] for row in rows])


def _matrix(values: Sequence[Sequence[float]], least: int = 0) -> Numbers:
    """Return rows of numbers as an array as wide as the longest, and at least so wide; the rest NaN."""
    width = max(least, *map(len, values))
    padded = [[*value, *(np.nan,) * (width - len(value))] for value in values]
    return np.array(padded, dtype=np.float64).reshape(len(values), width)


def _deviations(rows: Sequence[Diagnostics]) -> Numbers:
    # NaN stands for a number in another unit than the run's.
    squares = [[one * one for one in row.sigma if np.isfinite(one)] for row in rows]
    return np.array([np.sqrt(np.mean(some)) if some else np.nan for some in squares])


def _excess(rows: Sequence[Diagnostics]) -> Numbers:
    found = []
    for row in rows:
        parts = zip(row.estimate, row.truth, row.sigma, strict=False) if row.truth else ()
        ratios = [abs(estimate - truth) / sigma for estimate, truth, sigma in parts if sigma > 0]
        found.append(max(ratios, default=np.nan))
    return np.array(found, dtype=np.float64)


def _optional(values: Sequence[float | bool | None]) -> Numbers:
    return np.array([np.nan if value is None else float(value) for value in values])


def _steps(places: Numbers) -> Numbers:
    """Return the lengths (L,) of the ways between places (L, d); NaN of the first."""
    ways = np.sqrt(np.square(np.diff(places, axis=0)).sum(axis=1))
    return np.concatenate([[np.nan], ways])


def _outside(places: Numbers, size: tuple[int, int] | None) -> Numbers:
    if size is None or places.shape[1] != len(size):
        return np.full(len(places), np.nan)
    beyond = ((places < 0) | (places > np.array(size))).any(axis=1)
    return np.where(np.isfinite(places).all(axis=1), beyond.astype(np.float64), np.nan)
