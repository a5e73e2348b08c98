"""The pool: workers of lessons that are ready, and more of them while more is asked for at one time.

Nobody waits for somebody else's heavy figure: a worker does one thing at a time, and who finds none free gets a new
one, which is there in some 20 ms. One that takes too long, dies, or is no longer waited for is ended.
"""

import asyncio
from collections.abc import Callable
from multiprocessing.context import ForkServerProcess
from typing import Any, Self

from pftrack_server.errors import RefusedError, UnavailableError
from pftrack_server.lessons.worker import main
from pftrack_server.log import RateLimitedLogger
from pftrack_server.tasks.queue import Queue
from pftrack_server.worker import forkserver
from pftrack_server.worker.pipe import WebEnd, pair
from pftrack_server.worker.protocol import Call, Event, Failed, Reply, UnexpectedError

__all__ = ["Pool"]

AT_ONCE = 16
KEPT = 2
"""Workers that are kept while nothing is asked for."""
LONGEST_S = 60.0
"""Seconds for one figure. It takes some milliseconds, but the first of a worker imports the lesson and loads what is
compiled, which takes a busy machine many seconds; a worker that is ended then would begin with that again."""
END_S = 10.0

warnings = RateLimitedLogger(__name__)


class Pool:
    """Workers of lessons."""

    def __init__(self) -> None:
        self._places = Queue(AT_ONCE)
        self._free: list[_Worker] = []

    async def call(self, function: Callable[..., Any], *arguments: object) -> Any:  # noqa: ANN401 - whatever it returns
        """Return the result of a function that the workers know.

        Raises:
            ParameterError: It refused its arguments.
            RefusedError: It needs more memory than it may have.
            UnavailableError: It took too long, or its worker died.
        """
        async with self._places.place():
            worker = await self._ready() or await _Worker().start()
            healthy = False
            try:
                async with asyncio.timeout(LONGEST_S):
                    event = await worker.ask(Call(function, arguments))
                healthy = event is not None
            except TimeoutError:
                raise UnavailableError(
                    f"This took longer than the {LONGEST_S:g} s that a lesson may take and was given up; "
                    "choose values that need less."
                ) from None
            finally:
                if healthy and len(self._free) < KEPT:
                    self._free.append(worker)
                else:
                    await worker.close()
        return _result(event, function.__name__)

    async def _ready(self) -> "_Worker | None":
        """Return a worker that has nothing to do, if one has not been killed meanwhile."""
        while self._free:
            if not (worker := self._free.pop()).is_gone:
                return worker
            await worker.close()
        return None

    async def close(self) -> None:
        """End all workers that have nothing to do."""
        workers, self._free = self._free, []
        await asyncio.gather(*(worker.close() for worker in workers))


class _Worker:
    """One worker and the pipe to it."""

    def __init__(self) -> None:
        self._end: WebEnd | None = None
        self._process: ForkServerProcess | None = None
        self._answer: asyncio.Future[Event | None] | None = None
        self._gone = asyncio.Event()

    @property
    def is_gone(self) -> bool:
        """Whether it has ended."""
        return self._gone.is_set()

    async def start(self) -> Self:
        """Fork it."""
        ours, theirs = pair()
        try:
            self._end = await WebEnd.connect(ours, self._take, self._lost)
            self._process = await forkserver.spawn(main, theirs, name="pftrack-lessons")
        except BaseException:
            await self.close()
            raise
        finally:
            theirs.close()
        return self

    async def ask(self, call: Call) -> Event | None:
        """Return what came of a call; None if the worker died."""
        if self._end is None or self.is_gone:
            return None
        self._answer = asyncio.get_running_loop().create_future()
        self._end.send(call)
        return await self._answer

    async def close(self) -> None:
        """End it, whatever it is doing."""
        if self._process is not None:
            self._process.kill()
        if self._end is not None:
            self._end.close()
            await self._gone.wait()
        if self._process is not None:
            await asyncio.to_thread(self._process.join, END_S)
            self._process.close()
            self._process = None

    def _take(self, event: Event | None) -> None:
        if self._answer is not None and not self._answer.done():
            self._answer.set_result(event)

    def _lost(self) -> None:
        self._gone.set()
        self._take(None)


def _result(event: Event | None, name: str) -> Any:  # noqa: ANN401 - whatever the function returned
    match event:
        case Reply(result=result, error=None):
            return result
        case Reply(error=Exception() as error):
            raise error
        case Failed(message=message):
            raise RefusedError(message)
        case UnexpectedError(traceback=traceback):
            warnings.warn("a lesson failed", function=name, traceback=traceback)
            raise UnavailableError("This could not be computed: the lesson has a mistake; the server's log says which.")
        case _:
            raise UnavailableError("This could not be computed: its process was ended by the system. Try again.")
