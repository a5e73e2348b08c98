"""Forks: what followers have of their own, a session or the lesson, at most one each and no more than is allowed.

A fork ends when it has not been used for a while; a session's also with the session.
"""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from pftrack.core.refusal import ConflictError
from pftrack_server.core.errors import UnavailableError

UNUSED_S = 300.0
"""After so long a fork ends of which nobody asks for anything."""


@dataclass(slots=True)
class Fork:
    """What one follower has, or is about to have.

    Attributes:
        session: Name of the session, once there is one.
        lesson: Id of the lesson.
        used: When it was last asked for something (monotonic, s).
    """

    session: str | None = None
    lesson: str | None = None
    used: float = 0.0


class Forks:
    """The forks of one class.

    Args:
        most: How many there may be at one time.
        is_there: Tells whether there is a session of a name; one that was ended gives its place back.
        changed: Called when there is one more or one less.

    Attributes:
        most: How many there may be at one time; what is there stays when it becomes less.
    """

    def __init__(self, most: int, is_there: Callable[[str], bool], changed: Callable[[], None]) -> None:
        self.most = most
        self._is_there = is_there
        self._changed = changed
        self._forks: dict[str, Fork] = {}

    def __len__(self) -> int:
        """Return how many there are, those that are being made included."""
        return len(self._active())

    @property
    def sessions(self) -> list[str]:
        """Names of the sessions."""
        return [fork.session for fork in self._active().values() if fork.session]

    def of(self, seat: str) -> Fork | None:
        """Return what a follower has."""
        fork = self._forks.get(seat)
        return fork if fork is not None and self._is_active(fork) else None

    def unused_sessions(self, is_visited: Callable[[str], bool]) -> list[str]:
        """Return the names of the sessions that nobody has visited for a while."""
        now = time.monotonic()
        for fork in self._active().values():
            if fork.session and is_visited(fork.session):
                fork.used = now
        return [fork.session for fork in self._forks.values() if fork.session and now - fork.used >= UNUSED_S]

    def touch(self, seat: str, path: str) -> None:
        """Take note that a follower asks for something at a path, which may be of what that follower has."""
        fork = self.of(seat)
        if fork is not None and {fork.session, fork.lesson} & set(path.split("/")):
            fork.used = time.monotonic()

    @contextmanager
    def reserve(self, seat: str) -> Iterator[Fork]:
        """Keep a place for a follower; whoever is given it says what it is for, or the place is given back.

        Raises:
            ConflictError: The follower has one.
            UnavailableError: All places are taken, or there are none.
        """
        self._forks = self._active()
        if seat in self._forks:
            raise ConflictError("You already have a copy; end it first.")
        if not self.most:
            raise UnavailableError("The lecturer has allowed no own copies.")
        if len(self._forks) >= self.most:
            raise UnavailableError(f"All {self.most} places for own copies are taken; wait until one is free.")
        fork = self._forks[seat] = Fork(used=time.monotonic())
        self._changed()
        try:
            yield fork
        finally:
            if not (fork.session or fork.lesson) and self._forks.get(seat) is fork:
                del self._forks[seat]
            self._changed()

    def release(self, seat: str) -> Fork | None:
        """Take away what a follower has, and return it."""
        fork = self._forks.pop(seat, None)
        self._changed()
        return fork

    def _active(self) -> dict[str, Fork]:
        return {seat: fork for seat, fork in self._forks.items() if self._is_active(fork)}

    def _is_active(self, fork: Fork) -> bool:
        if fork.session:
            return self._is_there(fork.session)
        return not fork.lesson or time.monotonic() - fork.used < UNUSED_S
