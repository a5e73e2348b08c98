"""Frames: what a source shows at one instant, and what is known to be true of it."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.belief import Beliefs

__all__ = ["Backdrop", "Frame", "Landmarks", "Measurements", "Target"]


@dataclass(frozen=True, slots=True, eq=False)
class Landmarks:
    """Named points of a solid target.

    Attributes:
        points_px: (F, 2) where they are in the picture.
        visible: (F,) whether each is seen.
        model_mm: (F, 3) where they are in the target's own frame, as far as that is known.
        names: Of the points.
    """

    points_px: NDArray[np.float64]
    visible: NDArray[np.bool_]
    model_mm: NDArray[np.float64]
    names: tuple[str, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Measurements:
    """Positions of F points as they were measured, with noise that is known.

    Attributes:
        points_px: (F, 2) in the picture; NaN for a point that was not measured.
        sd_px: (F,) standard deviation of each measurement, or (F, 2) where it is not the same across and down; infinite
            for a point that was not measured.
    """

    points_px: NDArray[np.float64]
    sd_px: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Target:
    """Where the target truly is.

    Attributes:
        position: (d,) centre; (u, v) in px of the picture with u the column and v the row; or the signal's value; or
            the pose of a solid, (theta_x, theta_y, theta_z) in rad.
        size: Longer side of the box around it, px; 0 for a signal.
        hidden: Whether it is known to be out of sight; None for what cannot be, such as a signal.
        landmarks: Its points, if it is a solid that is tracked by them.
        extent: Width and height of the box around it, px; None for a target without one, such as a signal or a pose.
    """

    position: NDArray[np.float64]
    size: float = 0.0
    hidden: bool | None = False
    landmarks: Landmarks | None = None
    extent: tuple[float, float] | None = None


class Backdrop(Protocol):
    """Pictures of a source that tell what is behind its target; it can be a key, and the same one has the same."""

    def pictures(self, first: int) -> Iterator[NDArray[np.uint8]]:
        """Return some of the first so many pictures (height, width, 3), or with 0 some of all, evenly."""

    def __hash__(self) -> int:
        """Return the same for the same pictures."""


@dataclass(frozen=True, slots=True)
class Frame:
    """One instant of a source.

    Attributes:
        index: Number of the frame within the run, from 0.
        time_s: Time since frame 0, s.
        image_rgb: (height, width, 3) uint8, read-only, or None for a signal.
        signal: (d,) observed values, or None for a picture.
        measurements: Measured points, or None where the picture is all there is.
        target: The truth, or None where it is not known.
        backdrop: Where to see what is behind the target, or None where nothing tells.
        beliefs: What others believe of it, or None where nothing but the frame is given.
    """

    index: int
    time_s: float
    image_rgb: NDArray[np.uint8] | None = None
    signal: NDArray[np.float64] | None = None
    measurements: Measurements | None = None
    target: Target | None = None
    backdrop: Backdrop | None = None
    beliefs: Beliefs | None = None
