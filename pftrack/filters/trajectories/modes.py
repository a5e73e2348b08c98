"""What a cloud of particles comes to: the mode of a histogram, refined by the mean about it, or the mean.

The histogram has bins of 1 px that begin at whole numbers; the mean is of the particles in the 3 x 3 bins around the
fullest. A jump of the measurement makes the distribution bimodal, where a mean is at neither place.
"""

import numpy as np
from numpy.typing import NDArray

from pftrack.core.numerics.compiled import compiled

__all__ = ["LOG_BIN", "locate", "logs_mode"]

LOG_BIN = 0.25
"""Width of a bin of a logarithm."""

NEIGHBOURS = 1


@compiled
def locate(nodes: NDArray[np.float32], counts: NDArray[np.uint16], by_mode: bool) -> tuple[float, float]:
    """Return where nodes (n, 2), px, of `counts` (n,) particles each come to; of equally full bins the first counts."""
    count = nodes.shape[0]
    bins = np.zeros((count, 2), np.int64)
    top_x, top_y = np.int64(0), np.int64(0)
    if by_mode:
        for n in range(count):
            bins[n, 0], bins[n, 1] = np.int64(np.floor(nodes[n, 0])), np.int64(np.floor(nodes[n, 1]))
        top_x, top_y = bins[_fullest(bins, counts)]
    whole, sum_x, sum_y = 0.0, 0.0, 0.0
    for n in range(count):
        if abs(bins[n, 0] - top_x) <= NEIGHBOURS and abs(bins[n, 1] - top_y) <= NEIGHBOURS:
            whole += counts[n]
            sum_x += counts[n] * float(nodes[n, 0])
            sum_y += counts[n] * float(nodes[n, 1])
    return sum_x / whole, sum_y / whole


@compiled
def _fullest(bins: NDArray[np.int64], counts: NDArray[np.uint16]) -> int:
    """Return the number of the first node that lies in the fullest bin, given each node's bin (n, 2)."""
    count, size = bins.shape[0], 16
    while size < 2 * count:
        size *= 2
    # A table of the first node of each bin, by a hash of the bin.
    slots, held = np.full(size, -1, np.int32), np.zeros(count, np.int64)
    for n in range(count):
        slot = (bins[n, 0] * 73856093 ^ bins[n, 1] * 19349663) & (size - 1)
        while slots[slot] >= 0 and (bins[slots[slot], 0] != bins[n, 0] or bins[slots[slot], 1] != bins[n, 1]):
            slot = (slot + 1) & (size - 1)
        if slots[slot] < 0:
            slots[slot] = n
        held[slots[slot]] += counts[n]
    return int(np.argmax(held))


def logs_mode(logs: NDArray[np.float64], weights: NDArray[np.float64]) -> float:
    """Return the mode of logarithms (n,) with weights (n,): the mean in three bins of 0.25 around the fullest."""
    bins = np.floor(logs / LOG_BIN).astype(np.int64)
    bins -= bins.min()
    top = int(np.argmax(np.bincount(bins, weights)))
    near = np.abs(bins - top) <= NEIGHBOURS
    return float((logs[near] * weights[near]).sum() / weights[near].sum())
