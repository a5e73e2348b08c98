"""A hand guessed from what is seen of its fingers: where it is, how large, and how its fingers differ from the model's.

Place, turn and size come from places that the model has as well, such as tips and roots of straight fingers. Then each
finger that is seen gets its direction, length and width; the palm's thickness goes with the mean width.
"""

import math
from operator import itemgetter
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pftrack.experiments.hand.detection.hand_fit import FlatHand
from pftrack.experiments.hand.detection.protrusions import Protrusion
from pftrack.experiments.hand.shape import HIGH, LOW, MODEL, finger_slice, joints, open_pose

__all__ = [
    "ARM_LENGTH",
    "ROOT_BEHIND",
    "SeenFinger",
    "Similarity",
    "fold",
    "hand_of",
    "measure_finger",
    "similar",
    "unit",
]

ROOT_BEHIND = 0.10
"""How far behind the end of its protrusion a finger begins, in palm axes: the web of the fingers is wider."""
FIRST_LENGTHS, FIRST_WIDTHS = (0.5, 2.0), (0.5, 2.0)
"""Between which lengths and widths are looked for, in those of the model."""
PALM_MIDDLE = np.array([0.0, -0.62])
"""Of the model's palm, which is as far from its edge as any place is: column and row in palm axes."""
ARM_LENGTH = 4.0
"""Of the forearm, in palm axes: beyond any border."""
FLEXIONS = 41
"""Of a bent finger that are tried."""


class SeenFinger(NamedTuple):
    """One finger as it is seen: tip and where it leaves the palm (2,), and its half width, px of the mask."""

    tip: NDArray[np.float64]
    base: NDArray[np.float64]
    radius: float


def measure_finger(protrusion: Protrusion) -> SeenFinger:
    """Return the finger that a protrusion is, with the median of its half widths off the ends."""
    middle = protrusion.radii[len(protrusion.radii) // 8 : max(3 * len(protrusion.radii) // 4, 1)]
    return SeenFinger(protrusion.axis[0], protrusion.axis[-1], float(np.sort(middle)[len(middle) // 2]))


class Similarity(NamedTuple):
    """Where the model's palm is in a picture, and how well that fits.

    Attributes:
        off: Sum of squared distances between places and the model's, in palm axes.
        turn: On the screen, rad.
        scale: Length of the palm axis, px.
        wrist: (2,) px.
        side: Of the thumb, 1 or -1.
    """

    off: float
    turn: float
    scale: float
    wrist: NDArray[np.float64]
    side: float


def similar(
    seen: dict[int, SeenFinger], wrist: NDArray[np.float64] | None, side: float, palm: NDArray[np.float64] | None = None
) -> Similarity:
    """Return how far the model with straight fingers is from roots, tips and wrist, and turn, scale, wrist and side."""
    model = joints(open_pose((0.0, 0.0)), 1.0, MODEL.with_changes(side=side))[:, :, :2]
    here, there = [], []
    for finger, found in seen.items():
        way = unit(found.tip - found.base)
        length = math.dist(found.tip, found.base)
        root = found.base - ROOT_BEHIND * length / 0.9 * way
        here.append(model[finger, 3])
        there.append(found.tip)
        if finger:  # the thumb's root is hidden in the palm
            here.append(model[finger, 0])
            there.append(root)
    for place, found_at in ((np.zeros(2), wrist), (PALM_MIDDLE, palm)):
        if found_at is not None:
            here.append(place)
            there.append(found_at)
    points, places = np.array(here), np.array(there)
    middle, at = points.mean(axis=0), places.mean(axis=0)
    points, places = points - middle, places - at
    along = float((points * places).sum())
    across = float((points[:, 1] * places[:, 0] - points[:, 0] * places[:, 1]).sum())
    turn = round(math.atan2(across, along), 6)
    scale = math.hypot(along, across) / float(np.square(points).sum())
    cosine, sine = scale * math.cos(turn), scale * math.sin(turn)
    turned = np.stack(
        [cosine * points[:, 0] + sine * points[:, 1], cosine * points[:, 1] - sine * points[:, 0]], axis=1
    )
    origin = at - np.array([cosine * middle[0] + sine * middle[1], cosine * middle[1] - sine * middle[0]])
    return Similarity(float(np.square(turned - places).sum()) / (scale * scale), turn, scale, origin, side)


def hand_of(
    wrist: NDArray[np.float64], turn: float, scale: float, side: float, seen: dict[int, SeenFinger]
) -> FlatHand:
    """Return an open hand with the directions, lengths and widths of the fingers that are seen."""
    # Rounded, so that the last bits of a cosine, which differ by machine, decide about nothing.
    wrist, scale = np.round(wrist, 6), round(scale, 6)
    shape = MODEL.with_changes(side=side)
    pose = open_pose(wrist, turn)
    model = joints(pose, scale, shape)[:, :, :2]
    rest, lengths, widths = shape.rest.copy(), np.ones(5), np.ones(5)
    for finger, found in seen.items():
        expected, way = model[finger, 3] - model[finger, 0], found.tip - model[finger, 0]
        lengths[finger] = min(max(math.hypot(*way) / math.hypot(*expected), FIRST_LENGTHS[0]), FIRST_LENGTHS[1])
        widths[finger] = min(
            max(found.radius / (scale * float(shape.radii[finger].mean())), FIRST_WIDTHS[0]), FIRST_WIDTHS[1]
        )
        # Counter-clockwise on the screen; on the other side of a mirror spread is clockwise.
        turned = math.atan2(expected[1] * way[0] - expected[0] * way[1], float((expected * way).sum()))
        spread = round(side * turned, 6)
        first = finger_slice(finger).start
        pose[first] = min(max(spread, LOW[first]), HIGH[first])
        rest[finger] += spread - pose[first]
    for finger in set(range(1, 5)) - seen.keys():
        widths[finger] = np.mean([widths[other] for other in seen])
    thickness = float(np.mean(widths[1:]))
    return FlatHand(
        pose,
        scale,
        shape.with_changes(
            rest=rest,
            phalanges=shape.phalanges * lengths[:, None],
            radii=shape.radii * widths[:, None],
            thickness=shape.thickness * thickness,
            arm=(shape.arm[0], ARM_LENGTH),
        ),
    )


def fold(hand: FlatHand, tips: dict[int, NDArray[np.float64]]) -> NDArray[np.float64]:
    """Return the pose of a hand in which further fingers are bent so far that their tips are nearest to marks."""
    pose = hand.pose.copy()
    for finger, tip in tips.items():
        bends = finger_slice(finger)
        tried = []
        for flexion in np.linspace(0.0, 1.0, FLEXIONS):
            other = pose.copy()
            other[bends.start + 1 : bends.stop] = flexion * HIGH[bends.start + 1 : bends.stop]
            tried.append((math.dist(joints(other, hand.scale, hand.shape)[finger, 3, :2], tip), flexion, other))
        pose = min(tried, key=itemgetter(0, 1))[2]
    return pose


def unit(way: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a vector of unit length."""
    return np.asarray(way / max(math.hypot(*way), 1e-9))
