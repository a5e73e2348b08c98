"""The pool: processes of this machine that compute for a sweep.

Each is started afresh, not forked, and connected by a socket of its own. So the loss of one is seen at once and costs
its own chunk alone, and when the driver is lost, all of them find their sockets closed and end. Signals are the
driver's business: a terminal sends Ctrl-C to the whole group, and the workers let the driver decide.
"""

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from multiprocessing import Pipe
from multiprocessing.connection import Connection, wait
from typing import Any

from pftrack.sweep.errors import SweepError
from pftrack.sweep.work import one_thread
from pftrack.sweep.workers import Done

__all__ = ["LocalWorkers", "serve"]

ENVIRONMENT = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1", "NUMBA_NUM_THREADS": "1"}
GRACE_S = 5.0
LOOK_S = 0.5


class LocalWorkers:
    """Some processes; each takes one task at a time."""

    def __init__(self, jobs: int) -> None:
        """Start `jobs` processes."""
        self._hands: list[_Hand] = []
        for _ in range(jobs):
            self._hands.append(_Hand())

    def welcome(self) -> int:
        """Return how many processes have nothing to do."""
        return sum(hand.task is None for hand in self._hands)

    def start(self, number: int, function: Callable[..., Any], *arguments: object) -> None:
        """Give a task to a process that has nothing to do; one that was lost meanwhile is replaced."""
        place = next(place for place, hand in enumerate(self._hands) if hand.task is None)
        try:
            self._hands[place].take(number, function, arguments)
        except OSError:
            self._hands[place].end()
            self._hands[place] = _Hand()
            self._hands[place].take(number, function, arguments)

    def finished(self, timeout_s: float) -> list[Done]:
        """Return what was done; a process that was lost is replaced.

        Raises:
            SweepError: A task failed.
        """
        busy = {hand.connection: place for place, hand in enumerate(self._hands) if hand.task is not None}
        done = []
        for connection in wait(list(busy), timeout_s):
            place = busy[connection]  # type: ignore[index] # wait returns what it was given
            hand = self._hands[place]
            number, hand.task = hand.task, None
            assert number is not None  # noqa: S101 - it was busy
            try:
                failure, value = hand.connection.recv()
            except (EOFError, OSError):
                done.append(Done(number, lost=hand.end()))
                self._hands[place] = _Hand()
                continue
            if failure:
                raise SweepError(f"the sweep failed: {failure}")
            done.append(Done(number, value))
        return done

    def close(self) -> None:
        """End all processes."""
        for hand in self._hands:
            hand.end()


class _Hand:
    """One process, and the number of the task that it is busy with."""

    def __init__(self) -> None:
        self.task: int | None = None
        self.connection, theirs = Pipe()
        command = f"from pftrack.sweep.pool import serve; serve({theirs.fileno()}, {os.getpid()})"
        path = os.pathsep.join(filter(None, sys.path))
        self._process = subprocess.Popen(  # noqa: S603 - this very Python with our own words
            [sys.executable, "-c", command],
            pass_fds=[theirs.fileno()],
            stdin=subprocess.DEVNULL,
            env={**os.environ, **ENVIRONMENT, "PYTHONPATH": path},
        )
        theirs.close()

    def take(self, number: int, function: Callable[..., Any], arguments: tuple[object, ...]) -> None:
        """Send a task."""
        self.connection.send((function, arguments))
        self.task = number

    def end(self) -> str:
        """End the process, and say how it ended if it had already."""
        self.connection.close()
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(0.05)
        already = self._process.poll()
        self._process.kill()
        self._process.wait(GRACE_S)
        if already is not None and already < 0:
            return f"killed by {signal.Signals(-already).name}"
        return f"ended with status {already}" if already is not None else "ended"


def serve(descriptor: int, driver: int) -> None:
    """Do what comes over a socket, until it is closed or the driver is gone; the body of a process of the pool."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    one_thread()
    threading.Thread(target=_follow, args=[driver], daemon=True).start()
    with Connection(descriptor) as connection, suppress(EOFError, BrokenPipeError, ConnectionResetError):
        while True:
            function, arguments = connection.recv()
            try:
                answer: tuple[str, object] = "", function(*arguments)
            except Exception as error:  # noqa: BLE001 - the driver tells it
                answer = f"{type(error).__name__}: {error}", None
            connection.send(answer)


def _follow(driver: int) -> None:
    """End with the driver, in the middle of a chunk too: nobody will take it."""
    while os.getppid() == driver:
        time.sleep(LOOK_S)
    os._exit(1)
