"""Which feasible cells belong together: runs of neighbours in a grid of any dimension.

Two cells are neighbours if they touch, at a corner at least: 2 in one dimension, 80 in four. What is apart in the grid
is apart in the world too, so each run may become a region of its own.
"""

import numpy as np
from numpy.typing import NDArray

from pftrack.core.numerics.compiled import compiled

__all__ = ["label_components"]


@compiled
def label_components(feasible: NDArray[np.bool_], sizes: NDArray[np.int64]) -> tuple[NDArray[np.int64], int]:
    """Return the number (N,) of the run that each feasible cell is in, -1 for others, and how many runs there are.

    Args:
        feasible: (N,) cells, the last axis together.
        sizes: (d,) of the grid, N their product.
    """
    dimension, count = sizes.shape[0], feasible.shape[0]
    labels, stack = np.empty(count, np.int64), np.empty(count, np.int64)
    place, step = np.empty(dimension, np.int64), np.empty(dimension, np.int64)
    runs, left = 0, 0
    for cell in range(count):
        labels[cell] = -1
        left += feasible[cell]
    for begin in range(count):
        if not feasible[begin] or labels[begin] >= 0:
            continue
        labels[begin] = runs
        left -= 1
        stack[0] = begin
        waiting = 1
        # Once every cell has its number, nobody needs to be asked for neighbours any more.
        while waiting > 0 and left > 0:
            waiting -= 1
            rest = stack[waiting]
            for axis in range(dimension - 1, -1, -1):
                place[axis] = rest % sizes[axis]
                rest //= sizes[axis]
                step[axis] = -1
            more = True
            while more:
                other, inside = 0, True
                for axis in range(dimension):
                    moved = place[axis] + step[axis]
                    inside = inside and 0 <= moved < sizes[axis]
                    other = other * sizes[axis] + moved
                if inside and feasible[other] and labels[other] < 0:
                    labels[other] = runs
                    left -= 1
                    stack[waiting] = other
                    waiting += 1
                more = _increment(step)
        runs += 1
    return labels, runs


@compiled
def _increment(step: NDArray[np.int64]) -> bool:
    """Count up digits of -1, 0 and 1, in place; return whether there was a next number."""
    axis = step.shape[0] - 1
    while axis >= 0 and step[axis] == 1:
        step[axis] = -1
        axis -= 1
    if axis >= 0:
        step[axis] += 1
    return bool(axis >= 0)
