"""Warnings that are given once: what goes wrong in one frame mostly does in all that follow."""

import logging
import threading

__all__ = ["warn_once"]

logger = logging.getLogger(__name__)

_warned: set[str] = set()
_lock = threading.Lock()


def warn_once(about: str, message: str, error: Exception | None = None) -> None:
    """Log a warning, unless there was one about the same in this process.

    Args:
        about: What it is about; further ones about it are left out, whatever they say.
        message: The warning, a sentence.
        error: What was raised; the log then says where.
    """
    with _lock:
        if about in _warned:
            return
        _warned.add(about)
    logger.warning(message, exc_info=error)
