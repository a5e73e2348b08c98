"""Tracks of a file as a source, from a chosen frame on."""

import numpy as np

from pftrack.core.model.frame import Frame, Measurements, Target
from pftrack.core.model.parameters import Parameters
from pftrack.core.model.source import History
from pftrack.sources.recording import check_start
from pftrack.sources.tracks.bodies import named_shape
from pftrack.sources.tracks.sequence import TrackSequence
from pftrack.sources.tracks.target import BodyTarget

__all__ = ["RecordedTracks", "body_of"]

FAR = 10.0
"""The focal length that is assumed, in longer sides of the picture: with a long one a body is seen without perspective,
and little is wrong whatever the camera was."""


def body_of(sequence: TrackSequence) -> BodyTarget:
    """Return what is known of a body beforehand: how many points it has, and its shape if they have a face's names."""
    return BodyTarget(
        np.zeros(3 * len(sequence.names)),
        hidden=None,
        shape=named_shape(sequence.names),
        principal_px=np.array(sequence.size) / 2.0,
        focal_px=FAR * max(sequence.size),
    )


class RecordedTracks:
    """The frames of a table of tracks.

    Attributes:
        size: Width and height of the picture, px.
        frame_rate_hz: Frames a second.
        frame_count: Frames from the chosen one to the end.
        start: What is known beforehand.
        noisy: The frames do not depend on the seed.
    """

    noisy = False

    def __init__(self, sequence: TrackSequence, start: Target, first: int = 0) -> None:
        """Wire tracks up from the frame `first` of the sequence on, with what is known of them beforehand.

        Raises:
            ParameterError: That is not within the sequence.
        """
        check_start(first, sequence)
        self._sequence, self._first = sequence, first
        self.size, self.frame_rate_hz = sequence.size, sequence.frame_rate_hz
        self.frame_count: int | None = sequence.frame_count - first
        self.start = start

    def frame(self, index: int, history: History[Parameters]) -> Frame:
        """Return the tracks of a frame; the same arguments give the same frame, to the bit."""
        del history
        number = self._first + index
        sd = np.sqrt(self._sequence.variances[number])
        return Frame(index, index / self.frame_rate_hz, measurements=Measurements(self._sequence.positions[number], sd))
