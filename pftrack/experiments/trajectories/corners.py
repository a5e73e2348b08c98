"""Corners that are followed through pictures by block matching, with its mistakes: the raw observations of tracks.

Every corner has a template, by default from its first picture, and is searched around its last match. After a wrong
match the search therefore continues from the wrong place, and recovers if the right one is within reach. A corner has
no match where none is allowed, and where its template touches the edge of the picture: it is about to leave, or has
left.

A corner is a place that differs from its surroundings in every direction. Both detectors use the structure of the
gradients g = (gx, gy) in a small square, M = sum of g g^T with the entries A, B, B, C.

- *eigenvalue* (Shi and Tomasi 1994): the smaller eigenvalue of M, the least contrast over all directions.
- *orientation*, after the corner orientation detector of Chabat, Yang and Hansell (1999), which Ichimura and Ikoma 2000
  use. They measure the anisotropism of the structure by single derivatives,

      q = ((A - C)^2 + 4 B^2) / (A + C)^2,    1 for an edge, 0 where no direction is preferred,

  and treat places with a strong gradient but no direction as corners: |g| (1 - q)^2. Ichimura and Ikoma 2000 only cite
  it, and report that it takes points of a slanted line for corners; the exponent and the square window are this
  project's reading, and the second half of the published method, the directions of edges at a corner, is left out:
  matching does not need it.

A corner is a local maximum of the strength, of at least a share of the greatest, and far enough from stronger ones.
Sums of products of whole numbers are exact, and IEEE 754 defines the rounding of roots and quotients: so corners are
the same to the bit on every processor, unlike OpenCV's list in single precision.
"""

import math
from dataclasses import dataclass, replace
from typing import Any, Literal, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Bools, Floats, Ints
from pftrack.core.model.parameters import Parameters, parameter, revise
from pftrack.vision.likelihoods.template import luma
from pftrack.vision.matching import LARGEST_TEMPLATE_PX, Cost, cut, match

Detector: TypeAlias = Literal["eigenvalue", "orientation"]

BAND_ROWS = 128
MATCHING = "Matching"


class DetectorParameters(Parameters, group="Corners"):
    """Parameters of corners."""

    corner_detector: Detector = parameter("eigenvalue", "Detector", live=False)
    """By the smaller eigenvalue of the gradients (Shi and Tomasi), or by their lack of a direction (Chabat)."""
    corner_count: int = parameter(60, "Most corners", within=(1, 400, 1), useful=(1, 200), live=False)
    """Largest number of followed corners, the strongest first."""
    corner_quality: float = parameter(0.05, "Least strength", within=(0.001, 1, 0.001), useful=(0.001, 0.3), live=False)
    """Least strength of a corner, as a share of the strongest one of the picture."""
    corner_distance_px: float = parameter(
        9, "Least distance", unit="px", within=(1, 100, 1), useful=(1, 40), live=False
    )
    """Least distance between corners."""
    corner_window_px: int = parameter(5, "Window", unit="px", within=(3, 31, 2), live=False)
    """Side of the square over which gradients are summed."""
    corner_margin_px: int = parameter(12, "Margin", unit="px", within=(0, 200, 1), useful=(0, 60), live=False)
    """Least distance of corners from the edge of the picture."""


def find_corners(grey: NDArray[np.uint8], parameters: DetectorParameters, among: Bools | None = None) -> Floats:
    """Return corners (n, 2), (column, row) in px, the strongest first.

    Args:
        grey: Picture (height, width).
        parameters: Parameters of corners.
        among: (height, width) where there may be any; everywhere within the margin if None.
    """
    height, width = grey.shape
    margin = max(parameters.corner_margin_px, 1)
    if min(height, width) <= 2 * margin:
        return np.zeros((0, 2))
    values = strength(grey, parameters.corner_detector, parameters.corner_window_px)
    # On a level top of several pixels all are greatest; the order below keeps the first of them.
    tops = values >= cv2.dilate(values, np.ones((3, 3), np.uint8))
    tops &= (values >= parameters.corner_quality * values.max()) & (values > 0.0)
    inside = np.zeros_like(tops)
    inside[margin : height - margin, margin : width - margin] = True
    rows, columns = np.nonzero(tops & inside if among is None else tops & inside & among)
    order = np.argsort(-values[rows, columns], kind="stable")
    places = np.column_stack([columns, rows])[order]
    return _apart(places, grey.shape, parameters.corner_distance_px, parameters.corner_count)


