"""Child tasks: work that must not run in the web process, each in a process of its own with limits.

It is a child of the same forkserver as the workers, there in some 20 ms, and ended when it falls silent, when nobody
waits for it any more, and when the web process is gone. Short work has other places than work that may take minutes, so
that the one never waits for the other.
"""

import asyncio
import time
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass
from multiprocessing.context import ForkServerProcess
from typing import Any, TypeAlias

from pftrack.process import Ending, end_group, ending
from pftrack_server.errors import RefusedError, UnavailableError
from pftrack_server.log import RateLimitedLogger
from pftrack_server.tasks import child, functions
from pftrack_server.tasks.answers import unpack
from pftrack_server.tasks.child import Budget
from pftrack_server.tasks.queue import Queues, unless_gone
from pftrack_server.worker import forkserver
from pftrack_server.worker.pipe import WebEnd, pair
from pftrack_server.worker.protocol import Event, Failed, Reply, Step, UnexpectedError

__all__ = ["Answer", "ChildTasks"]

Answer: TypeAlias = Reply | Failed | Ending
"""A result, a refusal with a sentence, or how the process ended without either."""

BUDGET = Budget()
LOOK_S = 0.1
LAST_WORDS_S = 5.0
END_S = 30.0

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
            UnavailableError: They do not answer.
        """
        async with self.queues.check.place():
            _result(await self.answer(functions.nothing))

    async def run(self, function: Callable[..., Any], *arguments: object) -> Any:  # noqa: ANN401 - whatever the function returns
        """Return the result of a function of `pftrack_server.tasks.functions`, of values that JSON can say and bytes.

        Raises:
            RefusedError: The function refused its arguments, with a sentence, or its process died.
            UnavailableError: It took too long.
            ClientGoneError: Its client hung up.
        """
        return _result(await unless_gone(self._in_turn(function, arguments), self.gone))

    async def run_long(
        self,
        function: Callable[..., Any],
        *arguments: object,
        cpu_seconds: float,
        on_step: Callable[[int, int], None],
        file_bytes: int | None = None,
    ) -> Any:  # noqa: ANN401 - whatever the function returns
        """Return the result of a function that tells how far it is; it takes as long as it takes.

        Args:
            function: A generator of `pftrack_server.tasks.functions`.
            arguments: For it.
            cpu_seconds: Processor time that it may take.
            on_step: Called now and then with the steps that are done, and with all that there are.
            file_bytes: Length of any file that it writes; None for any.

        Raises:
            RefusedError: The function refused its arguments, with a sentence, or its process died.
            UnavailableError: It gave no sign of life for too long.
        """
        budget = Budget(cpu_seconds=cpu_seconds, file_bytes=file_bytes)
        async with self.queues.heavy.place():
            return _result(await self.answer(function, *arguments, budget=budget, on_step=on_step))

    async def _in_turn(self, function: Callable[..., Any], arguments: tuple[object, ...]) -> Answer:
        async with self.queues.light.place():
            return await self.answer(function, *arguments)

    async def answer(
        self,
        function: Callable[..., Any],
        *arguments: object,
        budget: Budget = BUDGET,
        on_step: Callable[[int, int], None] = lambda *_: None,
        stopped: Callable[[], bool] = lambda: False,
    ) -> Answer:
        """Have a task carried out now, whoever waits for a turn, and return what came of it.

        Its process, and whatever that has started, has ended when this returns or is cancelled.

        Args:
            function: One of `pftrack_server.tasks.functions`.
            arguments: For it.
            budget: What it may take.
            on_step: Called now and then with the steps that are done, and with all that there are.
            stopped: Asked ten times a second whether to give up; the process is then killed.
        """
        last: asyncio.Future[Event | None] = asyncio.get_running_loop().create_future()
        heard = time.monotonic()

        def settle(event: Event | None) -> None:
            nonlocal heard
            heard = time.monotonic()
            if isinstance(event, Step):
                on_step(event.done, event.total)
            elif not last.done():
                last.set_result(event)

        async with _child(function, arguments, budget, settle) as process:
            heard = time.monotonic()
            while not last.done():
                left = heard + budget.silence_s - time.monotonic()
                if stopped():
                    return Ending.KILLED
                if left <= 0:
                    return Ending.OUT_OF_TIME
                await asyncio.wait({last}, timeout=min(left, LOOK_S))
            match last.result():
                case Reply() | Failed() as answer:
                    return answer
                case UnexpectedError(traceback=traceback):
                    warnings.warn("a task failed", task=function.__name__, traceback=traceback)
                    return Ending.FAILED
                case _:
                    return await asyncio.to_thread(_fate, process)


@asynccontextmanager
async def _child(
    function: Callable[..., Any],
    arguments: tuple[object, ...],
    budget: Budget,
    on_event: Callable[[Event | None], None],
) -> AsyncIterator[ForkServerProcess]:
    """Have a process carry out a task; it is ended with the context, with whatever it has started.

    Every event that it sends is given to `on_event`, and None when it sends no more.
    """
    gone = asyncio.Event()

    def lost() -> None:
        gone.set()
        on_event(None)

    ours, theirs = pair()
    try:
        end = await WebEnd.connect(ours, on_event, lost, unpack, budget.answer_bytes)
        try:
            name = f"pftrack-{function.__name__}"
            process = await forkserver.spawn(child.main, theirs, function, arguments, budget, name=name)
        except BaseException:
            end.close()
            raise
    finally:
        theirs.close()
    assert process.pid is not None  # noqa: S101 - it was started
    try:
        yield process
    finally:
        end_group(process.pid)
        process.kill()  # it may not be the leader of a group yet
        end.close()
        await gone.wait()
        await asyncio.to_thread(process.join, END_S)
        process.close()


def _fate(process: ForkServerProcess) -> Ending:
    """Return how a process ended that has closed its pipe; one that goes on without a pipe is as good as crashed."""
    process.join(LAST_WORDS_S)
    return Ending.CRASHED if process.exitcode is None else ending(process.exitcode)


def _result(answer: Answer) -> Any:  # noqa: ANN401 - whatever the function returns
    match answer:
        case Reply(result=result):
            return result
        case Failed(message=message):
            raise RefusedError(message[:1].upper() + message[1:])
        case Ending.OUT_OF_TIME:
            raise UnavailableError(f"This gave no sign of life for {BUDGET.silence_s:g} s and was given up.")
        case _:
            raise RefusedError("This needs more memory or time than is allowed for it, or cannot be read safely.")
