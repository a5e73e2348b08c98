"""Features: what signals are beside what they were, frame by frame.

What a number means hangs on what is usual: the log evidence of one scene says nothing in another one. So each signal
comes with its memory. A frame's features depend on the frames up to it alone, and a memory of a few numbers carries
them on, so that a run that goes on is not read again.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["KINDS", "Memory", "feature_names", "remember"]

KINDS: tuple[str, ...] = ("now", "fast", "slow", "change", "lowest", "highest")
"""Of each signal: its value; its means over the last 5 and the last 25 frames or so; by how much the first of these has
changed since the beginning; the least and the greatest such change so far."""

FAST, SLOW = 1.0 / 5.0, 1.0 / 25.0
"""Share of a mean that a new value replaces."""

BEGINNING = 5
"""So many known values are the beginning, whose mean is what is usual."""


@dataclass(frozen=True, slots=True, eq=False)
class Memory:
    """What is kept of S signals in the frames so far.

    Attributes:
        counts: (S,) frames in which each was known.
        fast: (S,) mean over the last few; 0 where none was known.
        slow: (S,) mean over more.
        usual: (S,) mean over the first few.
        lowest: (S,) least of all changes so far.
        highest: (S,) greatest.
    """

    counts: NDArray[np.float64]
    fast: NDArray[np.float64]
    slow: NDArray[np.float64]
    usual: NDArray[np.float64]
    lowest: NDArray[np.float64]
    highest: NDArray[np.float64]

    @classmethod
    def empty(cls, count: int) -> "Memory":
        """Return that of no frame, of so many signals."""
        return cls(*np.zeros((6, count)))


def feature_names(signals: tuple[str, ...]) -> tuple[str, ...]:
    """Return the names of the features of some signals, in the order in which `remember` gives them."""
    return tuple(f"{signal} {kind}" for signal in signals for kind in KINDS)


def remember(memory: Memory, signals: NDArray[np.float64]) -> tuple[Memory, NDArray[np.float64]]:
    """Return what is kept after some frames, and their features (L, S times the kinds).

    A signal that is not known in a frame changes no memory, and its "now" is the fast mean.

    Args:
        memory: Of the frames before.
        signals: (L, S) of these frames, NaN where one is not known.
    """
    found = np.empty((len(signals), signals.shape[1], len(KINDS)))
    for place, values in enumerate(signals):
        known = ~np.isnan(values)
        counts = memory.counts + known
        first = 1.0 / np.maximum(counts, 1.0)
        now = np.where(known, values, memory.fast)
        fast = memory.fast + np.where(known, np.maximum(FAST, first), 0.0) * (now - memory.fast)
        slow = memory.slow + np.where(known, np.maximum(SLOW, first), 0.0) * (now - memory.slow)
        begins = known & (counts <= BEGINNING)
        usual = memory.usual + np.where(begins, first, 0.0) * (now - memory.usual)
        change = fast - usual
        lowest, highest = np.minimum(memory.lowest, change), np.maximum(memory.highest, change)
        memory = Memory(counts, fast, slow, usual, lowest, highest)
        found[place] = np.stack([now, fast, slow, change, lowest, highest], axis=1)
    return memory, found.reshape(len(signals), -1)
