"""Tracks of a file as a source, from a chosen frame on, and what is true and known beforehand of their body."""

from dataclasses import dataclass, field

import numpy as np

from pftrack.core.arrays import Floats
from pftrack.core.model.parameters import Parameters
from pftrack.core.model.source import Frame, History, Measurements, Target
from pftrack.sources.recording import check_start
from pftrack.sources.tracks.sequence import TrackSequence
from pftrack.sources.tracks.table import Shape, named_shape


@dataclass(frozen=True, slots=True)
class BodyTarget(Target):
    """A body: `position` is its shape (3 n,), about its centre and of unit size; zero where that is not known.

    Attributes:
        shape: What is between its points, and what others of the kind look like; a tracker may know that.
        principal_px: (2,) where the camera's axis meets the picture.
        focal_px: Of the camera.
        turn: (3, 3) from the body's frame to the camera's.
        translation: (3,) the body's centre in the camera's frame, in units of the body's size.
    """

    shape: Shape = field(default_factory=lambda: Shape(()))
    principal_px: Floats = field(default_factory=lambda: np.zeros(2))
    focal_px: float = 1000.0
    turn: Floats = field(default_factory=lambda: np.eye(3))
    translation: Floats = field(default_factory=lambda: np.zeros(3))


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
