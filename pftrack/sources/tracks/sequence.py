"""A table of tracks as a sequence: its frames can be looked at as pictures of dots, and a tracker is given the tracks.

So a table goes the ways of a video: it is surveyed once, kept with its index, and named by the hash of its content. It
says nothing of the picture that it comes from, so that is taken to be as large as what is seen of the points.
"""

import zlib
from collections.abc import Sequence
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray
from typing_extensions import override

from pftrack.core.arrays import Floats
from pftrack.core.geometry.polygons import paint_disc
from pftrack.core.model.parameters import Parameters
from pftrack.core.model.source import Frame, FrameIndex, FrameSequence, History, Measurements, Target
from pftrack.sources.limits import Limits, SourceError
from pftrack.sources.tracks.table import LARGEST_FILE_BYTES, read_tracks

FRAME_RATE_HZ = 30.0
LONGEST_PX, SHORTEST_PX, USUAL_PX = 1280, 200, 640
"""Of the picture's longer side: tracks in other units than px are scaled to the usual one."""

MARGIN = 0.08
TRUSTED = 5.0
"""A position whose standard deviation is so many times the middle one says nothing of where the body is."""

LEAST_EXTENT = 1e-9
"""Up to which all points are at one place, in the unit of the table: what is smaller cannot be scaled to a picture."""

LEAST_VARIANCE_PX2 = 1e-12
"""No tracker is so exact, and of much less the inverse is no number."""

PAPER, DOT_RGB, DOT_PX = 255, (86, 180, 233), 4.0


class TrackSequence(FrameSequence):
    """Tracks of a file, in px of a picture that holds what is seen of them.

    Attributes:
        names: Of the points.
        positions: (T, n, 2) px, NaN where a point was not seen.
        variances: (T, n, 2) px^2, infinite there.
        scale: px of the picture for a unit of the file.
        origin: (2,) where the picture's corner is, in the file's unit.
        first_frame: Number in the file of the first frame.
    """

    def __init__(self, file: BinaryIO, *, name: str, sha256: str, limits: Limits) -> None:
        """Read a file, which is closed.

        Raises:
            SourceError: It is no table of tracks, or exceeds the limits.
        """
        with file:
            file.seek(0)
            data = file.read(LARGEST_FILE_BYTES + 1)
        if len(data) > LARGEST_FILE_BYTES:
            raise SourceError(f"a table of tracks may have at most {LARGEST_FILE_BYTES // 1024**2} MiB")
        table = read_tracks(data, limits.frames)
        self.name = name
        self.names: Sequence[str] = table.names
        size, scale, origin = _frame(table.positions, table.variances)
        self.scale, self.origin, self.first_frame = scale, origin, table.first
        self.positions: Floats = scale * (table.positions - origin)
        variances = scale * scale * table.variances
        self.variances: Floats = np.maximum(variances, LEAST_VARIANCE_PX2)
        scaled = [] if scale == 1.0 else [_scaling(size, scale, origin)]
        if (variances < LEAST_VARIANCE_PX2).any():
            scaled.append(f"Variances below {LEAST_VARIANCE_PX2:g} px² of the picture were raised to that.")
        for array in (self.positions, self.variances):
            array.flags.writeable = False
        self.index = FrameIndex(
            kind="tracks",
            sha256=sha256,
            width=size[0],
            height=size[1],
            frame_rate_hz=FRAME_RATE_HZ,
            times_s=tuple((np.arange(len(self.positions)) / FRAME_RATE_HZ).tolist()),
            checksums=tuple(zlib.crc32(np.nan_to_num(one).tobytes()) for one in self.positions),
            warnings=(*table.warnings, *scaled),
        )

    @override
    def _picture(self, index: int) -> NDArray[np.uint8]:
        """Return a frame as dots on white paper; what is not seen has none."""
        image = np.full((self.size[1], self.size[0], 3), PAPER, dtype=np.uint8)
        for x, y in self.positions[index][np.isfinite(self.positions[index]).all(axis=1)]:
            paint_disc(image, float(x), float(y), DOT_PX, DOT_RGB)
        image.flags.writeable = False
        return image


def _scaling(size: tuple[int, int], scale: float, origin: Floats) -> str:
    """Return what a person has to know to find a position of the file in the picture."""
    across, down = (0.0 - origin).tolist()
    return (
        f"The positions were scaled by {scale:.3g} to fit into a picture of {size[0]} x {size[1]} px: a point of the "
        f"file is at {scale:.6g} (x {across:+.4g}, y {down:+.4g}). Marks and lengths are in px of that picture."
    )


def _frame(positions: Floats, variances: Floats) -> tuple[tuple[int, int], float, Floats]:
    """Return width and height of a picture of the tracks, px, and their scale and origin in it."""
    sd = np.sqrt(variances.max(axis=2))
    known = np.isfinite(sd) & np.isfinite(positions).all(axis=2)
    trusted = known & (sd <= TRUSTED * np.median(sd[known]))
    seen = positions[trusted]
    low, high = seen.min(axis=0), seen.max(axis=0)
    longest = float((high - low).max())
    if not longest > LEAST_EXTENT:
        raise SourceError("expected points at different places, got all at one")
    margin = MARGIN * longest
    # Positions that are px of a picture stay where they are in it.
    origin = np.where((low >= 0.0) & (low < longest), np.zeros(2), low - margin)
    extent = high + margin - origin
    scale = 1.0 if SHORTEST_PX <= extent.max() <= LONGEST_PX else USUAL_PX / float(extent.max())
    width, height = (max(int(np.ceil(scale * side)), 16) for side in extent)
    return (width, height), scale, origin


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
        """Wire tracks up from the frame `first` of the sequence on, with what is known of them beforehand."""
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
