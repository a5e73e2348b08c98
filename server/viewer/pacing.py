"""When the next frame may be sent: as soon as the slowest browser that is awake keeps up.

A browser or a line that cannot keep up does not complain: the buffers of the connection fill with seconds of stale
pictures. So each browser is asked for an echo, up to ten times a second while frames go out. The question travels
behind the frames already sent, and is answered by the code that takes them up to be drawn. While an answer is overdue
nothing more is sent, and the frame that follows is the newest. So what waits on the way never grows beyond a fraction
of a second, and a line that is merely long is not mistaken for a slow one.

A still scene is not asked: each question makes the browser draw for a while.
"""

import contextlib
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass

import viser

__all__ = ["Pacer"]

FASTEST_S = 1.0 / 30.0
LATE_S = 0.2
"""Time beyond a browser's best at which its answer is overdue."""
ASLEEP_S = 4.0
"""Lag above which nobody can be looking: a frozen tab must not stop the others."""
ECHO_EVERY_S = 0.1


@dataclass(slots=True)
class _Browser:
    best_s: float | None = None
    lag_s: float = 0.0
    asked: float | None = None
    asleep: bool = False

    def age_s(self, now: float) -> float:
        """How old what it shows is at least."""
        return max(self.lag_s, now - self.asked if self.asked is not None else 0.0)

    def overdue_s(self, now: float) -> float:
        """For how long its answer is overdue; not positive if it is not."""
        # One that has never answered is still loading, which may take seconds.
        if self.asleep or self.asked is None or self.best_s is None or now - self.asked > ASLEEP_S:
            return 0.0
        return now - self.asked - self.best_s - LATE_S


class Pacer:
    """Asks the browsers for echoes, and says whether they keep up.

    Args:
        on_answer: Called when a browser has answered or left.
    """

    def __init__(self, on_answer: Callable[[], None] = lambda: None) -> None:
        self._on_answer = on_answer
        self._browsers: dict[int, _Browser] = {}
        self._threads: dict[int, threading.Thread] = {}
        self._changed = threading.Condition()
        self._sent = 0
        self._closed = False

    @property
    def lag_s(self) -> float:
        """Age of what the slowest browser shows, s; 0 without one."""
        now = time.monotonic()
        ages = [each.age_s(now) for each in list(self._browsers.values()) if not each.asleep]
        return max((age for age in ages if age < ASLEEP_S), default=0.0)

    @property
    def held(self) -> bool:
        """Whether the next frame should wait, because a browser has not taken up the last ones yet."""
        now = time.monotonic()
        return any(browser.overdue_s(now) > 0.0 for browser in list(self._browsers.values()))

    def sent(self) -> None:
        """Take note that a frame is on its way."""
        with self._changed:
            self._sent += 1
            self._changed.notify_all()

    def meet(self, client: int) -> None:
        """Take a browser into account."""
        self._browsers[client] = _Browser()

    def asks(self, client: int) -> None:
        """Take note that a browser is being asked."""
        if browser := self._browsers.get(client):
            browser.asked = time.monotonic()

    def answered(self, client: int, lag_s: float) -> None:
        """Take a browser's answer, or its silence, into account."""
        if browser := self._browsers.get(client):
            browser.asked = None
            browser.asleep = lag_s >= ASLEEP_S
            if not browser.asleep:
                browser.lag_s = lag_s
                browser.best_s = min(lag_s, browser.best_s or lag_s)

    def forget(self, client: int) -> None:
        """Leave out a browser that has gone."""
        with self._changed:
            self._browsers.pop(client, None)
            self._threads.pop(client, None)
            self._changed.notify_all()
        self._on_answer()

    def watch(self, client: viser.ClientHandle) -> None:
        """Ask a browser for echoes until it leaves.

        It must not be asked by a thread of viser's pool: that one runs the callbacks of the controls, and browsers that
        come and go quickly would use it up.
        """
        self.meet(client.client_id)
        thread = threading.Thread(target=self._ask, args=(client,), name=f"echo-{client.client_id}", daemon=True)
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

    def _ask(self, client: viser.ClientHandle) -> None:
        asked_after = 0
        while (sent := self._next(client.client_id, asked_after)) is not None:
            asked_after = sent
            begun = time.monotonic()
            self.asks(client.client_id)
            # A browser that blocks its storage answers with an error, which is as good an echo as any. One that leaves
            # at this very moment makes viser warn, which is an error where warnings are.
            with contextlib.suppress(RuntimeError, TimeoutError, UserWarning):
                client.local_storage.get_item("pftrack-echo", timeout=ASLEEP_S)
            self.answered(client.client_id, time.monotonic() - begun)
            self._on_answer()
            with self._changed:
                rest = begun + ECHO_EVERY_S - time.monotonic()
                self._changed.wait_for(lambda: self._has_left(client.client_id), timeout=max(rest, 0.0))

    def _next(self, client: int, asked_after: int) -> int | None:
        """Wait for a frame after those already asked about; return how many there are, or None for the end."""
        with self._changed:
            self._changed.wait_for(lambda: self._sent > asked_after or self._has_left(client))
            return None if self._has_left(client) else self._sent

    def _has_left(self, client: int) -> bool:
        return self._closed or client not in self._browsers
