"""What runs were lost by, against what the diagnosis says of them (`docs/explanation/diagnosis.md`).

A *condition* (`diagnosis_conditions.yaml`) is a run that holds, and one change to it by which it fails, the *flaw*.
What is lost with the flaw and held without it, on the same seed, was lost because of it: so the cause is known without
anybody's opinion. Parameters of the flaw, trackers and seeds are drawn, by a number each, so that there are as many
different runs of a condition as one wants. The rules were made on the draws with even numbers; those with odd ones were
kept aside, and are what the shares are of. `unclear` counts as wrong.

Each run is told twice: with the truth, and as on a recording without any truth. Somebody asks then about the frame in
which it is lost, and there is nothing to go by but what the tracker itself computes.
"""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import NamedTuple, TypeAlias

from pydantic import BaseModel, ConfigDict, Field

from pftrack.analysis.diagnosis import course_of_run, diagnose_course, picture_size
from pftrack.analysis.diagnosis.course import Course, course_of
from pftrack.core.model.parameters import Value
from pftrack.core.model.preset import CAUSES, CauseId
from pftrack.core.model.recipe import Change, Recipe
from pftrack.core.numerics.random import Purpose, Stream
from pftrack.core.texts import read_as
from pftrack.experiments import EXPERIMENTS
from pftrack.reproduce.finding import Findings, References
from pftrack.reproduce.pool import Pool, begin
from pftrack.runs.loss import LASTING_FRAMES, Loss
from pftrack.runs.run import Run

REFERENCES = References(__file__)
POSES = {"head", "hand"}
OF_TRUTH = ("mirrored", "excess", "visible")
"""Roles of series that compare with the truth."""

KEPT_FROM = 2000
"""Draws that are kept aside have numbers from here on: odd ones below had been counted before."""

AT_END = 5
HELD_SHARE = 0.1
AROUND = 10, 20
"""Frames at the end in which a run must hold, and share of all that it may lose before; and so many frames before and
after one must it hold that is asked about it."""


class Range(BaseModel):
    """Bounds between which a number is drawn, a whole one between whole ones."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    low: int | float = Field(alias="from")
    high: int | float = Field(alias="to")

    def draw(self, chance: float) -> Value:
        """Return the number of a chance, 0..1."""
        value = self.low + (self.high - self.low) * chance
        return round(value) if isinstance(self.low, int) and isinstance(self.high, int) else value


Drawn: TypeAlias = Mapping[str, Value | Range | tuple[Value, ...]]
"""Values by name: given, drawn between bounds, or one of several."""


class Condition(BaseModel):
    """A run that holds, and what makes it fail.

    Attributes:
        name: Of the condition.
        cause: What the flaw is a case of.
        experiment: Id of the experiment.
        trackers: Of which one is drawn.
        base: Values of the run that holds.
        flaw: Values that differ in the one that fails.
        at: Frame at which the flaw comes; 0 for a whole run with it.
        cured_by: Another tracker than the drawn one for the run that holds.
        frames: Length of both.
        draws: How many there are of it in the study, half of them kept aside (`numbers`).
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: str
    cause: CauseId
    experiment: str
    trackers: tuple[str, ...]
    base: Drawn = {}
    flaw: Drawn = {}
    at: int = 0
    cured_by: str = ""
    frames: int | None = 60
    draws: int = 24
    origin: str = ""

    @property
    def numbers(self) -> tuple[int, ...]:
        """The draws of the study: even numbers are of those on which rules are made, odd ones of those kept aside."""
        return (*range(0, self.draws, 2), *range(KEPT_FROM + 1, KEPT_FROM + self.draws, 2))

    def draw(self, number: int) -> tuple[Recipe, Recipe]:
        """Return a run with the flaw and the same without it.

        Args:
            number: From which all that is drawn follows, the seed included.
        """
        chances = Stream(number, 0, Purpose.SCENE)
        tracker = self.trackers[int(chances.random() * len(self.trackers))]
        base, flaw = (
            {name: _draw(said, chances.random()) for name, said in it.items()} for it in (self.base, self.flaw)
        )
        begun = (Change(0, base),) if base else ()
        wrong = (Change(0, {**base, **flaw}),) if self.at == 0 else (*begun, Change(self.at, flaw))
        return self._recipe(tracker, number, wrong), self._recipe(self.cured_by or tracker, number, begun)

    def _recipe(self, tracker: str, seed: int, timeline: tuple[Change, ...]) -> Recipe:
        return Recipe(experiment=self.experiment, tracker=tracker, seed=seed, frames=self.frames, timeline=timeline)


def _draw(said: Value | Range | tuple[Value, ...], chance: float) -> Value:
    if isinstance(said, tuple):
        return said[int(chance * len(said))]
    return said.draw(chance) if isinstance(said, Range) else said


