"""Which true target each number of a tracker stands for, frame by frame, and where that changes.

As CLEAR MOT has it (Bernardin and Stiefelhagen 2008): a pair of the frame before stays together as long as its boxes
overlap by half; what is left is paired, the greatest overlap first (they take the greatest sum, which differs only
where three boxes overlap each other by half). A true target that comes by another number than
the last one it had is an identity switch. Where there are no boxes, the distance of positions stands for the overlap.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.belief import Belief

__all__ = ["LEAST_OVERLAP", "Identities", "overlap", "pair_up"]

LEAST_OVERLAP = 0.5


def overlap(one: NDArray[np.float64], other: NDArray[np.float64]) -> float:
    """Return the intersection over the union of two boxes (x, y, w, h)."""
    low, high = np.maximum(one[:2], other[:2]), np.minimum(one[:2] + one[2:], other[:2] + other[2:])
    shared = float(np.maximum(high - low, 0.0).prod())
    return shared / float(one[2:].prod() + other[2:].prod() - shared)


@dataclass(frozen=True, slots=True)
class Identities:
    """What became of the numbers.

    Attributes:
        pairs: For each frame of which both something is believed and true, the true target of each number.
        switches: How many true targets have another number than before, by frame.
        first: The true target that each number stood for first.
    """

    pairs: Mapping[int, Mapping[int, int]]
    switches: Mapping[int, int]
    first: Mapping[int, int]


def pair_up(frames: Sequence[tuple[int, Sequence[Belief], Sequence[Belief]]]) -> Identities:
    """Pair numbers with true targets through all frames.

    Args:
        frames: Number of the frame, what is believed of its targets, and what is true; by ascending number.
    """
    pairs: dict[int, dict[int, int]] = {}
    switches: dict[int, int] = {}
    first: dict[int, int] = {}
    before: dict[int, int] = {}  # of each true target, the number that it had last
    last: dict[int, int] = {}  # pairs of the frame before
    for frame, beliefs, truths in frames:
        gains = np.array([[_likeness(one, true) for true in truths] for one in beliefs])
        gains = gains.reshape(len(beliefs), len(truths))
        numbers, trues = [one.target for one in beliefs], [true.target for true in truths]
        found = {
            number: true
            for number, true in last.items()
            if number in numbers and true in trues and gains[numbers.index(number), trues.index(true)] >= LEAST_OVERLAP
        }
        rows = [place for place, number in enumerate(numbers) if number not in found]
        columns = [place for place, true in enumerate(trues) if true not in found.values()]
        ranked = sorted((-float(gains[row, column]), row, column) for row in rows for column in columns)
        for loss, row, column in ranked:
            if -loss >= LEAST_OVERLAP and numbers[row] not in found and trues[column] not in found.values():
                found[numbers[row]] = trues[column]
        changed = sum(before.get(true, number) != number for number, true in found.items())
        if changed:
            switches[frame] = changed
        for number, true in found.items():
            before[true] = number
            first.setdefault(number, true)
        pairs[frame] = last = found
    return Identities(pairs, switches, first)


def _likeness(one: Belief, true: Belief) -> float:
    """Return how well a belief covers a truth, 0 to 1; with positions alone there is nothing but the one target."""
    if one.box is not None and true.box is not None:
        return overlap(one.box, true.box)
    return float(one.target == true.target)
