"""Separation of a target from its surroundings by a likelihood; and templates in relief.

A tracker holds a target while its likelihood is higher there than beside it. Collins, Liu and Leordeanu ("Online
selection of discriminative tracking features", 2005) rank features by how well they separate the pixels of the target
from those of a ring around it, because features that discriminate best track best. Here the tracker's own likelihood is
examined, including its background level:

    contrast = 1 - (mean around the target) / (mean on the target),   0 if that is negative.

"On the target" is the ellipse inscribed in its box. "Around" is the region between the ellipse through the corners of
the box and one three times as large as the inscribed one, so neither the target's own corners nor far parts of the
picture count. At a contrast of 0 particles beside the target weigh as much as those on it, so nothing keeps them on the
target.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Bools, Floats, Ints, check, check_picture
from pftrack.core.numerics.compiled import compiled

Box = tuple[float, float, float, float]
"""x, y of the left top corner, width and height, px."""

INNER, OUTER = 2**0.5, 3.0
"""Sizes of the ring, in sizes of the ellipse inscribed in the box."""

ALIKE = 0.5
"""Places with at least this share of the target's mean likelihood look like it."""


@dataclass(frozen=True, slots=True)
class Separation:
    """Likelihoods of the target and its surroundings, relative to the likelihood's peak.

    Attributes:
        on: Mean on the target in the first picture.
        around: Mean around it in the first picture, or over all pictures if that is higher.
        alike: Share of the rest of the first picture, 0..1, that looks like the target.
    """

    on: float
    around: float
    alike: float

    @property
    def contrast(self) -> float:
        """Relative deficit of the surroundings' likelihood, 0..1."""
        return contrast(self.on, self.around)


def contrast(on: float, around: float) -> float:
    """Return the relative deficit of the surroundings' likelihood against the target's, 0..1."""
    return max(0.0, 1.0 - around / on) if on > 0.0 else 0.0


def separation(first: Floats, later: Iterable[Floats], box: Box) -> Separation:
    """Compare a target with its surroundings.

    The surroundings are also examined in later pictures, at the same place, since the tracker also meets what passes
    there or changes with the light. The target's later places are unknown, so only the first picture gives its
    likelihood.

    Args:
        first: (height, width) likelihood of each pixel of the first picture, 0..1.
        later: The same of later pictures.
        box: Around the target in the first picture.
    """
    target, ring = _within(first.shape, box, 1.0), _ring(first.shape, box)
    on = float(first[target].mean()) if target.any() else 0.0
    rest = ~_within(first.shape, box, OUTER)
    alike = float((first[rest] >= ALIKE * on).mean()) if rest.any() and on > 0.0 else 0.0
    if not ring.any():
        return Separation(on, 0.0, alike)
    around = [float(picture[ring].mean()) for picture in (first, *later)]
    return Separation(on, max(around[0], float(np.mean(around))), alike)


def surroundings(shape: tuple[int, ...], box: Box) -> tuple[slice, slice]:
    """Return the rows and columns that `separation` looks at around a target; none if it is far outside the picture."""
    height, width = shape[:2]
    x, y, w, h = box
    spans = ((y + h / 2, OUTER * h / 2, height), (x + w / 2, OUTER * w / 2, width))
    rows, columns = (
        slice(max(int(middle - half) - 1, 0), max(min(int(middle + half) + 2, side), 0)) for middle, half, side in spans
    )
    return rows, columns


def _within(shape: tuple[int, ...], box: Box, scale: float) -> Bools:
    """Return which pixels lie in the ellipse inscribed in the box, enlarged; the middle of a pixel counts."""
    x, y, w, h = box
    across = (np.arange(shape[1]) + 0.5 - x - w / 2) / (scale * w / 2)
    down = (np.arange(shape[0]) + 0.5 - y - h / 2) / (scale * h / 2)
    return np.asarray(across[None, :] ** 2 + down[:, None] ** 2 <= 1.0)


def _ring(shape: tuple[int, ...], box: Box) -> Bools:
    """Return which pixels are around the target; of a box that nearly fills the picture, all that are not on it."""
    outer = _within(shape, box, OUTER)
    ring = outer & ~_within(shape, box, INNER)
    return ring if ring.any() else outer & ~_within(shape, box, 1.0)


# Templates in relief show a feature at first sight, and bend with its surface as that turns. A flat template
# (`template`) shows a feature from the front. It matches only half of a face that is turned by 30 degrees: on simulated
# drivers the correlation of the tip of the nose falls to 0.4 there, and the best correlation is 25 px beside it. Here
# every pixel of a template is a point of the object, with the grey level of first sight and the normal of the surface
# there. The predicted pose of the object gives the directions and distances of these points from the feature, and shows
# which of them turn away; the picture is then compared at those places alone. So a template also follows the object's
# distance and roll.
#
# A template of a thousand pixels is thinned to a few hundred points, and it is bent once a frame rather than once a
# particle. Eleven features with fifty particles each take less time than with flat templates.

Part: TypeAlias = tuple[int, int, int, int]
"""Bounds of a picture, px: its first column and row, and those after its last."""

LEAST_FACING = 0.2
"""Least cosine between the surface's normal and the line of sight at which a point is visible."""

LEAST_SEEN = 0.25
"""Share of a template's points that must be seen."""

LEAST_VARIANCE = 0.5
"""In squared grey levels; a patch with less is flat."""


class Reliefs(NamedTuple):
    """One template a feature, each a cloud of points on a surface.

    Attributes:
        points_mm: (P, 3) of all features one after another, each relative to its feature, in the object's frame.
        normals: (P, 3) unit normals of the surface there, outwards.
        levels: (P,) grey levels at first sight.
        ends: (F + 1,) where each feature's points begin, and the last one's end.
    """

    points_mm: Floats
    normals: Floats
    levels: Floats
    ends: Ints