@cache
def conditions() -> tuple[Condition, ...]:
    """Return all of them.

    Raises:
        ValueError: The file declares something else; it names file and line.
    """
    read = read_as(Condition, Path(__file__).with_name("diagnosis_conditions.yaml"), "name")
    for one in read:
        if one.experiment not in EXPERIMENTS.own:
            known = ", ".join(EXPERIMENTS.own)
            raise ValueError(f"{one.origin}: {one.name} names the experiment {one.experiment!r}; there are {known}")
    return read


class Judgement(NamedTuple):
    """What is said of a lost run, and of the one that holds in its place.

    Attributes:
        aided: With the truth.
        unaided: Without.
        calm_aided: Whether nothing is said of the run that holds, if it is asked about the same frame; None where it is
            lost shortly before or after.
        calm_unaided: The same without the truth.
    """

    aided: CauseId
    unaided: CauseId
    calm_aided: bool | None = None
    calm_unaided: bool | None = None


def confusion(pool: Pool, full: bool) -> Findings:
    """Count what is said of runs of each cause, of the half that was kept aside; not in the quick form."""
    del full
    draws = [(place, number) for place, condition in enumerate(conditions()) for number in condition.numbers]
    yield from findings_of(zip(draws, pool.map(judge_draw, draws), strict=True))


def findings_of(judged: Iterable[tuple[tuple[int, int], Judgement | None]]) -> Findings:
    """Return what comes of draws, each with what is said of it; None does not count."""
    counted = [(conditions()[place], number, said) for (place, number), said in judged if said is not None]
    aside, known = ([it for it in counted if it[1] % 2 == half] for half in (1, 0))
    poses = [it for it in aside if it[0].experiment in POSES]
    calm = [said for _, _, said in aside if said.calm_aided is not None]
    shares = {
        "right-aside": _right(_aided(aside)),
        "right-known": _right(_aided(known)),
        "right-poses": _right(_aided(poses)),
        "calm": _share([it.calm_aided is True for it in calm]),
        "unaided-aside": _right(_unaided(aside)),
        "unaided-known": _right(_unaided(known)),
        "unaided-poses": _right(_unaided(poses)),
        "unaided-calm": _share([it.calm_unaided is True for it in calm]),
    }
    yield REFERENCES.judge("lost", len(counted))
    yield from (REFERENCES.judge(name, share) for name, share in shares.items())
    yield from _cells("cell", _aided(aside))
    yield from _cells("unaided-cell", _unaided(aside))


Counted: TypeAlias = Sequence[tuple[Condition, int, Judgement]]
Told: TypeAlias = list[tuple[CauseId, CauseId]]


def _aided(counted: Counted) -> Told:
    return [(condition.cause, said.aided) for condition, _, said in counted]


def _unaided(counted: Counted) -> Told:
    return [(condition.cause, said.unaided) for condition, _, said in counted]


def _right(told: Told) -> float:
    return _share([truth == cause for truth, cause in told])


def _share(holds: Sequence[bool]) -> float:
    return sum(holds) / max(len(holds), 1)


def _cells(name: str, told: Told) -> Findings:
    counts = Counter(told)
    yield from [
        REFERENCES.judge(name, counts[truth, cause], CAUSES[truth], CAUSES[cause])
        for truth in CAUSES
        for cause in CAUSES
        if counts[truth, cause]
    ]


def judge_draw(draw: tuple[int, int]) -> Judgement | None:
    """Return what is said of a draw of a condition; None if it is not lost by the flaw, and does not count.

    Args:
        draw: Place of the condition, and the number from which all that is drawn follows.
    """
    place, number = draw
    flawed, base = conditions()[place].draw(number)
    failing = _finish(flawed)
    loss = Loss.of(failing.diagnostics)
    begun = loss.lasting
    if begun is None or int(loss.lost[begun:].sum()) < LASTING_FRAMES:
        return None
    holding = _finish(base)
    lost = [row.lost is True for row in holding.diagnostics]
    at_end = all(row.lost for row in failing.diagnostics[-AT_END:])
    if any(lost[-AT_END:]) or not (at_end or sum(lost) <= HELD_SHARE * len(lost)):
        return None
    said = (diagnose_course(course_of_run(failing)).cause, diagnose_course(without_truth(failing), begun).cause)
    before, after = AROUND
    if begun >= len(lost) or any(row.is_lost for row in holding.diagnostics[max(begun - before, 0) : begun + after]):
        return Judgement(*said)
    calm = (diagnose_course(course, begun).cause for course in (course_of_run(holding), without_truth(holding)))
    return Judgement(*said, *(cause == "unclear" for cause in calm))


def without_truth(run: Run) -> Course:
    """Return the course of a run as it would be on a recording of which nothing is known."""
    rows = [replace(row, truth=None, error=None, lost=None, hidden=None) for row in run.diagnostics]
    declared = [series for series in run.experiment.all_series() if series.role not in OF_TRUTH]
    return course_of(rows, declared, unit=run.experiment.judge.unit, size=picture_size(run))


def _finish(recipe: Recipe) -> Run:
    run = begin(recipe)
    run.finish()
    return run
