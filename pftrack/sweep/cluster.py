"""The cluster: workers of a Dask scheduler, on other machines perhaps, that compute for a sweep.

Chunks travel as a plan's text and a number, and come back as the bytes of a file, so workers need pftrack of the same
version and nothing else: no shared disk. A recording travels once to each worker. Dask itself moves the task of a lost
worker to another one, and gives up on a task that has ended several of them.
"""

import gc
import logging
from collections.abc import Callable
from contextlib import suppress
from queue import Empty, SimpleQueue
from time import monotonic
from typing import Any

from pftrack.core.version import __version__
from pftrack.sources.sequence import Recording
from pftrack.sweep.axis import SweepError
from pftrack.sweep.work import Done, one_thread, pack, version

try:
    import dask
    from distributed import Client, KilledWorker
except ImportError:
    raise SweepError(
        "a sweep on a cluster needs the package distributed, which is not installed; pip install 'pftrack[cluster]'"
    ) from None


CONNECT_S = 5
"""Time limit for an answer of the scheduler."""

WORKERLESS_S = 15.0
"""Time limit for a cluster without workers."""

TASKS_A_THREAD = 2
"""One task in progress, and the next one, which hides the time of transfer."""

CHECK_S = 1.0

LOGGERS = "distributed", "distributed.client", "distributed.core", "distributed.comm", "distributed.batched", "tornado"


class ClusterWorkers:
    """All workers of a Dask scheduler, those that join later too."""

    def __init__(self, address: str) -> None:
        """Connect to a scheduler.

        Args:
            address: Its `host:port` or `tcp://host:port`.

        Raises:
            SweepError: No scheduler answers there, it has no workers, or they have another pftrack or none.
        """
        for name in LOGGERS:  # failures are reported once, by us
            logging.getLogger(name).setLevel(logging.CRITICAL + 1)
        dask.config.set({"distributed.comm.timeouts.connect": f"{CONNECT_S}s", "distributed.comm.retry.count": 0})
        self._address = address
        self._done: SimpleQueue[Any] = SimpleQueue()
        self._running: dict[object, tuple[int, Any]] = {}
        self._threads = 0
        self._checked_at = self._seen_at = monotonic()
        refused = ""
        try:
            self._client: Any = Client(address, timeout=CONNECT_S, set_as_default=False)  # type: ignore[no-untyped-call]
        except Exception as error:  # noqa: BLE001 - what a wrong address raises depends on what is wrong with it
            refused = f"no Dask scheduler answers at {address}: {_first_line(error)}"
        if refused:
            gc.collect()  # a client that did not connect holds itself, and may close within the lock of the next
            raise SweepError(refused)
        try:
            self._greet()
        except BaseException:
            self.close()
            raise

    def free(self) -> int:
        """Return how many more tasks keep all threads of the cluster busy."""
        return max(self._threads * TASKS_A_THREAD - len(self._running), 0)

    def share(self, recording: Recording | None) -> object:
        """Send a recording to all workers; those that join later get it from the others."""
        if recording is None:
            return None
        try:
            return self._client.scatter(pack(recording), broadcast=True, hash=False)
        except OSError as error:
            raise SweepError(f"the recording cannot be read: {error.strerror}") from None
        except Exception as error:  # noqa: BLE001 - the connection can break in many ways
            raise SweepError(f"the recording could not be sent to the cluster: {_first_line(error)}") from None

    def start(self, number: int, function: Callable[..., Any], *arguments: object) -> None:
        """Give a task to the scheduler."""
        future = self._client.submit(function, *arguments, pure=False)
        self._running[future.key] = number, future
        future.add_done_callback(self._done.put)

    def collect(self, timeout_s: float) -> list[Done]:
        """Return what was done.

        Raises:
            SweepError: A task failed or ended several workers, or the cluster went away.
        """
        self._check()
        done = []
        with suppress(Empty):
            future = self._done.get(timeout=timeout_s)
            while True:
                done.append(self._outcome(future))
                future = self._done.get_nowait()
        return done

    def close(self) -> None:
        """Cancel what is left and disconnect; the cluster stays."""
        with suppress(Exception):
            self._client.cancel([future for _, future in self._running.values()])
        with suppress(Exception):
            self._client.close(timeout=2)

    def _outcome(self, future: Any) -> Done:  # noqa: ANN401 - Dask's is generic over what it says nothing of
        number, _ = self._running.pop(future.key)
        if future.status == "finished":
            try:
                return Done(number, future.result(timeout=CONNECT_S * 2))
            except Exception:  # noqa: BLE001 - it was there, and its worker was lost before it came here
                return Done(number, lost="lost before its result arrived")
        if future.status != "error":
            raise self._lost_error()
        error = future.exception(timeout=CONNECT_S)
        if isinstance(error, KilledWorker):
            raise SweepError(
                f"a chunk ended its worker on the cluster again and again, so the sweep ends: {_first_line(error)}"
            )
        raise SweepError(f"the sweep failed on the cluster: {type(error).__name__}: {_first_line(error)}")

    def _check(self) -> None:
        """Look once a second how large the cluster is, and whether it is there at all."""
        now = monotonic()
        if now - self._checked_at < CHECK_S:
            return
        self._checked_at = now
        if self._client.status != "running":
            raise self._lost_error()
        try:
            self._threads = sum(self._client.nthreads().values())
        except Exception:  # noqa: BLE001 - the connection can break in many ways
            raise self._lost_error() from None
        if self._threads:
            self._seen_at = now
        elif now - self._seen_at > WORKERLESS_S:
            raise SweepError(f"the cluster at {self._address} has had no workers for {WORKERLESS_S:.0f} s")

    def _greet(self) -> None:
        """Wait for a worker, and see that all of them have the same pftrack."""
        try:
            self._client.wait_for_workers(1, timeout=CONNECT_S)
        except TimeoutError:
            raise SweepError(f"the Dask scheduler at {self._address} answers, but has no workers") from None
        try:
            versions = set(self._client.run(version).values())
            self._client.run(one_thread)
        except Exception as error:  # noqa: BLE001 - without pftrack there, unpickling fails in one way or another
            raise SweepError(f"the workers at {self._address} cannot use pftrack: {_first_line(error)}") from None
        if versions != {__version__}:
            there = ", ".join(sorted(versions))
            raise SweepError(f"the workers at {self._address} have pftrack {there}, here it is {__version__}")
        self._threads = sum(self._client.nthreads().values())

    def _lost_error(self) -> SweepError:
        return SweepError(f"the cluster at {self._address} went away; what was computed is kept")


def _first_line(error: BaseException | None) -> str:
    return next(iter(str(error).splitlines()), "") or type(error).__name__
