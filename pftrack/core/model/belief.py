"""Beliefs that others have computed: what a loop, or another tracker, says of its targets in one frame."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Belief", "Beliefs", "Plane"]


@dataclass(frozen=True, slots=True, eq=False)
class Belief:
    """What is believed of one target, or what is true of it: all that was said, and None for what was not.

    Attributes:
        target: Number of the target, as whoever computed it has it.
        particles: (N, d) states.
        log_weights: (N,) logarithms of their weights, which need not sum to one; None for equal ones.
        ancestors: (N,) place of each particle's parent in the frame before.
        mean: (d,) of the state, or of a position.
        covariance: (d, d) of the same.
        box: (4,) left and upper edge, width and height, px; the first pixel is 0.
        score: How sure the tracker says it is of the box; NaN if it does not say.
    """

    target: int = 0
    particles: NDArray[np.float64] | None = None
    log_weights: NDArray[np.float64] | None = None
    ancestors: NDArray[np.int64] | None = None
    mean: NDArray[np.float64] | None = None
    covariance: NDArray[np.float64] | None = None
    box: NDArray[np.float64] | None = None
    score: float = float("nan")

    @property
    def centre(self) -> NDArray[np.float64] | None:
        """(2,) middle of the box, px: a box covers whole pixels, and positions count from the centre of the first."""
        return None if self.box is None else self.box[:2] + (self.box[2:] - 1.0) / 2.0


@dataclass(frozen=True, slots=True)
class Plane:
    """Where two components of states are drawn that have no picture: px = scale * state + shift.

    Attributes:
        size: Width and height of the paper, px.
        scale: (2,) px for a unit, across and down.
        shift: (2,) px.
    """

    size: tuple[int, int]
    scale: tuple[float, float] = (1.0, 1.0)
    shift: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True, slots=True, eq=False)
class Beliefs:
    """What is believed of all targets of a frame, and what is true of them as far as it is known.

    Attributes:
        selected: Of the target that is looked at; the last one known, or else the first, where it is not `present`.
        present: Whether anything is said of it in this frame.
        others: Of the other targets.
        truths: What is true, of as many as there are.
        switches: How many true targets have another number in this frame than they had before.
        components: (tracked,) which components of the state the estimate is.
        names: Of all components; empty where they have none.
        plane: Where states are drawn.
    """

    selected: Belief
    present: bool
    others: tuple[Belief, ...]
    truths: tuple[Belief, ...]
    switches: int
    components: tuple[int, ...]
    names: tuple[str, ...]
    plane: Plane
