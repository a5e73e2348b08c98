"""How often the scene may change: as fast as the slowest browser that is awake can follow.

A browser that cannot keep up does not complain: the buffers of the connection fill with seconds of stale pictures. So
each browser is asked for an echo once a second. The question travels behind the frames already sent and is answered by
the code that draws them; the time until the answer is the age of what that person sees. When it grows, frames are left
out (the newest one is always shown); when it falls, they come back.
"""

import contextlib
import threading
import time

import viser

__all__ = ["Pacer"]

FASTEST_S = 1.0 / 30.0
SLOWEST_S = 0.5
LATE_S = 0.25
"""Lag above a browser's best at which it counts as late."""
ASLEEP_S = 4.0
"""Lag above which nobody can be looking: a frozen tab must not slow the others down."""
ECHO_EVERY_S = 1.0
ASLEEP_ROUNDS = 30
"""Rounds between two questions to a browser that sleeps, since each one costs the time of waiting in vain."""


class Pacer:
    """Measures the browsers' lag and derives the interval between frames.

    Attributes:
        interval_s: Shortest time between two frames.
    """

    def __init__(self) -> None:
        self.interval_s = FASTEST_S
        self._lags: dict[int, float] = {}
        self._best: dict[int, float] = {}
        self._closed = threading.Event()

    @property
    def lag_s(self) -> float:
        """Age of what the slowest browser shows, s; 0 without one."""
        return max((lag for lag in list(self._lags.values()) if lag < ASLEEP_S), default=0.0)

    def report(self, client: int, lag_s: float) -> None:
        """Take a browser's echo into account."""
        self._lags[client] = lag_s
        self._best[client] = min(lag_s, self._best.get(client, lag_s))
        awake = {client: lag for client, lag in list(self._lags.items()) if lag < ASLEEP_S}
        late = any(lag > self._best[client] + LATE_S for client, lag in awake.items())
        self.interval_s = min(SLOWEST_S, self.interval_s * 1.5) if late else max(FASTEST_S, self.interval_s * 0.8)

    def forget(self, client: int) -> None:
        """Leave out a browser that has gone."""
        self._lags.pop(client, None)
        self._best.pop(client, None)
        if not self._lags:
            self.interval_s = FASTEST_S

    def watch(self, server: viser.ViserServer) -> None:
        """Ask all browsers for echoes until closed; a thread of the viewer's own does nothing else.

        It must not be a thread of viser's pool: that one runs the callbacks of the controls, and browsers that come and
        go quickly would use it up.
        """
        rounds = 0
        while not self._closed.wait(ECHO_EVERY_S):
            rounds += 1
            for client in server.get_clients().values():
                if self._lags.get(client.client_id, 0.0) < ASLEEP_S or rounds % ASLEEP_ROUNDS == 0:
                    self._ask(server, client)

    def _ask(self, server: viser.ViserServer, client: viser.ClientHandle) -> None:
        asked = time.perf_counter()
        # A browser that blocks its storage answers with an error, which is as good an echo as any.
        with contextlib.suppress(RuntimeError, TimeoutError):
            client.local_storage.get_item("pftrack-echo", timeout=ASLEEP_S)
        if client.client_id in server.get_clients():
            self.report(client.client_id, time.perf_counter() - asked)
        else:
            self.forget(client.client_id)

    def close(self) -> None:
        """Stop asking."""
        self._closed.set()
