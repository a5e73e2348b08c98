"""Child tasks: work that must not run in the web process, each in a process of its own with limits, in its turn.

A process is there in some 20 ms, and ended when it falls silent, when nobody waits for it any more, and when the web
process is gone.

Light work, such as a picture of a frame, never waits for heavy work, such as decoding a film. Equal work is served in
the order of arrival. Work of unknown length begins among light work, and makes room there once it proves heavy.
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
    """A place in the line: its ticket, and the time (s, by the loop's clock) from which on nothing new passes it."""

    ticket: str | None
    due: float


class Queue:
    """So many places, and a line before them.

    Args:
        places: How many may be at work at one time.
    """

    def __init__(self, places: int) -> None:
        self._free = places
        self._waiting: dict[asyncio.Future[None], _Place] = {}

    @property
    def is_free(self) -> bool:
        """Whether nobody would have to wait."""
        return self._free > 0

    @asynccontextmanager
    async def place(self, ticket: str | None = None, *, weight_s: float = 0.0) -> AsyncIterator[None]:
        """Wait for a place, and have it as long as the context lasts.

        Args:
            ticket: A name under which the client asks `before`.
            weight_s: How long it may take, s: what comes by so much later and takes no time still comes before.
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
        """Return how many are before a ticket, or None if it does not wait."""
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
    """The queues of a kind of work.

    Attributes:
        check: For what makes sure that work can be done; it waits for no other work.
        light: For what takes a moment.
        heavy: For what may take minutes.

    Args:
        light: How much light work is done at one time.
        heavy: How much heavy work.
        moment_s: So long work is light.
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

        It begins among light work. What is not done in a moment goes on among heavy work if there is a free place, and
        else ends, and begins again when its turn comes.

        Args:
            work: Begins it.
            ticket: A name under which the client asks `before`.
            weight_s: How long it may take as heavy work, s; see `Queue.place`.
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
        """Return how many are before a ticket; 0 once it is worked on, or unknown."""
        return self.light.before(ticket) or self.heavy.before(ticket) or 0


BUDGET = Budget()
LONG_S = 30.0
"""Assumed length of a long task, s, for its place in the line."""

warnings = RateLimitedLogger(__name__)


async def _never() -> None:
    await asyncio.Event().wait()


@dataclass(frozen=True)
class ChildTasks:
    """Sends tasks to confined processes, a few at a time.

    Attributes:
        queues: Where tasks wait for their turn.
        gone: Waits until the client that has asked is gone; its short tasks are then dropped.
    """

    queues: Queues
    gone: Callable[[], Awaitable[object]] = _never

    async def check(self) -> None:
        """Make sure that processes can be made; this waits for no other task, but one after the other.

        Raises:
            RefusedError: They die.
            ApiError: They do not answer (503).
        """
        async with self.queues.check.place():
            await self.run_beside(functions.do_nothing)

    async def run(self, function: Callable[..., Any], *arguments: object) -> Any:  # noqa: ANN401 - whatever the function returns
        """Return the result of a function of `pftrack_server.jobs.functions`, of values that JSON can say and bytes.

        Raises:
            RefusedError: The function refused its arguments, with a sentence, or its process died.
            ApiError: It took too long (503); its client hung up (499).
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
        """Return the result of a function that tells how far it is; it takes as long as it takes.

        Args:
            function: A generator of `pftrack_server.jobs.functions`.
            arguments: For it.
            cpu_seconds: Processor time that it may take.
            on_step: Called now and then with the steps that are done, and with all that there are.
            file_bytes: Length of any file that it writes; None for any.
            may_be_short: Whether it may take a moment only, so that it begins among light work.

        Raises:
            RefusedError: The function refused its arguments, with a sentence, or its process died.
            ApiError: It gave no sign of life for too long (503).
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
        """Return the result of a function at once, without waiting for a turn.

        Its process and everything it started have ended when this returns or is cancelled.

        Args:
            function: One of `pftrack_server.jobs.functions`.
            arguments: For it.
            budget: What it may take.
            on_step: Called now and then with what it yields, such as the steps that are done and all that there are.
            stopped: Asked ten times a second whether to give up; the process is then killed.
            prepare: Is called in the process before it has a thread.

        Raises:
            RefusedError: The function refused its arguments, with a sentence, or its process died.
            ApiError: It gave no sign of life for too long, or was stopped (503).
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
    """Return the sentence for a task whose process ended without an answer."""
    match how:
        case Ending.OUT_OF_TIME:
            return f"This did not respond for {budget.silence_s:g} s and was stopped."
        case Ending.OUT_OF_CPU_TIME:
            return f"This needs more than the {budget.cpu_seconds:g} s of processor time that it may use."
        case Ending.KILLED:
            return "This could not be finished: its process was killed, by the system or by somebody. Try again."
    return "This could not be finished: its process ended unexpectedly. What it reads may be damaged."


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
    raise RefusedError("This failed, or what it reads cannot be read safely; the server's log says where.")


def _tasks(request: Request, tasks: Annotated[ChildTasks, service(ChildTasks)]) -> ChildTasks:
    return replace(tasks, gone=lambda: wait_until_gone(request))


TheTasks = Annotated[ChildTasks, Depends(_tasks)]
"""Child tasks for a client: what it no longer waits for is dropped."""
