"""Templates in relief: what a feature looked like at first sight, bent with the surface that it lies on as that turns.

A flat template (`template`) knows a feature as it was seen from the front. Of a face that is turned by 30 degrees it
sees half: on simulated drivers the correlation of the tip of the nose falls to 0.4 there, and what correlates best is
25 px beside it. Here every pixel of a template is a point of the object, with the grey level of first sight and the
normal of the surface there. Where the object is expected to stand next says which way these points are seen from the
feature, how far apart, and which of them turn away; then the picture is compared at those places alone. So a template
is also as large as the object is near, and as rolled as it is.

A template of a thousand pixels is thinned to a few hundred points, and it is bent once a frame rather than once a
particle. Eleven features with fifty particles each take less time than with flat templates.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pftrack.compiled import compiled

__all__ = ["Reliefs", "Views", "correlations", "seen"]

LEAST_FACING = 0.2
"""Cosine between the surface's normal and the line of sight from which a point is seen."""

LEAST_SEEN = 0.25
"""Share of a template's points that must be seen."""

LEAST_VARIANCE = 0.5
"""In squared grey levels; what has less is a flat patch."""


@dataclass(frozen=True, slots=True, eq=False)
class Reliefs:
    """One template a feature, each a cloud of points on a surface.

    Attributes:
        points_mm: (P, 3) of all features one after another, each relative to its feature, in the object's frame.
        normals: (P, 3) unit normals of the surface there, outwards.
        levels: (P,) grey levels at first sight.
        ends: (F + 1,) where each feature's points begin, and the last one's end.
    """

    points_mm: NDArray[np.float64]
    normals: NDArray[np.float64]
    levels: NDArray[np.float64]
    ends: NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class Views:
    """Templates as they should look in one frame.

    Attributes:
        offsets: (P, 2) columns and rows from the feature's pixel to those of its points.
        levels: (P,) of those that are seen, less their mean and of unit norm by feature; the others are 0.
        ends: (F + 1,) where each feature's points begin, with only the seen ones kept.
    """

    offsets: NDArray[np.int64]
    levels: NDArray[np.float64]
    ends: NDArray[np.int64]


def seen(reliefs: Reliefs, slopes: NDArray[np.float64]) -> Views:
    """Return what templates look like to a camera that is affine about each feature.

    Args:
        reliefs: The templates.
        slopes: (F, 2, 3) by how many px a mm of the object's frame moves a point beside each feature.
    """
    return Views(*_seen(reliefs.points_mm, reliefs.normals, reliefs.levels, reliefs.ends, np.ascontiguousarray(slopes)))


def correlations(grey: NDArray[np.uint8], positions: NDArray[np.float64], views: Views) -> NDArray[np.float64]:
    """Return the correlation (F, N), -1..1, of every feature's template with the picture at its particles.

    Args:
        grey: (height, width).
        positions: (F, N, 2) px; not finite ones count as outside the picture.
        views: One a feature; one of which too little is seen correlates with nothing, 0 everywhere.
    """
    return _correlations(grey, np.ascontiguousarray(positions), views.offsets, views.levels, views.ends)


@compiled
def _seen(
    points_mm: NDArray[np.float64],
    normals: NDArray[np.float64],
    levels: NDArray[np.float64],
    ends: NDArray[np.int64],
    slopes: NDArray[np.float64],
) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.int64]]:
    features = len(ends) - 1
    offsets, kept = np.empty((len(levels), 2), np.int64), np.empty(len(levels))
    kept_ends = np.zeros(features + 1, np.int64)
    count = 0
    for n in range(features):
        across, down = slopes[n, 0], slopes[n, 1]
        x = across[1] * down[2] - across[2] * down[1]
        y = across[2] * down[0] - across[0] * down[2]
        z = across[0] * down[1] - across[1] * down[0]
        length = np.sqrt(x * x + y * y + z * z)
        first, total = count, 0.0
        for p in range(ends[n], ends[n + 1]):
            facing = -(normals[p, 0] * x + normals[p, 1] * y + normals[p, 2] * z)
            if facing < LEAST_FACING * length:
                continue
            for axis in range(2):
                off = 0.0
                for i in range(3):
                    off += slopes[n, axis, i] * points_mm[p, i]
                offsets[count, axis] = int(np.floor(off + 0.5))
            kept[count] = levels[p]
            total += levels[p]
            count += 1
        if count - first < LEAST_SEEN * (ends[n + 1] - ends[n]):
            count = first
        squares, mean = 0.0, total / max(count - first, 1)
        for p in range(first, count):
            kept[p] -= mean
            squares += kept[p] * kept[p]
        if squares < LEAST_VARIANCE * (count - first):
            count = first
        for p in range(first, count):
            kept[p] /= np.sqrt(squares)
        kept_ends[n + 1] = count
    return offsets[:count].copy(), kept[:count].copy(), kept_ends


@compiled
def _correlations(
    grey: NDArray[np.uint8],
    positions: NDArray[np.float64],
    offsets: NDArray[np.int64],
    levels: NDArray[np.float64],
    ends: NDArray[np.int64],
) -> NDArray[np.float64]:
    features, count, _ = positions.shape
    height, width = grey.shape
    flat = grey.ravel()
    results = np.zeros((features, count))
    steps = np.empty(len(levels), np.int64)
    for n in range(features):
        begin, end = ends[n], ends[n + 1]
        if begin == end:
            continue
        left = right = offsets[begin, 0]
        top = bottom = offsets[begin, 1]
        for p in range(begin, end):
            column, row = offsets[p, 0], offsets[p, 1]
            left, right, top, bottom = min(left, column), max(right, column), min(top, row), max(bottom, row)
            steps[p] = row * width + column
        for i in range(count):
            x, y = np.floor(positions[n, i, 0] + 0.5), np.floor(positions[n, i, 1] + 0.5)
            if not (x + left >= 0 and x + right < width and y + top >= 0 and y + bottom < height):
                results[n, i] = -1.0
                continue
            place = int(y) * width + int(x)
            total, squares, product = np.int64(0), np.int64(0), 0.0
            for p in range(begin, end):
                level = np.int64(flat[place + steps[p]])
                total = np.int64(total + level)
                squares = np.int64(squares + level * level)
                product += level * levels[p]
            power = squares - total * (total / (end - begin))
            if power > LEAST_VARIANCE * (end - begin):
                results[n, i] = min(max(product / np.sqrt(power), -1.0), 1.0)
            else:
                results[n, i] = -1.0
    return results
