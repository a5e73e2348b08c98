"""Trials: what-if and a fit, compared with their runs made one by one.

The lost run is one of the ball behind a wide pillar. A user would repeat each trial of what-if with `Run`: as a branch
of the lost run, or from its first frame on. All three give the same numbers, so the same number of runs must hold their
target; `holding` is that number. A fit reports its number of runs; the same number of runs of the same lengths is
compared with it. `ratio` is relative to pftrack's time for the whole question; `ms` is processor time.
"""

from _table import Size, arguments, progress, report, single_threaded

single_threaded()

from collections.abc import Callable, Sequence  # noqa: E402
from time import process_time  # noqa: E402
from typing import TypeVar  # noqa: E402

from pftrack.analysis.counterfactuals import Report, what_if  # noqa: E402
from pftrack.analysis.fitting import fit  # noqa: E402
from pftrack.core.model.recipe import Change  # noqa: E402
from pftrack.experiments import find  # noqa: E402
from pftrack.runs.run import Run  # noqa: E402

T = TypeVar("T")
PILLAR = {"occlusion_width_px": 100.0}
LOSS_FRAMES = 45
FITTED = ("ball", "condensation", ("process_noise_px",)), ("sine", "kalman", ("assumed_noise_sd",))
SEEDS_JUDGED = 2
"""A fit judges settings before and after with twice the seeds of a trial, where random numbers decide."""


def timed(work: Callable[[], T]) -> tuple[float, T]:
    """Return the processor time of some work, ms, and its result."""
    begun = process_time()
    done = work()
    return 1e3 * (process_time() - begun), done


def begin(name: str, tracker: str, frames: int, *changes: Change) -> Run:
    """Return a run at its first frame."""
    experiment = find(name)
    return Run(experiment, experiment.simulate(), tracker=tracker, frames=frames, timeline=changes)


def holds(run: Run, found: Report) -> bool:
    """Compute a trial to its end, and return whether it then holds its target."""
    run.seek(found.last)
    return not any(row.lost for row in run.diagnostics[-found.judged :])


def by_branches(lost: Run, found: Report) -> int:
    """Repeat all trials as branches of the lost run; return the number of runs that hold their target."""
    return sum(
        holds(lost.branch(found.begin, {**each.alternative.values, "seed": seed}), found)
        for each in found.findings
        for seed in each.at_end
    )


def from_the_first_frame(lost: Run, found: Report) -> int:
    """Repeat all trials from frame 0; return the number of runs that hold their target."""
    changes = lost.timeline.changes_until(found.begin)
    return sum(
        holds(begin("ball", lost.tracker, lost.frames, *changes, Change(found.begin + 1, values)), found)
        for each in found.findings
        for values in ({**each.alternative.values, "seed": seed} for seed in each.at_end)
    )


def explain(seeds: int) -> list[dict[str, object]]:
    """Measure what-if and its trials one by one."""
    lost = begin("ball", "condensation", LOSS_FRAMES, Change(0, PILLAR))
    lost.finish()

    def last() -> Report:
        return list(what_if(lost, rounds=(seeds,)))[-1]

    last()
    ms, found = timed(last)
    runs = sum(len(each.at_end) for each in found.findings)
    rows = [_row("what-if", runs, ms, ms, sum(sum(each.at_end.values()) for each in found.findings))]
    for what, work in (("branches", by_branches), ("runs from frame 0", from_the_first_frame)):
        progress(f"what-if by {what}")
        taken, holding = timed(lambda work=work: work(lost, found))  # type: ignore[misc]
        rows.append(_row(f"the same by {what}", runs, taken, ms, holding))
    return rows


def fitted(name: str, tracker: str, names: Sequence[str], frames: int) -> list[dict[str, object]]:
    """Measure a fit and its runs one by one."""
    progress(f"fit of {name}")
    run = begin(name, tracker, frames)
    run.finish()
    fit(run, names)
    ms, found = timed(lambda: fit(run, names))
    judged = 2 * (SEEDS_JUDGED * found.seeds if found.seeds > 1 else 1)
    lengths = [frames] * judged + [1 + found.halves[0].last] * (found.runs - judged)
    taken, _ = timed(lambda: [begin(name, tracker, length).finish() for length in lengths])
    return [
        _row(f"fit of {names[0]}, {name}, {tracker}", found.runs, ms, ms, None),
        _row("its runs one by one", found.runs, taken, ms, None),
    ]


def _row(what: str, runs: int, ms: float, reference: float, holding: int | None) -> dict[str, object]:
    return {
        "what": what,
        "runs": runs,
        "ms": ms,
        "ms a run": ms / runs,
        "ratio": ms / reference,
        "holding": holding,
    }


def main() -> None:
    """Measure and report."""
    given = arguments(
        __doc__.splitlines()[0],
        seeds=Size(20, 1, "seeds of each change of what-if"),
        frames=Size(120, 41, "frames of the fitted runs"),
    )
    rows = explain(given.seeds)
    for name, tracker, names in FITTED:
        rows += fitted(name, tracker, names, given.frames)
    report("Trials, and their runs one by one", rows, as_json=given.json)


if __name__ == "__main__":
    main()
