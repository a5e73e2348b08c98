"""Pools: workers that are kept for the next call, and one more for each that finds none free."""

import asyncio
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any

from pftrack.process.background import BackgroundLoop
from pftrack.process.calls import Fault, Outcome, Refusal, Reply
from pftrack.process.child import Ending
from pftrack.process.fork_server import ForkServer
from pftrack.process.limits import Budget
from pftrack.process.worker import Worker


class WorkerLostError(Exception):
    """A worker ended before it could answer.

    Attributes:
        how: How it ended.
    """

    def __init__(self, how: Ending, words: str) -> None:
        super().__init__(words)
        self.how = how


class CallError(Exception):
    """A function failed in a way that nobody has foreseen.

    Attributes:
        traceback: For the log.
    """

    def __init__(self, name: str, traceback: str) -> None:
        super().__init__(name)
        self.traceback = traceback


class Pool:
    """Workers for calls, some of which may be made at the same time.

    A worker does one thing at a time. One that takes too long, dies, or is no longer waited for is ended, and another
    takes its place when it is needed.
    """

    def __init__(
        self,
        fork_server: ForkServer,
        *,
        most: int,
        kept: int,
        budget: Budget,
        refusals: tuple[type[Exception], ...] = (),
        prepare: Callable[[], object] | None = None,
    ) -> None:
        """Take note of what it shall be; its workers are forked when they are needed.

        Args:
            fork_server: It has imported what is to be called.
            most: How many calls may be under way; others wait.
            kept: How many workers are kept while nothing is asked for.
            budget: What each may take.
            refusals: Exceptions by which functions refuse their arguments.
            prepare: Is called in each worker before its first call.
        """
        self._fork_server, self._kept, self._budget = fork_server, kept, budget
        self._refusals, self._prepare = refusals, prepare
        self._places = asyncio.Semaphore(most)
        self._free: list[Worker] = []

    async def call(
        self, function: Callable[..., Any], *arguments: object, on_step: Callable[[Any], object] = lambda _: None
    ) -> Any:  # noqa: ANN401 - whatever it returns
        """Return the result of a function of a module.

        Raises:
            Exception: One of `refusals`, as the function raised it.
            MemoryError: It needs more than it may have.
            CallError: It failed.
            WorkerLostError: It took too long, or its worker died.
            OSError: The system makes no process.
        """
        async with self._places:
            worker = await self._ready() or await Worker.start(
                self._fork_server, self._budget, refusals=self._refusals, prepare=self._prepare
            )
            outcome: Outcome = Ending.KILLED
            try:
                outcome = await worker.call(function, *arguments, on_step=on_step)
            finally:
                how = ""
                if not isinstance(outcome, Ending) and len(self._free) < self._kept:
                    self._free.append(worker)
                else:
                    how = await worker.close()
        match outcome:
            case Reply(value=value):
                return value
            case Refusal(message=message, error=error):
                raise error or MemoryError(message)
            case Fault(name=name, traceback=traceback):
                raise CallError(name, traceback)
            case _:
                raise WorkerLostError(outcome, how)

    async def close(self) -> None:
        """End all workers that have nothing to do."""
        workers, self._free = self._free, []
        await asyncio.gather(*(worker.close() for worker in workers))

    async def _ready(self) -> Worker | None:
        """Return a worker that has nothing to do, if one has not been killed meanwhile."""
        while self._free:
            if not (worker := self._free.pop()).is_gone:
                return worker
            await worker.close()
        return None


class BlockingPool:
    """A pool for a program without an event loop: its own runs in a thread."""

    def __init__(
        self,
        fork_server: ForkServer,
        *,
        processes: int,
        budget: Budget,
        prepare: Callable[[], object] | None = None,
    ) -> None:
        """Begin; the arguments are as for `Pool`."""
        self.processes = processes
        self._fork_server = fork_server
        self._loop = BackgroundLoop("pool")
        self._pool = Pool(fork_server, most=processes, kept=processes, budget=budget, prepare=prepare)

    def submit(
        self, function: Callable[..., Any], *arguments: object, on_step: Callable[[Any], object] = lambda _: None
    ) -> "Future[Any]":
        """Have a worker call a function, and return its future, with the result or exceptions of `Pool.call`.

        Args:
            function: Of a module.
            arguments: For it.
            on_step: Is called, by the pool's thread, with all that it tells of how far it is.
        """
        return self._loop.submit(self._pool.call(function, *arguments, on_step=on_step))

    def close(self) -> None:
        """End all workers, whatever they are doing, and the fork server; not by the pool's own thread."""
        self._loop.close(last=self._pool.close)
        self._fork_server.close()
