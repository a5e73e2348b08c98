"""What a recorder has gathered and not yet written: numbers in memory that is used again and again.

To ask the system for fresh memory costs several times what copying into it costs, so a few chunks go round: the loop
fills one while others are written.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pftrack.sources.beliefs.archive import ARRAYS

__all__ = ["Chunk"]

LEAST = 8 * 1024
"""Numbers for which a column has room at first."""


class Column:
    """The rows of one array, one below the other.

    Attributes:
        rows: How many there are.
        used: How many numbers they have.
    """

    def __init__(self, dtype: "np.dtype[Any]") -> None:
        self.dtype = dtype
        self.inner: tuple[int, ...] = ()
        self.rows = self.used = 0
        self._numbers: NDArray[Any] = np.empty(0, dtype)

    def append(self, array: NDArray[Any]) -> None:
        """Copy an array of one row or more, in this column's precision."""
        end = self.used + array.size
        if end > len(self._numbers):
            larger = np.empty(max(2 * len(self._numbers), end, LEAST), self.dtype)
            larger[: self.used] = self._numbers[: self.used]
            self._numbers = larger
        self._numbers[self.used : end].reshape(array.shape)[...] = array
        self.inner = array.shape[1:]
        self.rows += len(array)
        self.used = end

    @property
    def shape(self) -> tuple[int, ...]:
        """Of all rows together."""
        return (self.rows, *self.inner)

    @property
    def data(self) -> memoryview:
        """Their bytes, until it is cleared."""
        return self._numbers[: self.used].data

    def clear(self) -> None:
        """Begin anew, in the same memory."""
        self.rows = self.used = 0


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

    def clear(self) -> None:
        """Begin anew, in the same memory."""
        self.rows, self.used = [], 0
        for column in self.columns.values():
            column.clear()
