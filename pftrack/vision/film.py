"""Films from pictures: H.264 in MP4, which every browser and lecture-room computer plays, or a GIF for a slide.

A film is written under a temporary name beside its final place and renamed when it is complete, so an interrupted run
leaves either the old file or none, never half a file.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from types import TracebackType
from typing import Self

import av
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from pftrack.core.files import part_of, settle
from pftrack.core.model.drawing import COLOURS, OKABE_ITO

GIF_COLOURS = 256


class FilmWriter:
    """Writes pictures of one size to an MP4 file; a context manager.

    The film appears at its place on leaving the context, and not at all if that is by an error. H.264 in its common
    form requires even sides: an odd picture gets one more row or column, a copy of its last.
    """

    def __init__(self, path: Path, frame_rate_hz: float, words: Mapping[str, str] | None = None) -> None:
        """Prepare to write.

        Args:
            path: Path of the finished film.
            frame_rate_hz: Pictures a second.
            words: Metadata of the file, by MP4's names, such as "title" and "comment".

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
        self._container.metadata.update(words or {})
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


@dataclass(frozen=True, eq=False)
class Colours:
    """The colours that all pictures of a GIF share, so unmoved parts stay the same from picture to picture.

    Attributes:
        image: An image of mode "P", with these colours as its palette.
    """

    image: Image.Image

    def of(self, picture_rgb: NDArray[np.uint8]) -> Image.Image:
        """Return a picture, (height, width, 3) RGB, in these colours."""
        return Image.fromarray(picture_rgb).quantize(palette=self.image, dither=Image.Dither.NONE)


def common_colours(pictures_rgb: Sequence[NDArray[np.uint8]]) -> Colours:
    """Return the best colours for pictures of one width; colours with a meaning are kept exactly."""
    meant = list(dict.fromkeys((*COLOURS.values(), *OKABE_ITO.values())))
    found = Image.fromarray(np.concatenate(pictures_rgb)).quantize(GIF_COLOURS - len(meant))
    palette = Image.new("P", (1, 1))
    palette.putpalette([*(found.getpalette() or ()), *(level for colour in meant for level in colour)])
    return Colours(palette)


def write_gif(path: Path, pictures: Sequence[Image.Image], period_s: float, *, comment: str) -> None:
    """Write pictures of one size, as `Colours.of` gives them, as a GIF that plays for ever.

    Args:
        path: Output file.
        pictures: At least one.
        period_s: Duration of each picture; GIF counts hundredths of a second, and browsers show no frame for less than
            two.
        comment: Description stored in the file, ASCII.

    Raises:
        OSError: The file cannot be written.
    """
    first, *others = pictures
    shown_ms = 10 * max(2, round(100 * period_s))
    first.save(
        path, "GIF", save_all=True, append_images=others, duration=shown_ms, loop=0, comment=comment.encode("ascii")
    )
