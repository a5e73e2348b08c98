"""What a recorder has gathered and not yet written: numbers in memory that is used again and again.

To ask the system for fresh memory costs several times what copying into it costs, so a few chunks go round: the loop
fills one while others are written.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pftrack.sources.beliefs.archive import ARRAYS

__all__ = ["Chunk"]

LEAST_BYTES = 64 * 1024


class Column:
    """The rows of one array, one below the other.

    Attributes:
        rows: How many there are.
        used: How many bytes they take.
    """

    def __init__(self, dtype: "np.dtype[Any]") -> None:
        self.dtype = dtype
        self.inner: tuple[int, ...] = ()
        self.rows = self.used = 0
        self._memory = np.empty(0, np.uint8)

    def append(self, array: NDArray[Any]) -> None:
        """Copy an array of one row or more, in this column's precision."""
        self.inner = array.shape[1:]
        end = self.used + array.size * self.dtype.itemsize
        if end > len(self._memory):
            larger = np.empty(max(2 * len(self._memory), end, LEAST_BYTES), np.uint8)
            larger[: self.used] = self._memory[: self.used]
            self._memory = larger
        place = self._memory[self.used : end].view(self.dtype).reshape(array.shape)
        np.copyto(place, array, casting="same_kind")
        self.rows += len(array)
        self.used = end

    @property
    def shape(self) -> tuple[int, ...]:
        """Of all rows together."""
        return (self.rows, *self.inner)

    @property
    def data(self) -> memoryview:
        """Their bytes, until it is cleared."""
        return self._memory[: self.used].data

    def clear(self) -> None:
        """Begin anew, in the same memory."""
        self.rows = self.used = 0


class Chunk:
    """Rows of frames and targets, and the arrays that belong to them.

    Attributes:
        number: Of the chunk in its file.
        rows: Frame, target, whether it is a truth, and how many rows of each array.
        columns: The arrays by name.
    """

    def __init__(self, precision: "np.dtype[Any]") -> None:
        """Make one that is empty.

        Args:
            precision: Of particles and their weights.
        """
        others = {"ancestors": np.dtype("<i4")}
        self.number = 0
        self.rows: list[tuple[int, ...]] = []
        self.columns = {
            name: Column(precision if name in {"particles", "log_weights"} else others.get(name, np.dtype("<f8")))
            for name in ARRAYS
        }

    @property
    def used(self) -> int:
        """How many bytes it holds."""
        return sum(column.used for column in self.columns.values())

    def clear(self) -> None:
        """Begin anew, in the same memory."""
        self.rows = []
        for column in self.columns.values():
            column.clear()
