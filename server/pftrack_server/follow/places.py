"""Places: who of a class is there, how many more may come, and which sockets each holds.

A place is taken with a follower's first socket and kept for a while after the last one has closed, so that a phone
whose network came and went finds its place again. The lecturer's own sockets take none.
"""

import asyncio
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import NamedTuple

from pftrack_server.core.errors import CrowdedError

LECTURER = ""
"""The seat of whoever came by the lecturer's link."""
MOST_SOCKETS = 24
"""Of one follower: two pages with four sessions each."""
MOST_SCENES = 20
"""Of one class: viser sends each browser its own, which takes many times what a drawing for all takes."""
SCENES = "/viz/"
KEPT_S = 30.0


class _Socket(NamedTuple):
    path: str
    hold: asyncio.Timeout


class Places:
    """The places of one class; all methods belong to the event loop's thread.

    Args:
        most: How many may be there at one time.
        changed: Called when somebody has come or gone.

    Attributes:
        most: How many may be there at one time; who is there stays when it becomes less.
        is_open: Whether somebody new may come in.
    """

    def __init__(self, most: int, changed: Callable[[], None]) -> None:
        self.most = most
        self.is_open = True
        self._changed = changed
        self._sockets: dict[str, set[_Socket]] = {}
        self._leaving: dict[str, asyncio.TimerHandle] = {}

    def __len__(self) -> int:
        """Return how many followers are there."""
        return len(self.seats)

    @property
    def sockets(self) -> int:
        """How many sockets there are, the lecturer's included."""
        return sum(map(len, self._sockets.values()))

    @property
    def seats(self) -> list[str]:
        """Who is there."""
        return [seat for seat, sockets in self._sockets.items() if sockets and seat != LECTURER]

    def __contains__(self, seat: str) -> bool:
        """Tell whether a follower has a place."""
        return seat in self._sockets

    @contextmanager
    def take(self, seat: str, path: str) -> Iterator[asyncio.Timeout]:
        """Let somebody hold one more socket.

        Args:
            seat: Of the follower.
            path: Of the socket.

        Yields:
            What to serve the socket within; it ends when the follower must leave.

        Raises:
            CrowdedError: The class is full or closed, or this follower holds too many already.
        """
        self._check_room(seat, path)
        if (leaving := self._leaving.pop(seat, None)) is not None:
            leaving.cancel()
        held = self._sockets.setdefault(seat, set())
        socket = _Socket(path, asyncio.timeout(None))
        held.add(socket)
        if len(held) == 1:
            self._changed()
        try:
            yield socket.hold
        finally:
            held.discard(socket)
            if not held:
                self._changed()
                self._leaving[seat] = asyncio.get_running_loop().call_later(KEPT_S, self._give_up, seat)

    def review(self, may_stay: Callable[[str, str], bool]) -> None:
        """End every socket, by seat and path, that may not stay."""
        now = asyncio.get_running_loop().time()
        for seat, sockets in self._sockets.items():
            for socket in sockets:
                if not may_stay(seat, socket.path):
                    socket.hold.reschedule(now)

    @property
    def _scenes(self) -> int:
        return sum(socket.path.startswith(SCENES) for held in self._sockets.values() for socket in held)

    def _check_room(self, seat: str, path: str) -> None:
        if seat != LECTURER and seat not in self._sockets:
            if not self.is_open:
                raise CrowdedError("The lecturer has closed the class to new followers.")
            if len(self._sockets.keys() - {LECTURER}) >= self.most:
                raise CrowdedError(f"The class is full: {self.most} follow already. Try again in a while.")
        if len(self._sockets.get(seat, ())) >= MOST_SOCKETS:
            raise CrowdedError(
                f"This browser holds {MOST_SOCKETS} connections already; close other pages of the class."
            )
        if path.startswith(SCENES) and self._scenes >= MOST_SCENES:
            raise CrowdedError(f"{MOST_SCENES} already watch the 3-D scene; use the flat view.")

    def _give_up(self, seat: str) -> None:
        del self._sockets[seat], self._leaving[seat]
