"""A decoder of one video stream: FFmpeg through PyAV, with a fixed format and strict limits.

- The container's format is forced; nothing is guessed.
- The file comes in as an open file object without a name, and whatever else the container may want to open is refused.
- Only decoders of a list of well-known codecs are let near the bytes; sound and subtitles are not decoded at all.
- One thread, so that the same bytes give the same pictures, also where they are damaged.
"""

from collections.abc import Iterable, Iterator
from typing import BinaryIO, NoReturn, cast

import av
import numpy as np
from av.sidedata.sidedata import SideData, Type
from av.stream import Discard, Disposition
from av.video.frame import VideoFrame
from av.video.reformatter import VideoReformatter
from av.video.stream import VideoStream
from numpy.typing import NDArray

from pftrack.sources.formats import ALLOWED, Format, SourceError

__all__ = ["Decoder", "orientation_of"]

_CODECS = {
    "h264": "H.264",
    "hevc": "H.265",
    "av1": "AV1",
    "libdav1d": "AV1",
    "vp8": "VP8",
    "libvpx": "VP8",
    "vp9": "VP9",
    "libvpx-vp9": "VP9",
    "theora": "Theora",
    "mpeg4": "MPEG-4",
    "msmpeg4v2": "DivX 2",
    "msmpeg4": "DivX 3",
    "h263": "H.263",
    "mpeg1video": "MPEG-1",
    "mpeg2video": "MPEG-2",
    "mjpeg": "Motion JPEG",
    "prores": "ProRes",
    "dnxhd": "DNxHD",
    "ffv1": "FFV1",
    "huffyuv": "HuffYUV",
    "ffvhuff": "HuffYUV",
    "utvideo": "Ut Video",
    "png": "PNG",
    "rawvideo": "raw pictures",
    "gif": "GIF",
}
_HEADROOM = 16
"""FFmpeg itself stops at this many times the allowed pixels; what exceeds them by less is refused with the limit."""


class Decoder:
    """One pass over the pictures of a video stream, from any point where decoding can begin.

    Attributes:
        damaged: Pictures of this pass that were found damaged and left out.
        skip_before: Pictures before this time need not come out, in ticks; those that no other picture rests on are
            then not decoded.
    """

    def __init__(self, file: BinaryIO, container_format: Format, max_pixels: int) -> None:
        """Open the stream at its beginning.

        Args:
            file: Open for reading; stays open when the decoder is closed.
            container_format: What the content is.
            max_pixels: The most that a picture may have.

        Raises:
            SourceError: It is broken, holds no pictures, or they are coded in a way that is not read here.
        """
        self.damaged = 0
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
        """How long the container says it lasts, in microseconds."""
        return self._container.duration

    def seek(self, stamp: int) -> None:
        """Go on from the keyframe at a time, or the nearest before it.

        Raises:
            SourceError: The container cannot seek.
        """
        try:
            self._container.seek(stamp, stream=self.stream, backward=True)
        except av.FFmpegError:
            raise SourceError("the video cannot be entered in the middle; expected one that can") from None

    def frames(self) -> Iterator[VideoFrame]:
        """Yield the pictures that decode undamaged, in the order in which they are shown."""
        context = self.stream.codec_context
        packets = self._container.demux(self.stream)
        while True:
            try:
                packet = next(packets)
                if packet.is_corrupt:  # cut short: what decodes of it would be a guess
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

    def rgb(self, frame: VideoFrame, orientation: int) -> NDArray[np.uint8]:
        """Convert a picture to 8-bit RGB, upright, read-only."""
        image: NDArray[np.uint8] = np.asarray(
            self._reformatter.reformat(frame, format="rgb24").to_ndarray(), dtype=np.uint8
        )
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
        stream = next((each for each in self._container.streams.video if not each.disposition & cover), None)
        if stream is None:
            kinds = {each.type for each in self._container.streams}
            what = "sound, but no pictures" if "audio" in kinds else "no pictures"
            raise SourceError(f"the file holds {what}; expected {ALLOWED}")
        context = stream.codec_context
        if getattr(context, "name", None) not in _CODECS:  # there is no context where FFmpeg has no decoder
            known = ", ".join(dict.fromkeys(_CODECS.values()))
            raise SourceError(f"the video is coded in a way that is not read here; expected one of {known}")
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


class _Nameless:
    """An open file without its name: what FFmpeg does not know, it cannot take for an address."""

    def __init__(self, file: BinaryIO) -> None:
        self.read, self.seek, self.tell = file.read, file.seek, file.tell


def _refuse(*_: object) -> NoReturn:
    raise PermissionError("a video may not open other files")


def _out_of_memory_or(error: av.FFmpegError, sentence: str) -> Exception:
    if isinstance(error, MemoryError):
        return MemoryError()
    return SourceError(f"{sentence}, so that it cannot be read; expected {ALLOWED}")
