"""The lessons of a server: list, figures, verdicts on answers, and results of checks.

A pool of workers draws figures and judges answers. Checks, and the runs behind questions, are computed once and kept
under a hash of everything that they depend on, including the program. A child task computes each at the first request,
so a class that opens a lesson at the same time waits for one computation and sees its progress. They are computed one
after the other; short ones do not wait for longer ones.
"""

import asyncio
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, Literal

from pftrack.core.refusal import RefusedError
from pftrack.process import MEBIBYTE, Budget, CallError, Ending, Pool, WorkerLostError
from pftrack.teaching.lessons import LESSONS, find
from pftrack.teaching.lessons import lesson as course
from pftrack.teaching.lessons.library import Library, read_lessons
from pftrack.teaching.lessons.notebook import lesson_notebook
from pftrack_server.core.errors import not_found, unavailable
from pftrack_server.core.log import RateLimitedLogger
from pftrack_server.core.processes import FORK_SERVER
from pftrack_server.jobs.child_tasks import ChildTasks, Queues
from pftrack_server.jobs.jobs import Job, Jobs, OnStep
from pftrack_server.jobs.results import DiskCache, digest
from pftrack_server.teaching import functions
from pftrack_server.teaching.messages import ComputingPublic, FigureRequest, missing

AT_ONCE = 16
KEPT = 2
"""Idle workers to keep: a fork for each move of a slider would take longer than the figure."""
LONGEST_S = 60.0
"""Time limit of one figure, s. A figure takes milliseconds, but a worker's first one imports the lesson and loads
compiled code, which takes a busy machine many seconds; a worker ended then would have to repeat that."""
MEMORY_BYTES = 1024 * MEBIBYTE
BUDGET = Budget(memory_bytes=MEMORY_BYTES, cpu_seconds=None, silence_s=LONGEST_S, niceness=3)
"""Limits of a lesson worker; the web process goes first, as with sessions."""

RUN_S = 1.5
"""How long an answer waits for a run, s; then it reports the run's progress."""
COMPUTED_BUDGET = Budget(cpu_seconds=1800.0, silence_s=600.0)
"""Limits of checks and runs; a check may take a minute on a slow machine, without a sign of life."""
MOMENT_S = 3.0
"""Time for which a computation counts as light, s."""
AGAIN_S = 60.0
"""Time after a failure before another attempt, s."""

warnings = RateLimitedLogger(__name__)


class LessonJob(Job[dict[str, Any]]):
    """A computation for a lesson: the results of its checks, or the right answer to its question."""

    kind: Literal["lesson"] = "lesson"


class LessonResults:
    """Finished and running computations of lessons.

    Args:
        kept: Cache of the results.
        tasks: Runs the computations.

    Attributes:
        jobs: Running computations, and recent failures.
    """

    def __init__(self, kept: DiskCache, tasks: ChildTasks) -> None:
        self.jobs = Jobs(kept_s=AGAIN_S)
        self._kept, self._tasks = kept, tasks
        self._queues = Queues(light=1, heavy=1, moment_s=MOMENT_S)

    async def get(self, about: str, function: Callable[..., Any], *arguments: object) -> LessonJob:
        """Return a result, or begin to compute it.

        Args:
            about: Everything that the result depends on, except the program.
            function: A generator that a child task runs.
            arguments: Its arguments.

        Raises:
            ApiError: Too many computations are running (503).
        """
        job = LessonJob(id=digest(about), name=function.__name__)
        job.result = await asyncio.to_thread(self._kept.read, job.id)
        if job.result is not None:
            return job

        async def work(on_step: OnStep) -> dict[str, Any]:
            found: dict[str, Any] = await self._queues.take_turn(
                lambda: self._tasks.run_beside(function, *arguments, budget=COMPUTED_BUDGET, on_step=on_step)
            )
            await asyncio.to_thread(self._kept.write, job.id, found)
            return found

        return self.jobs.find_or_begin(job, work)


