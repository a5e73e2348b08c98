"""Jobs: work that takes longer than a client should wait for one answer.

Each reports its progress and can be cancelled. Jobs exist only in memory. A job continues only while somebody asks for
it: a visitor who closed the page no longer waits for it, and others need its place.
"""

import asyncio
import contextlib
import time
from collections.abc import Callable, Coroutine
from dataclasses import dataclass, field
from typing import Any, Generic, Literal, TypeAlias, TypeVar, cast

import structlog
from pydantic import BaseModel, Field

from pftrack.core.refusal import RefusedError
from pftrack_server.core.errors import client_gone, not_found, unavailable
from pftrack_server.store.disk_budget import failure_message

Result = TypeVar("Result")


class Job(BaseModel, Generic[Result]):
    """Work in progress, or its result."""

    id: str
    kind: str
    name: str = Field(description="Name of the file being read or written, or of what is compared, fitted or explored")
    state: Literal["working", "done", "failed"] = "working"
    done: int = Field(0, description="Steps done")
    total: int = Field(0, description="Total of steps; 0 until it is known")
    result: Result | None = Field(None, description="Result so far; complete once the job is done")
    error: str | None = Field(None, description="Why the job failed, a sentence")

    def refresh(self) -> None:
        """Update a result that grows; called before the job is returned."""


log = structlog.get_logger(__name__)

MOST_AT_WORK = 32
"""Most running jobs of a kind."""
KEPT_S = 600.0
"""How long a job is kept after its end, s."""
LOOK_S = 15.0
"""Interval of the checks whether somebody has asked for a running job, s."""
MOST_LOOKS = 10
"""Checks without a request after which a job is dropped: 150 s, since browsers let a hidden page ask only once a
minute. Checks are counted, not seconds, so that a pause of this whole process counts as one check."""

OneJob = TypeVar("OneJob", bound=Job[Any])

OnStep: TypeAlias = Callable[[int, int], None]
"""(steps done, total) -> None."""
Work: TypeAlias = Callable[[OnStep], Coroutine[Any, Any, Any]]
"""Does the work of a job, and returns its result."""


@dataclass
class _Entry:
    """A job and its task.

    Attributes:
        job: Its public state.
        drop: Removes what the job left behind.
        task: The task that does its work.
        ended: When the task ended (monotonic, s).
        unasked: Checks since the last request for it.
    """

    job: Job[Any]
    drop: Callable[[], object]
    task: asyncio.Task[None] = field(init=False)
    ended: float | None = None
    unasked: int = 0


class Jobs:
    """Jobs of a server.

    Args:
        kept_s: How long a job is kept after its end, s.
    """

    def __init__(self, kept_s: float = KEPT_S) -> None:
        self._kept_s = kept_s
        self._all: dict[str, _Entry] = {}

    def all(self) -> list[Job[Any]]:
        """Return running and recently ended jobs, newest first; this does not count as a request for them."""
        self._forget()
        jobs = [each.job for each in reversed(self._all.values())]
        for job in jobs:
            job.refresh()
        return jobs

    def under_way(self, kind: type[OneJob]) -> list[OneJob]:
        """Return the running jobs of a kind; this does not count as a request for them."""
        return [each.job for each in self._all.values() if each.ended is None and isinstance(each.job, kind)]

    def get(self, name: str) -> Job[Any]:
        """Return a job; the request keeps it running.

        Raises:
            ApiError: The job is unknown, or ended long ago (404).
        """
        self._forget()
        found = self._all.get(name)
        if found is None:
            raise not_found("This job does not exist; it may have been cancelled, or have ended long ago.")
        found.unasked = 0
        found.job.refresh()
        return found.job

    def find_or_begin(self, job: OneJob, work: Work) -> OneJob:
        """Return the job of the same id, and keep it running, or begin this one; a dropped job begins again.

        Raises:
            ApiError: Too many jobs of this kind are running (503).
        """
        self._forget()
        known = self._all.get(job.id)
        is_kept = known is not None and known.unasked < MOST_LOOKS
        return cast("OneJob", self.get(job.id)) if is_kept else self.begin(job, work)

    async def wait(self, name: str, patience_s: float) -> None:
        """Wait at most `patience_s` seconds for a job to end."""
        await asyncio.wait({self._all[name].task}, timeout=patience_s)

    def check_room(self, kind: type[OneJob]) -> None:
        """Make sure that there is room for one more job of a kind.

        Raises:
            ApiError: Too many jobs of this kind are running (503).
        """
        if len(self.under_way(kind)) >= MOST_AT_WORK:
            several = f"{kind.model_fields['kind'].default}s"
            raise unavailable(f"The server works on at most {MOST_AT_WORK} {several} at a time; wait, or cancel one.")

    def begin(self, job: OneJob, work: Work, *, drop: Callable[[], object] = lambda: None) -> OneJob:
        """Begin a job and return it.

        Args:
            job: Its public state, with a unique name.
            work: Does it.
            drop: Removes what the job left behind; called when it has failed, or is forgotten.

        Raises:
            ApiError: Too many jobs of this kind are running (503).
        """
        self.check_room(type(job))
        made = _Entry(job, drop)
        made.task = asyncio.ensure_future(self._run(made, work))
        self._all[job.id] = made
        return job

    async def cancel(self, name: str) -> None:
        """End a job and forget it.

        Raises:
            ApiError: The job does not exist (404).
        """
        self.get(name)
        await _cancel(self._all[name])
        self._drop(name)

    async def close(self) -> None:
        """End all jobs."""
        await asyncio.gather(*map(_cancel, self._all.values()))

    def _forget(self) -> None:
        now = time.monotonic()
        for name, each in list(self._all.items()):
            if each.ended is not None and now - each.ended > self._kept_s:
                self._drop(name)

    def _drop(self, name: str) -> None:
        dropped = self._all.pop(name, None)
        if dropped is not None:
            dropped.drop()

    async def _run(self, entry: _Entry, work: Work) -> None:
        job = entry.job

        def step(done: int, total: int) -> None:
            job.done, job.total = done, total

        try:
            job.result = await _run_while_asked(entry, work(step))
            job.done, job.state = job.total, "done"  # the last steps are not reported
        except BaseException as error:
            job.state, job.error = "failed", failure_message(error)
            entry.drop()
            if not isinstance(error, RefusedError | asyncio.CancelledError):
                # Its client may have gone: only the log would show the failure.
                log.exception("a job failed", kind=job.kind, job=job.id)
            if not isinstance(error, Exception):
                raise
        finally:
            entry.ended = time.monotonic()
            # Forget it in time even if nobody asks again.
            asyncio.get_running_loop().call_later(self._kept_s + 1.0, self._forget)


async def _run_while_asked(entry: _Entry, work: Coroutine[Any, Any, Any]) -> Any:  # noqa: ANN401 - whatever the work returns
    working = asyncio.ensure_future(work)
    try:
        while not (await asyncio.wait({working}, timeout=LOOK_S))[0]:
            entry.unasked += 1
            if entry.unasked >= MOST_LOOKS:
                waited = f"{LOOK_S * MOST_LOOKS:g} s"
                raise client_gone(f"Nobody asked for this {entry.job.kind} for {waited}; begin it again.")
        return working.result()
    finally:
        working.cancel()
        await asyncio.gather(working, return_exceptions=True)


async def _cancel(entry: _Entry) -> None:
    entry.task.cancel()
    with contextlib.suppress(asyncio.CancelledError):
        await entry.task
