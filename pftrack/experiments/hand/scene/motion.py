"""How the simulated hand moves: three motions that begin with an open hand (after Shimada 1997, section 2.8).

- *wrist*: the hand turns about its long axis until it is seen from the side, with fingers a little curled: with
  straight ones a turn either way has the same silhouette;
- *bend*: the fingers close until none is seen beside the palm;
- *occlusion*: the middle and the ring finger fold within two frames, stay folded, and come back.

Time is in frames of the motion, and need not be whole.
"""

from types import MappingProxyType
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from pftrack.core.numerics.trigonometry import sines_cosines
from pftrack.experiments.hand.shape import open_pose

__all__ = ["FRAMES", "MotionName", "folded_time", "pose_at"]

MotionName: TypeAlias = Literal["wrist", "bend", "occlusion"]

FRAMES = MappingProxyType({"wrist": 30, "bend": 30, "occlusion": 24})
"""Of each motion."""

FOUR = np.array([9, 13, 17, 21])
"""Where a pose holds the angles of the four fingers, each beginning with its spread."""
FOLDED = FOUR[1:3]
"""Those that fold in *occlusion*: the middle and the ring finger."""


def pose_at(motion: MotionName, time: float) -> NDArray[np.float64]:
    """Return the pose (25,) of a hand whose wrist is at the origin and whose fingers point upwards.

    Args:
        motion: Which of the three.
        time: In frames, from 0; after its last frame the motion stays as it is there.
    """
    pose, last = open_pose((0.0, 0.0)), FRAMES[motion] - 1.0
    match motion:
        case "wrist":
            share = _ease(time / last)
            pose[2], pose[3] = 0.10 * share, 1.05 * share
            _flex(pose, FOUR, 0.22)
        case "bend":
            share = _ease((time - 3.0) / (last - 3.0))
            _flex(pose, FOUR, 1.25 * share)
            pose[6:9] += share * (0.35 - pose[6:9])
        case "occlusion":
            pose[3] = 0.25 * sines_cosines(np.array([0.25 * time]))[0][0]
            share = min(max((time - 4.0) / 2.0, 0.0), 1.0) - min(max((time - 14.0) / 4.0, 0.0), 1.0)
            _flex(pose, FOLDED, 1.3 * share)
    return pose


def folded_time(motion: MotionName, time: float) -> float:
    """Return the time of a motion that runs forwards, then backwards, then forwards again without end."""
    last = FRAMES[motion] - 1.0
    within = time % (2.0 * last)
    return min(within, 2.0 * last - within)


def _ease(share: float) -> float:
    """Return 0 before the beginning, 1 after the end, and half a cosine between."""
    return 0.5 - 0.5 * float(sines_cosines(np.array([np.pi * min(max(share, 0.0), 1.0)]))[1][0])


def _flex(pose: NDArray[np.float64], fingers: NDArray[np.int64], angle: float) -> None:
    for first in fingers:
        pose[first + 1 : first + 4] = angle