def strength(grey: NDArray[np.uint8], detector: Detector, window_px: int) -> Floats:
    """Return the strength of a corner at each pixel, (height, width), not negative.

    Args:
        grey: Picture (height, width).
        detector: The measure.
        window_px: Side of the square over which gradients are summed, odd.
    """
    across, down = cv2.Sobel(grey, cv2.CV_16S, 1, 0), cv2.Sobel(grey, cv2.CV_16S, 0, 1)
    side = window_px, window_px
    sums = [
        cv2.boxFilter(cv2.multiply(one, other, dtype=cv2.CV_32S), cv2.CV_32S, side, normalize=False)
        for one, other in ((across, across), (across, down), (down, down))
    ]
    values = np.empty(grey.shape)
    # In bands, since all of a large picture in numbers of 64 bits, and again at every step, is gigabytes.
    for top in range(0, len(grey), BAND_ROWS):
        rows = slice(top, top + BAND_ROWS)
        a, b, c, gx, gy = (each[rows].astype(np.float64) for each in (*sums, across, down))
        directed = (a - c) * (a - c) + 4.0 * b * b
        if detector == "eigenvalue":
            values[rows] = np.maximum((a + c - np.sqrt(directed)) / 2.0, 0.0)
        else:
            total = np.maximum((a + c) * (a + c), 1.0)
            undirected = (total - directed) / total
            values[rows] = np.sqrt(gx * gx + gy * gy) * undirected * undirected
    return values


def _apart(places: Ints, shape: tuple[int, ...], distance_px: float, most: int) -> Floats:
    """Return those places, at most so many, that are as far from all that were taken before them."""
    reach = math.ceil(distance_px)
    steps = np.square(np.arange(-reach, reach + 1))
    far = steps[:, None] + steps >= distance_px * distance_px
    # With a rim, so the surroundings of every place are within.
    free = np.ones((shape[0] + 2 * reach, shape[1] + 2 * reach), np.bool_)
    taken: list[tuple[int, int]] = []
    for x, y in places.tolist():
        if len(taken) == most:
            break
        if free[y + reach, x + reach]:
            taken.append((x, y))
            free[y : y + 2 * reach + 1, x : x + 2 * reach + 1] &= far
    return np.array(taken, np.float64).reshape(-1, 2)


class CornerParameters(DetectorParameters, group=MATCHING, constants={"between_pixels": False}):
    """Everything that following corners through pictures reads."""

    template_px: int = parameter(11, "Template", unit="px", within=(3, LARGEST_TEMPLATE_PX, 2), live=False)
    """Side of the square about a corner that is searched in later pictures."""
    search_reach_px: int = parameter(13, "Search to", unit="px", within=(1, 40, 1))
    """Distance from its last match within which a corner is searched, to all four sides."""
    match_cost: Cost = parameter("difference", "Compare by")
    """The mean difference of grey levels, which light misleads, or normalised correlation, which it does not."""
    template_renewal: bool = parameter(False, "Renew templates")
    """Whether a template is cut anew at every match: it adapts, and drifts away."""
    largest_cost: float = parameter(255, "Largest cost", within=(0, 255, 1))
    """A costlier match is none: in grey levels, in hundredths by correlation; 255 takes all."""
    largest_ratio: float = parameter(1, "Largest ratio", within=(0, 1, 0.01))
    """A match that costs more of the next best one elsewhere is ambiguous, and is none."""
    new_corners: bool = parameter(False, "New corners")
    """Whether a corner that has been gone for ten frames is replaced by another."""


GONE_FRAMES = 10
"""For so many frames without a match a corner is waited for."""

STILL_COST = 0.3
"""Up to this cost by correlation a place shows what it showed."""

HUNDREDTHS = 100.0


@dataclass(frozen=True, eq=False)
class Corners:
    """The corners after a frame, immutable; K of them from the first frame to the last.

    Attributes:
        templates: (K, b, b) grey levels to search next.
        sought: (K, b, b) grey levels searched in this frame.
        places: (K, 2) pixels around which they are searched next: their last matches.
        around: (K, 2) pixels around which they were searched in this frame.
        costs: (K,) of their best matches, grey levels or 0..2; NaN in the frame in which a corner was taken up.
        ratios: (K,) of these costs to the next best ones elsewhere; NaN where there is none.
        missing: (K,) number of frames since the last match.
        born: (K,) in which frame each was taken up.
        first_places: (K, 2) at which pixel.
        first_templates: (K, b, b) what was there.
        still: (K,) number of the frames since then with the same content there, independent of the match.
        index: Number of the frame.
    """

    templates: NDArray[np.uint8]
    sought: NDArray[np.uint8]
    places: Ints
    around: Ints
    costs: Floats
    ratios: Floats
    missing: Ints
    born: Ints
    first_places: Ints
    first_templates: NDArray[np.uint8]
    still: Ints
    index: int

    @property
    def gone(self) -> Bools:
        """(K,) which have been missing for so long that where they would be is not known any more."""
        return self.missing >= GONE_FRAMES

    @property
    def resting(self) -> Bools:
        """(K,) which have been where they were taken up in half of the frames since or more, ten or more by now.

        These do not move, so their measured motion is an error.
        """
        frames = self.index - self.born
        return (frames >= GONE_FRAMES) & (2 * self.still >= frames)

    def select(self, numbers: Ints) -> "Corners":
        """Return some of the corners, given by their numbers (M,), in that order."""
        arrays: dict[str, Any] = {name: it[numbers] for name, it in vars(self).items() if isinstance(it, np.ndarray)}
        return replace(self, **arrays)


