"""The course of a run: what its rows say over time, by what series are declared to be, and the moment in question.

Rules of diagnosis read these columns and nothing else, so that they hold for whatever tracker, plug-in or recording: a
column is there if the run has it, and NaN where a frame does not. Nothing here knows the name of a series. A rule that
finds its cause at work at the moment returns a `Sign`.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from string import Formatter
from typing import Annotated, TypeAlias

import numpy as np
from pydantic import Field, PlainSerializer, computed_field, with_config

from pftrack.analysis.diagnosis.pictures import Sights
from pftrack.core.arrays import Bools, Floats
from pftrack.core.model.preset import CAUSES, CauseId
from pftrack.core.model.series import Known, Series, SeriesRole
from pftrack.core.model.source import Frame
from pftrack.core.model.tracker import Diagnostics
from pftrack.core.texts import CLOSED, read_as
from pftrack.runs.loss import LASTING_FRAMES, Loss

Numbers: TypeAlias = Floats
Flags: TypeAlias = Bools


MOST_HIDDEN = 1.0 / 3.0
"""Share of the parts of a target that are to be seen, at most, where it counts as hidden."""


@with_config(CLOSED)
@dataclass(frozen=True, slots=True)
class Column:
    """What a column of a course is.

    Attributes:
        name: Attribute of `Course`.
        title: What it is, a few words.
        unit: Unit of its numbers; "run" for the run's own unit, empty for pure numbers.
        is_flag: Whether it is 0 or 1 in each frame.
        origin: File and line.
    """

    name: str
    title: str
    unit: str = ""
    is_flag: bool = False
    origin: str = ""


COLUMNS = {column.name: column for column in read_as(Column, Path(__file__).with_name("columns.yaml"), "name")}
"""What evidence is shown from, by name."""


@dataclass(frozen=True, eq=False)
class Course:
    """A run of L frames in columns; NaN where a frame does not have the number.

    Attributes:
        unit: Unit of estimates.
        estimates: (L, d).
        truths: (L, d).
        error: (L,) distance of the estimate from the truth.
        deviation: (L,) root mean square of the posterior standard deviations that are in the run's unit.
        sigmas: (L, d) posterior standard deviations; NaN of a number in another unit.
        excess: (L,) largest error of a component, or of what else is believed, over its standard deviation.
        loss: In which frames the target is lost, and who says so.
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
        outside: (L,) 1 where the target, or where no truth is known the estimate, is beyond the picture, else 0.
        sights: What the frames look like.
    """

    unit: str
    estimates: Numbers
    truths: Numbers
    error: Numbers
    deviation: Numbers
    sigmas: Numbers
    excess: Numbers
    loss: Loss
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
    outside: Numbers
    sights: Sights = field(default_factory=Sights)

    def __len__(self) -> int:
        """Return the number of frames L."""
        return len(self.error)

    def unit_of(self, name: str) -> str:
        """Return the unit of a column (`COLUMNS`); empty for pure numbers."""
        unit = COLUMNS[name].unit
        return self.unit if unit == "run" else unit

    @property
    def lost(self) -> Flags:
        """(L,) whether the target is lost."""
        return self.loss.lost

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
    frame: Callable[[int], Frame] | None = None,
) -> Course:
    """Return the course of a run.

    Args:
        rows: Rows of its frames, from 0 on, at least one.
        declared: Series that they may have.
        unit: Unit of its estimates.
        size: Width and height of the picture, px, where estimates are places in it.
        frame: The frame of a number, where it can be looked at again.
    """
    unknown = (np.nan,) * len(rows[0].estimate)
    truths = np.array([row.truth or unknown for row in rows], dtype=np.float64)
    estimates = np.array([row.estimate for row in rows], dtype=np.float64)
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
        loss=Loss.of(rows),
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
        outside=_outside(seen, size),
        sights=Sights(frame),
    )


def _number(row: Diagnostics, series: Series) -> float:
    """Return what a series says of a frame; the mean of the parts of a vector that are known."""
    if series.shape == "number":
        return row.number(series.name)
    known = [one for one in row.vector(series.name) or () if np.isfinite(one)]
    return float(np.mean(known)) if known else np.nan


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


SCATTERS = 3.0
"""A fit is low if it is below its usual value by so many times its usual scatter,"""
LEAST_FALL = {True: 0.12, False: 0.6}
"""and by at least so much: of a likeness, 0..1, and of a log evidence."""
LOWEST = 2.0 / 3.0
"""Share of its usual value from which a likeness is not low, however much it scatters."""
ENOUGH, FEWEST = 8, 4
"""So many usual frames show what is usual, and so many at the least make a scatter."""

PLACE = 2
"""Numbers of an estimate that is a place in the picture."""
FAR = 4.0
"""Times the usual error that an error is great."""

EQUAL = 0.985
"""ESS over the particles from which all weights are the same: nothing in the picture tells them apart."""
FALLEN, RISEN, ALIKE = 0.8, 1.12, 0.9
"""Times the least ESS before that it falls to where few particles are better than the rest; times its usual value, and
of the particles at the least, that it rises to where none is."""
LEADING, FOLLOWING = 8, 8
"""So many frames before a moment may hold what led to it, and so many after it show what came of it."""


@dataclass(frozen=True, eq=False)
class Moment:
    """A frame of a course, with what is usual in the frames before it.

    Attributes:
        course: The run.
        frame: The first frame of the loss, or the one that is asked about.
    """

    course: Course
    frame: int

    @cached_property
    def usual(self) -> Flags:
        """(L,) the frames before it in which the target was followed in sight; those just before only if need be."""
        course, frames = self.course, np.arange(len(self.course))
        good = (frames >= 1) & (frames < self.frame) & ~course.lost & (course.hidden != 1.0) & (course.outside != 1.0)
        calm = good & (frames < self.frame - 2)
        return np.asarray(calm if np.count_nonzero(calm) >= LASTING_FRAMES else good)

    @property
    def is_place(self) -> bool:
        """Whether the estimate is a place in the picture."""
        return int(self.course.estimates.shape[1]) == PLACE

    @property
    def is_gaussian(self) -> bool:
        """Whether the belief is one without particles whose evidence is that of an innovation."""
        course = self.course
        others = (course.particles, course.likeness, course.misfit)
        return bool(np.isfinite(course.evidence).any()) and not any(np.isfinite(column).any() for column in others)

    @property
    def by_likeness(self) -> bool:
        """Whether what is believed is told by a likeness, and not by an evidence."""
        return self.course.fit is self.course.likeness

    @property
    def least_fall(self) -> float:
        """By how much a fit falls, at least, where it is low."""
        return LEAST_FALL[self.by_likeness]

    @property
    def knows_truth(self) -> bool:
        """Whether the truth is known of any frame."""
        return bool(np.isfinite(self.course.error).any())

    @cached_property
    def _usual_fits(self) -> Numbers:
        """Fits of the usual frames, of that third of them in which they are best: what is lost slowly fits worse."""
        fits = self.course.fit[self.usual & np.isfinite(self.course.fit)]
        parts = np.array_split(fits, min(3, max(len(fits) // ENOUGH, 1)))
        return max(parts, key=middle)

    @cached_property
    def usual_fit(self) -> float:
        """Median of the fit in the usual frames; NaN where there are none."""
        return middle(self._usual_fits)

    @cached_property
    def low_fit(self) -> float:
        """Fit below which the picture does not show the target where it is believed to be."""
        fits = self._usual_fits
        if not self.knows_truth and len(fits) < FEWEST:
            return math.nan  # nothing is usual yet
        scatter = 1.4826 * middle(np.abs(fits - self.usual_fit)) if len(fits) >= FEWEST else 0.0
        low = self.usual_fit - max(SCATTERS * scatter, self.least_fall)
        # What is lost slowly fits worse and worse, which is not the scatter of a good fit.
        return max(low, LOWEST * self.usual_fit) if self.by_likeness else low

    @cached_property
    def unseen(self) -> Flags:
        """(L,) whether the picture does not show the target where it is believed to be.

        Either the fit is low, or nothing tells the particles apart while the fit is at the lowest of the run.
        """
        nothing = (self.course.ess_share >= EQUAL) & self.at_floor
        return np.asarray((self.course.fit < self.low_fit) | nothing)

    @cached_property
    def at_floor(self) -> Flags:
        """(L,) whether the fit is as low as in any frame of the run, or nearly."""
        fit = self.course.fit
        known = fit[np.isfinite(fit)]
        floor = known.min() + 0.05 * float(np.ptp(known)) if len(known) else np.nan
        return np.asarray(fit <= floor)

    @cached_property
    def goes_blind(self) -> int | None:
        """First frame of the stretch in which nothing is seen any more, if it is so in most of the next; else None."""
        since = self.since(self.unseen)
        blind = self.unseen[since : since + FOLLOWING]
        return since if len(blind) and np.count_nonzero(blind) > len(blind) / 2 else None

    @cached_property
    def leaves_cloud(self) -> bool:
        """Whether, as the fit fell, few particles became better than the rest: those at the edge of the cloud.

        So it is when a target leaves a cloud that does not follow. What is covered makes all of them alike instead.
        """
        shares, since = self.course.ess_share, self.goes_blind
        # Of a pose by its features the effective sample size tells nothing: they are weighed one by one.
        if since is None or self.by_features:
            return False
        before = shares[max(since - LEADING - 2, 1) : max(since - 1, 2)]
        falling = shares[max(since - 4, 1) : since + 4]
        falling = falling[falling < EQUAL]
        if not len(falling) or not np.isfinite(before).any():
            return False
        usual, later = middle(shares[self.usual]), middle(shares[since : since + FOLLOWING])
        never_alike = later < min(RISEN * usual, ALIKE)
        return bool(falling.min() < FALLEN * np.nanmin(before)) or never_alike

    @property
    def by_features(self) -> bool:
        """Whether the estimate is a pose, found by the likeness of features, and not a place."""
        return self.by_likeness and not self.is_place

    @property
    def fits_after(self) -> bool:
        """Whether what is followed from there on fits as what was followed before, in most frames."""
        blind = self.unseen[self.after]
        return middle(self.course.fit[self.after]) >= self.low_fit and bool(np.count_nonzero(blind) <= len(blind) / 2)

    @cached_property
    def off(self) -> Flags:
        """(L,) where the estimate is known to be far off: lost by the truth, or by several times the usual error."""
        course = self.course
        far = course.error > FAR * middle(course.error[self.usual])
        return np.asarray(np.isfinite(course.error) & (course.lost | far))

    @property
    def is_off(self) -> bool:
        """Whether it is so in this frame, or in most of those just after it."""
        later = self.off[self.after]
        known = bool(np.isfinite(self.course.error[self.frame]))
        return known and bool(self.course.lost[self.frame] or np.count_nonzero(later) > len(later) / 2)

    @property
    def before(self) -> slice:
        """The frames just before it, without frame 0 where there are others."""
        return slice(min(max(self.frame - LEADING, 1), max(self.frame - 1, 0)), max(self.frame, 1))

    @property
    def after(self) -> slice:
        """This frame and those just after it."""
        return slice(self.frame, self.frame + FOLLOWING)

    @property
    def near(self) -> slice:
        """The frames just before and just after it: what hides a target covers it little by little."""
        return slice(max(self.frame - LEADING, 0), self.frame + FOLLOWING)

    @property
    def around(self) -> slice:
        """The frames just before it, this one and the two after it."""
        return slice(max(self.frame - LEADING, 0), self.frame + 3)

    def since(self, holds: Flags, *, gap: int = 1) -> int:
        """Return the first frame of the stretch of frames in which something holds that reaches this one.

        Args:
            holds: (L,) where it holds.
            gap: So many frames in which it does not hold do not end a stretch.

        Returns:
            The frame; this one if it holds in none before, or the first one after if it holds from there on.
        """
        places = np.flatnonzero(holds[: self.frame + 1])
        if not len(places) or places[-1] < self.frame - LEADING:
            later = np.flatnonzero(holds[self.frame :])
            return self.frame + (int(later[0]) if len(later) else 0)
        breaks = np.flatnonzero(np.diff(places) > gap + 1)
        return int(places[breaks[-1] + 1] if len(breaks) else places[0])


def middle(values: Numbers) -> float:
    """Return the median of the finite values; NaN if there are none.

    It is a number of NumPy's, so that what is divided by a deviation of zero is infinite.
    """
    known = values[np.isfinite(values)]
    return np.float64(np.median(known) if len(known) else np.nan)


@with_config(CLOSED)
@dataclass(frozen=True, slots=True)
class Kind:
    """A kind of sign that a cause is at work.

    Attributes:
        name: Name of the rule that finds it, or of one of its ways.
        cause: Which.
        text: A sentence with places for numbers; see signs.yaml.
        evidence: Names of the columns of the course that show it.
        origin: File and line.
    """

    name: str
    cause: CauseId
    text: str
    evidence: tuple[str, ...]
    origin: str = ""


KINDS = {kind.name: kind for kind in read_as(Kind, Path(__file__).with_name("signs.yaml"), "name")}


@dataclass(frozen=True)
class Evidence:
    """A column of numbers in the frames around what it shows.

    Attributes:
        name: Name of the column.
        title: What it is, a few words.
        unit: Unit of its numbers; empty for pure ones.
        first: Frame of the first number.
        values: A number a frame, None where there is none.
    """

    name: str
    title: str
    unit: str
    first: int
    values: tuple[float | None, ...]


@dataclass(frozen=True)
class Sign:
    """That a cause is at work.

    Attributes:
        kind: What is said of it.
        since: Frame since when.
        strength: How clearly, from 0 to 1.
        numbers: What was measured, by name.
        unit: Unit of the run's estimates.
        evidence: The numbers that show it.
    """

    kind: Annotated[Kind, Field(exclude=True)]
    since: int
    strength: Annotated[float, PlainSerializer(lambda value: round(value, 3), return_type=float)]
    numbers: dict[str, Known]
    unit: Annotated[str, Field(exclude=True)] = ""
    evidence: tuple[Evidence, ...] = ()

    @computed_field  # type: ignore[prop-decorator]
    @property
    def cause(self) -> CauseId:
        """The cause."""
        return self.kind.cause

    @computed_field  # type: ignore[prop-decorator]
    @property
    def title(self) -> str:
        """What the cause is called in a sentence."""
        return CAUSES[self.cause]

    @computed_field  # type: ignore[prop-decorator]
    @property
    def words(self) -> str:
        """The sentence with its numbers, as far as they are known."""
        parts = self.kind.text.split("|")
        known = [part for part in parts if all(math.isfinite(self.numbers[name]) for name in _named(part))]
        return "".join(known).format(**self.numbers, unit=f" {self.unit}".rstrip())


def sign(kind: str, since: int, strength: float, **numbers: float) -> Sign:
    """Return a sign of a kind, with the numbers that its text names."""
    named = {"since": since, **numbers} if "since" in _named(KINDS[kind].text) else numbers
    return Sign(KINDS[kind], since, strength, named)


def _named(text: str) -> set[str]:
    """Return the names of the numbers in a text."""
    return {name for _, name, _, _ in Formatter().parse(text) if name and name != "unit"}


Rule: TypeAlias = Callable[[Moment], Sign | None]
