"""Where the work of reproducing is done: in this process, or spread over several."""

from collections.abc import Callable, Iterable
from concurrent.futures import as_completed
from pathlib import Path
from types import TracebackType
from typing import Self, TypeVar

from pftrack.process import BlockingPool, CallError, WorkerLostError
from pftrack.sweep import Plan, Progress, Result, SweepError, carry_out, partial_of, read_result
from pftrack.sweep.pool import open_pool

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
            progress: Called with the number of pieces done and of those known so far.
            folder: Where sweeps and figures are kept; nowhere if None.
        """
        self.folder = folder
        self._jobs = jobs
        self._pool: BlockingPool | None = None
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
        if self._pool is not None:
            self._pool.close()

    def map(self, function: Callable[[Item], Outcome], items: Iterable[Item]) -> list[Outcome]:
        """Return function(item) for all items, in order; function and items must be picklable.

        Raises:
            SweepError: The function failed in another process, or ended it.
        """
        work = list(items)
        self._known += len(work)
        if self._jobs == 1:
            results = []
            for item in work:
                results.append(function(item))
                self._advance(1)
            return results
        size = max(1, min(16, len(work) // 16))
        return self._spread(function, [work[start : start + size] for start in range(0, len(work), size)])

    def _spread(self, function: Callable[[Item], Outcome], pieces: list[list[Item]]) -> list[Outcome]:
        """Return the outcomes of all pieces in order, each computed by the next process that is free."""
        if self._pool is None:
            self._pool = open_pool(self._jobs)
        futures = {self._pool.submit(_transform, function, piece): len(piece) for piece in pieces}
        try:
            for each in as_completed(futures):
                each.result()
                self._advance(futures[each])
        except WorkerLostError as lost:
            raise SweepError(f"the study failed: a process of the pool was lost ({lost})") from None
        except (CallError, MemoryError, OSError) as error:
            raise SweepError(f"the computation failed: {error}") from None
        return [outcome for each in futures for outcome in each.result()]

    def _advance(self, count: int) -> None:
        self._done += count
        if self._progress is not None:
            self._progress(self._done, self._known)

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


def _transform(function: Callable[[Item], Outcome], items: list[Item]) -> list[Outcome]:
    return [function(item) for item in items]
