"""Waiting for what comes from another thread, process or page."""

import time
from collections.abc import Callable
from typing import TypeVar

__all__ = ["wait_for"]

FIRST_S, LONGEST_S, GROWTH = 0.01, 0.25, 1.3

Found = TypeVar("Found")


def wait_for(
    condition: Callable[[], Found],
    seconds: float = 60.0,
    what: str = "it holds",
    pause: Callable[[float], object] = time.sleep,
) -> Found:
    """Ask again and again until something holds, and return it.

    It is asked ever more seldom: asking takes processor time from those who are to bring it about. What counts is how
    long it has rested, not the clock: on a loaded machine, where all takes longer, there is as much more time.

    Args:
        condition: Is asked, and holds as soon as its result is true.
        seconds: How long to rest in all.
        what: Is waited for, to be said if it is in vain.
        pause: Waits so many seconds.
    """
    rested, rest = 0.0, FIRST_S
    while not (found := condition()):
        assert rested < seconds, f"waited in vain until {what}"
        pause(rest)
        rested += rest
        rest = min(GROWTH * rest, LONGEST_S)
    return found
