"""One decoder of a video: FFmpeg through PyAV, with a fixed format and strict limits.

- The container's format is forced; nothing is guessed.
- The file is passed as an open file object without a name, and any other file that the container requests is refused.
- Only decoders of a list of well-known codecs are used; sound and subtitles are not decoded.
- One thread decodes, so the same bytes give the same pictures, even where they are damaged.
"""

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import BinaryIO, NoReturn, cast

import av
import cv2
import numpy as np
from av.sidedata.sidedata import SideData, Type
from av.stream import Discard, Disposition
from av.video.frame import VideoFrame
from av.video.reformatter import ColorTrc, VideoReformatter
from av.video.stream import VideoStream
from numpy.typing import NDArray
from PIL import Image

from pftrack.core.refusal import RefusedError
from pftrack.core.texts import read_texts
from pftrack.sources.formats import ALLOWED, Format
from pftrack.sources.images import on_paper

_CODECS = read_texts(Path(__file__).with_name("codecs.yaml"))[0]
_MOST_OBLONG = 4
_NEARLY_SQUARE = 0.01
_HEADROOM = 16
"""FFmpeg itself stops at this multiple of the allowed pixels; pictures between both limits are refused in a sentence
with the limit."""

_HDR = {int(ColorTrc.SMPTE2084), int(ColorTrc.ARIB_STD_B67)}
_PALE = "its brightness is stored for HDR displays (HLG or PQ); pictures are shown as stored, paler than in a player"


class Decoder:
    """One pass over the pictures of a video stream, from any point where decoding can begin.

    Attributes:
        damaged: Pictures of this pass that were found damaged and left out.
        skip_before: Pictures before this time, in ticks, are not needed; those that no other picture needs are then not
            decoded.
        remarks: Remarks on the stream, a sentence each.
    """

    def __init__(self, file: BinaryIO, container_format: Format, max_pixels: int) -> None:
        """Open the stream at its beginning.

        Args:
            file: Open for reading; stays open when the decoder is closed.
            container_format: Container format of the content.
            max_pixels: The most that a picture may have.

        Raises:
            RefusedError: It is broken, holds no pictures, or has an unsupported codec.
        """
        self.damaged = 0
        self.remarks: list[str] = []
        self.skip_before: int | None = None
        file.seek(0)
        options = {"codec_whitelist": ",".join(_CODECS), "max_pixels": str(_HEADROOM * max_pixels)}
        try:
            self._container = av.open(
                _Nameless(file),
                mode="r",
                format=container_format.decoder,
                options=options,
                metadata_errors="replace",
                io_open=_refuse,
            )
        except av.FFmpegError as error:
            raise _out_of_memory_or(error, f"the {container_format.title} file is broken or cut short") from None
        try:
            self.stream = self._choose()
        except BaseException:
            self._container.close()
            raise
        self._reformatter = VideoReformatter()

    def close(self) -> None:
        """Let go of the decoder; the file stays open."""
        self._container.close()

    @property
    def duration_us(self) -> int | None:
        """Duration stated by the container, in microseconds."""
        return self._container.duration

    @property
    def announced(self) -> int:
        """Number of pictures in the container, without those that an edit list cuts off; 0 if unknown."""
        entries = self.stream.index_entries if self._container.format.name.startswith("mov") else ()
        shown = sum(not entry.is_discard for entry in entries)
        return min(self.stream.frames, shown) if shown else self.stream.frames

    def seek(self, stamp: int) -> None:
        """Continue from the keyframe at a time, or the nearest before it.

        Raises:
            RefusedError: The container cannot seek.
        """
        try:
            self._container.seek(stamp, stream=self.stream, backward=True)
        except av.FFmpegError:
            raise RefusedError("the video cannot be entered in the middle; expected one that can") from None

    def frames(self) -> Iterator[VideoFrame]:
        """Yield the pictures that decode undamaged, in the order in which they are shown."""
        context = self.stream.codec_context
        packets = self._container.demux(self.stream)
        while True:
            try:
                packet = next(packets)
                if packet.is_corrupt:  # cut short: the decoded picture would be a guess
                    self.damaged += 1
                    continue
                needless = self.skip_before is not None and packet.pts is not None and packet.pts < self.skip_before
                context.skip_frame = "NONREF" if needless else "DEFAULT"
                decoded = packet.decode()
            except StopIteration:
                return
            except av.FFmpegError as error:
                if isinstance(error, MemoryError):
                    raise
                self.damaged += 1
                continue
            for frame in decoded:
                if frame.is_corrupt:
                    self.damaged += 1
                else:
                    yield frame

    def square_size(self, width: int, height: int) -> tuple[tuple[int, int], str]:
        """Return the size that a stored picture has in square pixels; neither width nor height gets smaller.

        A ratio that no camera or disc has is taken for an error of the file, and one that changes the size by less than
        a hundredth is not worth another picture.

        Returns:
            Width and height, px, and a sentence for people where the pixels are not square.
        """
        told = self.stream.sample_aspect_ratio
        ratio = float(told or 1)
        if told is None or abs(ratio - 1) < _NEARLY_SQUARE:
            return (width, height), ""
        name = f"{told.numerator}:{told.denominator}"
        if not 1 / _MOST_OBLONG <= ratio <= _MOST_OBLONG:
            return (width, height), f"the shape of pixels is given as {name}; they are taken to be square"
        square = (round(width * ratio), height) if ratio > 1 else (width, round(height / ratio))
        return square, (
            f"pixels are not square ({name}); pictures of {width} x {height} px are shown and tracked as "
            f"{square[0]} x {square[1]} px"
        )

    def rgb(self, frame: VideoFrame, orientation: int, size: tuple[int, int]) -> NDArray[np.uint8]:
        """Convert a picture to 8-bit RGB, upright, read-only.

        Args:
            frame: The picture as stored.
            orientation: Its orientation, see `orientation_of`.
            size: Width and height before that, px; `square_size` makes its pixels square.
        """
        has_alpha = any(component.is_alpha for component in frame.format.components)
        stored = self._reformatter.reformat(frame, format="rgba" if has_alpha else "rgb24").to_ndarray()
        image: NDArray[np.uint8] = np.asarray(on_paper(Image.fromarray(stored)) if has_alpha else stored, np.uint8)
        if size != (frame.width, frame.height):  # the interpolation whose results do not depend on the processor
            image = np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_LINEAR_EXACT), dtype=np.uint8)
        if orientation & _TRANSPOSED:
            image = image.transpose(1, 0, 2)
        if orientation & _MIRRORED_X:
            image = image[:, ::-1]
        if orientation & _MIRRORED_Y:
            image = image[::-1]
        image = np.ascontiguousarray(image)
        image.setflags(write=False)
        return image

    def _choose(self) -> VideoStream:
        cover = Disposition.attached_pic
        streams = [each for each in self._container.streams.video if not each.disposition & cover]
        stream = max(streams, key=lambda each: each.frames, default=None)  # the first, if they are equal or unknown
        if stream is None:
            kinds = {each.type for each in self._container.streams}
            what = "sound, but no pictures" if "audio" in kinds else "no pictures"
            raise RefusedError(f"the file holds {what}; expected {ALLOWED}")
        context = stream.codec_context
        if getattr(context, "name", None) not in _CODECS:  # the context is missing where FFmpeg has no decoder
            known = ", ".join(dict.fromkeys(_CODECS.values()))
            raise RefusedError(f"the video has an unsupported codec; expected one of {known}")
        if len(streams) > 1:
            place = streams.index(stream) + 1
            self.remarks.append(f"the file has {len(streams)} streams of pictures; number {place} was taken")
        if stream.metadata.get("alpha_mode") == "1":
            self.remarks.append("its transparency is not read: pictures are shown as stored below it")
        if context.color_trc in _HDR:
            self.remarks.append(_PALE)
        for other in self._container.streams:
            if other.index != stream.index:
                other.discard = Discard.all
        context.thread_type = "NONE"
        context.thread_count = 1
        return stream


