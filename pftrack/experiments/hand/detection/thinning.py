"""Skeletons: a silhouette thinned to lines one pixel wide, and the lines that end freely.

Thinning is that of Guo and Hall (1989): from two sides in turn, pixels are taken off the edge as long as what is left
stays connected and keeps its ends. Whether a pixel may go depends on its eight neighbours alone, so that it is looked
up in a table. Only whole numbers are involved.

A rough edge makes short side lines. The distance transform says which of them mean something: it holds for each pixel
of the skeleton the radius of the largest disc around it that lies within the silhouette. What a side line adds to the
disc of the place that it leaves is all that would be lost without it; where that is little it is taken away, the
least first.
"""

import numpy as np
from numpy.typing import NDArray

from pftrack.core.numerics.compiled import compiled

__all__ = ["free_lines", "skeleton"]

LEAST_SHARE = 0.33
"""What a line adds at least, in radii of the disc that it leaves."""

ACROSS, DOWN = np.array([0, 1, 1, 1, 0, -1, -1, -1]), np.array([-1, -1, 0, 1, 1, 1, 0, -1])
"""The eight neighbours, from the one above round by the right."""


def _removable() -> NDArray[np.uint8]:
    """Return (256,) which of the two passes may remove a pixel with these neighbours: bit 0 the first, 1 the second."""
    table = np.zeros(256, np.uint8)
    for code in range(256):
        n, ne, e, se, s, sw, w, nw = (bool(code >> bit & 1) for bit in range(8))
        parts = (not n and (ne or e)) + (not e and (se or s)) + (not s and (sw or w)) + (not w and (nw or n))
        sides = min((nw or n) + (ne or e) + (se or s) + (sw or w), (n or ne) + (e or se) + (s or sw) + (w or nw))
        if parts == 1 and 2 <= sides <= 3:
            table[code] |= not ((s or sw or not nw) and w)
            table[code] |= 2 * (not ((n or ne or not se) and e))
    return table


REMOVABLE = _removable()
CHANGES = np.array([((code & ~(code << 1 | code >> 7)) & 255).bit_count() for code in range(256)])
"""(256,) how many separate groups the neighbours form: 1 at the end of a line, 2 on it, 3 and more where lines meet."""
NEIGHBOURS = np.array([code.bit_count() for code in range(256)])


@compiled
def skeleton(mask: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return the skeleton (height, width), 0 or 1, of a mask whose outermost pixels are 0.

    Args:
        mask: (height, width), anything but 0 is inside.
    """
    height, width = mask.shape
    thin = np.zeros((height, width), np.uint8)
    places = np.empty(height * width, np.int64)
    count = 0
    for row in range(1, height - 1):
        for column in range(1, width - 1):
            if mask[row, column] != 0:
                thin[row, column] = 1
                places[count] = row * width + column
                count += 1
    flat = thin.ravel()
    steps = DOWN * width + ACROSS
    gone = np.empty(count, np.int64)
    idle, turn = 0, 0
    while idle < 2:
        removed, kept = 0, 0
        for i in range(count):
            place = places[i]
            code = 0
            for bit in range(8):
                code |= int(flat[place + steps[bit]]) << bit
            if REMOVABLE[code] >> turn & 1:
                gone[removed] = place
                removed += 1
            else:
                places[kept] = place
                kept += 1
        for i in range(removed):
            flat[gone[i]] = 0
        count, turn = kept, 1 - turn
        idle = 0 if removed else idle + 1
    return thin


@compiled
def free_lines(
    thin: NDArray[np.uint8], radii: NDArray[np.float32], least: float
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the lines of a skeleton from each free end to where it meets others, without those that mean nothing.

    Args:
        thin: (height, width) 0 or 1; meaningless lines are taken away in place.
        radii: (height, width) distance of each pixel inside from the edge, px.
        least: How much a line adds at least to the disc of the place that it leaves, px; what adds less, or less than a
            third of the disc's radius, means nothing.

    Returns:
        The pixels (n, 2), column and row, of all lines one after another, each from its end; and where each line begins
        and the last one ends, (lines + 1,).
    """
    most = np.count_nonzero(thin)
    found, begins = np.empty((2 * most + 2, 2), np.int64), np.empty(most + 2, np.int64)
    while True:
        lines = _lines(thin, found, begins)
        worst, worst_gain = -1, 0.0
        for line in range(lines):
            first, last = begins[line], begins[line + 1] - 1
            column, row = found[last, 0], found[last, 1]
            if NEIGHBOURS[_code(thin, row, column)] < 2:  # another free end: the line is all there is
                continue
            x, y = float(column - found[first, 0]), float(row - found[first, 1])
            gain = np.sqrt(x * x + y * y) + radii[found[first, 1], found[first, 0]] - radii[row, column]
            gain -= max(least, LEAST_SHARE * radii[row, column])
            if gain < worst_gain:
                worst, worst_gain = line, gain
        if worst < 0:
            return found[: begins[lines]], begins[: lines + 1]
        _remove(thin, found[begins[worst] : begins[worst + 1]])


@compiled
def _lines(thin: NDArray[np.uint8], found: NDArray[np.int64], begins: NDArray[np.int64]) -> int:
    """Write the pixels of all lines from their free ends on, and where each begins; return how many there are."""
    size, lines = 0, 0
    begins[0] = 0
    for row in range(1, thin.shape[0] - 1):
        for column in range(1, thin.shape[1] - 1):
            if thin[row, column] != 0 and CHANGES[_code(thin, row, column)] < 2:
                size += _follow(thin, row, column, found[size:])
                lines += 1
                begins[lines] = size
    return lines


@compiled
def _remove(thin: NDArray[np.uint8], line: NDArray[np.int64]) -> None:
    """Take a line (n, 2) away, but for its last pixel, and corners there that the rest does not need."""
    last = line.shape[0] - 1
    for i in range(last):
        thin[line[i, 1], line[i, 0]] = 0
    for row in range(line[last, 1] - 1, line[last, 1] + 2):
        for column in range(line[last, 0] - 1, line[last, 0] + 2):
            if thin[row, column] != 0 and REMOVABLE[_code(thin, row, column)]:
                thin[row, column] = 0


@compiled
def _code(thin: NDArray[np.uint8], row: int, column: int) -> int:
    """Return which neighbours of a pixel are set, as bits."""
    code = 0
    for bit in range(8):
        code |= int(thin[row + DOWN[bit], column + ACROSS[bit]]) << bit
    return code


@compiled
def _follow(thin: NDArray[np.uint8], row: int, column: int, found: NDArray[np.int64]) -> int:
    """Write the pixels of a line from its end to where it meets others, or to its other end; return how many."""
    length, before_row, before_column = 0, -1, -1
    while length < found.shape[0]:
        found[length, 0], found[length, 1] = column, row
        length += 1
        if length > 1 and CHANGES[_code(thin, row, column)] != 2:
            break
        # Straight neighbours first, so that a corner is followed and not cut; not back to where the line came from.
        next_row, next_column = -1, -1
        for bit in (0, 2, 4, 6, 1, 3, 5, 7):
            r, c = row + DOWN[bit], column + ACROSS[bit]
            if thin[r, c] != 0 and (length < 2 or max(abs(r - before_row), abs(c - before_column)) > 1):
                next_row, next_column = r, c
                break
        if next_row < 0:
            break
        before_row, before_column, row, column = row, column, next_row, next_column
    return length
