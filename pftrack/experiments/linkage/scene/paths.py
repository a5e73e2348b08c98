"""How the joints of a chain move: keys between which the angles are eased (docs/methods/linkages.md).

Shimada gives no sequence in numbers; these are made to show what he describes.
"""

from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from pftrack.core.numerics.trigonometry import sines_cosines

__all__ = ["LENGTH", "PATHS", "PathName", "ease", "move", "swinging", "turn"]

PathName: TypeAlias = Literal["cross", "static", "mirror3", "mirror2", "two", "3d", "own"]

Keys: TypeAlias = tuple[tuple[float, float, float, float], ...]
"""(frame, theta_1, theta_2, theta_3), the angles in rad, each relative to the link before."""

PATHS: dict[PathName, Keys] = {
    "cross": ((0, 1.35, 0.95, 1.35), (18, 1.35, 0.95, 0.84), (26, 1.35, 0.93, 0.6), (50, 1.25, 0.6, 0.15)),
    "static": ((0, 1.1, 0.9, 0.85), (299, 1.1, 0.9, 0.85)),
    "mirror3": ((0, 1.35, 0.95, 1.35), (30, 1.35, 0.95, 0.84), (45, 1.35, 0.93, 0.6), (90, 1.25, 0.6, 0.15)),
    "mirror2": ((0, -1.5, 0.2, 0.1), (20, -1.2, 0.6, 0.4), (40, -1.0, 0.8, 0.7), (80, -0.9, 1.3, 1.0)),
    "two": (
        (0, 0.2, 0.4, 0.3),
        (30, -0.15, 0.5, 0.15),
        (70, -1.25, 1.5, 1.4),
        (90, -1.4, 1.55, 1.54),
        (160, -2.85, 1.55, 1.54),
        (180, -3.05, 1.55, 1.54),
        (200, -2.8, 1.55, 1.54),
    ),
    "3d": ((0, 0.0, 0.5, 0.4), (70, 0.0, 1.1, 0.9), (140, 0.0, 1.5, 1.4), (199, 0.0, 1.0, 0.8)),
}

OWN_FRAMES = 300

LENGTH: dict[PathName, int] = {name: int(keys[-1][0]) + 1 for name, keys in PATHS.items()} | {"own": OWN_FRAMES}
"""Frames of each path."""

TURN_RAD, TURN_RATE, TURN_PHASE, TURN_OFF_RAD = (
    np.array([0.45, 0.45, 0.3]),
    np.array([0.016, 0.013, 0.01]),
    np.array([0.0, 0.3, 0.0]),
    np.array([0.0, -0.1, 0.0]),
)
"""The attitude in space: amplitude, rad a frame, phase, and what is added."""

MOVE_PX, MOVE_RATE = np.array([10.0, 8.0]), np.array([0.05, 0.04])


def ease(keys: Keys, frame: float) -> NDArray[np.float64]:
    """Return the angles (3,) in a frame, rad: between two keys the weight of the later is (1 - cos(pi u)) / 2."""
    last = keys[0]
    for key in keys:
        if frame <= key[0]:
            u = (frame - last[0]) / (key[0] - last[0]) if key[0] > last[0] else 1.0
            weight = 0.5 - 0.5 * float(sines_cosines(np.array([np.pi * u]))[1][0])
            return np.asarray(np.array(last[1:]) + weight * (np.array(key[1:]) - np.array(last[1:])))
        last = key
    return np.array(last[1:])


def swinging(one: NDArray[np.float64], other: NDArray[np.float64], swing: int, frame: float) -> NDArray[np.float64]:
    """Return the angles (3,) of joints that go from one end to the other in `swing` frames, and back again, rad."""
    weight = 0.5 - 0.5 * float(sines_cosines(np.array([np.pi * frame / swing]))[1][0])
    return np.asarray(one + weight * (other - one))


def turn(frame: float) -> NDArray[np.float64]:
    """Return the attitude of the chain in space, a rotation vector (3,) in rad relative to the reference."""
    return np.asarray(TURN_RAD * sines_cosines(TURN_RATE * frame + TURN_PHASE)[0] + TURN_OFF_RAD)


def move(frame: float) -> NDArray[np.float64]:
    """Return how far its root has moved in the picture (2,), px."""
    return np.asarray(MOVE_PX * sines_cosines(MOVE_RATE * frame)[0])
