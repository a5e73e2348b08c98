"""Chunks: the pieces in which a sweep is computed, and the order in which it is.

A chunk is a contiguous range of run numbers, some whole conditions or some trials of one, that takes about a second. So
the final file is the chunks one after the other. They are computed in an order that spreads over the grid from the
start: by the fractional part of a linear form of the chunk's place on the axes, the additive recurrence of quasi-Monte
Carlo turned into a dither mask. Its factors are the golden ratio and square roots, which fractions approximate badly,
so that along any axis what is done is evenly spaced, and whatever two axes a map shows, it lies evenly all over it.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pftrack.sweep.plan import Plan

__all__ = ["Chunk", "Chunks", "Piece"]

MOST_CHUNKS = 20_000
"""A folder with more files is slow to list."""


FACTORS = ((5**0.5 - 1) / 2, 2**0.5, 3**0.5, 7**0.5, 13**0.5, 6**0.5, 10**0.5, 14**0.5)
"""Of the axes from the last to the first; independent of each other over the rational numbers."""


@dataclass(frozen=True, slots=True)
class Piece:
    """Some trials, start..stop-1, of one condition."""

    condition: int
    start: int
    stop: int


@dataclass(frozen=True, slots=True)
class Chunk:
    """A contiguous range of runs.

    Attributes:
        number: Its place among the chunks.
        first: Number of its first run.
        runs: How many there are.
        pieces: The same by condition.
    """

    number: int
    first: int
    runs: int
    pieces: tuple[Piece, ...]


@dataclass(frozen=True, slots=True)
class Chunks:
    """A plan cut into chunks.

    Attributes:
        plan: What is cut.
        conditions: Whole conditions in a chunk.
        trials: Trials in a chunk; all of them unless a chunk is one condition.
    """

    plan: Plan
    conditions: int
    trials: int

    @classmethod
    def of(cls, plan: Plan, runs: float) -> "Chunks":
        """Cut a plan into chunks of about this many runs, but into no more chunks than a folder can bear."""
        wanted = max(runs, plan.runs / MOST_CHUNKS)
        whole = int(wanted // (plan.trials * len(plan.trackers)))
        if whole >= 1:
            return cls(plan, min(whole, plan.conditions), plan.trials)
        return cls(plan, 1, min(max(int(wanted // len(plan.trackers)), 1), plan.trials))

    def __len__(self) -> int:
        return -(-self.plan.conditions // self.conditions) * self._splits

    def __getitem__(self, number: int) -> Chunk:
        """Return a chunk by its number, 0..len-1."""
        if not 0 <= number < len(self):
            raise IndexError(f"there are {len(self)} chunks, got {number}")
        plan = self.plan
        group, split = divmod(number, self._splits)
        start, stop = split * self.trials, min((split + 1) * self.trials, plan.trials)
        first = group * self.conditions
        last = min(first + self.conditions, plan.conditions)
        pieces = tuple(Piece(condition, start, stop) for condition in range(first, last))
        width = len(plan.trackers)
        return Chunk(number, (first * plan.trials + start) * width, len(pieces) * (stop - start) * width, pieces)

    def __iter__(self) -> Iterator[Chunk]:
        return (self[number] for number in range(len(self)))

    def spread(self) -> NDArray[np.int64]:
        """Return all numbers in the order in which they are computed: evenly over the grid from the start."""
        numbers = np.arange(len(self))
        groups, splits = np.divmod(numbers, self._splits)
        shape = (*self.plan.shape, 1)
        places = [*np.unravel_index(groups * self.conditions, shape)[:-1], *([splits] if self._splits > 1 else [])]
        form = np.zeros(len(self))
        for axis, place in enumerate(reversed(places)):
            form += place * FACTORS[axis % len(FACTORS)]
        order: NDArray[np.int64] = np.argsort(form % 1.0, kind="stable")
        return order

    @property
    def _splits(self) -> int:
        return -(-self.plan.trials // self.trials)
