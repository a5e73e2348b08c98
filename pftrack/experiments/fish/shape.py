"""The outline of a fish from above that bends at the root of its tail (Mitsugami et al. 2009, section 3.1).

The body is an ellipse, the tail a straight line that begins at the rear end of its long axis. A *pose* is (a, b, theta,
phi): the centre of the ellipse in px, the direction to the head and the bend of the tail against the body's axis in
rad, positive clockwise on the screen. What is painted, and counts as the silhouette, has a tail of some width.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["GOLDFISH", "FishShape", "body_points", "inside", "model_points", "tail_corners", "tail_line"]

BODY_POINTS, TAIL_POINTS = 24, 8
"""Of the model that is compared with edges."""

ROOT_INSIDE, ROOT_HALF_WIDTH, TIP_HALF_WIDTH = 6.0 / 40.0, 4.5 / 15.0, 2.0 / 15.0
"""How far inside the body the painted tail begins, in half lengths, and its half widths, in half widths of the body."""


class FishShape(NamedTuple):
    """What does not change: the semi-axes of the body's ellipse and the length of the tail, px."""

    half_length: float
    half_width: float
    tail_length: float

    @property
    def reach(self) -> float:
        """How far the tip of a straight tail is from the body's centre, px."""
        return self.half_length + self.tail_length


GOLDFISH = FishShape(40.0, 15.0, 40.0)
"""Of the simulated tank."""


def body_points(pose: NDArray[np.float64], shape: FishShape, count: int = BODY_POINTS) -> NDArray[np.float64]:
    """Return points of the body's outline (..., count, 2), px, of poses (..., 4)."""
    around = 2.0 * np.pi * (np.arange(count) + 0.5) / count
    along, across = shape.half_length * np.cos(around), shape.half_width * np.sin(around)
    cosine, sine = np.cos(pose[..., 2, None]), np.sin(pose[..., 2, None])
    x = pose[..., 0, None] + cosine * along - sine * across
    y = pose[..., 1, None] + sine * along + cosine * across
    return np.stack([x, y], axis=-1)


def tail_line(pose: NDArray[np.float64], shape: FishShape) -> NDArray[np.float64]:
    """Return root and tip of the tail (..., 2, 2), px, of poses (..., 4)."""
    body, tail = pose[..., 2], pose[..., 2] + pose[..., 3]
    root = pose[..., :2] - shape.half_length * np.stack([np.cos(body), np.sin(body)], axis=-1)
    return np.stack([root, root - shape.tail_length * np.stack([np.cos(tail), np.sin(tail)], axis=-1)], axis=-2)


def model_points(pose: NDArray[np.float64], shape: FishShape) -> NDArray[np.float64]:
    """Return all points that are compared with edges (..., 32, 2), px: of the body's outline, then of the tail."""
    ends = tail_line(pose, shape)
    share = (np.arange(TAIL_POINTS) + 1.0)[:, None] / TAIL_POINTS
    tail = ends[..., :1, :] + share * (ends[..., 1:, :] - ends[..., :1, :])
    return np.concatenate([body_points(pose, shape), tail], axis=-2)


def tail_corners(pose: NDArray[np.float64], shape: FishShape) -> NDArray[np.float64]:
    """Return the corners (4, 2) of the tail as it is painted, px, of a pose (4,): it begins inside the body."""
    root, tip = tail_line(pose, shape)
    begin = root + ROOT_INSIDE * shape.half_length * np.array([np.cos(pose[2]), np.sin(pose[2])])
    across = shape.half_width * np.array([-np.sin(pose[2] + pose[3]), np.cos(pose[2] + pose[3])])
    wide, narrow = ROOT_HALF_WIDTH * across, TIP_HALF_WIDTH * across
    return np.array([begin + wide, tip + narrow, tip - narrow, begin - wide])


def inside(point: NDArray[np.float64], pose: NDArray[np.float64], shape: FishShape) -> bool:
    """Return whether a point (2,) lies within the silhouette of a pose (4,): the body and the tail as it is painted."""
    cosine, sine = np.cos(pose[2]), np.sin(pose[2])
    x, y = point - pose[:2]
    along, across = cosine * x + sine * y, cosine * y - sine * x
    if (along / shape.half_length) ** 2 + (across / shape.half_width) ** 2 <= 1.0:
        return True
    corners = tail_corners(pose, shape)
    edges, ways = np.roll(corners, -1, axis=0) - corners, point - corners
    sides = edges[:, 0] * ways[:, 1] - edges[:, 1] * ways[:, 0]
    return bool((sides >= 0.0).all() or (sides <= 0.0).all())
