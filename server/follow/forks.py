"""Forks: sessions of followers' own, at most one each and no more than the lecturer allows."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from server.errors import ConflictError, UnavailableError

__all__ = ["Forks"]


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
        self._sessions: dict[str, str | None] = {}

    def __len__(self) -> int:
        """Return how many there are, those that are being made included."""
        return len(self._there())

    @property
    def names(self) -> list[str]:
        """Names of the sessions."""
        return [name for name in self._there().values() if name]

    def of(self, seat: str) -> str | None:
        """Return the name of a follower's own session, if there is one."""
        return self._there().get(seat)

    @contextmanager
    def room(self, seat: str) -> Iterator[Callable[[str], None]]:
        """Keep a place for a follower while a session is made; the context is given a function to name it.

        Raises:
            ConflictError: The follower has one.
            UnavailableError: All places are taken, or there are none.
        """
        self._sessions = self._there()
        if seat in self._sessions:
            raise ConflictError("You have a session of your own already; end it first.")
        if not self.most:
            raise UnavailableError("The lecturer has opened no places to try it.")
        if len(self._sessions) >= self.most:
            raise UnavailableError(f"All {self.most} places to try it are taken; wait until somebody ends a session.")
        self._sessions[seat] = None
        try:
            yield lambda name: self._sessions.update({seat: name})
        finally:
            if self._sessions[seat] is None:
                del self._sessions[seat]
            self._changed()

    def _there(self) -> dict[str, str | None]:
        return {seat: name for seat, name in self._sessions.items() if name is None or self._is_there(name)}
