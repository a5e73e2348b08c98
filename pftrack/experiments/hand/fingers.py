"""Protrusions: the parts of a silhouette that look like fingers, and the arm (Shimada 1997, section 2.3).

The silhouette is thinned to a skeleton (`pftrack.experiments.hand.silhouette`). Each free end is followed to its
junction with the rest, and cut where the silhouette becomes clearly wider than before. The part before the cut is a
protrusion: the axis of a finger, or of the part of a finger visible beside the palm. A line that ends at the picture's
border is the arm; the wrist is where the arm becomes wider.

Two details differ from the obvious choice. The tip of a finger is the middle of its round end, not the end of the
skeleton, which depends on single pixels of the edge. And the search for the wrist goes back from the place where the
arm is clearly wider to the place where it is hardly wider.

The cut is that of eq. 2.1; widths are distances to the edge instead of chords (eq. 2.2). See docs/methods/hands.md.
"""

from itertools import pairwise
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Floats, Ints
from pftrack.core.model.source import Backdrop
from pftrack.core.numerics.compiled import compiled
from pftrack.experiments.hand.silhouette import (
    Finding,
    Silhouette,
    SilhouetteParameters,
    contacts,
    free_lines,
    silhouette_of,
    skeleton,
)
from pftrack.experiments.shared.recording import keep_last

LEAST_PAD_PX, PAD_SHARE = 24, 0.6
"""The border is repeated outwards by more than half the arm's width, so the arm's skeleton crosses it."""
LEAST_GAIN_PX = 2.5
"""Least extension of a skeleton line beyond the disc at its junction."""
LEAST_LENGTH_PX = 9.0

FINGER_RATIO, FINGER_FROM = 1.45, 7
ARM_RATIO, LEAST_ARM_RATIO, ARM_FROM = 1.22, 1.12, 12
CLEARLY_PX = 1.2
"""A cut is where the width exceeds the mean so far by this factor, and by this many px; and this many px from the
end."""
STAYS = 3
"""Number of places for which this must hold."""
WRIST_RATIO, WIDEST_RATIO = 1.06, 1.6
"""Range of widths, relative to the arm, in which the rate of widening is measured."""
SMOOTH_PX = 4
"""Points on either side over which a line is smoothed: pixels are a staircase."""


class Protrusion(NamedTuple):
    """A part of the silhouette that looks like a finger.

    Attributes:
        axis: (k, 2) column and row from the middle of the tip to the palm's side, a px apart.
        radii: (k,) distance of each from the edge, px.
    """

    axis: Floats
    radii: Floats


class HandFeatures(NamedTuple):
    """The features of a silhouette. Places are in px of its mask; `silhouette.in_picture` takes them to the picture.

    Attributes:
        silhouette: The mask, its reduction relative to the picture, and whether it may be a hand.
        protrusions: Parts that look like fingers, unordered; empty if the silhouette cannot be a hand.
        wrist: (2,) where the arm becomes wider; None without an arm, or if it does not widen.
    """

    silhouette: Silhouette
    protrusions: tuple[Protrusion, ...]
    wrist: Floats | None

    @property
    def finding(self) -> Finding:
        """The finding on the silhouette."""
        return self.silhouette.finding


@keep_last
def features_of(
    image_rgb: NDArray[np.uint8], settings: SilhouetteParameters, backdrop: Backdrop | None = None
) -> HandFeatures:
    """Return the features of the hand in a picture (height, width, 3); arguments as for `silhouette_of`."""
    return features_in(silhouette_of(image_rgb, settings, backdrop))