class Views(NamedTuple):
    """Templates as they should look in one frame.

    Attributes:
        offsets: (P, 2) columns and rows from the feature's pixel to those of its points.
        levels: (P,) levels of visible points, less their mean and with unit norm per feature; the others are 0.
        ends: (F + 1,) where each feature's points begin, with only the seen ones kept.
        extent: (4,) the least column and row of all offsets, and the greatest, including the feature's pixel.
    """

    offsets: Ints
    levels: Floats
    ends: Ints
    extent: Ints


def project_views(reliefs: Reliefs, slopes: Floats) -> Views:
    """Return what templates look like to a camera that is affine about each feature.

    Args:
        reliefs: The templates.
        slopes: (F, 2, 3) by how many px a mm of the object's frame moves a point beside each feature.

    Raises:
        TypeError: The slopes are not an array of real numbers.
        ValueError: There are not as many as templates.
    """
    check(missing=True, ends=(reliefs.ends[1:], "F"), slopes=(slopes, "F 2 3"))
    return _project_views(reliefs, np.ascontiguousarray(slopes))


def reach(positions: Floats, views: Views, shape: tuple[int, int]) -> Part:
    """Return the part of a picture of some shape (height, width) that templates at positions (F, N, 2) px can cover.

    It is empty if all of them lie outside the picture; positions that are not finite are ignored.
    """
    height, width = shape
    (left, top), (right, bottom) = positions.min(axis=(0, 1)).tolist(), positions.max(axis=(0, 1)).tolist()
    if not math.isfinite(left + top + right + bottom):
        return 0, 0, width, height
    first_column, first_row, last_column, last_row = views.extent.tolist()
    return (
        _clamp(math.floor(left + 0.5) + first_column, width),
        _clamp(math.floor(top + 0.5) + first_row, height),
        _clamp(math.floor(right + 0.5) + last_column + 1, width),
        _clamp(math.floor(bottom + 0.5) + last_row + 1, height),
    )


def _clamp(place: int, size: int) -> int:
    return min(max(place, 0), size)


def correlations(grey: NDArray[np.uint8], positions: Floats, views: Views) -> Floats:
    """Return the correlation (F, N), -1..1, of every feature's template with the picture at its particles.

    Args:
        grey: (height, width).
        positions: (F, N, 2) px; positions that are not finite count as outside the picture.
        views: One per feature; if too little of a feature is visible, its correlation is 0 everywhere.

    Raises:
        TypeError: The picture is not an array of bytes, or the positions are not one of real numbers.
        ValueError: The picture is not (height, width), or there are not as many features as views.
    """
    check_picture(grey, "height width")
    check(missing=True, ends=(views.ends[1:], "F"), positions=(positions, "F N 2"))
    return _correlations(grey, np.ascontiguousarray(positions), views)


@compiled
def _project_views(reliefs: Reliefs, slopes: Floats) -> Views:
    points_mm, normals, levels, ends = reliefs
    features = len(ends) - 1
    offsets, kept = np.empty((len(levels), 2), np.int64), np.empty(len(levels))
    kept_ends, extent = np.zeros(features + 1, np.int64), np.zeros(4, np.int64)
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
                place = int(np.floor(off + 0.5))
                offsets[count, axis] = place
                extent[axis], extent[2 + axis] = min(extent[axis], place), max(extent[2 + axis], place)
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
    return Views(offsets[:count].copy(), kept[:count].copy(), kept_ends, extent)


@compiled
def _correlations(grey: NDArray[np.uint8], positions: Floats, views: Views) -> Floats:
    offsets, levels, ends, _ = views
    features, count, _ = positions.shape
    height, width = grey.shape
    flat = grey.ravel()
    results = np.zeros((features, count))
    steps = np.empty(len(levels), np.int64)
    inside, places = np.empty(count, np.int64), np.empty(count, np.int64)
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
        within = 0
        for i in range(count):
            x, y = np.floor(positions[n, i, 0] + 0.5), np.floor(positions[n, i, 1] + 0.5)
            results[n, i] = -1.0
            if x + left >= 0 and x + right < width and y + top >= 0 and y + bottom < height:
                inside[within] = i
                places[within] = int(y) * width + int(x)
                within += 1
        # Two particles at a time: while a sum waits for its last term, a term is added to the other.
        for i in range(0, within, 2):
            j = min(i + 1, within - 1)
            one, other = places[i], places[j]
            total, squares, product = np.int64(0), np.int64(0), 0.0
            other_total, other_squares, other_product = np.int64(0), np.int64(0), 0.0
            for p in range(begin, end):
                step, weight = steps[p], levels[p]
                level, other_level = np.int64(flat[one + step]), np.int64(flat[other + step])
                total, other_total = np.int64(total + level), np.int64(other_total + other_level)
                squares = np.int64(squares + level * level)
                other_squares = np.int64(other_squares + other_level * other_level)
                product += level * weight
                other_product += other_level * weight
            results[n, inside[i]] = _normalise(total, squares, product, end - begin)
            results[n, inside[j]] = _normalise(other_total, other_squares, other_product, end - begin)
    return results


@compiled
def _normalise(total: np.int64, squares: np.int64, product: float, count: int) -> float:
    """Return the correlation of a patch by the sums over its grey levels, their squares and their products."""
    power = squares - total * (total / count)
    return min(max(product / np.sqrt(power), -1.0), 1.0) if power > LEAST_VARIANCE * count else -1.0
