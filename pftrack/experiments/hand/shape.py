"""A hand of sixteen rigid parts and its silhouette (Shimada 1997, section 2.2).

The palm is a plate, each finger a chain of three phalanges, and the forearm a board behind them. All lengths are in
*palm axes*: the distance from the wrist to the middle of the knuckles of the four fingers, which is `scale` px long. In
the hand's own frame y points from the wrist to the fingers, x to the thumb's side and z out of the palm, towards a
camera that sees the palm. The camera is orthographic.

A *pose* q (25,) is

    wrist column and row, px,  a, b, c,  five times (spread, f1, f2, f3),  rad,

from the thumb to the little finger, with R = Rz(a) Ry(b) Rx(c). Angles are as seen on the screen: a turns the hand
counter-clockwise, b tilts the thumb's side away from the camera, c brings the fingers towards it. All results of this
module are in picture coordinates: columns to the right, rows down, z towards the camera, px.

Finger by finger, with the direction d = rest + spread, u = (-sin d, cos d, 0) and A_j = f1 + ... + fj,

    P_0 = MP,  P_j = P_(j-1) + L_j (u cos A_j + z sin A_j),

so fingers bend towards the camera. The thumb turns by 0.7 A_j within the palm's plane and tilts by 0.5 A_j out of it.
The numbers of the model are our own; Shimada does not give any.

Silhouettes do not distinguish a left palm from the back of a right hand, or a hand from its mirror image in the
picture's plane. A shape with `side` -1 has the thumb on the other side.
"""

import math
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike

from pftrack.core.arrays import Bools, Floats, Ints
from pftrack.core.geometry import convex_hull, fill
from pftrack.core.numerics.compiled import compiled, read_only
from pftrack.core.numerics.elementary import sines_cosines

FINGERS = "thumb", "index finger", "middle finger", "ring finger", "little finger"
ANGLES = 25
"""Numbers of a pose: two of the wrist's place, three of the palm, four of each finger."""

MOST_CORNERS = 24
"""Corners of one part's polygon."""

AROUND = 16
"""Directions in which a disc has corners."""

_STEEP, _FLAT = 0.5 * math.sqrt(2.0 + math.sqrt(2.0)), 0.5 * math.sqrt(2.0 - math.sqrt(2.0))
_FIRST = [(1.0, 0.0), (_STEEP, _FLAT), (math.sqrt(0.5), math.sqrt(0.5)), (_FLAT, _STEEP)]
_HALF = [*_FIRST, *((-y, x) for x, y in _FIRST)]
DIRECTIONS = np.array([*_HALF, *((-x, -y) for x, y in _HALF)])
"""Their unit vectors, from the first axis round by the second; by roots alone, which are the same on every machine."""


class HandShape(NamedTuple):
    """The constant shape: lengths in palm axes, directions in rad. All arrays are read-only, for compiled loops.

    Attributes:
        roots: (5, 3) roots of the fingers: the MP joints, for the thumb the CM joint.
        phalanges: (5, 3) lengths, from the palm to the tip.
        radii: (5, 4) at the joints and the tip.
        rest: (5,) direction of each finger from +y; negative is the thumb's side.
        outline: (9, 2) of the palm.
        thickness: Half of the palm's.
        arm: (2,) half the forearm's width, and its length.
        side: 1, or -1 for the mirror image.
    """

    roots: Floats
    phalanges: Floats
    radii: Floats
    rest: Floats
    outline: Floats
    thickness: float
    arm: Floats
    side: float = 1.0

    @classmethod
    def of(cls, **lengths: ArrayLike) -> Self:
        """Return a shape of numbers that may come from anywhere."""
        arrays = {name: read_only(np.array(values, np.float64)) for name, values in lengths.items()}
        return cls(**{name: array if array.ndim else float(array) for name, array in arrays.items()})  # type: ignore[arg-type]

    def with_changes(self, **lengths: ArrayLike) -> Self:
        """Return a shape with other numbers in some places."""
        return self.of(**{**self._asdict(), **lengths})


MODEL = HandShape.of(
    roots=[[0.30, 0.28, 0.06], [0.27, 0.99, 0.0], [0.09, 1.05, 0.0], [-0.10, 1.01, 0.0], [-0.27, 0.92, 0.0]],
    phalanges=[[0.46, 0.34, 0.28], [0.46, 0.28, 0.20], [0.51, 0.32, 0.21], [0.48, 0.30, 0.20], [0.37, 0.22, 0.18]],
    radii=[
        [0.115, 0.100, 0.085, 0.070],
        [0.095, 0.085, 0.078, 0.065],
        [0.095, 0.088, 0.080, 0.066],
        [0.090, 0.083, 0.076, 0.062],
        [0.080, 0.072, 0.066, 0.055],
    ],
    rest=[-0.75, -0.22, -0.05, 0.12, 0.30],
    outline=[
        [-0.19, 0.0],
        [0.19, 0.0],
        [0.33, 0.30],
        [0.38, 0.95],
        [0.18, 1.10],
        [-0.01, 1.14],
        [-0.20, 1.10],
        [-0.36, 0.98],
        [-0.33, 0.40],
    ],
    thickness=0.11,
    arm=[0.19, 1.6],
)
"""The model's hand, with the palm towards the camera and the thumb on the right."""

