"""Child tasks: work that must not run in the web process; each runs in turn in a process of its own, with limits.

A process starts in some 20 ms. It is ended if it falls silent, if nobody waits for it any more, or if the web process
is gone.

Light work, such as a picture of a frame, never waits for heavy work, such as decoding a film. Work of the same weight
is served in order of arrival. Work of unknown length begins as light work and leaves that queue if it proves heavy.
"""

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable, Coroutine
from contextlib import AsyncExitStack, asynccontextmanager
from dataclasses import dataclass, replace
from functools import partial
from typing import Annotated, Any, TypeVar

from fastapi import Depends, Request

from pftrack.core.refusal import RefusedError
from pftrack.process import Budget, Ending, Fault, Outcome, Refusal, Reply, run_task
from pftrack_server.core.errors import unavailable
from pftrack_server.core.log import RateLimitedLogger
from pftrack_server.core.processes import FORK_SERVER
from pftrack_server.core.requests import service, unless_gone, wait_until_gone
from pftrack_server.jobs import functions

Result = TypeVar("Result")


@dataclass(frozen=True, slots=True)
class _Place:
    """A place in the queue: its ticket, and the time (s, loop's clock) after which no new arrival passes it."""

    ticket: str | None
    due: float


class Queue:
    """A number of places, and the queue for them.

    Args:
        places: Most tasks at work at one time.
    """

    def __init__(self, places: int) -> None:
        self._free = places
        self._waiting: dict[asyncio.Future[None], _Place] = {}

    @property
    def is_free(self) -> bool:
        """Whether a new task would start at once."""
        return self._free > 0

    @asynccontextmanager
    async def place(self, ticket: str | None = None, *, weight_s: float = 0.0) -> AsyncIterator[None]:
        """Wait for a place, and hold it while the context lasts.

        Args:
            ticket: Name with which the client asks `before`.
            weight_s: Expected duration, s; an instant task that arrives less than this later still goes first.
        """
        if self._free > 0:
            self._free -= 1
        else:
            loop = asyncio.get_running_loop()
            turn = loop.create_future()
            self._waiting[turn] = _Place(ticket, loop.time() + weight_s)
            try:
                await turn
            except asyncio.CancelledError:
                if turn.done() and not turn.cancelled():
                    self._next()  # its turn had come at the same moment
                raise
            finally:
                self._waiting.pop(turn, None)
        try:
            yield
        finally:
            self._next()

    def before(self, ticket: str) -> int | None:
        """Return the number of tasks before a ticket, or None if it does not wait."""
        waiting = [self._waiting[turn].ticket for turn in self._line()]
        return waiting.index(ticket) + 1 if ticket in waiting else None

    def _line(self) -> list[asyncio.Future[None]]:
        return sorted(self._waiting, key=lambda turn: self._waiting[turn].due)

    def _next(self) -> None:
        for turn in self._line():
            del self._waiting[turn]
            if not turn.done():
                turn.set_result(None)
                return
        self._free += 1


class Queues:
    """The queues of light and heavy work.

    Attributes:
        check: For checks that processes can be started; they wait for no other work.
        light: For work of a moment.
        heavy: For work of minutes.

    Args:
        light: Most light tasks at one time.
        heavy: Most heavy tasks at one time.
        moment_s: Time after which a task counts as heavy, s.
    """

    def __init__(self, *, light: int = 4, heavy: int = 2, moment_s: float = 3.0) -> None:
        self.check = Queue(1)
        self.light = Queue(light)
        self.heavy = Queue(heavy)
        self._moment_s = moment_s

    async def take_turn(
        self, work: Callable[[], Coroutine[Any, Any, Result]], ticket: str | None = None, *, weight_s: float = 0.0
    ) -> Result:
        """Do work of unknown length, so that short work never waits for longer work.

        It begins as light work. If it is not done in a moment, it continues as heavy work if there is a free place;
        otherwise it is stopped, and begins again when its turn comes.

        Args:
            work: Starts the work.
            ticket: Name with which the client asks `before`.
            weight_s: Expected duration as heavy work, s; see `Queue.place`.
        """
        async with AsyncExitStack() as light:
            await light.enter_async_context(self.light.place(ticket))
            working = asyncio.ensure_future(work())
            try:
                await asyncio.wait((working,), timeout=self._moment_s)
                if working.done():
                    return working.result()
                if self.heavy.is_free:
                    async with self.heavy.place():
                        await light.aclose()
                        return await working
            finally:
                working.cancel()
                await asyncio.gather(working, return_exceptions=True)
        async with self.heavy.place(ticket, weight_s=weight_s):
            return await work()

    def before(self, ticket: str) -> int:
        """Return the number of tasks before a ticket; 0 if its task has started or is unknown."""
        return self.light.before(ticket) or self.heavy.before(ticket) or 0


BUDGET = Budget()
LONG_S = 30.0
"""Assumed duration of a long task, s, for its place in the queue."""

warnings = RateLimitedLogger(__name__)


async def _never() -> None:
    await asyncio.Event().wait()


