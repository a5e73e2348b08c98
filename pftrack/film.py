"""Pictures become a film: H.264 in MP4, as every browser and lecture-room computer plays it.

A film is written under another name beside its place and renamed when it is whole, so that a run that is broken off
leaves either the old file or none, never half of one.
"""

from fractions import Fraction
from pathlib import Path
from types import TracebackType
from typing import Self

import av
import numpy as np
from numpy.typing import NDArray

from pftrack.files import part_of, settle

__all__ = ["FilmWriter"]


class FilmWriter:
    """Writes pictures of one size to an MP4 file; a context manager.

    The film appears at its place on leaving the context, and not at all if that is by an error. H.264 in its common
    form wants even sides: an odd picture gets one more row or column, a copy of its last.
    """

    def __init__(self, path: Path, frame_rate_hz: float) -> None:
        """Prepare to write.

        Args:
            path: Where the film is to appear.
            frame_rate_hz: Pictures a second.

        Raises:
            OSError: The file cannot be written there.
        """
        self._path = path
        self._part = part_of(path)
        self._part.touch()
        try:
            self._container = av.open(self._part, "w", format="mp4", options={"movflags": "+faststart"})
        except BaseException:
            self._part.unlink(missing_ok=True)
            raise
        self._rate = Fraction(frame_rate_hz).limit_denominator(1001)
        self._stream: av.VideoStream | None = None

    def write(self, picture_rgb: NDArray[np.uint8]) -> None:
        """Append a picture, (height, width, 3) uint8 RGB; all must have the size of the first."""
        even = np.pad(picture_rgb, [(0, side % 2) for side in picture_rgb.shape[:2]] + [(0, 0)], mode="edge")
        if self._stream is None:
            self._stream = self._open(even.shape[1], even.shape[0])
        if (self._stream.height, self._stream.width) != even.shape[:2]:
            raise ValueError(
                f"the film's pictures are {self._stream.width} x {self._stream.height}, "
                f"got one of {even.shape[1]} x {even.shape[0]}"
            )
        frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(even), format="rgb24")
        self._container.mux(self._stream.encode(frame))

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        try:
            if kind is None and self._stream is not None:
                self._container.mux(self._stream.encode(None))
                self._container.close()
                settle(self._part, self._path)
            else:
                self._container.close()
        finally:
            self._part.unlink(missing_ok=True)

    def _open(self, width: int, height: int) -> av.VideoStream:
        stream = self._container.add_stream("libx264", rate=self._rate, options={"crf": "18", "preset": "veryfast"})
        stream.width, stream.height = width, height
        stream.pix_fmt = "yuv420p"
        stream.thread_count = 1  # the same film from the same pictures, on any machine
        return stream
