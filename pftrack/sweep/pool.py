"""The pool: processes of this machine that compute for a sweep or a study.

Each is a fresh interpreter, connected by a socket of its own. So the loss of one is seen at once and costs its own task
alone, and when the driver is lost, all of them find their sockets closed and end.
"""

import os
import subprocess
from collections.abc import Callable
from contextlib import suppress
from multiprocessing import Pipe
from multiprocessing.connection import wait
from typing import Any

from pftrack.process import command, described, environment
from pftrack.sweep.errors import SweepError
from pftrack.sweep.workers import Done

__all__ = ["LocalWorkers"]

GRACE_S = 5.0


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
                raise SweepError(f"the computation failed: {failure}")
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
        # In the driver's own group: whoever ends the group of a driver ends its workers.
        self._process = subprocess.Popen(  # noqa: S603 - this very Python and a module of ours
            command("pftrack.sweep.pool_process", str(theirs.fileno()), str(os.getpid())),
            pass_fds=[theirs.fileno()],
            stdin=subprocess.DEVNULL,
            env=environment(),
        )
        theirs.close()

    def take(self, number: int, function: Callable[..., Any], arguments: tuple[object, ...]) -> None:
        """Send a task."""
        self.connection.send((function, arguments))
        self.task = number

    def end(self) -> str:
        """End the process; return in words how it ended if it had already."""
        self.connection.close()
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(0.05)
        already = self._process.poll()
        self._process.kill()
        self._process.wait(GRACE_S)
        return "ended" if already is None else described(already)