@dataclass(frozen=True)
class ChildTasks:
    """Runs tasks in confined processes, a few at a time.

    Attributes:
        queues: The queues in which tasks wait.
        gone: Waits until the client hangs up; its short tasks are then dropped.
    """

    queues: Queues
    gone: Callable[[], Awaitable[object]] = _never

    async def check(self) -> None:
        """Make sure that processes can be started; checks run one at a time and wait for no other task.

        Raises:
            RefusedError: Processes die.
            ApiError: Processes do not answer (503).
        """
        async with self.queues.check.place():
            await self.run_beside(functions.do_nothing)

    async def run(self, function: Callable[..., Any], *arguments: object) -> Any:  # noqa: ANN401 - whatever the function returns
        """Return the result of a function in `pftrack_server.jobs.functions`.

        Arguments and result are JSON values or bytes.

        Raises:
            RefusedError: The function refused its arguments, or its process died.
            ApiError: It took too long (503), or its client hung up (499).
        """
        return await unless_gone(self._in_turn(function, arguments), self.gone)

    async def run_long(
        self,
        function: Callable[..., Any],
        *arguments: object,
        cpu_seconds: float,
        on_step: Callable[[int, int], None],
        file_bytes: int | None = None,
        may_be_short: bool = False,
    ) -> Any:  # noqa: ANN401 - whatever the function returns
        """Return the result of a function that reports its progress; its duration is not limited.

        Args:
            function: A generator in `pftrack_server.jobs.functions`.
            arguments: Its arguments.
            cpu_seconds: Limit of its processor time.
            on_step: Called at intervals with the steps done and the total.
            file_bytes: Most bytes of a file that it writes; None for no limit.
            may_be_short: Whether it may take only a moment, so that it begins as light work.

        Raises:
            RefusedError: The function refused its arguments, or its process died.
            ApiError: It was silent for too long (503).
        """
        budget = Budget(cpu_seconds=cpu_seconds, file_bytes=file_bytes)
        work = partial(self.run_beside, function, *arguments, budget=budget, on_step=on_step)
        if may_be_short:
            return await self.queues.take_turn(work, weight_s=LONG_S)
        async with self.queues.heavy.place(weight_s=LONG_S):
            return await work()

    async def _in_turn(self, function: Callable[..., Any], arguments: tuple[object, ...]) -> Any:  # noqa: ANN401 - as `run`
        async with self.queues.light.place():
            return await self.run_beside(function, *arguments)

    async def run_beside(
        self,
        function: Callable[..., Any],
        *arguments: object,
        budget: Budget = BUDGET,
        on_step: Callable[..., None] = lambda *_: None,
        stopped: Callable[[], bool] | None = None,
        prepare: Callable[[], object] | None = None,
    ) -> Any:  # noqa: ANN401 - whatever the function returns
        """Run a function now, without waiting in a queue, and return its result.

        Its process and all that it started have ended when this returns or is cancelled.

        Args:
            function: A function in `pftrack_server.jobs.functions`.
            arguments: Its arguments.
            budget: Limits of time, memory and files.
            on_step: Called at intervals with what it yields, such as the steps done and the total.
            stopped: Called ten times a second; once it returns true, the process is killed.
            prepare: Called in the process before it has a thread.

        Raises:
            RefusedError: The function refused its arguments, or its process died.
            ApiError: It was silent for too long, or was stopped (503).
        """
        outcome = await run_task(
            FORK_SERVER,
            function,
            *arguments,
            budget=budget,
            on_step=lambda step: on_step(step) if isinstance(step, dict) else on_step(*step),
            stopped=stopped,
            prepare=prepare,
        )
        if isinstance(outcome, Fault):
            warnings.warn("a task failed", task=function.__name__, traceback=outcome.traceback)
        return _result(outcome, budget)


def ending_message(how: Ending, budget: Budget) -> str:
    """Return a message about a task whose process ended without an answer."""
    match how:
        case Ending.OUT_OF_TIME:
            return f"This did not respond for {budget.silence_s:g} s and was stopped."
        case Ending.OUT_OF_CPU_TIME:
            return f"This needs more than the {budget.cpu_seconds:g} s of processor time that it may use."
        case Ending.KILLED:
            return "This could not be finished: its process was killed. Try again."
    return "This could not be finished: its process ended unexpectedly. Its input may be damaged."


def _result(outcome: Outcome, budget: Budget) -> Any:  # noqa: ANN401 - whatever the function returns
    match outcome:
        case Reply(value=value):
            return value
        case Refusal(message=message):
            raise RefusedError(message[:1].upper() + message[1:])
        case Ending.OUT_OF_TIME | Ending.KILLED as how:
            raise unavailable(ending_message(how, budget))
        case Ending() as how:
            raise RefusedError(ending_message(how, budget))
    raise RefusedError("This failed, or its input cannot be read safely; see the server's log.")


def _tasks(request: Request, tasks: Annotated[ChildTasks, service(ChildTasks)]) -> ChildTasks:
    return replace(tasks, gone=lambda: wait_until_gone(request))


TheTasks = Annotated[ChildTasks, Depends(_tasks)]
"""Child tasks for a client; they are dropped when it hangs up."""
