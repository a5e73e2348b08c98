"""How fast each browser is sent frames: as fast as it takes them up, whatever the others do.

A browser or a line that cannot keep up does not complain: the buffers of the connection fill with seconds of stale
pictures. So each browser is asked for an echo, up to ten times a second while frames go out. The question travels
behind the frames already sent, and is answered by the code that takes them up to be drawn. While its answer is overdue
that browser is sent nothing more, and what follows is the newest. So what waits on the way never grows beyond a
fraction of a second, a line that is merely long is not mistaken for a slow one, and one that never answers, such as a
frozen tab, is sent a few frames each time that the question is given up. While all browsers are held nothing is drawn.

A still scene is not asked: each question makes the browser draw for a while.
"""

import math
import threading
import time
from collections.abc import Callable
from typing import Protocol

import viser

from server.viewer import viser_adapter

__all__ = ["Pacer"]

FASTEST_S = 1.0 / 30.0
LATE_S = 0.2
"""Time beyond a browser's best at which its answer is overdue."""
ANSWER_S = 4.0
"""Time after which an answer is given up, and another question is asked."""
ECHO_EVERY_S = 0.1


class Line(Protocol):
    """What can be held: a connection to a browser."""

    @property
    def held(self) -> bool:
        """Whether nothing is sent, because an answer is overdue."""

    def expect(self, patience_s: float) -> None:
        """Take note that a question follows: so long after it has left nothing more is sent until `release`."""

    def release(self) -> float:
        """Send again, as the answer has come; return the time since the question had left, s."""


class Pace:
    """The pace of one browser, from its answers.

    Args:
        line: What leads to it.
    """

    def __init__(self, line: Line) -> None:
        self._line = line
        self._best_s = math.inf

    @property
    def held(self) -> bool:
        """Whether the browser is sent nothing, because its answer is overdue."""
        return self._line.held

    def asked(self) -> None:
        """Take note that a question goes out; the line is held when the answer is overdue."""
        # One that has never answered is still loading, which may take seconds: the best is infinite.
        self._line.expect(self._best_s + LATE_S)

    def answered(self) -> None:
        """Take note of an answer."""
        self._best_s = min(self._line.release(), self._best_s)

    def silent(self) -> None:
        """Take note that a question was given up: the line is free until the next answer is overdue."""
        self._line.release()


class Pacer:
    """Asks the browsers for echoes, each in a thread of its own, and holds the connections of those that are late.

    Args:
        on_release: Called when a browser has answered, so that it is held no longer, or has left.
    """

    def __init__(self, on_release: Callable[[], None] = lambda: None) -> None:
        self._on_release = on_release
        self._paces: dict[int, Pace] = {}
        self._threads: list[threading.Thread] = []
        self._changed = threading.Condition()
        self._sent = 0
        self._closed = False

    @property
    def all_held(self) -> bool:
        """Whether there are browsers, and all of them are held: a frame would be sent to nobody."""
        with self._changed:
            return bool(self._paces) and all(pace.held for pace in self._paces.values())

    def sent(self) -> None:
        """Take note that a frame is on its way."""
        with self._changed:
            self._sent += 1
            self._changed.notify_all()

    def forget(self, client: int) -> None:
        """Leave out a browser that has gone."""
        with self._changed:
            self._paces.pop(client, None)
            self._changed.notify_all()
        self._on_release()

    def watch(self, client: viser.ClientHandle) -> None:
        """Ask a browser for echoes until it leaves.

        It must not be asked by a thread of viser's pool: that one runs the callbacks of the controls, and browsers that
        come and go quickly would use it up.
        """
        line = viser_adapter.connection_of(client)
        if line is None:
            return
        pace = Pace(line)
        thread = threading.Thread(target=self._ask, args=(client, pace), name=f"echo-{client.client_id}", daemon=True)
        with self._changed:
            self._paces[client.client_id] = pace
            self._threads = [other for other in self._threads if other.is_alive()] + [thread]
            thread.start()

    def close(self) -> None:
        """Ask no more."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()

    def join(self) -> None:
        """Wait until nobody is being asked; who waits for an answer notices within 0.1 s that its browser is gone."""
        with self._changed:
            threads = self._threads
        for thread in threads:
            thread.join(timeout=1.0)

    def _ask(self, client: viser.ClientHandle, pace: Pace) -> None:
        asked_after = 0
        while (sent := self._next(client.client_id, asked_after)) is not None:
            asked_after = sent
            begun = time.monotonic()
            pace.asked()
            if _answers(client):
                pace.answered()
            else:
                pace.silent()
            self._on_release()
            with self._changed:
                rest = begun + ECHO_EVERY_S - time.monotonic()
                self._changed.wait_for(lambda: self._has_left(client.client_id), timeout=max(rest, 0.0))

    def _next(self, client: int, asked_after: int) -> int | None:
        """Wait for a frame after those already asked about; return how many there are, or None for the end."""
        with self._changed:
            self._changed.wait_for(lambda: self._sent > asked_after or self._has_left(client))
            return None if self._has_left(client) else self._sent

    def _has_left(self, client: int) -> bool:
        return self._closed or client not in self._paces


def _answers(client: viser.ClientHandle) -> bool:
    """Whether a browser answers in time."""
    try:
        client.local_storage.get_item("pftrack-echo", timeout=ANSWER_S)
    except TimeoutError:
        return False
    except (RuntimeError, UserWarning):
        # A browser that blocks its storage answers with an error, which is as good an echo as any. One that leaves at
        # this very moment makes viser warn, which is an error where warnings are.
        return True
    return True
