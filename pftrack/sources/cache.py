"""A bounded cache: what was used least recently goes first."""

from collections import OrderedDict
from typing import Generic, TypeVar

__all__ = ["BoundedCache"]

T = TypeVar("T")


class BoundedCache(Generic[T]):
    """Values by frame number, within a number of bytes; the newest value is kept even if it alone is larger."""

    def __init__(self, capacity_bytes: int) -> None:
        """Begin empty.

        Args:
            capacity_bytes: What all values together may take.
        """
        self.capacity_bytes = capacity_bytes
        self.used_bytes = 0
        self._entries: OrderedDict[int, tuple[T, int]] = OrderedDict()

    def __len__(self) -> int:
        """Count the values."""
        return len(self._entries)

    def __contains__(self, number: int) -> bool:
        """Tell whether a frame is at hand, without using it."""
        return number in self._entries

    def get(self, number: int) -> T | None:
        """Return a frame's value, which becomes the most recently used, or None."""
        entry = self._entries.get(number)
        if entry is None:
            return None
        self._entries.move_to_end(number)
        return entry[0]

    def put(self, number: int, value: T, size_bytes: int) -> None:
        """Keep a value, and let go of the least recently used ones where there is no room."""
        self.drop(number)
        self._entries[number] = (value, size_bytes)
        self.used_bytes += size_bytes
        while self.used_bytes > self.capacity_bytes and len(self._entries) > 1:
            self.drop(next(iter(self._entries)))

    def drop(self, number: int) -> None:
        """Let go of a frame's value, if there is one."""
        entry = self._entries.pop(number, None)
        if entry is not None:
            self.used_bytes -= entry[1]

    def clear(self) -> None:
        """Let go of everything."""
        self._entries.clear()
        self.used_bytes = 0
