"""Listeners: the pages that hear a stream, each at its own pace.

A listener is an asynchronous iterator of encoded messages for `converse`. What it says and when is its own: a session's
queues messages, a sweep's looks at what has changed.
"""

import asyncio
from abc import ABC, abstractmethod
from collections.abc import AsyncIterator, Iterator
from contextlib import contextmanager
from typing import Generic, TypeVar

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
    def __aiter__(self) -> AsyncIterator[str | bytes]:
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
