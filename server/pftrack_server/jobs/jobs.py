"""Jobs: work that takes longer than a client should wait for one answer.

Each tells its progress and can be cancelled. Jobs live in memory alone. A job continues for as long as somebody asks
for it: a visitor who closed the page no longer waits, and others wait for the place.
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
    """Work under way, or its result."""

    id: str
    kind: str
    name: str = Field(description="Of the file that is read or written, or what is compared, fitted or explored")
    state: Literal["working", "done", "failed"] = "working"
    done: int = Field(0, description="Steps done")
    total: int = Field(0, description="Steps to do; 0 until that is known")
    result: Result | None = Field(None, description="What has been found so far; all of it once it is done")
    error: str | None = Field(None, description="Why it has failed, a sentence")

    def refresh(self) -> None:
        """Say what has been found so far, where that grows; called before anybody looks."""


log = structlog.get_logger(__name__)

MOST_AT_WORK = 32
"""Of a kind."""
KEPT_S = 600.0
"""How long the result of a job is kept, s."""
LOOK_S = 15.0
"""Time between two looks whether somebody has asked for a job that is under way."""
MOST_LOOKS = 10
"""Looks without a question after which it is dropped: 150 s, since browsers let a hidden page ask once a minute only.
They are counted, so that a while in which this very process was stopped is one look and not hundreds of seconds."""

OneJob = TypeVar("OneJob", bound=Job[Any])

OnStep: TypeAlias = Callable[[int, int], None]
"""(steps done, all that there are) -> None."""
Work: TypeAlias = Callable[[OnStep], Coroutine[Any, Any, Any]]
"""Does what a job is about, and returns its result."""


@dataclass
class _Entry:
    """A job with what carries it out.

    Attributes:
        job: What is told of it.
        drop: Lets go of what it leaves behind.
        task: Carries it out.
        ended: When that ended (monotonic, s).
        unasked: Looks since somebody asked for it.
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
        """Return those under way, and those that ended a while ago, the newest first; this asks for none."""
        self._forget()
        jobs = [each.job for each in reversed(self._all.values())]
        for job in jobs:
            job.refresh()
        return jobs

    def under_way(self, kind: type[OneJob]) -> list[OneJob]:
        """Return those of a kind that are under way; this asks for none."""
        return [each.job for each in self._all.values() if each.ended is None and isinstance(each.job, kind)]

    def get(self, name: str) -> Job[Any]:
        """Return a job, which then goes on.

        Raises:
            ApiError: It is unknown, or ended long ago (404).
        """
        self._forget()
        found = self._all.get(name)
        if found is None:
            raise not_found("This job does not exist; it may have been cancelled, or have ended long ago.")
        found.unasked = 0
        found.job.refresh()
        return found.job

    def find_or_begin(self, job: OneJob, work: Work) -> OneJob:
        """Return the job of the same id, which then goes on, or begin this one; one that was left alone begins anew.

        Raises:
            ApiError: There are as many under way as there may be (503).
        """
        self._forget()
        known = self._all.get(job.id)
        is_kept = known is not None and known.unasked < MOST_LOOKS
        return cast("OneJob", self.get(job.id)) if is_kept else self.begin(job, work)

    async def wait(self, name: str, patience_s: float) -> None:
        """Wait for a job to end, but no longer than this."""
        await asyncio.wait({self._all[name].task}, timeout=patience_s)

    def check_room(self, kind: type[OneJob]) -> None:
        """Make sure that there is a place for one more of a kind.

        Raises:
            ApiError: There are as many under way as there may be (503).
        """
        if len(self.under_way(kind)) >= MOST_AT_WORK:
            several = f"{kind.model_fields['kind'].default}s"
            raise unavailable(f"The server works on at most {MOST_AT_WORK} {several} at a time; wait, or cancel one.")

    def begin(self, job: OneJob, work: Work, *, drop: Callable[[], object] = lambda: None) -> OneJob:
        """Begin a job, and return it.

        Args:
            job: What is told of it, with a name of its own.
            work: Does it.
            drop: Lets go of what it leaves behind: once it has failed, or nobody can ask for it any more.

        Raises:
            ApiError: There are as many under way as there may be (503).
        """
        self.check_room(type(job))
        made = _Entry(job, drop)
        made.task = asyncio.ensure_future(self._run(made, work))
        self._all[job.id] = made
        return job

    async def cancel(self, name: str) -> None:
        """End a job, and forget it.

        Raises:
            ApiError: It does not exist (404).
        """
        self.get(name)
        await _cancel(self._all[name])
        self._drop(name)

    async def close(self) -> None:
        """End all of them."""
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
            job.done, job.state = job.total, "done"  # the last steps are not told
        except BaseException as error:
            job.state, job.error = "failed", failure_message(error)
            entry.drop()
            if not isinstance(error, RefusedError | asyncio.CancelledError):
                # Its client may have gone: nobody else would write it down.
                log.exception("a job failed", kind=job.kind, job=job.id)
            if not isinstance(error, Exception):
                raise
        finally:
            entry.ended = time.monotonic()
            # What it left behind goes also if nobody asks again.
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
