"""What hard bounds of errors say of the image of each link in space, whatever was seen of it: points or lines.

A measured point lies in a square, and a link that is seen as a line has both ends in the strip along it. So each point
of the chain lies in a polygon: a joint, where the strips of its two links cross. The difference of a link's ends lies
within the difference of the extents of their polygons, along the line and across it. Across it that is twice the bound
of the errors; along it, it is known where both ends are: where another line or a point tells of each of them.
"""

from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from pftrack.experiments.linkage.sets.polygons import Strip, extent, intersect
from pftrack.experiments.linkage.shape import LINKS
from pftrack.experiments.linkage.trackers.observation import POINT_ROWS

__all__ = ["LinkImage", "bound_places", "link_images", "places_of"]

AXES = np.eye(2)

Extents: TypeAlias = tuple[NDArray[np.float64], NDArray[np.float64]]
"""Middles (4, 2) and half extents (4, 2) of where points are, along the axes of the image; infinite halves are none."""


class LinkImage(NamedTuple):
    """The end of a link less its beginning, in the image.

    Attributes:
        turn: (3, 3) rotation about the line of sight that makes the two directions along which it is bounded the axes.
        middle: (2,) along these, px.
        bound: (2,) of the distance from that, px; infinite where nothing is known, -infinite where nothing is possible.
    """

    turn: NDArray[np.float64]
    middle: NDArray[np.float64]
    bound: NDArray[np.float64]


def link_images(seen: NDArray[np.float64], bound: float) -> list[LinkImage | None]:
    """Return what is known of each link's image, None where it is nothing.

    Args:
        seen: (8, 3) or (14, 3) observation, see `observation`.
        bound: Of the error of a measured coordinate, and of an end from its line, px.
    """
    if len(seen) == POINT_ROWS:
        points = seen[:, 0].reshape(-1, 2)
        shown, both = points[1:] - points[:-1], np.full(2, 2.0 * bound)
        return [None if np.isnan(one).any() else LinkImage(np.eye(3), one, both) for one in shown]
    polygons = places_of(seen, bound)
    return [_link_image(polygons[link], polygons[link + 1], seen, link) for link in range(LINKS)]


def places_of(seen: NDArray[np.float64], bound: float) -> list[NDArray[np.float64]]:
    """Return the corners (k, 2) of where each of the four points can be, px from the origin."""
    strips: list[list[Strip]] = [[] for _ in range(LINKS + 1)]
    for row, (value, *direction) in enumerate(seen):
        if not np.isnan(value):
            past = row - POINT_ROWS
            point = row // 2 if past < 0 else past // 2 + past % 2
            strips[point].append((np.array(direction), float(value) - bound, float(value) + bound))
    return [intersect(one) for one in strips]


def _link_image(
    beginning: NDArray[np.float64], end: NDArray[np.float64], seen: NDArray[np.float64], link: int
) -> LinkImage | None:
    turn, row = np.eye(3), POINT_ROWS + 2 * link
    if not np.isnan(seen[row, 0]):
        across, down = seen[row, 1:]
        turn[:2, :2] = [[across, down], [-down, across]]
    if not (len(beginning) and len(end)):
        # Strips that do not meet contradict each other: no link is between what is nowhere.
        return LinkImage(turn, np.zeros(2), np.full(2, -np.inf))
    middle, half = np.zeros(2), np.full(2, np.inf)
    for axis in range(2):
        (first, last), (low, high) = extent(beginning, turn[axis, :2]), extent(end, turn[axis, :2])
        if np.isfinite([first, last, low, high]).all():
            middle[axis], half[axis] = 0.5 * (low - last + high - first), 0.5 * (high - first - low + last)
    return LinkImage(turn, middle, half) if np.isfinite(half).any() else None


def bound_places(seen: NDArray[np.float64], bound: float) -> Extents:
    """Return how far each point of the chain extends, given what was seen of it."""
    if len(seen) == POINT_ROWS:
        points = seen[:, 0].reshape(-1, 2)
        return points, np.where(np.isnan(points), np.inf, bound)
    middles, halves = np.zeros((LINKS + 1, 2)), np.full((LINKS + 1, 2), np.inf)
    for point, corners in enumerate(places_of(seen, bound)):
        for axis in range(2 if len(corners) else 0):
            low, high = extent(corners, AXES[axis])
            if np.isfinite(high):
                middles[point, axis], halves[point, axis] = 0.5 * (low + high), 0.5 * (high - low)
    return middles, halves
