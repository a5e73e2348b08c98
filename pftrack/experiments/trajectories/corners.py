"""Corners that are followed through pictures by block matching, with its mistakes: the raw observations of tracks.

Every corner has a template, by default that of the picture in which it was taken up, and is looked for around its last
match. A search that has gone wrong therefore goes on from the wrong place, and finds back if the right one is within
reach. A corner has no match where none is allowed, and where its template touches the edge of the picture: what it
shows is about to leave, or has left.
"""

from dataclasses import dataclass, replace
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Bools, Floats, Ints
from pftrack.core.model.parameters import parameter, revise
from pftrack.vision.detection.corners import DetectorParameters, find_corners
from pftrack.vision.detection.matching import LARGEST_TEMPLATE_PX, Cost, cut, match
from pftrack.vision.likelihoods.template import luma

MATCHING = "Matching"


class CornerParameters(DetectorParameters, group=MATCHING, constants={"between_pixels": False}):
    """Everything that following corners through pictures reads."""

    # fmt: off
    template_px: int = parameter(
        11, "Template", "Side of the square about a corner that is looked for in later pictures.",
        unit="px", within=(3, LARGEST_TEMPLATE_PX, 2), live=False)
    search_reach_px: int = parameter(
        13, "Search to", "How far from its last match a corner is looked for, to all four sides.",
        unit="px", within=(1, 40, 1))
    match_cost: Cost = parameter(
        "difference", "Compare by",
        "The mean difference of grey levels, which light misleads, or normalised correlation, which it does not.")
    template_renewal: bool = parameter(
        False, "Renew templates", "Whether a template is cut anew at every match: it adapts, and drifts away.")
    largest_cost: float = parameter(
        255, "Largest cost", "A costlier match is none: in grey levels, in hundredths by correlation; 255 takes all.",
        within=(0, 255, 1))
    largest_ratio: float = parameter(
        1, "Largest ratio", "A match that costs more of the next best one elsewhere is ambiguous, and is none.",
        within=(0, 1, 0.01))
    new_corners: bool = parameter(
        False, "New corners", "Whether a corner that has been gone for ten frames is replaced by another.")
    # fmt: on


GONE_FRAMES = 10
"""For so many frames without a match a corner is waited for."""

STILL_COST = 0.3
"""Up to this cost by correlation a place shows what it showed."""

HUNDREDTHS = 100.0


@dataclass(frozen=True, eq=False)
class Corners:
    """The corners after a frame, immutable; K of them from the first frame to the last.

    Attributes:
        templates: (K, b, b) grey levels that are looked for next.
        sought: (K, b, b) grey levels that were looked for in this frame.
        places: (K, 2) pixels around which they are looked for next: their last matches.
        around: (K, 2) pixels around which they were looked for in this frame.
        costs: (K,) of their best matches, grey levels or 0..2; NaN in the frame in which a corner was taken up.
        ratios: (K,) of these costs to the next best ones elsewhere; NaN where there is none.
        missing: (K,) for how many frames there has been no match.
        born: (K,) in which frame each was taken up.
        first_places: (K, 2) at which pixel.
        first_templates: (K, b, b) what was there.
        still: (K,) in how many of the frames since then the same has been there, wherever the match was.
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

        These stand still, so that what seems to be their motion is an error.
        """
        frames = self.index - self.born
        return (frames >= GONE_FRAMES) & (2 * self.still >= frames)

    @property
    def nbytes(self) -> int:
        """How much memory they take, bytes."""
        return 3 * self.templates.nbytes + 5 * self.places.nbytes

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
        parameters: What counts as a corner.
        points: (K, 2) px, if it is known which to follow; else they are looked for.
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
        parameters: How to match.
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
    """Return the side of a template, px: an odd number, so that it has a middle."""
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
