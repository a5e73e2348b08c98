"""What is believed of a target that is tracked by the colours of its window."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from pftrack.core.numerics.elementary import exponential
from pftrack.experiments.shared.point_state import PointState
from pftrack.vision.likelihoods.background import NO_BACKGROUND, Background
from pftrack.vision.likelihoods.colour_bins import BINS, Space
from pftrack.vision.likelihoods.histogram import Window

__all__ = ["DIMENSION", "SIZE", "VELOCITY", "HistogramState", "Look"]

DIMENSION = 5
"""Of the state: position (u, v) in px, velocity in px/frame, logarithm of the size beside the first one."""
VELOCITY = slice(2, 4)
SIZE = 4
"""Which coordinates velocity and size are."""


@dataclass(frozen=True, slots=True, eq=False)
class Look:
    """What the target looked like when it was marked.

    Attributes:
        patch_rgb: (h, w, 3) the part of the picture in which the window and its surroundings lie.
        middle: (2,) of the window within the patch, px.
        window: Its shape; kernel and parts are chosen later.
        size_px: Width and height as they were marked; those of the window are odd.
    """

    patch_rgb: NDArray[np.uint8]
    middle: NDArray[np.float64]
    window: Window
    size_px: tuple[float, float]


@dataclass(frozen=True, slots=True)
class HistogramState(PointState):
    """The posterior of one frame, immutable: that of the point, and what is known of its window.

    Attributes:
        look: How the target looked first.
        space: Of the colours that the model counts.
        kernel: Whether it counts the middle more.
        parts: Into how many parts it divides the window, across and down.
        model: q (110 in each part).
        background: What is around the target, as far as it counts.
        background_use: Whether bins are weighed by it, and how much contrast counts.
        view: The last picture, small and grey, if the camera is followed.
        likeness: rho of the window at the estimate.
        missed: For how many frames in a row that has been too low.
        searching: Whether the target is lost, and looked for; None while that is never done.
    """

    look: Look | None = None
    space: Space = "hsv"
    kernel: bool = False
    parts: tuple[int, int] = (1, 1)
    model: NDArray[np.float64] = field(default_factory=lambda: np.full(BINS, 1.0 / BINS))
    background: Background = NO_BACKGROUND
    background_use: tuple[bool, float] = (False, 0.0)
    view: NDArray[np.uint8] | None = None
    likeness: float = 1.0
    missed: int = 0
    searching: bool | None = None

    @property
    def scale(self) -> float:
        """Size of the window beside the first one."""
        return float(exponential(self.posterior.mean[SIZE]))

    @property
    def window(self) -> Window:
        """The window at the estimate."""
        first = self.first_window
        half_width, half_height = (
            int(np.floor(self.scale * half + 0.5)) for half in (first.reach_across_px, first.reach_down_px)
        )
        return Window(half_width, half_height, self.kernel, self.parts)

    @property
    def first_window(self) -> Window:
        """The window that was marked.

        Raises:
            ValueError: The state was made without a target.
        """
        first = self.first_look.window
        return Window(first.reach_across_px, first.reach_down_px, self.kernel, self.parts)

    @property
    def first_look(self) -> Look:
        """How the target looked first.

        Raises:
            ValueError: The state was made without a target.
        """
        if self.look is None:
            raise ValueError("a target's window is known from its start on, got a state without one")
        return self.look

    @property
    def whole_model(self) -> NDArray[np.float64]:
        """The model of all parts together, (110,)."""
        return np.asarray(self.model.reshape(-1, BINS).sum(axis=0))

    @property
    def box_px(self) -> tuple[float, float]:
        """Width and height of what was marked, at the size of the estimate, px."""
        width, height = self.first_look.size_px
        return self.scale * width, self.scale * height
