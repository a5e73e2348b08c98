"""Tracks of a file as a source, from a chosen frame on: what another program has followed, to be smoothed."""

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.frame import Frame, Target
from pftrack.core.model.parameters import Parameters
from pftrack.core.model.sequence import FrameSequence
from pftrack.core.model.source import History
from pftrack.experiments.trajectories.scene.target import Origin, TrajectoriesTarget
from pftrack.sources.recording import check_start
from pftrack.sources.tracks.recorded import RecordedTracks
from pftrack.sources.tracks.sequence import TrackSequence

__all__ = ["RecordedPictures", "tracks_from"]

NOWHERE: NDArray[np.float64] = np.full(2, np.nan)
NOWHERE.flags.writeable = False


def tracks_from(sequence: TrackSequence, first: int) -> RecordedTracks:
    """Return the tracks of a table from the frame `first` on, of which nothing is known but what they were in the file.

    Raises:
        ParameterError: That is not within the sequence.
    """
    origin = Origin(tuple(sequence.names), sequence.scale, sequence.origin, sequence.first_frame + first)
    return RecordedTracks(sequence, TrajectoriesTarget(NOWHERE, hidden=None, origin=origin, paper=sequence.size), first)


class RecordedPictures:
    """The pictures of a recording, in which the tracker looks for points itself.

    Attributes:
        size: Width and height of the picture, px.
        frame_rate_hz: Frames a second.
        frame_count: Frames from the chosen one to the end.
        start: Nothing is known beforehand.
        noisy: The pictures do not depend on the seed.
    """

    noisy = False

    def __init__(self, sequence: FrameSequence, first: int = 0) -> None:
        """Wire a recording up from the picture `first` on.

        Raises:
            ParameterError: That is not within the recording.
        """
        check_start(first, sequence)
        self._sequence, self._first = sequence, first
        self._times_s = sequence.times_s[first:] - sequence.times_s[first]
        self.size, self.frame_rate_hz = sequence.size, sequence.frame_rate_hz
        self.frame_count: int | None = sequence.frame_count - first
        self.start: Target = TrajectoriesTarget(NOWHERE, hidden=None)

    def frame(self, index: int, history: History[Parameters]) -> Frame:
        """Return a picture; the same arguments give the same frame, to the bit."""
        del history
        return Frame(index, float(self._times_s[index]), image_rgb=self._sequence.picture(self._first + index))
