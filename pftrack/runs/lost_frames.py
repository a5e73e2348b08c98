"""In which frames of a run the target is lost, and who says so."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pftrack.model.diagnostics import Diagnostics
from pftrack.model.loss_witness import LossVerdict, Witness, judge_loss
from pftrack.runs.loss_probability import loss_probabilities
from pftrack.runs.run import Run

__all__ = ["LostFrames", "find_lost_frames", "judge_rows"]


@dataclass(frozen=True)
class LostFrames:
    """What is said of the L frames that a run has computed.

    Attributes:
        verdicts: Of each frame.
        probabilities: (L,) that the target is lost, by the tracker's own numbers; NaN where nothing tells it.
    """

    verdicts: tuple[LossVerdict, ...]
    probabilities: NDArray[np.float64]

    @property
    def lost(self) -> NDArray[np.bool_]:
        """(L,) whether the target is lost; of frames of which nobody says anything it is not."""
        return np.array([one.lost is True for one in self.verdicts], dtype=np.bool_)

    @property
    def witnesses(self) -> tuple[Witness, ...]:
        """Who says so of each frame."""
        return tuple(one.witness for one in self.verdicts)


def find_lost_frames(run: Run) -> LostFrames:
    """Return in which frames a run has lost its target, as far as it has been computed."""
    return judge_rows(run.diagnostics, loss_probabilities(run))


def judge_rows(rows: Sequence[Diagnostics], probabilities: NDArray[np.float64] | None = None) -> LostFrames:
    """Return what is said of the frames of some rows, with their probabilities (L,) where these are known."""
    told = np.full(len(rows), np.nan) if probabilities is None else probabilities
    verdicts = (judge_loss(row.lost, row.searching, one) for row, one in zip(rows, told.tolist(), strict=True))
    return LostFrames(tuple(verdicts), told)
