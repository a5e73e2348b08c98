"""How a head looks to whoever sees the picture: yaw, pitch and roll, in place of the angles of a rotation.

With d = R (0, 0, -1) the direction in which the face looks, in the camera's frame, and e = R (1, 0, 0) its eye line,

    yaw = atan2(d.x, -d.z),   pitch = asin(-d.y),   roll = atan2(e.y, e.x):

yaw is positive when the face looks towards the right side of the picture, pitch when it looks up, roll when the head is
turned clockwise in the picture. So yaw = -theta_y and pitch = -theta_x exactly; the roll is that of the eye line as it
is seen, which is theta_z only while the head looks into the camera.
"""

import numpy as np
from numpy.typing import NDArray

__all__ = ["gaze", "theta_of"]


def gaze(theta_rad: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return yaw, pitch and roll (3,), rad, of the angles (theta_x, theta_y, theta_z), rad.

    Pitch is within a quarter of a turn, yaw and roll within half a turn.
    """
    sx, sy, sz = np.sin(theta_rad)
    cx, cy, cz = np.cos(theta_rad)
    return np.array(
        [np.arctan2(-sy * cx, cy * cx), np.arcsin(np.clip(-sx, -1.0, 1.0)), np.arctan2(cx * sz, cy * cz + sy * sx * sz)]
    )


def theta_of(gaze_rad: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (theta_x, theta_y, theta_z), rad, of yaw, pitch and roll, rad; the inverse of `gaze`.

    Yaw and pitch must be within a quarter of a turn: the eye line of a head that looks away runs the other way.
    """
    yaw, pitch, roll = gaze_rad
    x, y = -pitch, -yaw
    across = np.cos(roll) * np.cos(x) - np.sin(roll) * np.sin(y) * np.sin(x)
    return np.array([x, y, np.arctan2(np.sin(roll) * np.cos(y), across)])
