"""Queues: how much is worked on at one time, who is next, and how many are before somebody.

Light work, such as a picture of a frame, never waits for heavy work, such as decoding a film. Of equals the first to
come is the first to be served.
"""

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable, Coroutine
from contextlib import asynccontextmanager, suppress
from typing import Any, TypeVar

from pftrack_server.errors import ClientGoneError

__all__ = ["Queue", "Queues", "unless_gone"]

Result = TypeVar("Result")

LIGHT_AT_ONCE = 4
HEAVY_AT_ONCE = 2


class Queue:
    """So many places, and a line before them.

    Args:
        places: How many may be at work at one time.
    """

    def __init__(self, places: int) -> None:
        self._free = places
        self._waiting: dict[asyncio.Future[None], str | None] = {}

    @asynccontextmanager
    async def place(self, ticket: str | None = None) -> AsyncIterator[None]:
        """Wait for a place, and have it as long as the context lasts.

        Args:
            ticket: A name under which the client asks `before`.
        """
        if self._free > 0:
            self._free -= 1
        else:
            turn = asyncio.get_running_loop().create_future()
            self._waiting[turn] = ticket
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
        waiting = list(self._waiting.values())
        return waiting.index(ticket) + 1 if ticket in waiting else None

    def _next(self) -> None:
        for turn in list(self._waiting):
            del self._waiting[turn]
            if not turn.done():
                turn.set_result(None)
                return
        self._free += 1


class Queues:
    """The queues of a server.

    Attributes:
        check: For what makes sure that work can be done; it waits for no other work.
        light: For what takes a moment.
        heavy: For what may take minutes.
    """

    def __init__(self) -> None:
        self.check = Queue(1)
        self.light = Queue(LIGHT_AT_ONCE)
        self.heavy = Queue(HEAVY_AT_ONCE)

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
