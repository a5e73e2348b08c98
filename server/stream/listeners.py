"""Listeners: the pages that hear a session's stream, each at its own pace.

A listener that falls behind is not waited for and not fed old news: its queue is thrown away and it is greeted again
with everything there is to know.
"""

import asyncio
from collections import deque
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import contextmanager

from server.schemas.messages import Hello, Message, encode

__all__ = ["Listener", "Listeners"]

LONGEST_QUEUE = 256


class Listener:
    """One page's queue of encoded messages."""

    def __init__(self, greeting: Callable[[], Hello]) -> None:
        self._greeting = greeting
        self._queue: deque[str] = deque()
        self._behind = True
        self._closed = False
        self._news = asyncio.Event()
        self._news.set()

    def put(self, text: str) -> None:
        """Add a message, or give up the queue when it is full."""
        if self._behind:
            return
        if len(self._queue) >= LONGEST_QUEUE:
            self.greet()
            return
        self._queue.append(text)
        self._news.set()

    def greet(self) -> None:
        """Forget what is queued and tell everything anew."""
        self._queue.clear()
        self._behind = True
        self._news.set()

    def close(self) -> None:
        """End the stream after what is queued."""
        self._closed = True
        self._news.set()

    async def __aiter__(self) -> AsyncIterator[str]:
        """Yield messages as they come, the greeting first."""
        while True:
            await self._news.wait()
            if self._behind:
                self._behind = False
                yield encode(self._greeting())
            elif self._queue:
                yield self._queue.popleft()
            elif self._closed:
                return
            else:
                self._news.clear()


class Listeners:
    """All listeners of one session."""

    def __init__(self, greeting: Callable[[], Hello]) -> None:
        self._greeting = greeting
        self._all: set[Listener] = set()

    def __len__(self) -> int:
        return len(self._all)

    @contextmanager
    def join(self) -> Iterator[Listener]:
        """Add a listener for as long as the context lasts."""
        listener = Listener(self._greeting)
        self._all.add(listener)
        try:
            yield listener
        finally:
            self._all.discard(listener)

    def emit(self, message: Message) -> None:
        """Send a message to all, encoded once."""
        if self._all:
            text = encode(message)
            for listener in self._all:
                listener.put(text)

    def greet(self) -> None:
        """Tell everything anew to all."""
        for listener in self._all:
            listener.greet()

    def close(self) -> None:
        """End all streams."""
        for listener in self._all:
            listener.close()
