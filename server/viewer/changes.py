"""Changes on their way from a person's hand to the session: always the newest value of each control."""

import logging
import threading
from collections.abc import Callable

from pftrack.parameters import Value

__all__ = ["Coalescer"]

INTERVAL_S = 0.05

logger = logging.getLogger(__name__)


class Coalescer:
    """Sends changes on, at most one batch at a time and 20 a second.

    A dragged slider gives a value every 50 ms, whether or not the last one has been dealt with. The first is sent at
    once; those that come meanwhile replace each other and leave together.

    Args:
        send: Takes a batch of values by name; runs in a thread of its own, one batch at a time.
    """

    def __init__(self, send: Callable[[dict[str, Value]], None]) -> None:
        self._send = send
        self._lock = threading.Lock()
        self._pending: dict[str, Value] = {}
        self._sending = False
        self._closed = threading.Event()

    @property
    def busy(self) -> bool:
        """Whether a change is still on its way."""
        return self._sending

    def offer(self, name: str, value: Value) -> None:
        """Leave a value to be sent; this never waits."""
        with self._lock:
            if self._closed.is_set():
                return
            self._pending[name] = value
            if self._sending:
                return
            self._sending = True
        threading.Thread(target=self._work, name="changes", daemon=True).start()

    def close(self) -> None:
        """Send nothing more."""
        self._closed.set()

    def _work(self) -> None:
        while True:
            with self._lock:
                batch, self._pending = self._pending, {}
                if not batch or self._closed.is_set():
                    self._sending = False
                    return
            try:
                self._send(batch)
            except Exception:
                # A change that fails must not take the control with it; whoever takes changes reports what is wrong
                # with a value by `Viewer.refuse`.
                logger.exception("a change could not be sent on")
            self._closed.wait(INTERVAL_S)
