"""What a run has seen, as a source that no parameter and no seed changes."""

from typing import Any, Final

from pftrack.core.model.frame import Frame
from pftrack.core.model.source import History
from pftrack.runs.run import Run

__all__ = ["SeenSource"]

KEPT_BYTES: Final = 512 * 2**20
"""Of pictures that are kept, so that hundreds of runs over a recording do not decode it hundreds of times."""


class SeenSource:
    """The frames of a run, with all that was changed in its scene."""

    noisy = False

    def __init__(self, run: Run, frames: int) -> None:
        """Keep what can be kept.

        Args:
            run: Whose frames they are.
            frames: How many there are.
        """
        self.size, self.frame_rate_hz, self.start = run.source.size, run.source.frame_rate_hz, run.source.start
        self.frame_count: int | None = frames
        self._source, self._history = run.source, run.timeline.history
        self._kept: dict[int, Frame] = {}
        self._left = KEPT_BYTES

    def frame(self, index: int, history: History[Any]) -> Frame:
        """Return a frame; the parameters of who asks change nothing."""
        del history
        kept = self._kept.get(index)
        if kept is None:
            kept = self._source.frame(index, self._history)
            size = 0 if kept.image_rgb is None else kept.image_rgb.nbytes
            if size <= self._left:
                self._kept[index], self._left = kept, self._left - size
        return kept