class Lessons:
    """The lessons of a server.

    Args:
        folder: Folder of lecturers' files.
        kept: Cache of results of checks and runs.
        tasks: Computes these.
    """

    def __init__(self, folder: Path, kept: DiskCache, tasks: ChildTasks) -> None:
        self._folder = folder
        self._reading = asyncio.Lock()
        self._pool = Pool(FORK_SERVER, most=AT_ONCE, kept=KEPT, budget=BUDGET)
        self._computed = LessonResults(kept, tasks)

    async def close(self) -> None:
        """End all computations."""
        await asyncio.gather(self._pool.close(), self._computed.jobs.close())

    async def all(self) -> Library:
        """Return all lessons, and the problems of files that cannot be read."""
        async with self._reading:  # the first reader fills the cache for the others
            return await asyncio.to_thread(read_lessons, self._folder)

    async def get(self, wanted: str) -> course.Lesson:
        """Return a lesson by its id or number.

        Raises:
            ApiError: The lesson does not exist; the message lists all lessons (404).
        """
        try:
            if wanted in LESSONS or wanted.isdecimal():  # a lesson of the course needs no file
                return await asyncio.to_thread(find, wanted)
            return find(wanted, (await self.all()).lessons)
        except RefusedError as error:
            raise not_found(str(error)) from None

    async def figure(self, lesson: course.Lesson, asked_for: FigureRequest) -> bytes:
        """Return a demonstration's figure and numbers as JSON.

        Raises:
            RefusedError: The lesson has no figure.
            ParameterError: A value is refused.
        """
        if not isinstance(lesson.body, course.Demonstration):
            raise RefusedError("This lesson shows a run; it has no figure.", field="lesson", value=lesson.id)
        told = asked_for.parameters, asked_for.seed, asked_for.revealed, asked_for.nearest
        drawn: bytes = await self._call(functions.draw, lesson.id, lesson.source, *told)
        return drawn

    async def notebook(self, lesson: course.Lesson) -> bytes:
        """Return a lesson as a Jupyter notebook, with its defaults.

        Raises:
            RefusedError: Its experiment is not installed.
        """
        if isinstance(lesson.body, course.Scenario) and (problem := missing(lesson.body.experiment)):
            raise RefusedError(problem)
        return await asyncio.to_thread(lesson_notebook, lesson)

    async def judge(self, lesson: course.Lesson, given: course.Given) -> course.Verdict | ComputingPublic:
        """Judge an answer, or return the progress of the run that decides on it.

        Raises:
            ParameterError: The answer does not fit the question.
            RefusedError: The run cannot be computed.
        """
        given = course.read_answer(lesson.question, given)
        if isinstance(lesson.body, course.Demonstration):
            verdict: course.Verdict = await self._call(functions.judge_demonstration, lesson.id, lesson.source, given)
            return verdict
        if problem := missing(lesson.body.experiment):
            raise RefusedError(problem)
        job = await self._result("answer", functions.answer, lesson)
        if job.result is None:
            await self._computed.jobs.wait(job.id, RUN_S)
        if job.error is not None:
            raise RefusedError(job.error)
        if job.result is None:
            return ComputingPublic(done=job.done, total=job.total)
        return course.judge(lesson.question, course.Answer(**job.result), given)

    async def poll_answers(self, lesson: course.Lesson) -> tuple[str, ...] | ComputingPublic:
        """Return the answers for a class to choose from, or the progress of the run behind them.

        Raises:
            RefusedError: The right answer cannot be computed, or is not a number.
        """
        question = lesson.question
        if question.choices:
            return course.poll_answers(question)
        # Any verdict contains the right answer.
        verdict = await self.judge(lesson, question.bounds[0])
        if isinstance(verdict, ComputingPublic):
            return verdict
        try:
            return course.poll_answers(question, verdict.exact)
        except ValueError as error:
            raise RefusedError(f"This question cannot be asked as a poll: {error}.") from None

    async def checks(self, lesson: course.Lesson) -> LessonJob:
        """Return the results of a lesson's checks, or their progress."""
        return await self._result("checks", functions.check, lesson)

    async def _result(self, kind: str, function: Callable[..., Any], lesson: course.Lesson) -> LessonJob:
        about = {"kind": kind, "lesson": lesson.id, "origin": lesson.origin, "source": lesson.source}
        return await self._computed.get(json.dumps(about), function, lesson.id, lesson.source)

    async def _call(self, function: Callable[..., Any], *arguments: object) -> Any:  # noqa: ANN401 - whatever it returns
        """Return the result of one of `functions`.

        Raises:
            RefusedError: The function refused its arguments, or needs too much memory.
            ApiError: It took too long, failed, or its worker died (503).
        """
        try:
            return await self._pool.call(function, *arguments)
        except MemoryError:
            most = f"{MEMORY_BYTES // MEBIBYTE} MiB"
            raise RefusedError(f"This needs more than the {most} of memory that a lesson may use.") from None
        except CallError as error:
            warnings.warn("a lesson failed", function=function.__name__, traceback=error.traceback)
            raise unavailable("The lesson has a mistake; the server's log names it.") from None
        except WorkerLostError as lost:
            if lost.how is Ending.OUT_OF_TIME:
                raise unavailable(
                    f"This took longer than the {LONGEST_S:g} s that a lesson may take; choose values that need less."
                ) from None
            raise unavailable("The lesson's process was killed. Try again.") from None
