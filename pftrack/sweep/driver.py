"""The driver: hands out chunks, keeps what comes back, and can be lost at any time.

It holds no rows: a chunk comes back as the bytes of its file and goes to disk. The disk is its only memory, so resuming
a sweep is the same as beginning it with fewer chunks.
"""

from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator
from contextlib import closing
from dataclasses import dataclass
from functools import partial
from itertools import chain
from math import inf
from pathlib import Path
from time import monotonic
from typing import Any

from pftrack.sources.sequence import Recording
from pftrack.sweep.axis import SweepError, SweepStopped
from pftrack.sweep.journal import Journal, Result, begin, read_result, resume
from pftrack.sweep.plan import Plan
from pftrack.sweep.table import Chunks
from pftrack.sweep.work import LocalWorkers, Workers, as_text, compute_chunk, measure

CHUNK_S = 1.0
"""Intended duration of a chunk: the loss with a worker, and long relative to the cost of handing it out."""

SMALLEST_CHUNK_S = 0.1
CHUNKS_A_WORKER = 8
"""A short sweep is cut finer, so that all workers end together."""

MOST_ATTEMPTS = 3
"""Largest number of workers that a task may lose."""

POLL_S = 0.2
PATIENCE_S = 2.0
"""Longest wait for running tasks after a request to stop."""

RATE_S = 20.0
"""Over how long the rate is taken."""


@dataclass(frozen=True, slots=True)
class Progress:
    """The progress of a sweep.

    Attributes:
        done: Runs that are kept, from earlier times too.
        runs: All runs.
        rate: Runs a second of late; 0 while nothing is known.
        seconds_left: At that rate; None while nothing is known.
        lost_workers: Number of workers lost so far.
    """

    done: int
    runs: int
    rate: float
    seconds_left: float | None
    lost_workers: int = 0


@dataclass(frozen=True, slots=True)
class Estimate:
    """The cost of a plan.

    Attributes:
        runs: Number of runs.
        conditions: Number of cells over all axes.
        seconds: Expected duration.
        run_s: Duration of one run on one core, s.
    """

    runs: int
    conditions: int
    seconds: float
    run_s: float


def carry_out(
    plan: Plan | None,
    out: Path,
    *,
    jobs: int = 1,
    cluster: str | None = None,
    recording: Recording | None = None,
    progress: Callable[[Progress], object] | None = None,
    stop: Callable[[], bool] | None = None,
) -> Result:
    """Compute a sweep, or what is left of one.

    Args:
        plan: The plan; None continues the sweep begun at `out`.
        out: The result file, to be written.
        jobs: Processes of this machine.
        cluster: Address of a Dask scheduler that computes in their place.
        recording: That of the plan, where it is on one.
        progress: Called with the progress several times a second.
        stop: Asked several times a second whether to stop.

    Returns:
        The finished result.

    Raises:
        SweepStopped: It was asked to stop; what was computed is kept.
        SweepError: It cannot be begun or continued, or its workers fail; what was computed is kept.
        OSError: A file cannot be written; what was computed is kept.
    """
    journal = resume(out) if plan is None else begin(plan, out)
    with journal.claim():
        journal.check_version()
        if not journal.finished:
            if journal.plan.footage is not None and recording is None:
                raise SweepError(f"the sweep is on {journal.plan.footage.name or 'a recording'}, which has to be given")
            try:
                found = open_workers(jobs, cluster)
            except SweepError:
                if plan is not None:  # nothing has begun: with another address the same may be asked again
                    journal.clear()
                raise
            with closing(found) as workers:
                _Drive(journal, workers, max(jobs, 1), recording, progress, stop).finish()
        journal.clear()
    return read_result(journal.out)


def estimate(plan: Plan, jobs: int = 1, recording: Recording | None = None) -> Estimate:
    """Return what a plan would cost, measured on a few of its runs."""
    run_s = measure(as_text(plan), recording)
    return Estimate(plan.runs, plan.conditions, plan.runs * run_s / jobs, run_s)


def open_workers(jobs: int, cluster: str | None) -> Workers:
    """Return processes of this machine, or the workers of a Dask scheduler at an address.

    Raises:
        SweepError: No scheduler answers there, it has no workers, or they have another pftrack or none.
    """
    if cluster is None:
        return LocalWorkers(jobs)
    from pftrack.sweep.cluster import ClusterWorkers  # noqa: PLC0415 - an extra that need not be installed

    return ClusterWorkers(cluster)


