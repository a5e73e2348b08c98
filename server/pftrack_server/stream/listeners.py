"""Listeners: the pages that hear a stream, each at its own pace.

A listener is an asynchronous iterator of encoded messages for `converse`. What it says and when is its own: a session's
queues messages, a sweep's looks at what has changed.
"""

import asyncio
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import AsyncIterator, Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from typing import Generic, TypeVar

from pftrack_server.schemas.messages import Hello
from pftrack_server.schemas.stream import Message, Pong, encode

LONGEST_QUEUE = 256
LONGEST_TALE = 64
"""Messages after a greeting for which it is kept; a page then reads them faster than a new one is made."""

One = TypeVar("One", bound="Listener")


class Listener(ABC):
    """One page that hears a stream.

    Attributes:
        news: Set when there may be something to say.
        closed: Whether the stream ends after what is left to say.
    """

    def __init__(self) -> None:
        self.news = asyncio.Event()
        self.news.set()
        self.closed = False

    def close(self) -> None:
        """End the stream after what is left to say."""
        self.closed = True
        self.news.set()

    @abstractmethod
    def answer(self, sent: float) -> None:
        """Answer a ping with its own time."""

    @abstractmethod
    def __aiter__(self) -> AsyncIterator[str]:
        """Yield messages as they come, the greeting first."""


class Listeners(Generic[One]):
    """All listeners of one stream."""

    def __init__(self) -> None:
        self._all: set[One] = set()

    def __len__(self) -> int:
        return len(self._all)

    def __iter__(self) -> Iterator[One]:
        return iter(self._all)

    @contextmanager
    def add(self, listener: One) -> Iterator[One]:
        """Add a listener for as long as the context lasts."""
        self._all.add(listener)
        try:
            yield listener
        finally:
            self._all.discard(listener)

    def close(self) -> None:
        """End all streams."""
        for listener in self._all:
            listener.close()


class QueueListener(Listener):
    """One page's queue of encoded messages.

    A page that falls behind is not waited for and not fed old news: its queue is dropped and it is greeted again with
    the complete state.
    """

    def __init__(self, greeting: Callable[[], Sequence[str]]) -> None:
        super().__init__()
        self._greeting = greeting
        self._queue: deque[str] = deque()
        self._behind = True

    def put(self, text: str) -> None:
        """Add a message, or give up the queue when it is full."""
        if self._behind:
            return
        if len(self._queue) >= LONGEST_QUEUE:
            self.greet()
            return
        self._queue.append(text)
        self.news.set()

    def answer(self, sent: float) -> None:
        """Answer a ping with its own time."""
        self.put(encode(Pong(sent=sent)))

    def greet(self) -> None:
        """Drop what is queued and send everything again."""
        self._queue.clear()
        self._behind = True
        self.news.set()

    async def __aiter__(self) -> AsyncIterator[str]:
        """Yield messages as they come, the greeting first."""
        while True:
            await self.news.wait()
            if self._behind:
                self._behind = False
                self._queue.extend(self._greeting())
            elif self._queue:
                yield self._queue.popleft()
            elif self.closed:
                return
            else:
                self.news.clear()


class SessionListeners(Listeners[QueueListener]):
    """All listeners of one session, which hear the same messages.

    A greeting holds the whole past of a run, so it is kept for those who come next, with what was said since: a class
    that comes all at once is greeted by one.
    """

    def __init__(self, greeting: Callable[[], Hello]) -> None:
        super().__init__()
        self._greeting = greeting
        self._tale: list[str] = []

    def join(self) -> AbstractContextManager[QueueListener]:
        """Add a listener for as long as the context lasts."""
        return self.add(QueueListener(self._greeting_texts))

    def emit(self, message: Message) -> None:
        """Send a message to all, encoded once."""
        if self._all:
            text = encode(message)
            if self._tale:
                self._tale.append(text)
            if len(self._tale) > LONGEST_TALE:
                self._tale = []
            for listener in self._all:
                listener.put(text)
        else:
            self._tale = []

    def greet(self) -> None:
        """Send everything again to all."""
        self._tale = []
        for listener in self._all:
            listener.greet()

    def _greeting_texts(self) -> Sequence[str]:
        """Return a greeting and what was said since."""
        if not self._tale:
            self._tale = [encode(self._greeting())]
        return self._tale
