"""Genealogies: from which particles of earlier frames the present ones descend.

Each resampling lets some particles have many children and others none, so the further one looks back, the fewer
ancestors the present generation has, until all descend from one: there their lines coalesce, and the cloud knows
nothing of the past but one path (Kitagawa 1996; Jacob, Murray, Rubenthaler 2015, "Path storage in the particle
filter"). How soon that happens is impoverishment, made visible.

A particle that is drawn without a parent, as from an observation or by another tracker, begins a line of its own: its
parent is -1, and so is its ancestor in all frames before.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

__all__ = ["Genealogy", "count_descendants", "trace"]


@dataclass(frozen=True)
class Genealogy:
    """The ancestors of N particles over L frames.

    Attributes:
        last: The frame of the present generation.
        places: (L, N) for each frame, the oldest first, which of its particles the ancestor of each present one is, -1
            before its line began; the last row counts the present ones themselves.
    """

    last: int
    places: NDArray[np.int64]

    @property
    def frames(self) -> range:
        """The frames, the oldest first."""
        return range(self.last + 1 - len(self.places), self.last + 1)

    @cached_property
    def counts(self) -> NDArray[np.int64]:
        """(L,) how many different ancestors the present generation has in each frame."""
        return np.array([len(np.unique(row[row >= 0])) for row in self.places], np.int64)

    @property
    def coalesced(self) -> int | None:
        """The newest frame in which one particle is the ancestor of all; None if they do not go back so far."""
        alone = np.flatnonzero((self.counts == 1) & (self.places >= 0).all(axis=1))
        return None if not len(alone) or len(self.places[0]) == 1 else self.frames[int(alone[-1])]

    @cached_property
    def heights(self) -> NDArray[np.float64]:
        """(L, N) where the line of each particle is drawn in each frame, 0..1, so that lines meet and never cross.

        NaN before it began. The present ones are in the order of their ancestors, equally far apart; an ancestor is in
        the middle of those that descend from it.
        """
        length, count = self.places.shape
        rows = np.empty(count)
        rows[np.lexsort(self.places[::-1])] = (np.arange(count) + 0.5) / count
        heights = np.empty((length, count))
        for row, places in zip(heights, self.places, strict=True):
            _, families = np.unique(places, return_inverse=True)
            row[:] = (np.bincount(families, rows) / np.bincount(families))[families]
            row[places < 0] = np.nan
        return heights

    def lines(self, most: int) -> NDArray[np.float64]:
        """Return the heights (L, K) of at most so many of the lines, evenly chosen from the lowest to the highest."""
        count = self.places.shape[1]
        chosen = np.argsort(self.heights[-1], kind="stable")
        return self.heights[:, chosen[:: -(-count // most)]]


def trace(last: int, ancestors: Sequence[NDArray[np.int64]], count: int, among: slice = slice(None)) -> Genealogy:
    """Trace particles back.

    Args:
        last: The frame of the present generation.
        ancestors: (N_t,) of the frames that end with it, the oldest first: the place of each particle's parent in the
            frame before, -1 without one. It is followed no further back than to where the oldest line begins.
        count: How many present particles there are.
        among: Which of the present particles are traced, as those of one of several filters; all if not given.

    Raises:
        ValueError: The last frame has another number of particles.
    """
    if ancestors and len(ancestors[-1]) != count:
        raise ValueError(f"expected the parents of {count} particles, got {len(ancestors[-1])}")
    rows = [np.arange(count)[among]]
    for parents in reversed(ancestors):
        before = np.append(parents, -1)[rows[-1]]
        if (before < 0).all():
            break
        rows.append(before)
    return Genealogy(last, np.stack(rows[::-1]).astype(np.int64))


def count_descendants(particle: int, ancestors: Sequence[NDArray[np.int64]]) -> list[int]:
    """Return how many particles of each further frame descend from one.

    Args:
        particle: Its place.
        ancestors: (N_t,) of the frames after it, in order.
    """
    counts, family = [], np.array([particle])
    for parents in ancestors:
        family = np.flatnonzero(np.isin(parents, family))
        counts.append(len(family))
    return counts
