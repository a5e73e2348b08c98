"""Children as their parent sees them: how they are started and ended, and what their exit status means."""

import os
import signal
import sys
import threading
import time
from contextlib import suppress
from enum import Enum, auto

__all__ = ["ONE_THREAD", "Ending", "command", "describe", "end_group", "ending", "environment", "follow_parent"]

ONE_THREAD = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1", "NUMBA_NUM_THREADS": "1"}
"""Environment that keeps numerical libraries to one thread: there is a process for every core already."""

LOOK_S = 0.5


class Ending(Enum):
    """How a child process ended."""

    DONE = auto()
    FAILED = auto()
    OUT_OF_TIME = auto()
    OUT_OF_CPU_TIME = auto()
    KILLED = auto()
    CRASHED = auto()


def command(module: str, *arguments: str) -> list[str]:
    """Return the command that runs a module in a fresh interpreter, which imports nothing from the current folder."""
    return [sys.executable, "-P", "-m", module, *arguments]


def environment() -> dict[str, str]:
    """Return the environment of a child, in which it finds the packages that this process finds."""
    return {**os.environ, **ONE_THREAD, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}


def end_group(process: int) -> None:
    """Kill all processes of the group that a child leads; a group that has ended already is left alone."""
    with suppress(ProcessLookupError, PermissionError):
        os.killpg(process, signal.SIGKILL)


def ending(status: int | None) -> Ending:
    """Return how a child ended.

    Args:
        status: Its exit status, negative for the signal that ended it; None if it had to be killed for lasting too
            long.
    """
    if status is None or status == -signal.SIGALRM:
        return Ending.OUT_OF_TIME
    if status >= 0:
        return Ending.FAILED if status else Ending.DONE
    return {-signal.SIGXCPU: Ending.OUT_OF_CPU_TIME, -signal.SIGKILL: Ending.KILLED}.get(status, Ending.CRASHED)


def describe(status: int) -> str:
    """Return an exit status in words: "ended with status 1", "killed by SIGSEGV"."""
    if status >= 0:
        return f"ended with status {status}"
    known = -status in set(signal.Signals)
    return f"killed by {signal.Signals(-status).name if known else f'signal {-status}'}"


def follow_parent(parent: int) -> None:
    """End this process soon after its parent has ended, whatever it is doing.

    Args:
        parent: Process number of the parent, from the parent itself: it may be gone before this is called.
    """

    def follow() -> None:
        while os.getppid() == parent:
            time.sleep(LOOK_S)
        os._exit(1)

    threading.Thread(target=follow, name="follow-parent", daemon=True).start()
