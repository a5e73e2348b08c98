"""What a measure may be of a right hand whose candidate stands on a grid (Shimada 1997, section 2.6.4).

A candidate stands for a cell of poses: half a step of every angle to either side. If the true pose lies anywhere in
the cell and the model is right, a measure x_n of the candidate is not 0 but some x_n*, which depends on where in the
cell the pose is. The likelihood is the mean over the cell of a Gaussian around that (eqs. 2.8 and 2.9), relative to its
peak:

    p(x_n) = mean over the cell of exp(-(x_n - x_n*)^2 / (2 sigma_n^2)).

The width of an observation (eq. 2.10) is the same for all hands, and drops out. The mean is a sum over a lattice of
points in the five angles that move a finger: a, b and c of the palm, its spread and its flexion. Where tip and joints
go if one of them changes by half a step comes from the model; in between, they go evenly.
"""

import numpy as np
from numpy.typing import NDArray

from pftrack.core.numerics.compiled import compiled, read_only
from pftrack.experiments.hand.shape import palm_axes
from pftrack.filters.particles import normalise

__all__ = ["CELL_ANGLES", "NODES", "axis_distances", "cell_log_fit", "displacements", "farthest", "tip_distances"]

CELL_ANGLES = 5
"""Of a cell: the palm's a, b and c, a finger's spread and flexion."""

SHORTEST = 1e-9
"""Segment that has a direction, px."""

_COUNT, _GENERATOR = 47, (1, 10, 6, 13, 36)
NODES = read_only(2.0 * np.remainder(np.outer(np.arange(_COUNT) + 0.5, _GENERATOR) / _COUNT, 1.0) - 1.0)
"""(n, 5) points of a cell, in half steps: a lattice of rank one."""


@compiled
def cell_log_fit(square: float, ideals: NDArray[np.float64], sd: float) -> float:
    """Return the log of the mean Gaussian of a measure over a cell, relative to its peak; never above 0 (eq. 2.9).

    Args:
        square: Of the measure x_n, which is not negative.
        ideals: (n,) what it may be of a right hand, x_n*; empty if the hand stands for no cell but for itself.
        sd: sigma_n.
    """
    if ideals.shape[0] == 0:
        return -0.5 * square / (sd * sd)
    measure = np.sqrt(square)
    logs = np.empty(ideals.shape[0])
    for n in range(ideals.shape[0]):
        off = (measure - ideals[n]) / sd
        logs[n] = -0.5 * off * off
    return float(min(normalise(logs)[1] - np.log(float(ideals.shape[0])), 0.0))


@compiled
def displacements(
    pose: NDArray[np.float64],
    places: NDArray[np.float64],
    spread: NDArray[np.float64],
    flexed: NDArray[np.float64],
    halves: NDArray[np.float64],
    scale: float,
    side: float,
) -> NDArray[np.float64]:
    """Return by how much joints and tips (5, 5, 4, 2) of fingers move for half a step of each angle of a cell, px.

    The first index is the finger, the second the angle.

    Args:
        pose: (25,) of the palm.
        places: (5, 4, 3) joints and tips, px.
        spread: (5, 4, 3) the same with every finger spread by half a step.
        flexed: (5, 4, 3) the same with every finger bent by half a step.
        halves: (3,) half steps of the palm's a, b and c, rad.
        scale: Length of the palm axis, px.
        side: Of the hand.
    """
    found = np.empty((5, CELL_ANGLES, 4, 2))
    for i in range(3):
        turn = _turn(pose, i, halves[i], scale, side)
        for finger in range(5):
            for j in range(4):
                x, y = places[finger, j, 0] - pose[0], places[finger, j, 1] - pose[1]
                for k in range(2):
                    found[finger, i, j, k] = turn[k, 0] * x + turn[k, 1] * y + turn[k, 2] * places[finger, j, 2]
    for finger in range(5):
        for j in range(4):
            for k in range(2):
                found[finger, 3, j, k] = spread[finger, j, k] - places[finger, j, k]
                found[finger, 4, j, k] = flexed[finger, j, k] - places[finger, j, k]
    return found