def begin(
    image_rgb: NDArray[np.uint8], parameters: CornerParameters, points: Floats | None = None
) -> tuple[Corners, Floats]:
    """Return the corners of a first picture, and where they are, (K, 2) px.

    Args:
        image_rgb: (height, width, 3).
        parameters: Parameters of corners.
        points: (K, 2) px to follow, if given; else they are detected.
    """
    grey = luma(image_rgb)
    if points is None:
        points = _find(grey, parameters)
    return _take_up(grey, points, _size(parameters), 0), points


def follow(
    corners: Corners, image_rgb: NDArray[np.uint8], parameters: CornerParameters, index: int
) -> tuple[Corners, Floats]:
    """Return the corners after a further picture, and where each was found, (K, 2) px; NaN where it was not.

    Args:
        corners: Before.
        image_rgb: (height, width, 3), of the same size as before.
        parameters: Parameters of matching.
        index: Number of the frame.
    """
    grey = luma(image_rgb)
    height, width = grey.shape
    correlating = parameters.match_cost == "correlation"
    matches = match(grey, corners.templates, corners.places, parameters.search_reach_px, parameters.match_cost)
    half = corners.templates.shape[1] // 2
    inside = ((matches.places > half) & (matches.places < np.array([width, height]) - 1 - half)).all(axis=1)
    largest = parameters.largest_cost / HUNDREDTHS if correlating else parameters.largest_cost
    with np.errstate(invalid="ignore"):  # infinite costs, and none at all
        ratios = np.where(matches.seconds > 0.0, matches.costs / matches.seconds, 1.0)
        allowed = (matches.costs <= largest) & ~(ratios > parameters.largest_ratio)
    good = np.isfinite(matches.costs) & inside & allowed
    places = np.where(good[:, None], matches.places, corners.places)
    positions = np.where(good[:, None], places, np.nan)
    templates = corners.templates
    if parameters.template_renewal:
        templates = np.where(good[:, None, None], cut(grey, places, templates.shape[1]), templates)
    there = match(grey, corners.first_templates, corners.first_places, 0, "correlation").costs <= STILL_COST
    followed = replace(
        corners,
        templates=templates,
        sought=corners.templates,
        places=places,
        around=corners.places,
        costs=matches.costs,
        ratios=ratios,
        missing=np.where(good, 0, corners.missing + 1),
        still=corners.still + there,
        index=index,
    )
    if parameters.new_corners and followed.gone.any() and index % GONE_FRAMES == 0:
        return _replace(followed, positions, grey, parameters, index)
    return followed, positions


def _size(parameters: CornerParameters) -> int:
    """Return the side of a template, px: an odd number, so it has a middle."""
    return parameters.template_px // 2 * 2 + 1


def _find(grey: NDArray[np.uint8], parameters: CornerParameters, among: Bools | None = None) -> Floats:
    """Return corners whose templates are within the picture and do not touch its edge."""
    margin = max(parameters.corner_margin_px, _size(parameters) // 2 + 1)
    return find_corners(grey, revise(parameters, {"corner_margin_px": margin}), among)


def _take_up(grey: NDArray[np.uint8], points: Floats, size: int, index: int) -> Corners:
    places = np.rint(points).astype(np.int64)
    unknown, count = np.full(len(places), np.nan), np.zeros(len(places), np.int64)
    pieces = cut(grey, places, size)
    return Corners(pieces, pieces, places, places, unknown, unknown, count, count + index, places, pieces, count, index)


def _replace(
    corners: Corners,
    positions: Floats,
    grey: NDArray[np.uint8],
    parameters: CornerParameters,
    index: int,
) -> tuple[Corners, Floats]:
    """Take up new corners, away from those that are there, in place of those that are gone."""
    gone = np.flatnonzero(corners.gone)
    free = np.full(grey.shape, 1, np.uint8)
    radius = int(parameters.corner_distance_px)
    for x, y in np.rint(positions[~np.isnan(positions[:, 0])]).astype(int).tolist():
        cv2.circle(free, (x, y), radius, 0, -1)
    points = _find(grey, revise(parameters, {"corner_count": len(gone)}), free == 1)
    new, slots = _take_up(grey, points, corners.templates.shape[1], index), gone[: len(points)]
    arrays: dict[str, Any] = {name: it.copy() for name, it in vars(corners).items() if isinstance(it, np.ndarray)}
    for name, array in arrays.items():
        array[slots] = getattr(new, name)
    positions = positions.copy()
    positions[slots] = points
    return replace(corners, **arrays), positions
