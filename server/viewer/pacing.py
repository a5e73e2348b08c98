"""How fast each browser is sent frames: as fast as it takes them up, whatever the others do.

A browser or a line that cannot keep up does not complain: the buffers of the connection fill with seconds of stale
pictures. So each browser is asked for an echo, up to ten times a second while frames go out. The question travels
behind the frames already sent, and is answered by the code that takes them up to be drawn. While its answer is overdue
that browser is sent nothing more, and what follows is the newest. So what waits on the way never grows beyond a
fraction of a second, a line that is merely long is not mistaken for a slow one, and one that never answers, such as a
frozen tab, is sent a few frames each time that the question is given up.

A still scene is not asked: each question makes the browser draw for a while.
"""

import threading
import time
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

    def hold(self, after_s: float) -> None:
        """Send nothing from some seconds on."""

    def release(self) -> None:
        """Send again."""


class Pace:
    """The pace of one browser, from its answers.

    Args:
        line: What leads to it.
    """

    def __init__(self, line: Line) -> None:
        self._line = line
        self._best_s: float | None = None

    def asked(self) -> None:
        """Take note that a question goes out; the line is held when the answer is overdue."""
        # One that has never answered is still loading, which may take seconds.
        if self._best_s is not None:
            self._line.hold(self._best_s + LATE_S)

    def answered(self, lag_s: float) -> None:
        """Take note of an answer."""
        self._best_s = min(lag_s, self._best_s or lag_s)
        self._line.release()

    def silent(self) -> None:
        """Take note that a question was given up: the line is free until the next answer is overdue."""
        self._line.release()


class Pacer:
    """Asks the browsers for echoes, each in a thread of its own, and holds the connections of those that are late."""

    def __init__(self) -> None:
        self._threads: dict[int, threading.Thread] = {}
        self._changed = threading.Condition()
        self._sent = 0
        self._closed = False

    def sent(self) -> None:
        """Take note that a frame is on its way."""
        with self._changed:
            self._sent += 1
            self._changed.notify_all()

    def forget(self, client: int) -> None:
        """Leave out a browser that has gone."""
        with self._changed:
            self._threads.pop(client, None)
            self._changed.notify_all()

    def watch(self, client: viser.ClientHandle) -> None:
        """Ask a browser for echoes until it leaves.

        It must not be asked by a thread of viser's pool: that one runs the callbacks of the controls, and browsers that
        come and go quickly would use it up.
        """
        line = viser_adapter.connection_of(client)
        if line is None:
            return
        name = f"echo-{client.client_id}"
        thread = threading.Thread(target=self._ask, args=(client, Pace(line)), name=name, daemon=True)
        self._threads[client.client_id] = thread
        thread.start()

    def close(self) -> None:
        """Ask no more."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()

    def join(self) -> None:
        """Wait until nobody is being asked; who waits for an answer notices within 0.1 s that its browser is gone."""
        for thread in list(self._threads.values()):
            thread.join(timeout=1.0)

    def _ask(self, client: viser.ClientHandle, pace: Pace) -> None:
        asked_after = 0
        while (sent := self._next(client.client_id, asked_after)) is not None:
            asked_after = sent
            begun = time.monotonic()
            pace.asked()
            if _answers(client):
                pace.answered(time.monotonic() - begun)
            else:
                pace.silent()
            with self._changed:
                rest = begun + ECHO_EVERY_S - time.monotonic()
                self._changed.wait_for(lambda: self._has_left(client.client_id), timeout=max(rest, 0.0))

    def _next(self, client: int, asked_after: int) -> int | None:
        """Wait for a frame after those already asked about; return how many there are, or None for the end."""
        with self._changed:
            self._changed.wait_for(lambda: self._sent > asked_after or self._has_left(client))
            return None if self._has_left(client) else self._sent

    def _has_left(self, client: int) -> bool:
        return self._closed or client not in self._threads


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
