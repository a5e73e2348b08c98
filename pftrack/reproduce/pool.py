"""Where the work of reproducing is done: in this process, or spread over several."""

from collections.abc import Callable, Iterable
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from types import TracebackType
from typing import Any, Self, TypeVar

import cv2

__all__ = ["Pool"]

Item = TypeVar("Item")
Result = TypeVar("Result")


class Pool:
    """Maps functions over lists of work and reports progress."""

    def __init__(self, jobs: int, progress: Callable[[int, int], object] | None = None) -> None:
        """Prepare for `jobs` processes; `progress` is told pieces done and pieces known so far."""
        # Spawned, not forked: a fork copies whatever locks the threads of compiled libraries hold.
        self._executor = (
            ProcessPoolExecutor(jobs, mp_context=get_context("spawn"), initializer=_one_thread) if jobs > 1 else None
        )
        self._progress = progress
        self._done = 0
        self._known = 0

    def __enter__(self) -> Self:
        """Use the pool."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """End its processes; what has not begun is dropped."""
        if self._executor is not None:
            self._executor.shutdown(cancel_futures=True)

    def map(self, function: Callable[[Item], Result], items: Iterable[Item]) -> list[Result]:
        """Return function(item) for all items, in order; function and items must be picklable."""
        work = list(items)
        self._known += len(work)
        outcomes: Iterable[Any] = (
            map(function, work)
            if self._executor is None
            else self._executor.map(function, work, chunksize=max(1, min(16, len(work) // 16)))
        )
        results = []
        for outcome in outcomes:
            results.append(outcome)
            self._done += 1
            if self._progress is not None:
                self._progress(self._done, self._known)
        return results


def _one_thread() -> None:
    cv2.setNumThreads(1)
