"""Checks that a run has the same numbers whichever way leads to them."""

import atexit
import os
import tempfile
from collections.abc import Iterator, Sequence
from functools import cache
from itertools import cycle, islice
from pathlib import Path

import numpy as np

from pftrack.core.model.parameters import Value, declarations, flat, with_role
from pftrack.core.model.source import Frame, History
from pftrack.experiments.experiment import Experiment
from pftrack.process import UNLIMITED, BlockingPool, CallError, ForkServer, WorkerLostError
from pftrack.runs import many
from pftrack.runs.opening import load
from pftrack.runs.record import RecordError, save
from pftrack.runs.run import Run
from pftrack.runs.scoring import estimates_hash, reductions
from pftrack.testing.check import (
    FRAMES,
    SEED,
    CheckError,
    begin_run,
    copy_arrays,
    demand,
    each_tracker,
    straight,
    whole,
)

MIDDLE = FRAMES // 2
LATE = FRAMES - 3
TO_AND_FRO = (MIDDLE, 1, FRAMES - 2, MIDDLE - 1, FRAMES - 1)
FEW = FRAMES // 6
"""The last frame that is computed again from a file: each follows from what the file says of the run."""

SEEKING = (2, 1, FRAMES - 2, FRAMES - 3)
"""Forward, back to a frame that is computed again from the first state, and from one that was kept on the way."""


@whole("frames are the same when asked for again")
def _frames_are_the_same(experiment: Experiment) -> None:
    setup = experiment.simulate()
    history = History(((0, setup.parameters),))
    one, other = (setup.open_source(SEED, setup.parameters) for _ in range(2))
    known = [one.frame(index, history) for index in range(FRAMES)]
    for index in TO_AND_FRO:
        same = _look_alike(known[index], other.frame(index, history))
        demand(same, f"frame {index} of the source depends on which frames were asked for before")


@whole("only a noisy source depends on the seed")
def _only_noise_depends_on_the_seed(experiment: Experiment) -> None:
    setup = experiment.simulate()
    history = History(((0, setup.parameters),))
    one, other = (setup.open_source(seed, setup.parameters) for seed in (SEED, SEED + 1))
    if not one.noisy:
        for index in range(FRAMES):
            same = _look_alike(one.frame(index, history), other.frame(index, history))
            demand(same, f"the source says that it is not noisy, and frame {index} depends on the seed")


def _look_alike(one: Frame, other: Frame) -> bool:
    """Tell whether two frames show the same, to the bit."""
    pairs = ((one.image_rgb, other.image_rgb), (one.signal, other.signal))
    return all((a is None and b is None) or np.array_equal(a, b) for a, b in pairs)  # type: ignore[arg-type]  # not None


@each_tracker("seeking comes to the same numbers")
def _seeking_agrees(experiment: Experiment, tracker: str) -> None:
    known, wandering = straight(experiment, tracker), begin_run(experiment, tracker)
    for frame in SEEKING:
        again, first = copy_arrays(wandering.seek(frame)), copy_arrays(known.steps[frame])
        for name, array in first.items():
            same = np.array_equal(again[name], array, equal_nan=array.dtype.kind == "f")
            what = "estimates" if name == "estimate" else f"states: {name}"
            demand(same, f"a run that seeks to and fro must come to the same {what} in frame {frame}, and does not")
    demand_equal(known.run, wandering, "a run that seeks to and fro", max(SEEKING) + 1)


@each_tracker("a branch shares the past and comes to the same numbers")
def _a_branch_agrees(experiment: Experiment, tracker: str) -> None:
    trunk = straight(experiment, tracker).run
    before = trunk.estimates_sha256
    twin = trunk.branch(LATE)
    twin.finish()
    demand_equal(trunk, twin, "a branch that changes nothing")
    changed = trunk.branch(LATE, dict(islice(_other_values(experiment, tracker), 1)))
    changed.finish()
    shared = [row.estimate for row in changed.diagnostics[: LATE + 1]]
    past = [row.estimate for row in trunk.diagnostics[: LATE + 1]]
    demand(shared == past, "a branch that changes a parameter must share the past, and its past differs")
    demand(trunk.estimates_sha256 == before, "computing a branch changed the run that it left")
    replayed = begin_run(experiment, tracker, timeline=changed.timeline.changes)
    replayed.finish()
    demand_equal(changed, replayed, "a run with the branch's timeline")


@each_tracker("what only smooths changes no estimate")
def _smoothing_changes_no_estimate(experiment: Experiment, tracker: str) -> None:
    trunk = straight(experiment, tracker).run
    for declared in with_role(type(trunk.parameters_at(LATE)), "smoothing"):
        if not declared.trackers or tracker in declared.trackers:
            for bound in (it for it in (declared.minimum, declared.maximum) if it is not None):
                smoothed = trunk.branch(LATE, {declared.name: bound})
                smoothed.finish()
                demand_equal(trunk, smoothed, f"a branch in which {declared.title}, which only smooths, is {bound:g}")


def _other_values(experiment: Experiment, tracker: str) -> Iterator[tuple[str, Value]]:
    """Yield live numbers that a tracker reads, each a step away from its default, or at one of its bounds."""
    parameters = experiment.simulate().parameters
    values = flat(parameters)
    for declared in declarations(type(parameters)):
        read = not declared.trackers or tracker in declared.trackers
        low, high, step = declared.minimum, declared.maximum, declared.step
        if declared.live and read and declared.kind in {"integer", "number"} and low is not None and high is not None:
            kind, value = (int if declared.kind == "integer" else float), float(values[declared.name])
            for other in (value + (step or 0.0), value - (step or 0.0), high, low):
                if low <= other <= high and other != value:
                    yield declared.name, kind(other)
                    break


