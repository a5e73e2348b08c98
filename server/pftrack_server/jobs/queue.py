"""Queues: how much is worked on at one time, who is next, and how many are before somebody.

Light work, such as a picture of a frame, never waits for heavy work, such as decoding a film. Of equals the first to
come is the first to be served. Of much work nobody knows how long it takes before it is done: it begins among light
work, and makes room there when it has turned out to be heavy.
"""

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable, Coroutine
from contextlib import AsyncExitStack, asynccontextmanager, suppress
from dataclasses import dataclass
from typing import Any, TypeVar

from pftrack_server.errors import ClientGoneError

Result = TypeVar("Result")


@dataclass(frozen=True, slots=True)
class _Place:
    """A place in the line: who has it, and when (s, by the loop's clock) it is no longer passed by whoever comes."""

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
        """Do work of which nobody knows how long it takes; what takes a moment waits for nothing that takes longer.

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


async def unless_gone(work: Coroutine[Any, Any, Result], gone: Callable[[], Awaitable[object]]) -> Result:
    """Do work for a client, and cancel it once the client is gone.

    Args:
        work: What to do.
        gone: Waits until the client has hung up.

    Raises:
        ClientGoneError: It has, before the work was done.
    """
    working = asyncio.ensure_future(work)
    leaving = asyncio.ensure_future(gone())
    try:
        await asyncio.wait((working, leaving), return_when=asyncio.FIRST_COMPLETED)
        if working.done():
            return working.result()
        raise ClientGoneError("The client hung up before this was done.")
    finally:
        for task in (working, leaving):
            task.cancel()
        with suppress(asyncio.CancelledError):
            await asyncio.gather(working, leaving, return_exceptions=True)
