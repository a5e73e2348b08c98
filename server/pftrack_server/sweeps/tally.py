"""The tally: what of a sweep lies on the disk, counted once when it appears.

Only sums are kept, so that a sweep that nobody looks at costs nothing and a large one no more than a small one. The
methods block for some milliseconds; whoever calls them holds the lock.
"""

from pathlib import Path

from pftrack.sweep import Plan, Result, partial_of, read_chunk
from pftrack.sweep.axis import SweepError
from pftrack.sweep.cells import Counts, cells, columns, count
from pftrack_server.schemas.sweep_views import Pair

TOTAL: Pair = (None, None)


class Tally:
    """Sums over the files of one sweep, for every pair of axes that somebody has asked for.

    Attributes:
        done: Runs that are there.
        successes: How many of them succeeded.
        problems: How many of them could not be computed.
    """

    def __init__(self, plan: Plan, out: Path) -> None:
        self._plan = plan
        self._out = out
        self._files: set[Path] = set()
        self._complete = False
        self._counts: dict[Pair, Counts] = {TOTAL: count(plan, None, *TOTAL)}
        self.done = self.successes = self.problems = 0

    def look(self) -> bool:
        """Count what has appeared since the last time; return whether there was anything.

        Raises:
            SweepError: The result is damaged.
        """
        if self._complete:
            return False
        if self._out.exists():
            self._close()
            return True
        there = self._there()
        if not self._files <= there:
            if self._out.exists():
                self._close()
                return True
            # Somebody took files away, and the sweep started again.
            self._files = set()
            self._counts = {pair: count(self._plan, None, *pair) for pair in self._counts}
        return self._add(sorted(there - self._files))

    def counts(self, pair: Pair) -> Counts:
        """Return the sums for a pair of axes.

        Raises:
            SweepError: The result is damaged.
        """
        if pair not in self._counts:
            found = self._sum(self.result(), pair)
            if _runs(found) < self.done and self._out.exists():
                # The chunks went into the result while they were counted.
                self._close()
                found = self._sum(self.result(), pair)
            self._counts[pair] = found
        return self._counts[pair]

    def result(self) -> Result:
        """Return exactly what has been counted."""
        if self._complete:
            return Result(self._plan, (self._out,), complete=True)
        return Result(self._plan, tuple(sorted(self._files)), complete=False, place=partial_of(self._out))

    def _there(self) -> set[Path]:
        try:
            every = partial_of(self._out).iterdir()
            return {path for path in every if path.suffix == ".parquet" and path.stem.isdecimal()}
        except FileNotFoundError:
            return set()

    def _add(self, paths: list[Path]) -> bool:
        news = False
        for path in paths:
            try:
                table = read_chunk(path)
            except (SweepError, OSError):
                # Damaged, or just gone into the result: the next look will tell.
                continue
            self._files.add(path)
            self._counts = {pair: known + count(self._plan, table, *pair) for pair, known in self._counts.items()}
            news = True
        if news:
            self._total()
        return news

    def _close(self) -> None:
        """Go over from the chunks, which are gone, to the one file that was made of them."""
        if self.done < self._plan.runs:
            result = Result(self._plan, (self._out,), complete=True)
            self._counts = {pair: self._sum(result, pair) for pair in self._counts}
            self._total()
        self._complete = True

    def _total(self) -> None:
        every = cells(self._counts[TOTAL]).values()
        self.done = _runs(self._counts[TOTAL])
        self.successes = sum(int(one.successes.sum()) for one in every)
        self.problems = sum(int(one.problems.sum()) for one in every)

    def _sum(self, result: Result, pair: Pair) -> Counts:
        total = count(self._plan, None, *pair)
        for piece in result.pieces(columns(self._plan, *pair)):
            total += count(self._plan, piece, *pair)
        return total


def _runs(counts: Counts) -> int:
    return sum(int(one.runs.sum()) for one in cells(counts).values())
