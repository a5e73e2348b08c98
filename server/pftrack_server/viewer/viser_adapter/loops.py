"""The event loop in which a viser server works: one that is running already, in place of a loop in a thread of its own.

With a loop for each session every frame goes back and forth between threads, which wait for each other and for the
interpreter: with sixteen sessions that takes longer than what the threads do. viser has no public way to be given a
loop, so where it makes one it gets a `_BorrowedLoop`.
"""

import asyncio
import threading
from collections.abc import Coroutine, Iterator
from contextlib import contextmanager
from typing import Any

from viser.infra import _infra

Loop = asyncio.AbstractEventLoop


class _BorrowedLoop:
    """A loop as viser's thread sees it: not its own, so it may give it work, but neither stop nor close it."""

    def __init__(self, loop: Loop) -> None:
        self._loop = loop

    def __getattr__(self, name: str) -> Any:  # noqa: ANN401 - whatever viser asks of a loop
        return getattr(self._loop, name)

    def run_until_complete(self, work: Coroutine[Any, Any, None]) -> None:
        """Wait in viser's thread until a coroutine has run in the loop."""
        asyncio.run_coroutine_threadsafe(work, self._loop).result()

    def stop(self) -> None:
        """Leave the loop running."""

    def close(self) -> None:
        """Leave the loop open."""


class _Asyncio:
    """What viser's connection layer takes from the module `asyncio`."""

    def __init__(self) -> None:
        self.wanted: Loop | None = None

    def __getattr__(self, name: str) -> Any:  # noqa: ANN401 - a module's
        return getattr(asyncio, name)

    def new_event_loop(self) -> Loop | _BorrowedLoop:
        """Return the loop in which the server that is being started is to work."""
        return asyncio.new_event_loop() if self.wanted is None else _BorrowedLoop(self.wanted)

    def set_event_loop(self, loop: Loop | _BorrowedLoop) -> None:
        """Make a loop that of viser's thread, if it is."""
        if not isinstance(loop, _BorrowedLoop):
            asyncio.set_event_loop(loop)


_asyncio = _Asyncio()
_starting = threading.Lock()


def install() -> None:
    """Make viser look for its loops here."""
    _infra.asyncio = _asyncio  # type: ignore[attr-defined,assignment]  # a module of viser's own


@contextmanager
def working_in(loop: Loop | None) -> Iterator[None]:
    """Have the viser server that is started within this context work in a loop, or in one of its own.

    Raises:
        RuntimeError: This is the thread of that loop, which would wait for itself.
    """
    if loop is not None and loop is asyncio._get_running_loop():  # noqa: SLF001 - None where there is none
        raise RuntimeError("a scene has to be started beside the loop in which it is to work, not in it")
    with _starting:
        _asyncio.wanted = loop
        try:
            yield
        finally:
            _asyncio.wanted = None