def features_in(silhouette: Silhouette) -> HandFeatures:
    """Return the features of a silhouette."""
    if not silhouette.finding.ok:
        return HandFeatures(silhouette, (), None)
    mask = silhouette.mask.astype(np.uint8)
    broad = min(int(contacts(silhouette.mask).max(initial=0)), max(mask.shape) // 2)
    pad = max(LEAST_PAD_PX, int(PAD_SHARE * broad))
    repeated = cv2.copyMakeBorder(mask, pad, pad, pad, pad, cv2.BORDER_REPLICATE)
    padded = np.asarray(cv2.copyMakeBorder(repeated, 1, 1, 1, 1, cv2.BORDER_CONSTANT, value=(0,)), np.uint8)
    corner = pad + 1
    radii = np.asarray(cv2.distanceTransform(padded, cv2.DIST_L2, cv2.DIST_MASK_PRECISE), np.float32)
    pixels, begins = free_lines(skeleton(padded), radii, LEAST_GAIN_PX)
    height, width = mask.shape
    protrusions, wrist, widest = [], None, 0.0
    for first, last in pairwise(begins.tolist()):
        line = pixels[first:last]
        widths = radii[line[:, 1], line[:, 0]].astype(np.float64)
        if not _within(line[0] - corner, width, height):
            if widths[0] > widest:
                widest = widths[0]
                wrist = _wrist_of(line - corner, widths)
            continue
        protrusion = _protrusion(line, widths, padded)
        # A line that reaches the border is not a finger: a fist on its arm is one line from end to end.
        if protrusion is not None and _within(protrusion.axis[-1] - corner, width, height):
            protrusions.append(Protrusion(protrusion.axis - corner, protrusion.radii))
    return HandFeatures(silhouette, tuple(protrusions), wrist)


def _within(place: NDArray[np.generic], width: int, height: int) -> bool:
    column, row = place.tolist()
    return bool(0 <= column < width and 0 <= row < height)


def _protrusion(line: Ints, widths: Floats, padded: NDArray[np.uint8]) -> Protrusion | None:
    """Return a finger's axis, given the pixels (n, 2) and widths (n,) from its end to where it meets the rest."""
    begin = _begin(line, widths)
    cut = _cut(widths, begin, FINGER_FROM, FINGER_RATIO)
    if cut - begin < LEAST_LENGTH_PX - 4.0:
        return None
    places = _smooth(line[:cut].astype(np.float64))
    tip, at = _tip(padded, places, widths, begin)
    axis, radii = resample(np.vstack([tip, places[at:]]), np.append(widths[at], widths[at:cut]))
    return Protrusion(axis, radii) if len(axis) > LEAST_LENGTH_PX else None


def _wrist_of(line: Ints, widths: Floats) -> Floats | None:
    """Return an arm's wrist (2,), if it becomes wider, given its pixels and widths from outside the border on."""
    smooth = _smooth(np.column_stack([widths, widths]))[:, 0].copy()
    cut = _cut(smooth, 2, ARM_FROM, ARM_RATIO)
    if cut == len(smooth) > ARM_FROM and smooth[-1] > LEAST_ARM_RATIO * smooth[2:].mean():
        cut -= 1  # a finger's line joins the arm's before that is clearly wider
    at = _wrist(smooth, cut)
    return None if at < 0 else _smooth(line.astype(np.float64))[at]


@compiled
def _begin(line: Ints, widths: Floats) -> int:
    """Return the first index of a line (n, 2) that is as far from its end as the silhouette is wide from there on."""
    count: int = widths.shape[0]
    for i in range(count):
        x, y, mean, last = line[i, 0] - line[0, 0], line[i, 1] - line[0, 1], 0.0, min(i + FINGER_FROM, count - 1)
        for j in range(i, last + 1):
            mean += widths[j] / (last - i + 1)
        if x * x + y * y >= mean * mean:
            return int(i)
    return count


@compiled
def _cut(widths: Floats, begin: int, least: int, ratio: float) -> int:
    """Return the first index at which a width is clearly more than the mean from `begin` on, and stays so; or all."""
    count: int = widths.shape[0]
    total = 0.0
    for i in range(begin, count):
        if i >= begin + least:
            limit = total / (i - begin)
            limit = max(ratio * limit, limit + CLEARLY_PX)
            wider = True
            for j in range(i, min(i + STAYS, count)):
                wider = wider and widths[j] > limit
            if wider:
                return int(i)
        total += widths[i]
    return count


@compiled
def _wrist(widths: Floats, cut: int) -> int:
    """Return the index at which an arm begins to become wider, given where it clearly is; -1 if it does not.

    A line through the widths around the cut is followed back to the mean of the arm.
    """
    count = widths.shape[0]
    if cut >= count:
        return -1
    mean = 0.0
    for i in range(2, cut):
        mean += widths[i] / (cut - 2)
    first, last = cut, cut
    while first > ARM_FROM and widths[first - 1] > WRIST_RATIO * mean:
        first -= 1
    while last + 1 < count and widths[last] < WIDEST_RATIO * mean and widths[last + 1] > widths[last]:
        last += 1
    size, at, width = last - first + 1, 0.5 * (first + last), 0.0
    for i in range(first, last + 1):
        width += widths[i] / size
    above, below = 0.0, 0.0
    for i in range(first, last + 1):
        above += (i - at) * (widths[i] - width)
        below += (i - at) * (i - at)
    begin = at - (width - mean) * below / above if above > 0.0 else float(first)
    return int(min(max(begin + 0.5, 0.0), float(cut)))


@compiled
def _tip(padded: NDArray[np.uint8], places: Floats, widths: Floats, begin: int) -> tuple[Floats, int]:
    """Return the middle of a finger's round end, and the index of the first place (n, 2) of its axis behind that.

    The finger is followed along its axis to the end of the silhouette, on three parallel lines; its end is round, so
    the outer lines end a known part of the radius earlier.
    """
    count = places.shape[0]
    near, far = min(begin + 2, count - 1), min(begin + 12, count - 1)
    x, y = places[near, 0] - places[far, 0], places[near, 1] - places[far, 1]
    length = np.sqrt(x * x + y * y)
    if length < 2.0:
        return places[begin].copy(), min(begin + 1, count - 1)
    x, y = x / length, y / length
    radius = 0.0
    for i in range(near, far + 1):
        radius += widths[i] / (far - near + 1)
    reach = 0.0
    for side in range(-1, 2):
        column, row = places[near, 0] - 0.5 * side * radius * y, places[near, 1] + 0.5 * side * radius * x
        steps = 0
        while padded[int(row + 0.5), int(column + 0.5)] != 0:
            column, row, steps = column + 0.25 * x, row + 0.25 * y, steps + 1
        reach += (0.25 * steps - 0.125 + (0.134 * radius if side else 0.0)) / 3.0
    tip = np.array([places[near, 0] + (reach - radius) * x, places[near, 1] + (reach - radius) * y])
    for i in range(count):
        if (places[i, 0] - tip[0]) * x + (places[i, 1] - tip[1]) * y < -1.0:
            return tip, i
    return tip, count - 1


@compiled
def _smooth(line: Floats) -> Floats:
    """Return a line (n, 2) smoothed by means of neighbouring points, fewer towards the ends."""
    count = line.shape[0]
    smooth = np.empty((count, 2))
    for i in range(count):
        reach = min(SMOOTH_PX, i, count - 1 - i)
        for axis in range(2):
            total = 0.0
            for j in range(i - reach, i + reach + 1):
                total += line[j, axis]
            smooth[i, axis] = total / (2 * reach + 1)
    return smooth


@compiled
def resample(line: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Return points (k, 2) a px of arc length apart along a line (n, 2), and the values (k,) there."""
    count = line.shape[0]
    length = 0.0
    for i in range(1, count):
        x, y = line[i, 0] - line[i - 1, 0], line[i, 1] - line[i - 1, 1]
        length += np.sqrt(x * x + y * y)
    size = int(length + 1e-9) + 1
    points, there = np.empty((size, 2)), np.empty(size)
    points[0, 0], points[0, 1], there[0] = line[0, 0], line[0, 1], values[0]
    at, passed = 1, 0.0
    for i in range(1, count):
        x, y = line[i, 0] - line[i - 1, 0], line[i, 1] - line[i - 1, 1]
        step = np.sqrt(x * x + y * y)
        while at < size and passed + step >= at - 1e-9 and step > 0.0:
            share = (at - passed) / step
            points[at, 0], points[at, 1] = line[i - 1, 0] + share * x, line[i - 1, 1] + share * y
            there[at] = values[i - 1] + share * (values[i] - values[i - 1])
            at += 1
        passed += step
    return points, there
