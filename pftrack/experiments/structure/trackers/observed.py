"""What every method may go back to: the last frames of the tracks, and what counts of all of them for the plain one.

So a method that takes over in mid-run begins with what the others have seen.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pftrack.vision.structure.accumulated import Accumulated, accumulate, empty

__all__ = ["LONGEST", "Observed", "begin", "take"]

LONGEST = 180
"""How many frames are kept at most."""


@dataclass(frozen=True, eq=False)
class Observed:
    """The frames so far.

    Attributes:
        positions: (W, n, 2) px from the principal point; 0 where the variance is infinite.
        told: (W, n, 2) px^2, infinite where a point was not measured.
        variances: (W, n, 2) px^2, the same over how likely each measurement is right.
        filled: (W, n, 2) px, a point that was not measured where it was last.
        everything: The same of all frames, as the plain factorization needs it.
        frames: How many there were.
        counts: (n,) in how many frames each point was measured.
    """

    positions: NDArray[np.float64]
    told: NDArray[np.float64]
    variances: NDArray[np.float64]
    filled: NDArray[np.float64]
    everything: Accumulated
    frames: int
    counts: NDArray[np.int64]

    @property
    def nbytes(self) -> int:
        """How much memory it takes."""
        arrays = self.positions, self.told, self.variances, self.filled, self.everything.gram, self.counts
        return sum(array.nbytes for array in arrays)


def begin(count: int) -> Observed:
    """Return what is known before the first frame of `count` points."""
    nothing = np.zeros((0, count, 2))
    return Observed(nothing, nothing, nothing, nothing, empty(count), 0, np.zeros(count, np.int64))


def take(seen: Observed, positions: NDArray[np.float64], variances: NDArray[np.float64]) -> Observed:
    """Return what is known after a further frame.

    Args:
        seen: Before.
        positions: (n, 2) px; anything where the variance is infinite.
        variances: (n, 2) px^2.
    """
    measured = np.isfinite(variances)
    known = np.where(measured, positions, 0.0)
    # A point that was never measured is in the middle of the others.
    middle = known.sum(axis=0) / np.maximum(measured.sum(axis=0), 1)
    before = seen.filled[-1] if seen.frames else np.broadcast_to(middle, positions.shape)
    filled = np.where(measured, positions, before)
    return Observed(
        _append(seen.positions, known),
        _append(seen.told, variances),
        _append(seen.variances, variances),
        _append(seen.filled, filled),
        accumulate(seen.everything, filled),
        seen.frames + 1,
        seen.counts + measured.all(axis=1),
    )


def _append(rows: NDArray[np.float64], row: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.concatenate([rows[max(0, len(rows) + 1 - LONGEST) :], row[None]])
