"""What is computed once and kept: checks of lessons, and the runs that their questions are about.

Each is kept under a hash of all that it depends on, the program among it, and computed again when that has changed. It
is computed in a child task when it is first asked for, so that a class that opens a lesson at one time waits for one
computation. Of several one after the other is computed, and what takes a moment waits for nothing that takes longer.
Whoever asks meanwhile is told how far it is.
"""

import asyncio
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import structlog

from pftrack.process import Budget, Ending, Outcome, Refusal, Reply
from pftrack_server.jobs.child_tasks import ChildTasks, Queues, ending_message
from pftrack_server.jobs.results import DiskCache, digest

BUDGET = Budget(cpu_seconds=1800.0, silence_s=600.0)
"""A check may take a minute on a slow machine, and says nothing meanwhile."""
MOMENT_S = 3.0
"""So long what is computed is taken for light."""
AGAIN_S = 60.0
"""So long after a failure nobody tries again."""

log = structlog.get_logger(__name__)


@dataclass
class Job:
    """Something that is computed.

    Attributes:
        done: Steps done.
        total: Steps to do; 0 until that is known.
        result: What came of it; None until it has ended.
        problem: Why nothing came of it, one sentence.
        ended: When it ended (monotonic, s); None until then.
        task: What computes it.
    """

    done: int = 0
    total: int = 0
    result: dict[str, Any] | None = None
    problem: str = ""
    ended: float | None = None
    task: asyncio.Task[None] | None = field(default=None, repr=False)

    @property
    def has_failed_long_ago(self) -> bool:
        """Whether it may go better now."""
        return bool(self.problem) and self.ended is not None and time.monotonic() - self.ended > AGAIN_S

    def step(self, done: int, total: int) -> None:
        """Take note of how far it is."""
        self.done, self.total = done, total


class LessonResults:
    """What was computed, and what is.

    Args:
        folder: Where it is kept.
        tasks: Where it is computed.
    """

    def __init__(self, folder: Path, tasks: ChildTasks) -> None:
        self._kept = DiskCache(folder)
        self._tasks = tasks
        self._queues = Queues(light=1, heavy=1, moment_s=MOMENT_S)
        self._jobs: dict[str, Job] = {}

    def open(self) -> None:
        """Forget what another version of the program has computed."""
        self._kept.open()

    async def close(self) -> None:
        """Stop what is computed."""
        tasks = [job.task for job in self._jobs.values() if job.task is not None]
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    async def get(self, about: str, function: Callable[..., Any], *arguments: object) -> Job:
        """Return what was computed, or begin to compute it.

        Args:
            about: All that the result depends on beside the program.
            function: A generator that a child task goes through.
            arguments: For it.
        """
        name = digest(about)
        if name in self._jobs and self._jobs[name].has_failed_long_ago:
            del self._jobs[name]
        if name not in self._jobs:
            job = Job(result=await asyncio.to_thread(self._kept.read, name))
            # Somebody else may have begun while the disk was asked.
            job = self._jobs.setdefault(name, job)
            if job.result is None and job.task is None:
                job.task = asyncio.create_task(self._compute(name, job, function, arguments))
        return self._jobs[name]

    async def _compute(self, name: str, job: Job, function: Callable[..., Any], arguments: tuple[object, ...]) -> None:
        try:
            outcome: Outcome = await self._queues.take_turn(
                lambda: self._tasks.answer(function, *arguments, budget=BUDGET, on_step=job.step)
            )
        except Exception:
            log.exception("a lesson's computation failed", function=function.__name__)
            outcome = Ending.FAILED
        match outcome:
            case Reply(value=dict() as result):
                job.result = result
                await asyncio.to_thread(self._kept.write, name, result)
            case Refusal(message=message):
                job.problem = f"{message[:1].upper()}{message[1:].rstrip('.')}."
            case Ending() as how if how is not Ending.FAILED:
                job.problem = ending_message(how, BUDGET)
            case _:
                job.problem = "This could not be computed; the server's log may say why."
        job.ended = time.monotonic()
