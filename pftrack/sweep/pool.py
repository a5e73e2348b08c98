"""The pool: processes of this machine that compute for a sweep or a study.

The loss of one is seen at once and costs its own task alone, and when the driver is lost, all of them end.
"""

from collections.abc import Callable
from concurrent.futures import FIRST_COMPLETED, Future, wait
from typing import Any

from pftrack.process import UNLIMITED, BlockingPool, CallError, ForkServer, WorkerLostError
from pftrack.sweep.errors import SweepError
from pftrack.sweep.recording import Recording
from pftrack.sweep.work import one_thread
from pftrack.sweep.workers import Done

__all__ = ["LocalWorkers", "open_pool", "prepare"]

PRELOAD = "pftrack.sweep.preload"

_PREPARED: list[ForkServer] = []


def prepare() -> None:
    """Fork the server of the next pool off this process, which has imported everything and started no thread."""
    made = _fresh()
    made.fork_off()
    _PREPARED.append(made)


def open_pool(jobs: int) -> BlockingPool:
    """Return a pool of `jobs` processes that compute with one thread each."""
    fork_server = _PREPARED.pop() if _PREPARED else _fresh()
    return BlockingPool(fork_server, processes=jobs, budget=UNLIMITED, prepare=one_thread)


def _fresh() -> ForkServer:
    return ForkServer(PRELOAD)


class LocalWorkers:
    """Some processes; each takes one task at a time."""

    def __init__(self, jobs: int) -> None:
        """Begin with `jobs` processes."""
        self._pool = open_pool(jobs)
        self._numbers: dict[Future[Any], int] = {}

    def free(self) -> int:
        """Return how many processes have nothing to do."""
        return self._pool.processes - len(self._numbers)

    def share(self, recording: Recording | None) -> Recording | None:
        """Return the recording: a process of this machine opens it where it is."""
        return recording

    def start(self, number: int, function: Callable[..., Any], *arguments: object) -> None:
        """Give a task to a process that has nothing to do; one that was lost meanwhile is replaced."""
        self._numbers[self._pool.submit(function, *arguments)] = number

    def collect(self, timeout_s: float) -> list[Done]:
        """Return what was done; a process that was lost is replaced.

        Raises:
            SweepError: A task failed, or the system makes no process.
        """
        return [self._take(each) for each in wait(self._numbers, timeout_s, FIRST_COMPLETED).done]

    def close(self) -> None:
        """End all processes."""
        self._pool.close()

    def _take(self, future: "Future[Any]") -> Done:
        number = self._numbers.pop(future)
        try:
            return Done(number, future.result())
        except WorkerLostError as error:
            return Done(number, lost=str(error))
        except (CallError, MemoryError, OSError) as error:
            raise SweepError(f"the computation failed: {error}") from None
