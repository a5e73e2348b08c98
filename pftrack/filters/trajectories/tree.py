"""The tree of a track's positions; only those with descendants are kept.

These functions are parts of the compiled loop of `cloud`, which checks all sizes; they check none.

A tree under construction is three arrays with room for all tracks, and a cursor: positions, indices of parents, numbers
of descendants. The nodes of an age are contiguous.
"""

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Floats, Ints
from pftrack.core.numerics.compiled import compiled
from pftrack.filters.resampling import systematic_parents

Tree: TypeAlias = tuple[NDArray[np.float32], NDArray[np.uint16], NDArray[np.uint16]]


@compiled
def sample_positions(mean: Floats, covariance: Floats, normals: Floats) -> tuple[Floats, Floats]:
    """Return positions in a frame (n, 2) and in the one before (n, 2), px, drawn from a Gaussian.

    Args:
        mean: (2, 2) of both, by axis, px.
        covariance: (3,) of either axis: variance, covariance and variance, px^2.
        normals: (4 n,) numbers.
    """
    count = normals.shape[0] // 4
    here, there = np.empty((count, 2)), np.empty((count, 2))
    own = np.sqrt(max(covariance[0], 0.0))
    slope = covariance[1] / own if own > 0.0 else 0.0
    rest = np.sqrt(max(covariance[2] - slope * slope, 0.0))
    for axis in range(2):
        for n in range(count):
            first, second = normals[2 * axis * count + n], normals[(2 * axis + 1) * count + n]
            here[n, axis] = mean[axis, 0] + own * first
            there[n, axis] = mean[axis, 1] + slope * first + rest * second
    return here, there


@compiled
def came_from(counts: NDArray[np.uint16], count: int) -> Ints:
    """Return the node of each of `count` particles (count,), given the number of particles of each node (n,)."""
    standing = np.empty(counts.shape[0])
    total = 0
    for node in range(counts.shape[0]):
        standing[node] = counts[node]
        total += counts[node]
    if total != count:
        return systematic_parents(standing, 0.5, count)
    own = np.empty(count, np.int64)
    n = 0
    for node in range(counts.shape[0]):
        for _ in range(counts[node]):
            own[n] = node
            n += 1
    return own


@compiled
def positions_of(
    own: Ints, row: Ints, nodes: NDArray[np.float32], parents: NDArray[np.uint16]
) -> tuple[Floats, Floats]:
    """Return the particles' positions in the last frame (n, 2) and in the one before (n, 2), px.

    Args:
        own: (n,) node of the newest age from which each comes.
        row: Offsets of the track's ages.
        nodes: Nodes of all tracks.
        parents: Their parents.
    """
    count = own.shape[0]
    at, earlier = np.empty((count, 2)), np.empty((count, 2))
    for n in range(count):
        node = row[0] + own[n]
        parent = row[1] + parents[node]
        for axis in range(2):
            at[n, axis], earlier[n, axis] = nodes[node, axis], nodes[parent, axis]
    return at, earlier


@compiled
def sprout(chosen: Ints, here: Floats, own: Ints, tree: Tree, cursor: int) -> int:
    """Add the newest age: the particles that were drawn, each once; return where the tree ends now.

    Args:
        chosen: (n,) numbers of the particles drawn, ascending.
        here: (2, n) positions of all particles, px.
        own: (n,) nodes that they come from.
        tree: Tree under construction.
        cursor: Its end.
    """
    nodes, parents, counts = tree
    last = np.int64(-1)
    for particle in chosen:
        if particle == last:
            counts[cursor - 1] += np.uint16(1)
            continue
        nodes[cursor, 0], nodes[cursor, 1] = here[0, particle], here[1, particle]
        parents[cursor], counts[cursor] = own[particle], 1
        cursor += 1
        last = particle
    return cursor


@compiled
def copy(chosen: Ints, values: Floats, target: NDArray[np.float32], cursor: int) -> int:
    """Write values (2, n) of the particles that were drawn, each once; return where they end."""
    last = np.int64(-1)
    for particle in chosen:
        if particle != last:
            target[cursor, 0], target[cursor, 1] = values[0, particle], values[1, particle]
            cursor += 1
            last = particle
    return cursor


@compiled
def _prune(nodes: NDArray[np.float32], parents: NDArray[np.uint16], tree: Tree, begin: int, cursor: int) -> int:
    """Add the nodes of an age that have descendants; return where the tree ends now.

    Args:
        nodes: (n, 2) of that age, px; none where the tree did not reach so far back.
        parents: (n,) of these.
        tree: Tree under construction, up to the age after that.
        begin: Index at which that age begins; the indices of its parents become those of the added nodes.
        cursor: End of the tree.
    """
    new_nodes, new_parents, counts = tree
    count, end = nodes.shape[0], cursor
    if count == 0:
        return cursor
    standing, renamed = np.zeros(count, np.int64), np.zeros(count, np.uint16)
    for child in range(begin, end):
        standing[new_parents[child]] += counts[child]
    for node in range(count):
        if standing[node] > 0:
            renamed[node] = cursor - end
            new_nodes[cursor, 0], new_nodes[cursor, 1] = nodes[node, 0], nodes[node, 1]
            new_parents[cursor], counts[cursor] = parents[node], standing[node]
            cursor += 1
    for child in range(begin, end):
        new_parents[child] = renamed[new_parents[child]]
    return cursor


@compiled
def grow(
    nodes: NDArray[np.float32],
    parents: NDArray[np.uint16],
    row: Ints,
    tree: Tree,
    new_row: Ints,
) -> int:
    """Add all older ages of a track, as far as they fit; return the new end of the tree.

    Args:
        nodes: Nodes of the frame before.
        parents: Their parents.
        row: Offsets of the track's ages among them.
        tree: Tree under construction, up to the newest age.
        new_row: Offsets of the track's ages in it. The first two are given; the function fills in the others.
    """
    cursor = int(new_row[1])
    for age in range(1, new_row.shape[0] - 1):
        first, last = (row[age - 1], row[age]) if age < row.shape[0] else (0, 0)
        cursor = _prune(nodes[first:last], parents[first:last], tree, new_row[age - 1], cursor)
        new_row[age + 1] = cursor
    return cursor
