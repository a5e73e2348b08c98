"""Where the work of reproducing is done: in this process, or spread over several."""

from collections.abc import Callable, Iterable
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from types import TracebackType
from typing import Any, Self, TypeVar

import cv2

from pftrack.sweep import Plan, Progress, Result, SweepError, carry_out, partial_of, read_result

__all__ = ["Pool"]

Item = TypeVar("Item")
Outcome = TypeVar("Outcome")

RUNS_A_PIECE = 120
"""How many runs of a sweep count as one piece of work."""


class Pool:
    """Maps functions over lists of work, carries out sweeps, and reports progress."""

    def __init__(
        self, jobs: int, progress: Callable[[int, int], object] | None = None, folder: Path | None = None
    ) -> None:
        """Prepare to compute.

        Args:
            jobs: How many processes.
            progress: Told how many pieces are done and how many are known so far.
            folder: Where sweeps and figures are kept; nowhere if None.
        """
        self.folder = folder
        self._jobs = jobs
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

    def map(self, function: Callable[[Item], Outcome], items: Iterable[Item]) -> list[Outcome]:
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

    def sweep(self, plan: Plan, out: Path) -> Result:
        """Return the result of a sweep that is kept in a file: finished before, gone on with, or computed.

        Raises:
            SweepError: The file holds another sweep.
        """
        begun = out.exists() or partial_of(out).exists()
        if begun and read_result(out).plan != plan:
            raise SweepError(f"{out} holds another sweep; name another folder")
        if out.exists():
            return read_result(out)
        known, pieces = self._known, -(-plan.runs // RUNS_A_PIECE)
        self._known += pieces

        def tell(progress: Progress) -> None:
            self._done = known + progress.done // RUNS_A_PIECE
            if self._progress is not None:
                self._progress(self._done, self._known)

        result = carry_out(None if begun else plan, out, jobs=self._jobs, progress=tell)
        self._done = known + pieces
        return result


def _one_thread() -> None:
    cv2.setNumThreads(1)