LOW = read_only(
    np.array([-np.inf] * 3 + [-0.5 * np.pi] * 2 + [-0.35, 0.0, 0.0, 0.0] + 4 * [-0.26, -0.1, -0.05, -0.05]),
)
HIGH = read_only(
    np.array([np.inf] * 3 + [0.5 * np.pi] * 2 + [0.5, 1.0, 1.0, 1.2] + 4 * [0.26, 1.6, 1.75, 1.4]),
)
"""Limits of a pose (25,). The palm's limits are where it is seen from its edge."""


def finger_slice(finger: int) -> slice:
    """Return where a pose holds the angles of a finger, 0 being the thumb."""
    return slice(5 + 4 * finger, 9 + 4 * finger)


def open_pose(wrist: ArrayLike, a: float = 0.0) -> Floats:
    """Return the pose (25,) of an open hand that faces the camera; its thumb is bent by 0.1 rad at both joints.

    Args:
        wrist: (2,) column and row, px.
        a: Turn on the screen, rad.
    """
    pose = np.zeros(ANGLES)
    pose[:2], pose[2] = wrist, a
    pose[7:9] = 0.1
    return pose


@compiled
def palm_axes(pose: Floats, scale: float, side: float) -> Floats:
    """Return (3, 3), px in the picture by palm axes in the hand: scale R with rows turned down and x on its side."""
    sines, cosines = sines_cosines(pose[2:5])
    sa, sb, sc = sines[0], sines[1], sines[2]
    ca, cb, cc = cosines[0], cosines[1], cosines[2]
    axes = np.empty((3, 3))
    axes[0, 0], axes[0, 1], axes[0, 2] = ca * cb, ca * sb * sc - sa * cc, ca * sb * cc + sa * sc
    axes[1, 0], axes[1, 1], axes[1, 2] = -sa * cb, -sa * sb * sc - ca * cc, -sa * sb * cc + ca * sc
    axes[2, 0], axes[2, 1], axes[2, 2] = -sb, cb * sc, cb * cc
    for i in range(3):
        axes[i, 0] *= scale * side
        axes[i, 1] *= scale
        axes[i, 2] *= scale
    return axes


@compiled
def joints(pose: Floats, scale: float, shape: HandShape) -> Floats:
    """Return the joints and tips (5, 4, 3) of the fingers: column, row, and height above the wrist to the camera, px.

    Args:
        pose: (25,).
        scale: Length of the palm axis, px.
        shape: Shape of the hand.
    """
    axes = palm_axes(pose, scale, shape.side)
    turns = np.empty(30)
    for finger in range(5):
        direction, flexed = shape.rest[finger] + pose[5 + 4 * finger], 0.0
        for j in range(3):
            flexed += pose[6 + 4 * finger + j]
            turns[3 * finger + j] = direction + 0.7 * flexed if finger == 0 else direction
            turns[15 + 3 * finger + j] = 0.5 * flexed if finger == 0 else flexed
    sines, cosines = sines_cosines(turns)
    found = np.empty((5, 4, 3))
    for finger in range(5):
        x, y, z = shape.roots[finger, 0], shape.roots[finger, 1], shape.roots[finger, 2]
        for j in range(4):
            if j > 0:
                length, at = shape.phalanges[finger, j - 1], 3 * finger + j - 1
                forward = length * cosines[15 + at]
                x -= forward * sines[at]
                y += forward * cosines[at]
                z += length * sines[15 + at]
            for i in range(3):
                base = pose[i] if i < 2 else 0.0
                found[finger, j, i] = base + axes[i, 0] * x + axes[i, 1] * y + axes[i, 2] * z
    return found


@compiled
def palm_points(pose: Floats, scale: float, shape: HandShape) -> Floats:
    """Return the corners (18, 2) of the palm's plate in the picture, px: its near side, then its far one."""
    axes = palm_axes(pose, scale, shape.side)
    count = shape.outline.shape[0]
    found = np.empty((2 * count, 2))
    for n in range(2 * count):
        x, y = shape.outline[n % count, 0], shape.outline[n % count, 1]
        z = shape.thickness if n < count else -shape.thickness
        for i in range(2):
            found[n, i] = pose[i] + axes[i, 0] * x + axes[i, 1] * y + axes[i, 2] * z
    return found


