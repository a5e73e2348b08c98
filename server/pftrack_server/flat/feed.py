"""The feed of the flat view: a session's newest drawing for all pages that look on, each at its own pace.

A page says how many drawings it has painted. At most `WINDOW` are on their way to it; while they are, newer ones
replace each other here, so a slow page sees fewer drawings, never old ones, and slows nobody. The worker is asked for
its next drawing as soon as one page could take it, and encodes it once for all.
"""

import asyncio
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import contextmanager

from pftrack_server.flat.codec import EncodedDrawing

WINDOW = 2
"""Drawings on their way to one page: one that is painted while the next one travels."""


class Watcher:
    """One page that looks on.

    Args:
        feed: What it looks at.
    """

    def __init__(self, feed: "DrawingFeed") -> None:
        self._feed = feed
        self._sent = self._painted = 0
        self._last: EncodedDrawing | None = None
        self._keys: frozenset[int] = frozenset()
        self._news = asyncio.Event()
        self._news.set()

    @property
    def ready(self) -> bool:
        """Whether it could take one more drawing."""
        return self._sent - self._painted < WINDOW

    def acknowledge(self, count: int) -> None:
        """Take note of how many drawings the page has painted, or left out for newer ones, since it came.

        Raises:
            ValueError: It says that it has painted more than it was sent.
        """
        if not self._painted <= count <= self._sent:
            raise ValueError(f"expected between {self._painted} and {self._sent} painted drawings, got {count}")
        self._painted = count
        self.wake()
        self._feed.want()

    def wake(self) -> None:
        """Look whether there is something to send."""
        self._news.set()

    def forget(self) -> None:
        """Send the pictures again: another worker gives the same keys to other pictures."""
        self._keys = frozenset()

    async def __aiter__(self) -> AsyncIterator[bytes]:
        """Yield messages until the feed is closed."""
        while not self._feed.closed:
            self._news.clear()
            newest = self._feed.newest
            if newest is not None and newest is not self._last and self.ready:
                self._last = newest
                self._sent += 1
                message = newest.message(self._keys)
                self._keys = frozenset(picture.key for picture in newest.pictures)
                self._feed.want()
                yield message
            else:
                await self._news.wait()


class DrawingFeed:
    """The newest drawing of one session and the pages that look at it; all methods belong to the event loop's thread.

    Args:
        credit: Lets the worker send one drawing.

    Attributes:
        newest: The newest drawing, None before the first.
        closed: Whether the session has ended.
    """

    def __init__(self, credit: Callable[[], None]) -> None:
        self._credit = credit
        self._watchers: set[Watcher] = set()
        self._asked = False
        self.newest: EncodedDrawing | None = None
        self.closed = False

    def __len__(self) -> int:
        return len(self._watchers)

    @contextmanager
    def join(self) -> Iterator[Watcher]:
        """Add a page for as long as the context lasts."""
        watcher = Watcher(self)
        self._watchers.add(watcher)
        self.want()
        try:
            yield watcher
        finally:
            self._watchers.discard(watcher)

    def want(self) -> None:
        """Ask the worker for a drawing if a page could take one and none is on its way."""
        if not self._asked and any(watcher.ready for watcher in self._watchers):
            self._asked = True
            self._credit()

    def offer(self, drawing: EncodedDrawing) -> None:
        """Take the drawing that was asked for."""
        self.newest = drawing
        self._asked = False
        for watcher in self._watchers:
            watcher.wake()

    def on_worker_started(self) -> None:
        """Ask a new worker for its first drawing."""
        for watcher in self._watchers:
            watcher.forget()
        self.newest = None
        self._asked = False
        self.want()

    def close(self) -> None:
        """Send all pages away after what is on its way to them."""
        self.closed = True
        for watcher in self._watchers:
            watcher.wake()
