"""The lines of one node in all frames, each once: a path that grows keeps its lines, and has one more in each frame."""

import numpy as np
from numpy.typing import NDArray

ENDS = 6
"""Numbers of a line: two places."""
FACTORS = np.array((0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9, 0xD6E8FEB86659FD93, 0xFF51AFD7ED558CCD,
                    0xC4CEB9FE1A85EC53), dtype=np.uint64)  # fmt: skip
"""Odd numbers that spread a line's six over 64 bits: two lines that fall together are as good as never."""


class Lines:
    """Takes the lines of one frame after the other."""

    def __init__(self) -> None:
        self._tables: list[NDArray[np.int32]] = []
        self._keys: NDArray[np.uint64] = np.zeros(0, np.uint64)
        self._places: NDArray[np.int64] = np.zeros(0, np.int64)

    @property
    def table(self) -> NDArray[np.int32]:
        """All lines (n, 6) in the order in which they came."""
        return np.concatenate(self._tables) if self._tables else np.zeros((0, ENDS), np.int32)

    def add(self, ends: NDArray[np.int32]) -> NDArray[np.int32]:
        """Return a frame's lines as the numbers of the table's rows.

        Args:
            ends: Six numbers a line.
        """
        lines = ends.reshape(-1, ENDS)
        keys = _keys(lines)
        new = ~self._has(keys)
        if new.any():
            self._take(lines[new], keys[new])
        return self._places[np.searchsorted(self._keys, keys)].astype("<i4")

    def _has(self, keys: NDArray[np.uint64]) -> NDArray[np.bool_]:
        if not len(self._keys):
            return np.zeros(len(keys), np.bool_)
        at = np.minimum(np.searchsorted(self._keys, keys), len(self._keys) - 1)
        return np.asarray(self._keys[at] == keys)

    def _take(self, lines: NDArray[np.int32], keys: NDArray[np.uint64]) -> None:
        """Append lines that are new, in the order in which they stand; one that comes twice is taken once."""
        unseen, first = np.unique(keys, return_index=True)
        order = np.argsort(first)
        places = np.empty(len(unseen), np.int64)
        places[order] = len(self._keys) + np.arange(len(unseen))
        self._tables.append(lines[first[order]])
        at = np.searchsorted(self._keys, unseen)
        self._places = np.insert(self._places, at, places)
        self._keys = np.insert(self._keys, at, unseen)


def _keys(lines: NDArray[np.int32]) -> NDArray[np.uint64]:
    spread = lines.astype(np.int64).astype(np.uint64) * FACTORS
    mixed = (spread ^ (spread >> np.uint64(29))) * FACTORS[::-1]
    return np.asarray(np.bitwise_xor.reduce(mixed ^ (mixed >> np.uint64(32)), axis=1))
