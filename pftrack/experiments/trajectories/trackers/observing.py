"""Where the points of a frame are measured: given with it, or by following corners through its picture."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.frame import Frame
from pftrack.experiments.trajectories.scene.target import TrajectoriesTarget
from pftrack.experiments.trajectories.trackers.corner_parameters import CornerParameters
from pftrack.experiments.trajectories.trackers.corners import Corners, begin, follow

__all__ = ["Observation"]


@dataclass(frozen=True, eq=False)
class Observation:
    """What is seen of K tracks in a frame; it depends on no random numbers of a tracker.

    Attributes:
        corners: That are looked for in pictures; None where measurements are given.
        points: (K, 2) px, both NaN where a track has no measurement.
        again: (K,) whose corners have just given their places to others, so that another track begins there.
        gone: (K,) of which nobody knows any more where they would be.
    """

    corners: Corners | None
    points: NDArray[np.float64]
    again: NDArray[np.bool_]
    gone: NDArray[np.bool_]

    @classmethod
    def first(cls, target: TrajectoriesTarget, frame: Frame, parameters: object) -> Self:
        """Observe the first frame: its measurements, or the corners of its picture."""
        if frame.image_rgb is None:
            corners, points = None, _measure(frame)
        else:
            corners, points = begin(*_picture(frame, parameters), target.start_px)
        none = np.zeros(len(points), np.bool_)
        return cls(corners, points, none, none)

    @classmethod
    def following(cls, corners: Corners | None, frame: Frame, parameters: object) -> Self:
        """Observe a further frame, given the corners of the one before."""
        if corners is None:
            points = _measure(frame)
            none = np.zeros(len(points), np.bool_)
            return cls(None, points, none, none)
        image, matching = _picture(frame, parameters)
        found, points = follow(corners, image, matching, frame.index)
        return cls(found, points, found.born == frame.index, found.gone)


def _picture(frame: Frame, parameters: object) -> tuple[NDArray[np.uint8], CornerParameters]:
    if frame.image_rgb is None or not isinstance(parameters, CornerParameters):
        raise ValueError("corners are followed in pictures, with parameters of matching; got a frame or values without")
    return frame.image_rgb, parameters


def _measure(frame: Frame) -> NDArray[np.float64]:
    """Return the measurements (K, 2) of a frame, both NaN where either is missing."""
    if frame.measurements is None:
        raise ValueError("a tracker of trajectories needs measured points, got a frame without them")
    points = frame.measurements.points_px
    return np.where(np.isfinite(points).all(axis=1, keepdims=True), points, np.nan)
