"""What is known beforehand of a solid that is tracked by its points, and of the camera before which it is."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["GAUSSIAN", "STUDENT_4", "STUDENT_8", "Solid", "Widths"]


class Widths(NamedTuple):
    """Half widths of the central parts of a distribution, in its standard deviations.

    Attributes:
        half: Of the central 50 %.
        most: Of the central 95 %.
    """

    half: float
    most: float


GAUSSIAN = Widths(0.674490, 1.959964)
STUDENT_4 = Widths(0.523752, 1.963243)
STUDENT_8 = Widths(0.611749, 1.997058)
"""Student's t with four and eight degrees of freedom: most is nearer, and now and then something is far off."""


@dataclass(frozen=True, slots=True, eq=False)
class Solid:
    """A rigid object with F points, and the camera before which it is.

    Attributes:
        points_mm: (F, 3) in its own frame.
        reference: (2, 4) the affine camera that sees it at theta = 0.
        focal_px: Focal length of the pinhole.
        principal_px: (2,) its principal point.
        translation_mm: (3,) where the origin of its frame was at the start, in the camera's frame.
        pinned_mm: (F, 3) the points moved to where they were seen at the start; None if shape and camera are known.
        depth_doubt: By which share its depth, along the line of sight of the start, may be wrong (standard deviation).
        misfit_share: Which share of the variance with which its points do not fit it concerns its pose.
        reach_rad: How far it turns from the start (standard deviation), if it is held; a pinhole's layer uses it.
        widths: How the errors of its pose are distributed, as far as the band is calibrated.
    """

    points_mm: NDArray[np.float64]
    reference: NDArray[np.float64]
    focal_px: float
    principal_px: NDArray[np.float64]
    translation_mm: NDArray[np.float64]
    pinned_mm: NDArray[np.float64] | None = None
    depth_doubt: float = 0.0
    misfit_share: float = 1.0
    reach_rad: float = math.inf
    widths: Widths = GAUSSIAN

    @property
    def scale(self) -> float:
        """How large a mm of it is at the start, px."""
        (a, b), (c, d) = self.reference[:, :2]
        return float(np.sqrt(abs(a * d - b * c)))
