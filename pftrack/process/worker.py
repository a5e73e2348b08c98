"""Workers: children that answer calls, as their parent sees them; and tasks, each a call to a child of its own."""

import asyncio
import time
from collections.abc import Callable
from typing import Any, Self

from pftrack.process.answers import pack, unpack
from pftrack.process.calls import Answer, Call, Fault, Outcome, Refusal, Reply, Step, answer_calls
from pftrack.process.child import Child, Ending, describe, ending
from pftrack.process.fork_server import ForkServer
from pftrack.process.limits import Budget
from pftrack.process.pipe import LARGEST_MESSAGE, AsyncEnd

LOOK_S = 0.1
LAST_WORDS_S = 5.0
END_S = 30.0


class Worker:
    """A confined child that answers one call at a time."""

    def __init__(self, child: Child, budget: Budget) -> None:
        self._child, self._budget = child, budget
        self._end: AsyncEnd | None = None
        self._gone = asyncio.Event()
        self._last: asyncio.Future[Reply | Refusal | Fault | None] | None = None
        self._on_step: Callable[[Any], object] = lambda _: None
        self._heard = time.monotonic()

    @classmethod
    async def start(
        cls,
        fork_server: ForkServer,
        budget: Budget,
        *,
        refusals: tuple[type[Exception], ...] = (),
        as_json: bool = False,
        prepare: Callable[[], object] | None = None,
    ) -> Self:
        """Fork one.

        Args:
            fork_server: It has imported what is to be called.
            budget: What it may take.
            refusals: Exceptions by which functions refuse their arguments.
            as_json: Whether its answers travel as JSON, since what it reads may take it over.
            prepare: Is called in it before its first call.

        Raises:
            OSError: The system makes no process.
        """
        child = await fork_server.fork_async(answer_calls, budget, refusals, pack if as_json else None, prepare)
        worker = cls(child, budget)
        try:
            if as_json:
                most = budget.answer_bytes
                worker._end = await AsyncEnd.connect(child.end, worker._take, worker._lose, unpack, most)
            else:
                worker._end = await AsyncEnd.connect(child.end, worker._take, worker._lose, most_bytes=LARGEST_MESSAGE)
        except BaseException:
            child.kill()
            child.end.close()
            raise
        return worker

    @property
    def pid(self) -> int:
        """Number of its process, and of the group that it leads."""
        return self._child.pid

    @property
    def is_gone(self) -> bool:
        """Whether it has ended."""
        return self._gone.is_set()

    async def call(
        self,
        function: Callable[..., Any],
        *arguments: object,
        on_step: Callable[[Any], object] = lambda _: None,
        stopped: Callable[[], bool] | None = None,
    ) -> Outcome:
        """Return what comes of a call; after an ending, or when this is cancelled, the worker is to be closed.

        Args:
            function: Of a module.
            arguments: For it.
            on_step: Is called with all that it tells of how far it is.
            stopped: Asked ten times a second whether to give up.
        """
        self._last, self._on_step = asyncio.get_running_loop().create_future(), on_step
        self._heard = time.monotonic()
        if self._end is None or self.is_gone:
            return await self._fate()
        self._end.send(Call(function, arguments))
        while not self._last.done():
            waits = [LOOK_S] if stopped is not None else []
            if stopped is not None and stopped():
                return Ending.KILLED
            if self._budget.silence_s is not None:
                left = self._heard + self._budget.silence_s - time.monotonic()
                if left <= 0:
                    return Ending.OUT_OF_TIME
                waits.append(left)
            await asyncio.wait({self._last}, timeout=min(waits, default=None))
        answer = self._last.result()
        return await self._fate() if answer is None else answer

    def terminate(self) -> None:
        """Ask it to end, by the signal."""
        self._child.terminate()

    def kill(self) -> None:
        """End it now, with whatever it has started; its call then comes to an ending."""
        self._child.kill()

    async def close(self) -> str:
        """End it now, with whatever it has started; return in words how it had ended."""
        self._child.kill()
        if self._end is not None:
            self._end.close()
            await self._gone.wait()
        return describe(await self._child.wait(END_S))

    async def _fate(self) -> Ending:
        """Return how it ended; one that goes on without a pipe is as good as crashed."""
        status = await self._child.wait(LAST_WORDS_S)
        return Ending.CRASHED if status is None else ending(status)

    def _take(self, answer: Answer) -> None:
        self._heard = time.monotonic()
        if isinstance(answer, Step):
            self._on_step(answer.value)
        elif self._last is not None and not self._last.done():
            self._last.set_result(answer)

    def _lose(self) -> None:
        self._gone.set()
        if self._last is not None and not self._last.done():
            self._last.set_result(None)


async def run_task(
    fork_server: ForkServer,
    function: Callable[..., Any],
    *arguments: object,
    budget: Budget,
    refusals: tuple[type[Exception], ...] = (),
    on_step: Callable[[Any], object] = lambda _: None,
    stopped: Callable[[], bool] | None = None,
) -> Outcome:
    """Have a child of its own carry out a task, and return what came of it, which has travelled as JSON.

    The child, and whatever it has started, has ended when this returns or is cancelled. The arguments are as for
    `Worker.start` and `Worker.call`.
    """
    worker = await Worker.start(fork_server, budget, refusals=refusals, as_json=True)
    try:
        return await worker.call(function, *arguments, on_step=on_step, stopped=stopped)
    finally:
        await worker.close()