def hand_out(
    workers: Workers,
    numbers: Iterable[int],
    task: Callable[[int], tuple[Any, ...]],
    lose: Callable[[int, str, bool], None],
    stop: Callable[[], bool] = lambda: False,
) -> Iterator[list[tuple[int, Any]]]:
    """Have tasks done and yield, several times a second, numbers and values of those that were done meanwhile.

    Args:
        workers: Who take them.
        numbers: Numbers of the tasks, in order; a task whose worker is lost is handed out again first.
        task: From a number to a function and its arguments.
        lose: Called with number, how its worker was lost, and whether too often; it then raises a SweepError.
        stop: Asked whether to stop; what is running is waited for a little.

    Raises:
        SweepStopped: It was asked to stop before all were done.
        SweepError: A task failed, or all workers are gone.
    """
    waiting, running, attempts = deque(numbers), set[int](), Counter[int]()
    end = inf
    while waiting or running:
        if end == inf and stop():
            end = monotonic() + PATIENCE_S
        if end < inf and (not running or monotonic() > end):
            raise SweepStopped
        while end == inf and waiting and workers.free() > 0:
            number = waiting.popleft()
            workers.start(number, *task(number))
            running.add(number)
        found = []
        for done in workers.collect(POLL_S):
            running.discard(done.number)
            if done.lost:
                attempts[done.number] += 1
                lose(done.number, done.lost, attempts[done.number] >= MOST_ATTEMPTS)
                waiting.appendleft(done.number)
            else:
                found.append((done.number, done.value))
        yield found


class _Drive:
    """One session of computing."""

    def __init__(
        self,
        journal: Journal,
        workers: Workers,
        jobs: int,
        recording: Recording | None,
        progress: Callable[[Progress], object] | None,
        stop: Callable[[], bool] | None,
    ) -> None:
        self._journal, self._plan, self._workers, self._jobs = journal, journal.plan, workers, jobs
        self._text = as_text(journal.plan)
        self._recording = workers.share(recording)
        self._progress, self._stop = progress or (lambda _: None), stop or (lambda: False)
        self._done = 0
        self._lost = 0
        self._history: deque[tuple[float, int]] = deque()

    def finish(self) -> None:
        """Compute what is missing and put the result together."""
        chunks = self._journal.chunks() or self._cut()
        kept = self._journal.complete_chunks(chunks)
        self._done = sum(chunks[number].runs for number in kept)
        self._history.clear()
        left = [int(number) for number in chunks.spread() if int(number) not in kept]

        def task(number: int) -> tuple[Any, ...]:
            return compute_chunk, self._text, chunks.conditions, chunks.trials, number, self._recording

        def name(number: int) -> str:
            chunk = chunks[number]
            return f"the chunk of the runs {chunk.first} to {chunk.first + chunk.runs - 1}"

        self._tell()
        for done in hand_out(self._workers, left, task, partial(self._lose, name), self._stop):
            for number, rows in done:
                self._journal.keep(chunks[number], rows)
                self._done += chunks[number].runs
            self._tell()
        self._journal.finish()

    def _cut(self) -> Chunks:
        """Measure the plan and cut it into chunks of about a second."""
        self._tell()
        task, lose = (measure, self._text, self._recording), partial(self._lose, lambda _: "the first run")
        (found,) = chain(*hand_out(self._workers, [0], lambda _: task, lose, self._stop))
        run_s = max(float(found[1]), 1e-7)
        share = self._plan.runs * run_s / (CHUNKS_A_WORKER * self._jobs)
        chunks = Chunks.of(self._plan, min(CHUNK_S, max(SMALLEST_CHUNK_S, share)) / run_s)
        self._journal.cut(chunks)
        return chunks

    def _lose(self, name: Callable[[int], str], number: int, how: str, too_often: bool) -> None:
        self._lost += 1
        if too_often:
            raise SweepError(
                f"{name(number)} ended its worker {MOST_ATTEMPTS} times ({how}), so the sweep ends; the {self._done:,} "
                f"runs computed are kept"
            )

    def _tell(self) -> None:
        now = monotonic()
        self._history.append((now, self._done))
        while now - self._history[0][0] > RATE_S:
            self._history.popleft()
        begun, before = self._history[0]
        rate = (self._done - before) / (now - begun) if self._done > before else 0.0
        left = (self._plan.runs - self._done) / rate if rate else None
        self._progress(Progress(self._done, self._plan.runs, rate, left, self._lost))
