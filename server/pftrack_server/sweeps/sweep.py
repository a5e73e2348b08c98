"""One sweep in the web process: a plan, a process that computes it, and the growing result files.

The files hold the progress. If child, server or machine dies, the sweep resumes from them; a sentence without a path or
a stack trace gives the reason why it stopped.

Each page watches a sweep over the axes of its choice and at its own pace. Nothing is queued: a listener that is ready
receives the present state, so a slow browser does not slow a sweep.
"""

import asyncio
import time
from collections import deque
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import structlog
from pydantic import BaseModel

from pftrack.core.model.parameters import Value
from pftrack.experiments import EXPERIMENTS
from pftrack.process import UNLIMITED
from pftrack.sources.sequence import Recording
from pftrack.sweep import Plan, begin, partial_of
from pftrack.sweep.work import prepare
from pftrack_server.core.bodies import fields_of
from pftrack_server.core.log import RateLimitedLogger
from pftrack_server.core.panel import TrackerPublic
from pftrack_server.core.settings import Settings
from pftrack_server.jobs.child_tasks import ChildTasks
from pftrack_server.sessions.duplex import Listener, Listeners, Message, encode
from pftrack_server.sessions.spec import MeasurePublic
from pftrack_server.store.database import SweepRow
from pftrack_server.store.disk_budget import failure_message
from pftrack_server.sweeps import functions
from pftrack_server.sweeps.results import AxisPublic, CellsPublic, MapPublic, Results, axis_view, fixed_views

State = Literal["running", "stopped", "done"]


class SweepPublic(BaseModel):
    """A sweep.

    Rates are in runs per second, times in seconds. `fixed` is `parameters` with titles and units; `successes` counts
    all runs so far, if the experiment defines success; `problems` counts runs whose values contradict each other;
    `recording` is the name of the recording of all runs, if there is one. Without `has_truth` there is no error, and
    `measures` are the methods' own reports.
    """

    id: str
    title: str
    experiment: str
    unit: str
    judged: bool
    has_truth: bool
    axes: list[AxisPublic]
    trackers: list[TrackerPublic]
    measures: list[MeasurePublic]
    trials: int
    frames: int
    recording: str | None
    seed: int
    loss_probability: bool
    parameters: dict[str, Value]
    fixed: list[AxisPublic]
    runs: int
    conditions: int
    done: int
    successes: int | None
    problems: int
    state: State
    message: str | None
    rate: float | None
    seconds: float
    seconds_left: float | None
    created: str
    outcome: str
    page: str


class Hello(Message):
    """The complete state; the first message of every connection."""

    type: Literal["hello"] = "hello"
    sweep: SweepPublic
    cells: CellsPublic


class Progress(Message):
    """The sweep, after progress or a change of state."""

    type: Literal["progress"] = "progress"
    sweep: SweepPublic


class Cells(Message):
    """The changed cells, by their number: row after row of the y axis."""

    type: Literal["cells"] = "cells"
    done: int
    at: list[int]
    maps: list[MapPublic]


KEPT = "The computed runs are kept; resume the sweep to continue."
CANCELLED = f"The sweep was cancelled. {KEPT}"
DELETED = "The sweep was deleted."
STOPPED = f"The server was stopped. {KEPT}"


EVERY_S = 0.2


class SweepListener(Listener):
    """One page that watches a sweep."""

    def __init__(self, sweep: "Sweep", x: str | None, y: str | None) -> None:
        super().__init__()
        self.news.clear()  # the greeting does not wait
        self._sweep = sweep
        self._axes = x, y

    async def __aiter__(self) -> AsyncIterator[str]:
        """Yield messages, the greeting first, no faster than a person can see."""
        known = await self._sweep.cells(*self._axes)
        shown = self._sweep.view()
        yield encode(Hello(sweep=shown, cells=known))
        told = time.monotonic()
        while not self.closed:
            await self.news.wait()
            self.news.clear()
            # Changes within one interval are sent together; the end of a sweep is sent at once.
            await asyncio.sleep(max(0.0, told + EVERY_S - time.monotonic()))
            told = time.monotonic()
            now = await self._sweep.cells(*self._axes)
            changed = _changed_cells(known, now)
            known = now
            if changed is not None:
                yield encode(changed)
            if (view := self._sweep.view()) != shown:
                shown = view
                yield encode(Progress(sweep=shown))


def _changed_cells(before: CellsPublic, now: CellsPublic) -> Cells | None:
    """Return the cells with new runs, or None."""
    if before is now:
        return None
    cells = len(now.maps[0].runs) if now.maps else 0
    at = [index for index in range(cells) if _runs(before, index) != _runs(now, index)]
    return Cells(done=now.done, at=at, maps=[_only(one, at) for one in now.maps]) if at else None