@each_tracker("a saved run comes to the same numbers")
def _a_saved_run_agrees(experiment: Experiment, tracker: str) -> None:
    with tempfile.TemporaryDirectory() as folder:
        run = straight(experiment, tracker).run.branch(FEW)
        save(run, Path(folder, "run.pft"), states=True)
        again = _load(Path(folder, "run.pft"))
    again.seek(FEW)
    demand_equal(run, again, "the run from its file")


def _load(path: Path) -> Run:
    try:
        return load(path)
    except RecordError as error:
        raise CheckError(f"a saved run must open again: {error}") from None


@whole("another process comes to the same numbers")
def _another_process_agrees(experiment: Experiment) -> None:
    with tempfile.TemporaryDirectory() as folder:
        runs, files = [], []
        for tracker in experiment.trackers:
            runs.append(straight(experiment, tracker).run)
            files.append(str(Path(folder, f"{tracker}.pft")))
            save(runs[-1], Path(files[-1]))
        hashes = hashes_elsewhere(files)
    for tracker, run, found in zip(experiment.trackers, runs, hashes, strict=True):
        demand(found == run.estimates_sha256, f"another process comes to other estimates with the tracker {tracker}")


@whole("a batch comes to the numbers of live runs")
def _a_batch_agrees(experiment: Experiment) -> None:
    folding = [name for name, tracker in experiment.trackers.items() if tracker.fold]
    alone = [name for name in experiment.trackers if name not in folding]
    _demand_batch(experiment, folding, [SEED, SEED + 1])
    # Whatever takes no frames at once is carried out frame by frame, the one like the other.
    _demand_batch(experiment, alone[:1], [SEED])


def _demand_batch(experiment: Experiment, trackers: list[str], seeds: list[int]) -> None:
    rows = many.outcomes(experiment, experiment.simulate(), values={}, trackers=trackers, seeds=seeds, frames=FRAMES)
    for seed, row in zip(seeds, rows, strict=True):
        for tracker, outcome in zip(trackers, row, strict=True):
            live = straight(experiment, tracker).run if seed == SEED else begin_run(experiment, tracker, seed=seed)
            live.finish()
            where = f"than a live run with the tracker {tracker}, seed {seed}"
            same = outcome.estimates_sha256 == live.estimates_sha256
            demand(same, f"a batch comes to other estimates {where}")
            summary = live.summary()
            names = ("success", "mean_error", "lost_frames", "first_lost_frame", "labelled_frames")
            of_batch = {**{name: getattr(outcome, name) for name in names}, **outcome.measures, **outcome.reductions}
            kept = reductions(experiment.all_series(tracker), live.diagnostics[1:])
            of_live = {**{name: getattr(summary.verdict, name) for name in names}, **summary.measures, **kept}
            for name in of_batch | of_live:
                pair = of_batch.get(name), of_live.get(name)
                demand(pair[0] == pair[1], f"a batch comes to another {name} {where}: {pair[0]} for {pair[1]}")


@whole("any tracker takes over from any other")
def _trackers_take_over(experiment: Experiment) -> None:
    """Let each tracker follow each other one, and see that a run with all of them comes again from its timeline."""
    names = list(experiment.trackers)
    for shift in range(1, len(names)):
        run = begin_run(experiment, names[0])
        order = islice(cycle([*names[shift:], *names[:shift]]), FRAMES // 2 - 1)
        for place, tracker in enumerate(order, 1):
            run.seek(2 * place - 1)
            run.change({"tracker": tracker})
        run.finish()
        for row in run.diagnostics:
            finite = np.isfinite(row.estimate).all()
            demand(finite, f"the estimate of frame {row.frame} is {row.estimate} after the tracker changed")
        if shift == 1:
            again = begin_run(experiment, names[0], timeline=run.timeline.changes)
            again.finish()
            demand_equal(run, again, "a run with the same changes of tracker")


def demand_equal(run: Run, other: Run, what: str, frames: int | None = None) -> None:
    """Go on if two runs have the same estimates in all frames, or in so many at the beginning, to the bit.

    Raises:
        CheckError: They have not; the sentence names the first frame in which they differ.
    """
    one, two = (np.array([row.estimate for row in each.diagnostics[:frames]]) for each in (run, other))
    if estimates_hash(one) != estimates_hash(two):
        pairs = zip(run.diagnostics, other.diagnostics, strict=True)
        frame = next((one.frame for one, two in pairs if one.estimate != two.estimate), 0)
        raise CheckError(f"{what} must come to the same estimates, and differs from frame {frame} on")


def hashes_elsewhere(paths: Sequence[str]) -> list[str]:
    """Return the hashes of the estimates that saved runs come to in another process.

    Args:
        paths: Of the files.

    Raises:
        CheckError: It cannot compute them.
    """
    try:
        hashes: list[str] = _pool(frozenset(os.environ.items())).submit(_hash_runs, tuple(paths)).result()
    except (CallError, WorkerLostError, MemoryError, OSError) as error:
        raise CheckError(f"another process cannot compute the run: {error}") from None
    return hashes


@cache
def _pool(environment: frozenset[tuple[str, str]]) -> BlockingPool:  # noqa: ARG001 - one for each environment
    """Start a process in the environment of now; it ends with this one."""
    pool = BlockingPool(ForkServer("pftrack.runs.opening"), processes=1, budget=UNLIMITED)
    atexit.register(pool.close)
    return pool


def _hash_runs(paths: Sequence[str]) -> list[str]:
    hashes = []
    for path in paths:
        run = load(Path(path))
        run.finish()
        hashes.append(run.estimates_sha256)
    return hashes
