"""What a recorder has gathered and not yet written: numbers in memory that is used again and again.

To ask the system for fresh memory costs several times what copying into it costs, so a few chunks go round: the loop
fills one while others are written.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pftrack.sources.beliefs.archive import ARRAYS

__all__ = ["Chunk"]

NOTHING = dict.fromkeys(ARRAYS, 0)
LEAST = 8 * 1024
"""Numbers for which a column has room at first."""


class Column:
    """The rows of one array, one below the other.

    Attributes:
        rows: How many there are.
    """

    def __init__(self, dtype: "np.dtype[Any]") -> None:
        self.rows = 0
        self._numbers: NDArray[Any] = np.empty(0, dtype)

    def append(self, array: NDArray[Any]) -> None:
        """Copy an array of one row or more, in this column's precision; all have rows of one shape."""
        begin = self.rows
        end = begin + len(array)
        if end > len(self._numbers):
            least = -(-LEAST * len(array) // max(array.size, 1))
            larger = np.empty((max(2 * len(self._numbers), end, least), *array.shape[1:]), self._numbers.dtype)
            if begin:
                larger[:begin] = self._numbers[:begin]
            self._numbers = larger
        self._numbers[begin:end] = array
        self.rows = end

    @property
    def array(self) -> NDArray[Any]:
        """All rows, a view until the column is cleared."""
        return self._numbers[: self.rows]

    def clear(self) -> None:
        """Begin anew, in the same memory."""
        self.rows = 0


class Chunk:
    """Rows of frames and targets, and the arrays that belong to them.

    Attributes:
        number: Of the chunk in its file.
        rows: Frame, target, whether it is a truth, and how many rows of each array.
        columns: The arrays by name.
        used: How many numbers it holds.
    """

    def __init__(self, precision: "np.dtype[Any]") -> None:
        """Make one that is empty.

        Args:
            precision: Of particles and their weights.
        """
        others = {"ancestors": np.dtype("<i4")}
        self.number = self.used = 0
        self.rows: list[tuple[int, ...]] = []
        self.columns = {
            name: Column(precision if name in {"particles", "log_weights"} else others.get(name, np.dtype("<f8")))
            for name in ARRAYS
        }

    def append(self, frame: int, target: int, said: Mapping[str, NDArray[Any]], *, is_truth: bool) -> None:
        """Copy what is said of a target in a frame: arrays by name, each of one row or more."""
        counts = dict(NOTHING)
        columns = self.columns
        for name, array in said.items():
            columns[name].append(array)
            counts[name] = len(array)
            self.used += array.size
        self.rows.append((frame, target, int(is_truth), *counts.values()))

    def clear(self) -> None:
        """Begin anew, in the same memory."""
        self.rows, self.used = [], 0
        for column in self.columns.values():
            column.clear()
