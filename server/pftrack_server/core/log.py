"""Warnings that come again and again: written down now and then, with how many were left out."""

import threading
import time
from typing import Any

import structlog

EVERY_S = 10.0


class RateLimitedLogger:
    """Writes a warning at most once in a while, so that nobody can fill the log.

    Args:
        logger: The name of who warns.
        every_s: The least time between two of them.
    """

    def __init__(self, logger: str, every_s: float = EVERY_S) -> None:
        self._log = structlog.get_logger(logger)
        self._every_s = every_s
        self._lock = threading.Lock()
        self._due = 0.0
        self._left_out = 0

    def warn(self, event: str, **what: Any) -> None:  # noqa: ANN401 - as structlog's own
        """Write a warning, or count it."""
        with self._lock:
            if time.monotonic() < self._due:
                self._left_out += 1
                return
            self._due = time.monotonic() + self._every_s
            if self._left_out:
                what["left_out"], self._left_out = self._left_out, 0
        self._log.warning(event, **what)
