"""Links that are seen as lines: where a link lies across the picture is known, and not where on its line it ends.

Of an elongated shape in a silhouette the axis is found more easily than its ends. The line of a link is observed by
its unit normal n and its offset from the picture's corner: n . p = offset for each of its points p. Shimada 1997, eqs.
4.9 to 4.11, has (m, rho) with m the difference of the two ends' images; but the length of m is what is *not* seen, and
rho has to be told by the normal rather than by m.

Both ends of a link err across its line, independently and as much as measured points do; the line goes through where
they seem to be. So a line is known the better the longer its link looks, and the distance of a true end from the
observed line is never greater than its error: a bound of the errors bounds the distances.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.frame import Measurements

__all__ = ["SHORTEST_PX", "LinkMeasurements", "observe_lines"]

SHORTEST_PX = 1.0
"""A link that looks shorter than this shows no line."""


@dataclass(frozen=True, slots=True, eq=False)
class LinkMeasurements(Measurements):
    """Points of a chain in space, and lines of its links.

    Attributes:
        normals: (3, 2) unit normal of the line of each link; NaN where none was seen.
        offsets_px: (3,) of it, n . p of its points in the picture; NaN where none was seen.
    """

    normals: NDArray[np.float64]
    offsets_px: NDArray[np.float64]


def observe_lines(
    points_px: NDArray[np.float64], errors_px: NDArray[np.float64], visible: NDArray[np.bool_]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return normals (3, 2) and offsets (3,) of the lines of links; NaN where none is seen.

    Args:
        points_px: (4, 2) true places of root, joints and tip.
        errors_px: (3, 2) by how much the beginning and the end of each link seem to be off, across it.
        visible: (4,) whether each point is in sight; of a link with a visible end a part is.
    """
    normals, offsets = np.full((len(errors_px), 2), np.nan), np.full(len(errors_px), np.nan)
    for link, (first, last) in enumerate(errors_px):
        beginning, way = points_px[link], points_px[link + 1] - points_px[link]
        length = float(np.sqrt(np.square(way).sum()))
        if length < SHORTEST_PX or not visible[link : link + 2].any():
            continue
        across = np.array([-way[1], way[0]]) / length
        seen = way + (last - first) * across
        normals[link] = np.array([-seen[1], seen[0]]) / np.sqrt(np.square(seen).sum())
        offsets[link] = float((normals[link] * (beginning + first * across)).sum())
    return normals, offsets
