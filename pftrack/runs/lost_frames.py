"""In which frames of a run the target is lost, and who says so."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.diagnostics import Diagnostics
from pftrack.core.model.loss_witness import LossVerdict, Witness, judge_loss
from pftrack.runs.run import Run

__all__ = ["LostFrames", "find_lost_frames", "judge_rows"]


@dataclass(frozen=True)
class LostFrames:
    """What is said of the L frames that a run has computed.

    Attributes:
        verdicts: Of each frame.
    """

    verdicts: tuple[LossVerdict, ...]

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
    return judge_rows(run.diagnostics)


def judge_rows(rows: Sequence[Diagnostics]) -> LostFrames:
    """Return what is said of the frames of some rows."""
    return LostFrames(tuple(judge_loss(row.lost, row.searching) for row in rows))
