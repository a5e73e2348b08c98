"""Workers: children that answer calls, from the parent's side, for one task or kept in a pool.

A pool keeps its workers for the next call, and has one more for each that finds none free. A program without an event
loop has one in a thread (`BackgroundLoop`).
"""

import asyncio
import threading
import time
from collections.abc import Callable, Coroutine
from concurrent.futures import Future
from types import TracebackType
from typing import Any, Self, TypeVar

from pftrack.core.refusal import RefusedError
from pftrack.process.calls import Answer, Call, Fault, Outcome, Refusal, Reply, Step, answer_calls, pack, unpack
from pftrack.process.child import LARGEST_MESSAGE, AsyncEnd, Child, Ending, describe, ending
from pftrack.process.fork_server import ForkServer
from pftrack.process.limits import Budget

T = TypeVar("T")

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
        refusals: tuple[type[Exception], ...] = (RefusedError,),
        as_json: bool = False,
        prepare: Callable[[], object] | None = None,
    ) -> Self:
        """Fork one.

        Args:
            fork_server: It has imported what is to be called.
            budget: Its limits.
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
            function: A function of a module.
            arguments: For it.
            on_step: Called with its progress reports.
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
        """End it now, with everything it has started; its call then ends."""
        self._child.kill()

    async def close(self) -> str:
        """End it now, with everything it has started; return in words how it had ended."""
        self._child.kill()
        if self._end is not None:
            self._end.close()
            await self._gone.wait()
        return describe(await self._child.wait(END_S))

    async def _fate(self) -> Ending:
        """Return how it ended; one that runs without a pipe counts as crashed."""
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
    refusals: tuple[type[Exception], ...] = (RefusedError,),
    on_step: Callable[[Any], object] = lambda _: None,
    stopped: Callable[[], bool] | None = None,
    prepare: Callable[[], object] | None = None,
) -> Outcome:
    """Run a task in a separate child, and return its result, transferred as JSON.

    The child, and whatever it has started, has ended when this returns or is cancelled. The arguments are as for
    `Worker.start` and `Worker.call`.
    """
    worker = await Worker.start(fork_server, budget, refusals=refusals, as_json=True, prepare=prepare)
    try:
        return await worker.call(function, *arguments, on_step=on_step, stopped=stopped)
    finally:
        await worker.close()


class WorkerLostError(Exception):
    """A worker ended before it could answer.

    Attributes:
        how: How it ended.
    """

    def __init__(self, how: Ending, words: str) -> None:
        super().__init__(words)
        self.how = how


class CallError(Exception):
    """A function failed unexpectedly.

    Attributes:
        traceback: For the log.
    """

    def __init__(self, name: str, traceback: str) -> None:
        super().__init__(name)
        self.traceback = traceback


class Pool:
    """Workers for calls, which may run at the same time.

    A worker does one thing at a time. A worker that takes too long, dies, or is no longer awaited is ended, and
    replaced when needed.
    """

    def __init__(
        self,
        fork_server: ForkServer,
        *,
        most: int,
        kept: int,
        budget: Budget,
        refusals: tuple[type[Exception], ...] = (RefusedError,),
        prepare: Callable[[], object] | None = None,
    ) -> None:
        """Take note of what it shall be; its workers are forked when they are needed.

        Args:
            fork_server: It has imported what is to be called.
            most: Largest number of running calls; others wait.
            kept: Number of idle workers to keep.
            budget: Limits of each.
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


class BackgroundLoop:
    """Runs coroutines side by side, and hands out futures of what they return.

    To be closed, or used in a `with` statement; not by its own thread.
    """

    def __init__(self, name: str) -> None:
        """Begin.

        Args:
            name: Name of its thread.
        """
        self._closing = threading.Lock()
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever, name=name, daemon=True)
        self._thread.start()

    def submit(self, coroutine: Coroutine[Any, Any, T]) -> "Future[T]":
        """Run a coroutine in the thread of the loop, and return its future."""
        return asyncio.run_coroutine_threadsafe(coroutine, self._loop)

    def close(self, last: Callable[[], Coroutine[Any, Any, object]] | None = None) -> None:
        """Cancel what still runs, wait until it has ended, and end the thread; a second time, do nothing.

        Args:
            last: Final task in the loop.
        """
        with self._closing:
            if self._loop.is_closed():
                return
            self.submit(_cancel_others()).result()
            if last is not None:
                self.submit(last()).result()
            self._loop.call_soon_threadsafe(self._loop.stop)
            self._thread.join()
            self._loop.close()

    def __enter__(self) -> Self:
        """Return itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close it."""
        self.close()


async def _cancel_others() -> None:
    others = asyncio.all_tasks() - {asyncio.current_task()}
    for each in others:
        each.cancel()
    await asyncio.gather(*others, return_exceptions=True)


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
        self._pool = Pool(fork_server, most=processes, kept=processes, budget=budget, refusals=(), prepare=prepare)

    def submit(
        self, function: Callable[..., Any], *arguments: object, on_step: Callable[[Any], object] = lambda _: None
    ) -> "Future[Any]":
        """Have a worker call a function, and return its future, with the result or exceptions of `Pool.call`.

        Args:
            function: A function of a module.
            arguments: For it.
            on_step: Called, by the pool's thread, with its progress reports.
        """
        return self._loop.submit(self._pool.call(function, *arguments, on_step=on_step))

    def close(self) -> None:
        """End all workers, whatever they are doing, and the fork server; not by the pool's own thread."""
        self._loop.close(last=self._pool.close)
        self._fork_server.close()
