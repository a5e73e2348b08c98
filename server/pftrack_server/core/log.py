"""Repeated warnings: logged at intervals, with the number of those left out."""

import threading
import time
from typing import Any

import structlog

EVERY_S = 10.0


class RateLimitedLogger:
    """Writes a warning at most once per interval, so that no client can fill the log.

    Args:
        logger: Name of the logger.
        every_s: Least time between two warnings, s.
    """

    def __init__(self, logger: str, every_s: float = EVERY_S) -> None:
        self._log = structlog.get_logger(logger)
        self._every_s = every_s
        self._lock = threading.Lock()
        self._due = 0.0
        self._left_out = 0

    def warn(self, event: str, **what: Any) -> None:  # noqa: ANN401 - as structlog's own
        """Log a warning, or count it if the last one was too recent."""
        with self._lock:
            if time.monotonic() < self._due:
                self._left_out += 1
                return
            self._due = time.monotonic() + self._every_s
            if self._left_out:
                what["left_out"], self._left_out = self._left_out, 0
        self._log.warning(event, **what)