@compiled
def arm_corners(pose: Floats, scale: float, shape: HandShape) -> Floats:
    """Return the corners (4, 2) of the forearm, px: it turns with a alone."""
    sines, cosines = sines_cosines(pose[2:3])
    across, along = scale * shape.arm[0], scale * shape.arm[1]
    found = np.empty((4, 2))
    for n in range(4):
        x = across if 0 < n < 3 else -across
        y = -along if n > 1 else 0.0
        found[n, 0] = pose[0] + cosines[0] * x - sines[0] * y
        found[n, 1] = pose[1] - sines[0] * x - cosines[0] * y
    return found


@compiled
def capsule(first: Floats, first_radius: float, second: Floats, second_radius: float) -> Floats:
    """Return a convex polygon (m, 2) around two discs, with at most 24 corners, px.

    Its straight sides touch both discs; the arcs have a corner in each of sixteen directions. If one disc lies within
    the other, the result is the polygon of the larger one.

    Args:
        first: (2,) or longer, centre of one disc.
        first_radius: Its radius.
        second: (2,) or longer, centre of the other.
        second_radius: Its radius.
    """
    found = np.empty((MOST_CORNERS, 2))
    x, y = second[0] - first[0], second[1] - first[1]
    apart = np.sqrt(x * x + y * y)
    size = 0
    if apart <= abs(first_radius - second_radius) + 1e-9:
        centre, radius = (first, first_radius) if first_radius >= second_radius else (second, second_radius)
        for k in range(AROUND):
            found[k, 0] = centre[0] + radius * DIRECTIONS[k, 0]
            found[k, 1] = centre[1] + radius * DIRECTIONS[k, 1]
        return found[:AROUND]
    x, y = x / apart, y / apart
    # The normals of the straight sides, in the frame of the axis: (cosine, +-sine).
    cosine = (first_radius - second_radius) / apart
    sine = np.sqrt(1.0 - cosine * cosine)
    # Directions run from that of the axis once round: over the second disc's arc, the first one's, and the second's.
    last = True
    for k in range(AROUND + 1):
        on_second = k == AROUND or DIRECTIONS[k, 0] > cosine
        if on_second != last:
            across = sine if last else -sine
            for turn in range(2):
                centre, radius = (second, second_radius) if (turn == 0) == last else (first, first_radius)
                found[size, 0] = centre[0] + radius * (cosine * x - across * y)
                found[size, 1] = centre[1] + radius * (cosine * y + across * x)
                size += 1
            last = on_second
        if k < AROUND:
            centre, radius = (second, second_radius) if on_second else (first, first_radius)
            found[size, 0] = centre[0] + radius * (DIRECTIONS[k, 0] * x - DIRECTIONS[k, 1] * y)
            found[size, 1] = centre[1] + radius * (DIRECTIONS[k, 0] * y + DIRECTIONS[k, 1] * x)
            size += 1
    return found[:size]


@compiled
def parts(pose: Floats, scale: float, shape: HandShape) -> tuple[Floats, Ints]:
    """Return the convex polygons (17, 24, 2) of all parts in the picture, px, and the number of corners (17,) of each.

    The forearm is the first, the palm the second, phalanx j of finger f, both counted from 0, number 2 + 3 f + j.

    Args:
        pose: (25,).
        scale: Length of the palm axis, px.
        shape: Shape of the hand.
    """
    corners, counts = np.zeros((17, MOST_CORNERS, 2)), np.empty(17, np.int64)
    places = joints(pose, scale, shape)
    for part in range(17):
        if part == 0:
            outline = arm_corners(pose, scale, shape)
        elif part == 1:
            outline = convex_hull(palm_points(pose, scale, shape))
        else:
            finger, j = (part - 2) // 3, (part - 2) % 3
            near, far = scale * shape.radii[finger, j], scale * shape.radii[finger, j + 1]
            outline = capsule(places[finger, j], near, places[finger, j + 1], far)
        counts[part] = outline.shape[0]
        for n in range(outline.shape[0]):
            corners[part, n, 0], corners[part, n, 1] = outline[n, 0], outline[n, 1]
    return corners, counts


def silhouette(pose: ArrayLike, scale: float, shape: HandShape, size: tuple[int, int]) -> Bools:
    """Return the silhouette (height, width) of a hand with its arm; parts outside the picture are left out.

    Args:
        pose: (25,).
        scale: Length of the palm axis, px.
        shape: Shape of the hand.
        size: Width and height of the picture, px.
    """
    return fill(*parts(np.array(pose, np.float64), float(scale), shape), size[1], size[0])