_TRANSPOSED, _MIRRORED_X, _MIRRORED_Y = 1, 2, 4


def orientation_of(frame: VideoFrame) -> int:
    """Read how a picture must be turned to stand upright.

    The container's display matrix maps (x, y) to (a x + c y, b x + d y); cameras use its eight multiples of a quarter
    turn with or without a mirror.

    Returns:
        A sum of 1: rows and columns change places; then 2: left and right do; then 4: top and bottom do.
    """
    side_data = cast("Iterable[SideData]", frame.side_data)  # typed as a mapping, which it is not quite
    data = next((data for data in side_data if data.type == Type.DISPLAYMATRIX), None)
    if data is None:
        return 0
    a, b, _, c, d = (int(value) for value in np.frombuffer(bytes(data), np.int32)[:5])
    if abs(a) >= abs(b):
        return _MIRRORED_X * (a < 0) + _MIRRORED_Y * (d < 0)
    return _TRANSPOSED + _MIRRORED_X * (c < 0) + _MIRRORED_Y * (b < 0)


def stored_size(size: tuple[int, int], orientation: int) -> tuple[int, int]:
    """Return the width and height before a picture is turned upright, from those after it."""
    return (size[1], size[0]) if orientation & _TRANSPOSED else size


class _Nameless:
    """An open file without its name, which FFmpeg could take for an address."""

    def __init__(self, file: BinaryIO) -> None:
        self.read, self.seek, self.tell = file.read, file.seek, file.tell


def _refuse(*_: object) -> NoReturn:
    raise PermissionError("a video may not open other files")


def _out_of_memory_or(error: av.FFmpegError, sentence: str) -> Exception:
    if isinstance(error, MemoryError):
        return MemoryError()
    return RefusedError(f"{sentence}, so it cannot be read; expected {ALLOWED}")
