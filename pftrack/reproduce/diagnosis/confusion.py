"""What runs were lost by, against what the diagnosis says of them (`docs/explanation/diagnosis.md`).

A run counts if it is lost with its flaw and holds without it. The rules were made on the draws with even numbers; those
with odd ones were kept aside, and are what the shares are of. `unclear` counts as wrong.
"""

from collections import Counter
from collections.abc import Iterable

from pftrack.diagnosis import diagnose
from pftrack.experiments import find
from pftrack.model.cause import CAUSES, CauseId
from pftrack.model.recipe import Recipe
from pftrack.reproduce.diagnosis.conditions import CONDITIONS
from pftrack.reproduce.finding import Finding, Own, claim, not_run
from pftrack.reproduce.pool import Pool
from pftrack.runs.loss_intervals import LASTING_FRAMES, first_loss
from pftrack.runs.run import Run

__all__ = ["CELL", "confusion", "judge_draw"]

DRAWS = 24
"""Of each condition; the odd ones were not looked at while the rules were made."""
LEAST_RUNS = 400
LEAST_RIGHT = 0.8
CELL = "diagnosis: lost by {}, said to be {}, runs kept aside"
"""The result of a cell of the table."""
SOURCE = Own("this project, docs/explanation/diagnosis.md")
AT_END = 5
HELD_SHARE = 0.1
"""Frames at the end in which a run must hold, and share of all that it may lose before."""


def confusion(pool: Pool, full: bool) -> list[Finding]:
    """Count what is said of runs of each cause, of the half that was kept aside; not in the quick form."""
    if not full:
        return [not_run("diagnosis: share of the causes that are found", "few runs would say nothing of a share")]
    draws = [(place, number) for place in range(len(CONDITIONS)) for number in range(DRAWS)]
    said = list(zip(draws, pool.map(judge_draw, draws), strict=True))
    counted = [
        (number % 2 == 1, CONDITIONS[place].cause, cause) for (place, number), cause in said if cause is not None
    ]
    aside = [(truth, cause) for is_aside, truth, cause in counted if is_aside]
    known = [(truth, cause) for is_aside, truth, cause in counted if not is_aside]
    return [
        claim(
            f"diagnosis: at least {LEAST_RUNS} runs are lost by what was put there (runs)",
            len(counted),
            holds=len(counted) >= LEAST_RUNS,
            source=SOURCE,
        ),
        _right("diagnosis: at least 80 % of the runs kept aside are told right (share)", aside, LEAST_RIGHT),
        _right("diagnosis: so are those on which the rules were made (share)", known, LEAST_RIGHT),
        *_cells(aside),
    ]


def _right(result: str, told: list[tuple[CauseId, CauseId]], least: float) -> Finding:
    share = sum(truth == cause for truth, cause in told) / max(len(told), 1)
    return claim(result, share, holds=share >= least, source=SOURCE)


def _cells(told: Iterable[tuple[CauseId, CauseId]]) -> list[Finding]:
    counts = Counter(told)
    return [
        claim(CELL.format(CAUSES[truth], CAUSES[cause]), counts[truth, cause], holds=True, source=SOURCE)
        for truth in CAUSES
        for cause in CAUSES
        if counts[truth, cause]
    ]


def judge_draw(draw: tuple[int, int]) -> CauseId | None:
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
    lost = [row.lost is True for row in _finish(base).diagnostics]
    at_end = all(row.lost for row in failing.diagnostics[-AT_END:])
    if any(lost[-AT_END:]) or not (at_end or sum(lost) <= HELD_SHARE * len(lost)):
        return None
    return diagnose(failing).cause


def _finish(recipe: Recipe) -> Run:
    experiment = find(recipe.experiment)
    run = Run.from_recipe(recipe, experiment, experiment.simulate())
    run.finish()
    return run
