"""What runs were lost by, against what the diagnosis says of them (`docs/explanation/diagnosis.md`).

A run counts if it is lost with its flaw and holds without it. The rules were made on the draws with even numbers; those
with odd ones were kept aside, and are what the shares are of (`Condition.numbers`). `unclear` counts as wrong.

Each run is told twice: with the truth, and as on a recording without any truth. Somebody asks then about the frame in
which it is lost, and there is nothing to go by but what the tracker itself computes.
"""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import NamedTuple, TypeAlias

from pftrack.analysis.diagnosis.course import Course, course_of
from pftrack.analysis.diagnosis.diagnosis import course_of_run, diagnose_course, picture_size
from pftrack.core.model.preset import CAUSES, CauseId
from pftrack.core.model.recipe import Recipe
from pftrack.experiments import find
from pftrack.reproduce.diagnosis.conditions import CONDITIONS, POSE_CONDITIONS, Condition
from pftrack.reproduce.finding import Finding, Own, claim, not_run
from pftrack.reproduce.pool import Pool
from pftrack.runs.run import Run
from pftrack.runs.scoring import LASTING_FRAMES, first_loss

LEAST_RUNS = 400
LEAST_RIGHT = 0.8
CELL = "diagnosis: lost by {}, said to be {}, runs kept aside"
"""The result of a cell of the table."""
UNAIDED_CELL = "diagnosis without truth: lost by {}, said to be {}, runs kept aside"
"""The same of what is told without the truth."""
OF_TRUTH = ("mirrored", "excess", "visible")
"""Roles of series that compare with the truth."""
SOURCE = Own("this project, docs/explanation/diagnosis.md")
AT_END = 5
HELD_SHARE = 0.1
AROUND = 10, 20
"""Frames at the end in which a run must hold, and share of all that it may lose before; and so many frames before and
after one must it hold that is asked about it."""


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


def confusion(pool: Pool, full: bool) -> list[Finding]:
    """Count what is said of runs of each cause, of the half that was kept aside; not in the quick form."""
    if not full:
        return [not_run("diagnosis: share of the causes that are found", "few runs would say nothing of a share")]
    draws = [(place, number) for place, condition in enumerate(CONDITIONS) for number in condition.numbers]
    return findings_of(zip(draws, pool.map(judge_draw, draws), strict=True))


def findings_of(judged: Iterable[tuple[tuple[int, int], Judgement | None]]) -> list[Finding]:
    """Return what comes of draws, each with what is said of it; None does not count."""
    counted = [(CONDITIONS[place], number, said) for (place, number), said in judged if said is not None]
    aside, known = ([it for it in counted if it[1] % 2 == half] for half in (1, 0))
    poses = [it for it in aside if it[0] in POSE_CONDITIONS]
    calm = [said for _, _, said in aside if said.calm_aided is not None]
    return [
        claim(
            f"diagnosis: at least {LEAST_RUNS} runs are lost by what was put there (runs)",
            len(counted),
            holds=len(counted) >= LEAST_RUNS,
            source=SOURCE,
        ),
        _right("diagnosis: at least 80 % of the runs kept aside are told right (share)", _aided(aside), LEAST_RIGHT),
        _right("diagnosis: so are those on which the rules were made (share)", _aided(known), LEAST_RIGHT),
        _right("diagnosis: so are the heads and hands among those kept aside (share)", _aided(poses), LEAST_RIGHT),
        _calm(
            "diagnosis: runs kept aside that hold, and of which nothing is said (share)", [it.calm_aided for it in calm]
        ),
        _right("diagnosis without truth: runs kept aside that are told right (share)", _unaided(aside), 0.0),
        _right("diagnosis without truth: of those on which the rules were made (share)", _unaided(known), 0.0),
        _right("diagnosis without truth: of the heads and hands kept aside (share)", _unaided(poses), 0.0),
        _calm(
            "diagnosis without truth: runs kept aside that hold, and of which nothing is said (share)",
            [it.calm_unaided for it in calm],
        ),
        *_cells(CELL, _aided(aside)),
        *_cells(UNAIDED_CELL, _unaided(aside)),
    ]


Counted: TypeAlias = Sequence[tuple[Condition, int, Judgement]]
Told: TypeAlias = list[tuple[CauseId, CauseId]]


def _aided(counted: Counted) -> Told:
    return [(condition.cause, said.aided) for condition, _, said in counted]


def _unaided(counted: Counted) -> Told:
    return [(condition.cause, said.unaided) for condition, _, said in counted]


def _right(result: str, told: Told, least: float) -> Finding:
    share = sum(truth == cause for truth, cause in told) / max(len(told), 1)
    return claim(result, share, holds=share >= least, source=SOURCE)


def _calm(result: str, calm: Sequence[bool | None]) -> Finding:
    return claim(result, sum(one is True for one in calm) / max(len(calm), 1), holds=True, source=SOURCE)


def _cells(cell: str, told: Told) -> list[Finding]:
    counts = Counter(told)
    return [
        claim(cell.format(CAUSES[truth], CAUSES[cause]), counts[truth, cause], holds=True, source=SOURCE)
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
    flawed, base = CONDITIONS[place].draw(number)
    failing = _finish(flawed)
    gone = [row.is_lost for row in failing.diagnostics]
    begun = first_loss(gone)
    if begun is None or sum(gone[begun:]) < LASTING_FRAMES:
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
    return course_of(rows, declared, unit=run.experiment.unit, size=picture_size(run))


def _finish(recipe: Recipe) -> Run:
    experiment = find(recipe.experiment)
    run = Run.from_recipe(recipe, experiment, experiment.simulate())
    run.finish()
    return run