def _runs(view: CellsPublic, index: int) -> list[tuple[int, int]]:
    return [(one.runs[index], one.problems[index]) for one in view.maps]


def _only(one: MapPublic, at: list[int]) -> MapPublic:
    columns = {name: [column[index] for index in at] for name, column in one if isinstance(column, list)}
    measures = {name: [column[index] for index in at] for name, column in one.measures.items()}
    return one.model_copy(update={**columns, "measures": measures})


NICENESS = 10
"""Niceness of a sweep, below that of watched sessions."""

log = structlog.get_logger(__name__)

LOOK_EVERY_S = 0.25
WRITE_EVERY_S = 5.0
RATE_OVER_S = 20.0

Keep = Callable[["Sweep"], Awaitable[None]]
FindRecording = Callable[[Plan], Awaitable[Recording | None]]


@dataclass(eq=False)
class Sweep:
    """One sweep; call all methods in the event loop's thread.

    Attributes:
        row: Its row in the database, in which it records its progress.
        plan: The plan.
        out: Its result file.
        settings: Settings of the server.
        tasks: Runs its process.
        keep: Stores its changes.
        find_recording: Finds the recording of its runs.
        filters: Texts of filters of the server's owner that its runs may execute.
        results: Its results so far.
    """

    row: SweepRow
    plan: Plan
    out: Path
    settings: Settings
    tasks: ChildTasks
    keep: Keep
    find_recording: FindRecording
    filters: tuple[str, ...]

    def __post_init__(self) -> None:
        """Set the title, and load a stored sweep."""
        self.results = Results(self.plan, self.out)
        self._seconds = self.row.seconds
        self._axes = [axis_view(self.plan, axis.name) for axis in self.plan.axes]
        self._fixed = fixed_views(self.plan)
        self._watch: asyncio.Task[None] | None = None
        self._reason: str | None = None
        self._began = 0.0
        self._past: deque[tuple[float, int]] = deque()
        self._listeners: Listeners[SweepListener] = Listeners()
        self._warnings = RateLimitedLogger(__name__, every_s=60.0)

    # ------------------------------------------------------------ views

    @property
    def listeners(self) -> int:
        """Number of pages that watch the sweep."""
        return len(self._listeners)

    def view(self) -> SweepPublic:
        """Return the public view of the sweep."""
        row, plan, experiment = self.row, self.plan, self.plan.wiring
        rate = self._rate()
        kept = fields_of(SweepPublic, row)
        so_far = {"successes": row.successes if plan.judged else None, "seconds": self._now_seconds()}
        return SweepPublic(
            **kept | so_far,
            unit=experiment.judge.unit,
            judged=plan.judged,
            has_truth=plan.has_truth,
            axes=self._axes,
            trackers=[{"id": name, "title": experiment.trackers[name].title} for name in plan.trackers],
            measures=[MeasurePublic.model_validate(measure.as_dict()) for measure in plan.measures],
            trials=plan.trials,
            frames=plan.frames,
            recording=plan.footage.name if plan.footage else None,
            seed=plan.seed,
            loss_probability=plan.loss_probability,
            parameters=dict(plan.values),
            fixed=self._fixed,
            conditions=plan.conditions,
            rate=rate,
            seconds_left=(plan.runs - row.done) / rate if rate else None,
            outcome=self._outcome(),
            page=f"sweep/{row.id}",
        )

    async def cells(self, x: str | None = None, y: str | None = None) -> CellsPublic:
        """Return its map over one or two axes, by default the first two.

        Raises:
            RefusedError: The axis is unknown.
        """
        return await asyncio.to_thread(self.results.cells, x, y)

    # ------------------------------------------------------------ life cycle

    async def start(self) -> None:
        """Begin or resume.

        Raises:
            ConflictError: Its recording no longer exists.
            OSError: The disk cannot be written.
        """
        recording = await self.find_recording(self.plan)
        if not self.out.exists() and not partial_of(self.out).exists():
            await asyncio.to_thread(begin, self.plan, self.out)
        self._reason = None
        settings = self.settings
        # Untrusted files are decoded, and the owner's files executed, within the same limits as in a session.
        memory_bytes = settings.worker_memory_bytes if recording or self.filters else None
        budget = replace(UNLIMITED, file_bytes=settings.max_sweeps_bytes, memory_bytes=memory_bytes, niceness=NICENESS)
        self._began = time.monotonic()
        self._past.clear()
        computing = self.tasks.run_beside(
            functions.compute,
            self.out,
            settings.sweep_jobs,
            recording,
            self.filters,
            budget=budget,
            stopped=lambda: self._reason is not None,
            prepare=prepare,  # the fork server of its pool is forked before the process has a thread
        )
        self._watch = asyncio.create_task(self._follow(asyncio.ensure_future(computing)))
        await self._become("running", None)
        log.info("sweep started", sweep=self.row.id, runs=self.plan.runs, done=self.row.done)

    async def stop(self, reason: str) -> None:
        """End its process; computed runs are kept."""
        if self._watch is not None:
            self._reason = self._reason or reason
            await asyncio.shield(self._watch)

    async def close(self, reason: str) -> None:
        """End its process and close all listeners."""
        await self.stop(reason)
        self._listeners.close()

    async def look(self) -> None:
        """Count the results on disk."""
        await asyncio.to_thread(self.results.look)
        self._take()

    async def _follow(self, end: asyncio.Future[None]) -> None:
        """Watch the sweep's process and its files until the process ends."""
        written = time.monotonic()
        try:
            while not end.done():
                await asyncio.wait({end}, timeout=LOOK_EVERY_S)
                await self._glance()
                if time.monotonic() - written > WRITE_EVERY_S:
                    written = time.monotonic()
                    await self._write()
            await self._glance()
        finally:
            self._seconds, self._watch = self._now_seconds(), None
        error = end.exception()
        if error is None and self.out.exists():
            await self._become("done", None)
            return
        if self._reason is None:
            log.warning("sweep stopped", sweep=self.row.id, error=repr(error))
        said = failure_message(error) if error else "The computation failed."
        await self._become("stopped", self._reason or f"{said.rstrip('.')}. {KEPT}")

    async def _glance(self) -> None:
        """Count the results on disk; if that fails, the next attempt may succeed."""
        try:
            if await asyncio.to_thread(self.results.look):
                self._take()
        except Exception:
            log.exception("a sweep's files cannot be read", sweep=self.row.id)

    def _take(self) -> None:
        found = self.results
        self.row.done, self.row.successes, self.row.problems = found.done, found.successes, found.problems
        self._past.append((time.monotonic(), self.row.done))
        while len(self._past) > 2 and self._past[-1][0] - self._past[0][0] > RATE_OVER_S:
            self._past.popleft()
        self._wake()

    async def _become(self, state: State, message: str | None) -> None:
        self.row.state, self.row.message = state, message
        self._wake()
        await self._write()

    async def _write(self) -> None:
        """Store the progress; if that fails, the next attempt may succeed, and the files hold it too."""
        self.row.seconds = self._now_seconds()
        try:
            await self.keep(self)
        except Exception as error:  # noqa: BLE001 - whatever it is, the sweep goes on
            self._warnings.warn("the progress of a sweep could not be stored", sweep=self.row.id, error=repr(error))

    # ------------------------------------------------------------ listeners

    def join(self, x: str | None, y: str | None) -> AbstractContextManager[SweepListener]:
        """Add a listener while the context lasts."""
        return self._listeners.add(SweepListener(self, x, y))

    def _wake(self) -> None:
        for listener in self._listeners:
            listener.news.set()

    # ------------------------------------------------------------ figures

    def _now_seconds(self) -> float:
        running = time.monotonic() - self._began if self._watch is not None else 0.0
        return round(self._seconds + running, 1)

    def _rate(self) -> float | None:
        """Return the recent rate, runs per second."""
        if self.row.state != "running" or len(self._past) < 2:
            return None
        (then, before), (now, after) = self._past[0], self._past[-1]
        return (after - before) / (now - then) if now > then and after > before else None

    def _outcome(self) -> str:
        """Return the progress and the share of successful runs, in a few words."""
        so_far = "" if self.row.state == "done" else f"{self.row.done:,} of "
        parts = [f"{so_far}{self.plan.runs:,} runs"]
        if self.plan.judged and self.row.successes is not None and self.row.done > self.row.problems:
            parts.append(f"{100 * self.row.successes / (self.row.done - self.row.problems):.0f} % succeeded")
        return ", ".join(parts)


def default_title(plan: Plan) -> str:
    """Return a title for a plan without one."""
    experiment = EXPERIMENTS[plan.experiment]
    titles = [axis_view(plan, axis.name).title.lower() for axis in plan.axes[:3]]
    over = " × ".join(titles) or "repeated"
    where = [plan.footage.name] if plan.footage and plan.footage.name else []
    return " · ".join((experiment.title_on(plan.footage), *where, over))[:200]
