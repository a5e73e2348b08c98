"""The pool: processes of this machine that compute for a sweep or a study.

Each is forked from a fork server and connected by a socket of its own. So the loss of one is seen at once and costs its
own task alone, and when the driver is lost, all of them find their sockets closed and end.
"""

from collections.abc import Callable
from contextlib import suppress
from itertools import count
from multiprocessing.connection import Connection, wait
from typing import Any

from pftrack.process import ForkServer
from pftrack.sweep.errors import SweepError
from pftrack.sweep.work import one_thread
from pftrack.sweep.workers import Done

__all__ = ["LocalWorkers", "prepare", "work"]

_PREPARED: list[ForkServer] = []


def prepare() -> None:
    """Fork the server of the next pool off this process, which has imported everything and started no thread."""
    _PREPARED.append(ForkServer.forked(work))


class LocalWorkers:
    """Some processes; each takes one task at a time."""

    def __init__(self, jobs: int) -> None:
        """Start `jobs` processes."""
        self._fork_server = _PREPARED.pop() if _PREPARED else _fresh()
        self._numbers = count()
        self._workers = [self._worker() for _ in range(jobs)]

    def welcome(self) -> int:
        """Return how many processes have nothing to do."""
        return sum(worker.task is None for worker in self._workers)

    def start(self, number: int, function: Callable[..., Any], *arguments: object) -> None:
        """Give a task to a process that has nothing to do; one that was lost meanwhile is replaced."""
        place = next(place for place, worker in enumerate(self._workers) if worker.task is None)
        try:
            self._workers[place].take(number, function, arguments)
        except OSError:
            self._workers[place].end()
            self._workers[place] = self._worker()
            self._workers[place].take(number, function, arguments)

    def finished(self, timeout_s: float) -> list[Done]:
        """Return what was done; a process that was lost is replaced.

        Raises:
            SweepError: A task failed.
        """
        busy = {worker.connection: place for place, worker in enumerate(self._workers) if worker.task is not None}
        done = []
        for connection in wait(list(busy), timeout_s):
            place = busy[connection]  # type: ignore[index] # wait returns what it was given
            worker = self._workers[place]
            number, worker.task = worker.task, None
            assert number is not None  # noqa: S101 - it was busy
            try:
                failure, value = worker.connection.recv()
            except (EOFError, OSError):
                done.append(Done(number, lost=worker.end()))
                self._workers[place] = self._worker()
                continue
            if failure:
                raise SweepError(f"the computation failed: {failure}")
            done.append(Done(number, value))
        return done

    def close(self) -> None:
        """End all processes."""
        for worker in self._workers:
            worker.end()
        self._fork_server.close()

    def _worker(self) -> "_Worker":
        try:
            return _Worker(self._fork_server, next(self._numbers))
        except OSError:  # the fork server itself was lost
            self._fork_server.close()
            self._fork_server = _fresh()
            return _Worker(self._fork_server, next(self._numbers))


class _Worker:
    """One process, and the number of the task that it is busy with."""

    def __init__(self, server: ForkServer, number: int) -> None:
        self.task: int | None = None
        self._fork_server, self._number = server, number
        self.connection = server.start(number)

    def take(self, number: int, function: Callable[..., Any], arguments: tuple[object, ...]) -> None:
        """Send a task."""
        self.connection.send((function, arguments))
        self.task = number

    def end(self) -> str:
        """End the process; return in words how it ended if it had already."""
        self.connection.close()
        return self._fork_server.end(self._number)


def _fresh() -> ForkServer:
    return ForkServer.fresh("pftrack.sweep.pool_process")


def work(connection: "Connection[Any, Any]") -> None:
    """Carry out tasks until the socket is closed, as a process of the pool."""
    one_thread()
    with connection, suppress(EOFError, BrokenPipeError, ConnectionResetError):
        while True:
            function, arguments = connection.recv()
            try:
                answer: tuple[str, object] = "", function(*arguments)
            except Exception as error:  # noqa: BLE001 - the driver reports it
                answer = f"{type(error).__name__}: {error}", None
            connection.send(answer)