@compiled
def _turn(pose: NDArray[np.float64], angle: int, half: float, scale: float, side: float) -> NDArray[np.float64]:
    """Return by how much places relative to the wrist move (2, 3) if a palm (25,) turns by half a step."""
    turned = pose.copy()
    turned[2 + angle] += half
    axes = palm_axes(pose, scale, side)
    change, turn = palm_axes(turned, scale, side) - axes, np.zeros((2, 3))
    for k in range(2):
        for m in range(3):
            for n in range(3):  # the axes are those of a turn, scaled: their transpose undoes it
                turn[k, m] += change[k, n] * axes[m, n] / (scale * scale)
    return turn


@compiled
def farthest(moves: NDArray[np.float64], end: int) -> float:
    """Return how far at most a joint or tip may be from its place in the cell, px; `moves` (m, 4, 2) of a finger."""
    most = 0.0
    for i in range(moves.shape[0]):
        most += np.sqrt(moves[i, end, 0] * moves[i, end, 0] + moves[i, end, 1] * moves[i, end, 1])
    return most


@compiled
def tip_distances(moves: NDArray[np.float64], end: int) -> NDArray[np.float64]:
    """Return x_ft* (n,) px, by which a joint or tip is off its place in points of the cell; none if there is no cell.

    Args:
        moves: (5, 4, 2) of one finger by `displacements`; (0, 4, 2) of a hand that stands for no cell.
        end: Number of the joint or tip.
    """
    found = np.empty(NODES.shape[0] if moves.shape[0] else 0)
    for n in range(found.shape[0]):
        x, y = 0.0, 0.0
        for i in range(moves.shape[0]):
            x += NODES[n, i] * moves[i, end, 0]
            y += NODES[n, i] * moves[i, end, 1]
        found[n] = np.sqrt(x * x + y * y)
    return found


@compiled
def axis_distances(
    moves: NDArray[np.float64], places: NDArray[np.float64], end: int, length: float
) -> NDArray[np.float64]:
    """Return x_fa* (n,) px, the mean distance of a finger's axis in points of the cell once the ends coincide.

    Args:
        moves: (5, 4, 2) of one finger by `displacements`; (0, 4, 2) of a hand that stands for no cell.
        places: (4, 2) or wider, its joints and tip, px.
        end: Number of the joint or tip at which the axis begins.
        length: Of the axis that is compared, px; it may end before the root.
    """
    found = np.zeros(NODES.shape[0] if moves.shape[0] else 0)
    for n in range(found.shape[0]):
        total, x, y, longer, left, joint = 0.0, 0.0, 0.0, 0.0, length, end
        while joint > 0 and left > 0.0:
            over, under = places[joint - 1, 0] - places[joint, 0], places[joint - 1, 1] - places[joint, 1]
            whole = max(np.sqrt(over * over + under * under), SHORTEST)
            over, under = over / whole, under / whole
            # Points at equal arc length are compared, so a point slides by as much as the axis before it is longer.
            first = np.sqrt((x - longer * over) ** 2 + (y - longer * under) ** 2)
            right, down = 0.0, 0.0
            for i in range(moves.shape[0]):
                right += NODES[n, i] * (moves[i, joint - 1, 0] - moves[i, joint, 0])
                down += NODES[n, i] * (moves[i, joint - 1, 1] - moves[i, joint, 1])
            x, y, longer = x + right, y + down, longer + right * over + down * under
            last = np.sqrt((x - longer * over) ** 2 + (y - longer * under) ** 2)
            part = min(whole, left)
            total += (first + 0.5 * (last - first) * part / whole) * part
            left, joint = left - part, joint - 1
        found[n] = total / length if length > 0.0 else 0.0
    return found
