"""Jobs: work that takes longer than a client should wait for one answer.

Each tells how far it is and can be cancelled. It lives in memory: nothing of it has been promised to anybody before it
is done. It goes on for as long as somebody asks for it: whoever has closed the page no longer waits, and others do, for
its place.
"""

import asyncio
import contextlib
import time
from collections.abc import Callable, Coroutine
from dataclasses import dataclass, field
from typing import Any, Generic, TypeAlias, TypeVar

import structlog

from pftrack_server.errors import ApiError, ClientGoneError, NotFoundError, UnavailableError
from pftrack_server.store.files import new_name
from pftrack_server.system_errors import failure_message

log = structlog.get_logger(__name__)

MOST_AT_WORK = 32
KEPT_S = 600.0
"""So long it can be asked what came of a job."""
LOOK_S = 15.0
"""Time between two looks whether somebody has asked for a job that is under way."""
MOST_LOOKS = 10
"""Looks without a question after which it is dropped: 150 s, since browsers let a hidden page ask once a minute only.
They are counted, so that a while in which this very process was stopped is one look and not hundreds of seconds."""

About = TypeVar("About")
Result = TypeVar("Result")

Work: TypeAlias = Callable[[Callable[[int, int], None]], Coroutine[Any, Any, Result]]
"""(what to tell the steps done and all that there are) -> the work."""


@dataclass
class Job(Generic[About, Result]):
    """Work under way, or what came of it.

    Attributes:
        id: Its name.
        about: What is known of it from the start.
        done: Steps done.
        total: Steps to do; 0 until that is known.
        task: What does it, and then its result.
        ended: When that ended (monotonic, s).
        unasked: Looks since somebody asked for it.
    """

    id: str
    about: About
    done: int = 0
    total: int = 0
    task: asyncio.Task[Result] = field(init=False)
    ended: float | None = None
    unasked: int = 0

    def step(self, done: int, total: int) -> None:
        """Take note of how far it is."""
        self.done, self.total = done, total


class Jobs(Generic[About, Result]):
    """All jobs of one kind.

    Args:
        noun: What one of them is called, as in "There is no such ... here".
    """

    def __init__(self, noun: str) -> None:
        self._noun = noun
        self._all: dict[str, Job[About, Result]] = {}

    @property
    def all(self) -> list[Job[About, Result]]:
        """Those under way, and those that ended a while ago, the newest first; looking at them asks for all."""
        self._forget()
        for each in self._all.values():
            each.unasked = 0
        return list(reversed(self._all.values()))

    def peek(self) -> list[Job[About, Result]]:
        """Return those under way, and those that ended a while ago; looking so asks for none."""
        return list(self._all.values())

    def get(self, name: str) -> Job[About, Result]:
        """Return a job, which then goes on.

        Raises:
            NotFoundError: There is none, or it ended long ago.
        """
        self._forget()
        if name not in self._all:
            raise NotFoundError(f"There is no such {self._noun}; it may have been cancelled, or have ended long ago.")
        self._all[name].unasked = 0
        return self._all[name]

    def check_room(self) -> None:
        """Make sure that there is a place for one more.

        Raises:
            UnavailableError: There are as many under way as there may be.
        """
        self._forget()
        if sum(not each.task.done() for each in self._all.values()) >= MOST_AT_WORK:
            raise UnavailableError(
                f"The server works on at most {MOST_AT_WORK} {self._noun}s at a time; wait, or cancel one."
            )

    def begin(self, about: About, work: Work[Result]) -> Job[About, Result]:
        """Begin a job.

        Raises:
            UnavailableError: There are as many under way as there may be.
        """
        self.check_room()
        made: Job[About, Result] = Job(new_name(), about)
        made.task = asyncio.ensure_future(self._run(made, work(made.step)))
        # Nobody has to ask for what came of it.
        made.task.add_done_callback(lambda task: None if task.cancelled() else task.exception())
        self._all[made.id] = made
        return made

    async def cancel(self, name: str) -> None:
        """End a job, and forget it.

        Raises:
            NotFoundError: There is none.
        """
        await _cancel(self.get(name))
        self._drop(name)

    async def close(self) -> None:
        """End all of them."""
        await asyncio.gather(*map(_cancel, self._all.values()))

    def _forget(self) -> None:
        now = time.monotonic()
        for each in list(self._all.values()):
            if each.ended is not None and now - each.ended > KEPT_S:
                self._drop(each.id)

    def _drop(self, name: str) -> None:
        dropped = self._all.pop(name, None)
        if dropped is not None:
            self.on_drop(dropped)

    def on_drop(self, job: Job[About, Result]) -> None:
        """Let go of what a job has left behind, now that nobody can ask for it any more; as it is, that is nothing."""

    async def _run(self, job: Job[About, Result], work: Coroutine[Any, Any, Result]) -> Result:
        try:
            return await self._run_while_asked(job, work)
        except ApiError:
            raise
        except Exception:
            # Its client may have gone: nobody else would write it down.
            log.exception("a job failed", kind=self._noun, job=job.id)
            raise
        finally:
            job.ended = time.monotonic()
            # What it left behind goes also if nobody asks again.
            asyncio.get_running_loop().call_later(KEPT_S + 1.0, self._forget)

    async def _run_while_asked(self, job: Job[About, Result], work: Coroutine[Any, Any, Result]) -> Result:
        working = asyncio.ensure_future(work)
        try:
            while not (await asyncio.wait({working}, timeout=LOOK_S))[0]:
                job.unasked += 1
                if job.unasked >= MOST_LOOKS:
                    waited = f"{LOOK_S * MOST_LOOKS:g} s"
                    raise ClientGoneError(
                        f"Nobody asked for this {self._noun} for {waited}, so it was stopped; begin it again."
                    )
            return working.result()
        finally:
            working.cancel()
            await asyncio.gather(working, return_exceptions=True)


def failure_of(job: Job[About, Result]) -> str | None:
    """Return why a job that has ended has failed, a sentence; None if it has not."""
    error = asyncio.CancelledError() if job.task.cancelled() else job.task.exception()
    return None if error is None else failure_message(error)


async def _cancel(job: Job[About, Result]) -> None:
    job.task.cancel()
    with contextlib.suppress(asyncio.CancelledError, Exception):
        await job.task
