"""The driver: hands out chunks, keeps what comes back, and can be lost at any time.

It holds no rows: a chunk comes back as the bytes of its file and goes to disk. What is on disk is all that it knows of
the past, so going on with a sweep is the same as beginning it, with fewer chunks to do.
"""

from collections import Counter, deque
from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from time import monotonic

from pftrack.sweep.axis import SweepError, SweepStopped
from pftrack.sweep.journal import Journal, begin, resume
from pftrack.sweep.plan import Plan
from pftrack.sweep.recording import Recording
from pftrack.sweep.result import Result, read_result
from pftrack.sweep.table import Chunks
from pftrack.sweep.work import LocalWorkers, Workers, as_text, compute_chunk, measure

CHUNK_S = 1.0
"""How long a chunk is meant to take: what is lost with a worker, and long beside what handing it out costs."""

SMALLEST_CHUNK_S = 0.1
CHUNKS_A_WORKER = 8
"""A short sweep is cut finer, so that all workers end together."""

MOST_ATTEMPTS = 3
POLL_S = 0.2
PATIENCE_S = 2.0
"""How long running chunks are waited for when the sweep is asked to stop."""

RATE_S = 20.0
"""Over how long the rate is taken."""

MEASURING = -1
"""In the place of a chunk's number: the task that measures."""


@dataclass(frozen=True, slots=True)
class Progress:
    """How far a sweep is.

    Attributes:
        done: Runs that are kept, from earlier times too.
        runs: All runs.
        rate: Runs a second of late; 0 while nothing is known.
        seconds_left: At that rate; None while nothing is known.
        lost_workers: How many workers were lost so far.
    """

    done: int
    runs: int
    rate: float
    seconds_left: float | None
    lost_workers: int = 0


@dataclass(frozen=True, slots=True)
class Estimate:
    """What a plan would cost.

    Attributes:
        runs: How many.
        conditions: How many cells, all axes taken together.
        seconds: How long it would take.
        run_s: What one run takes on one core, s.
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
        plan: What to compute; None goes on with what was begun at `out`.
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
        SweepError: Nobody answers there, it has no workers, or they have another pftrack or none.
    """
    if cluster is None:
        return LocalWorkers(jobs)
    from pftrack.sweep.cluster import ClusterWorkers  # noqa: PLC0415 - an extra that need not be installed

    return ClusterWorkers(cluster)


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
        self._lost = 0
        self._attempts: Counter[int] = Counter()
        self._done = 0
        self._history: deque[tuple[float, int]] = deque()

    def finish(self) -> None:
        """Compute what is missing and put the result together."""
        chunks = self._journal.chunks() or self._cut()
        kept = self._journal.complete_chunks(chunks)
        self._done = sum(chunks[number].runs for number in kept)
        waiting = deque(int(number) for number in chunks.spread() if int(number) not in kept)
        running: set[int] = set()
        self._history.clear()
        self._tell()
        while waiting or running:
            while waiting and self._workers.free() > 0:
                number = waiting.popleft()
                task = self._text, chunks.conditions, chunks.trials, number, self._recording
                self._workers.start(number, compute_chunk, *task)
                running.add(number)
            self._collect(chunks, waiting, running, POLL_S)
            if self._stop():
                self._wind_up(chunks, waiting, running)
        self._journal.finish()

    def _cut(self) -> Chunks:
        """Measure the plan and cut it into chunks of about a second."""
        self._tell()
        self._workers.start(MEASURING, measure, self._text, self._recording)
        while True:
            for done in self._workers.collect(POLL_S):
                if not done.lost:
                    run_s = max(float(done.value), 1e-7)
                    share = self._plan.runs * run_s / (CHUNKS_A_WORKER * self._jobs)
                    chunks = Chunks.of(self._plan, min(CHUNK_S, max(SMALLEST_CHUNK_S, share)) / run_s)
                    self._journal.cut(chunks)
                    return chunks
                self._lose(MEASURING, done.lost, "the first run")
                self._workers.start(MEASURING, measure, self._text, self._recording)
            if self._stop():
                raise SweepStopped

    def _collect(self, chunks: Chunks, waiting: deque[int], running: set[int], timeout_s: float) -> None:
        """Keep what is done; put back what was lost."""
        for done in self._workers.collect(timeout_s):
            running.discard(done.number)
            chunk = chunks[done.number]
            if done.lost:
                self._lose(
                    done.number, done.lost, f"the chunk of the runs {chunk.first} to {chunk.first + chunk.runs - 1}"
                )
                waiting.appendleft(done.number)
            else:
                self._journal.keep(chunk, done.value)
                self._done += chunk.runs
        self._tell()

    def _wind_up(self, chunks: Chunks, waiting: deque[int], running: set[int]) -> None:
        """Wait a little for what is running, then stop."""
        end = monotonic() + PATIENCE_S
        while running and monotonic() < end:
            self._collect(chunks, waiting, running, POLL_S)
        if waiting or running:
            raise SweepStopped

    def _lose(self, number: int, how: str, what: str) -> None:
        self._lost += 1
        self._attempts[number] += 1
        if self._attempts[number] >= MOST_ATTEMPTS:
            raise SweepError(
                f"{what} ended its worker {MOST_ATTEMPTS} times ({how}), so the sweep ends; the {self._done:,} runs "
                f"computed are kept"
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
