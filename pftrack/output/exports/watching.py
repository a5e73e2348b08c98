"""Watching a recording while it is written: the scene follows the newest frame as the loop runs.

The recorder says whenever something has been written; the file is read as far as it is whole, and the newest frames
become a run that takes the place of the one that is shown. Nothing here is waited for by the loop.
"""

import threading
from pathlib import Path

from pftrack.core.model.sequence import FrameIndex
from pftrack.experiments.experiment import Experiment
from pftrack.output.exports.viewers import Shown, show
from pftrack.runs.run import Run
from pftrack.sources.beliefs.sequence import BeliefSequence
from pftrack.sources.errors import SourceError
from pftrack.sources.limits import DEFAULT_LIMITS

__all__ = ["Watcher"]

SPAN = 1000
"""Frames: so many at least, and twice as many at most, are computed anew whenever something has been written."""

GROWING = "0" * 64
"""In the place of a digest: what grows has none yet."""


class Watcher:
    """Shows a recording that is being written.

    Attributes:
        shown: The scene; None before there is a frame.
        failure: Why it is not shown; None as long as it is.
    """

    def __init__(
        self, experiment: Experiment, path: Path, *, clip: Path | None = None, browser: bool | None = None
    ) -> None:
        """Begin to watch, in a thread of its own.

        Args:
            experiment: What shows recordings of beliefs.
            path: The file.
            clip: The clip that it is of, where that is not in it.
            browser: Whether to open a browser; as `show` does if not given.
        """
        self._experiment, self._path, self._clip, self._browser = experiment, path, clip, browser
        self.shown: Shown | None = None
        self.failure: Exception | None = None
        self._index: FrameIndex | None = None
        self._news, self._is_over = threading.Event(), False
        self._thread = threading.Thread(target=self._watch, name="pftrack watcher", daemon=True)
        self._thread.start()

    def tell(self) -> None:
        """Say that something has been written."""
        self._news.set()

    def end(self) -> None:
        """Say that nothing more will be written; the last frame is shown, and the scene stays open."""
        self._is_over = True
        self._news.set()
        self._thread.join()

    def _watch(self) -> None:
        while not self._is_over and self.failure is None:
            self._news.wait()
            self._news.clear()
            try:
                self._show()
            except SourceError:
                continue  # nothing whole is in the file yet
            except Exception as error:  # noqa: BLE001 - the loop goes on, whatever is wrong with a picture of it
                self.failure = error

    def _show(self) -> None:
        run = self._newest()
        if self.shown is None:
            self.shown = show(run, browser=self._browser)
        else:
            self.shown.follow(run)

    def _newest(self) -> Run:
        """Return the newest frames as a run that stands at the last."""
        sequence = BeliefSequence(
            self._path.open("rb"),
            name=self._path.name,
            sha256=GROWING,
            limits=DEFAULT_LIMITS,
            index=self._index,
            clip=self._clip,
        )
        self._index = sequence.index
        if self._experiment.on_video is None:
            raise ValueError(f"{self._experiment.id} takes no recording")
        last = min(sequence.content.last - sequence.first, sequence.frame_count - 1)
        setup = self._experiment.on_video(sequence, None, start=max(last // SPAN - 1, 0) * SPAN)
        start = 0 if setup.footage is None else setup.footage.start
        run = Run(self._experiment, setup, frames=last - start + 1)
        run.finish()
        return run
