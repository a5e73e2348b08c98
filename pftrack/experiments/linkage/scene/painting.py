"""What the camera sees of a chain: three tapering links on a plain ground, joints, and what is laid over them.

A chain in the plane turns about upright axes, so that a camera beside it sees all of its joints in one row: its links
are bars that become shorter as they turn away. Positions are in whole sixteenths of a pixel, as OpenCV takes them, so a
pose has one picture.
"""

from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from pftrack.sources.overlay import OccluderParameters, paint_strip

__all__ = ["paint"]

LINKS = ((72, 99, 132), (95, 127, 163), (126, 157, 190))
"""Colours of the links, from the root on."""

RADII_PX = (13.0, 11.0, 9.0, 6.5)
"""Of the chain at its root, joints and tip."""

EDGE, BOLT, GROUND_TOP, GROUND_BOTTOM = (43, 58, 78), (233, 237, 242), 246.0, 224.0
SOCKET, SOCKET_SIDE_PX = (88, 92, 98), 38.0
SHIFT = 4
"""Bits of a sixteenth of a pixel."""


def paint(
    points_px: NDArray[np.float64],
    depths: NDArray[np.float64] | None,
    size: tuple[int, int],
    parameters: OccluderParameters,
) -> NDArray[np.uint8]:
    """Return a picture (height, width, 3) RGB, read-only.

    Args:
        points_px: (4, 2) of root, joints and tip in the picture.
        depths: (4,) how far from the camera each is; nearer links are in front. None: those further from the root are.
        size: Width and height of the picture, px.
        parameters: The occluder.
    """
    image = _ground(*size).copy()
    _paint_socket(image, points_px[0])
    links = range(len(LINKS))
    order = links if depths is None else sorted(links, key=lambda link: -(depths[link] + depths[link + 1]))
    for link in order:
        _paint_link(image, points_px[link : link + 2], RADII_PX[link : link + 2], LINKS[link])
    paint_strip(image, parameters)
    image.flags.writeable = False
    return image


@lru_cache(maxsize=2)
def _ground(width: int, height: int) -> NDArray[np.uint8]:
    """Return a light ground that darkens downwards."""
    rows = np.linspace(GROUND_TOP, GROUND_BOTTOM, height)
    return np.broadcast_to(np.rint(rows)[:, None, None], (height, width, 3)).astype(np.uint8)


def _paint_socket(image: NDArray[np.uint8], root: NDArray[np.float64]) -> None:
    half = np.array([0.5 * SOCKET_SIDE_PX, 0.5 * SOCKET_SIDE_PX])
    low, high = (tuple(map(int, _sixteenths(corner))) for corner in (root - half, root + half))
    cv2.rectangle(image, low, high, SOCKET, -1, cv2.LINE_AA, SHIFT)


def _paint_link(
    image: NDArray[np.uint8], ends: NDArray[np.float64], radii: tuple[float, ...], colour: tuple[int, int, int]
) -> None:
    """Paint a link as what a disc sweeps that shrinks on its way, with an edge, and a bolt at its joint."""
    for grown, tone in ((1.5, EDGE), (0.0, colour)):
        wide = [radius + grown for radius in radii]
        cv2.fillConvexPoly(image, _sixteenths(_sides(ends, wide)), tone, cv2.LINE_AA, SHIFT)
        for end, radius in zip(ends, wide, strict=True):
            x, y = map(int, _sixteenths(end))
            cv2.circle(image, (x, y), round(2**SHIFT * radius), tone, -1, cv2.LINE_AA, SHIFT)
    x, y = map(int, _sixteenths(ends[0]))
    for share, tone in ((0.45, EDGE), (0.3, BOLT)):
        cv2.circle(image, (x, y), round(2**SHIFT * share * radii[0]), tone, -1, cv2.LINE_AA, SHIFT)


def _sides(ends: NDArray[np.float64], radii: list[float]) -> NDArray[np.float64]:
    """Return the corners (4, 2) of the two tangents that discs at both ends have in common."""
    way = ends[1] - ends[0]
    length = float(np.sqrt(np.square(way).sum()))
    along = way / length if length > 0.0 else np.array([1.0, 0.0])
    sine = float(np.clip((radii[0] - radii[1]) / max(length, 1e-9), -1.0, 1.0))
    across = np.array([-along[1], along[0]]) * np.sqrt(1.0 - sine**2)
    left, right = sine * along + across, sine * along - across
    return np.array(
        [ends[0] + radii[0] * left, ends[1] + radii[1] * left, ends[1] + radii[1] * right, ends[0] + radii[0] * right]
    )


def _sixteenths(points: NDArray[np.float64]) -> NDArray[np.int32]:
    return np.asarray(np.rint(2.0**SHIFT * points), np.int32)
