"""What is true of many points that move, as far as it is known, and which of them is looked at."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.frame import Target
from pftrack.core.model.parameters import Parameters, parameter

__all__ = ["Motion", "Origin", "SelectionParameters", "TrajectoriesTarget"]


class SelectionParameters(Parameters):
    """Which track the run's estimate and error are of."""

    # fmt: off
    selected_track: int = parameter(
        0, "Selected track", "Number of the track that is looked at closely; its position is the run's estimate.",
        ge=0, le=399, step=1, group="Selection")
    # fmt: on


class Motion(Protocol):
    """How the points of a scene truly move."""

    def path(self, points: NDArray[np.float64], index: int, born: NDArray[np.int64]) -> NDArray[np.float64]:
        """Return where points of the scene are in a frame, (K, 2) px; NaN where that is not known.

        Args:
            points: (K, 2) where each was in the frame in which it was taken up, px.
            index: Number of the frame.
            born: (K,) number of the frame in which each was taken up.
        """


@dataclass(frozen=True, slots=True, eq=False)
class Origin:
    """What tracks of a file were in the file.

    Attributes:
        names: (K,) of the tracks.
        scale: px of the picture for a unit of the file.
        corner: (2,) where the picture's corner is, in the file's unit.
        first_frame: Number in the file of the frame 0 of the run.
    """

    names: tuple[str, ...]
    scale: float
    corner: NDArray[np.float64]
    first_frame: int


@dataclass(frozen=True, slots=True)
class TrajectoriesTarget(Target):
    """Many points; `position` is that of the selected one.

    Attributes:
        motion: How they truly move; None where that is not known.
        start_px: (K, 2) where they are in frame 0, if which points are followed is known beforehand.
        origin: What they were in a file; None for others.
        paper: Width and height of what is drawn on where there are no pictures, px.
    """

    motion: Motion | None = None
    start_px: NDArray[np.float64] | None = None
    origin: Origin | None = None
    paper: tuple[int, int] = (0, 0)
