"""Videos and animated GIFs: any frame in any order, with the very pixels of a pass from the first to the last.

A compressed video is a chain: most pictures are differences to others, and decoding can begin only at a keyframe. So
`VideoSequence` first makes one pass and keeps, for each picture, its time and the checksum of its pixels. To reach a
frame it then seeks to the keyframe before it and decodes from there; pictures on the way that no other rests on are
skipped, and the last ones before the goal are kept, because a step backwards wants them next.

What a seek gives need not be what the pass gave: some files let pictures refer across keyframes, some containers seek
inexactly, damage spreads differently. So each picture is checked against its checksum before it is handed out. If it is
wrong, the keyframe is not used again, an earlier one is tried, and in the end the pass is repeated from the start. That
repetition does just what the survey did: it skips nothing and holds on to no decoder's buffers, because what a decoder
puts where data are missing may be what an earlier picture left in the buffer.
"""

import threading
import weakref
import zlib
from bisect import bisect_right
from collections.abc import Iterator
from typing import BinaryIO

import numpy as np
from av.video.frame import VideoFrame
from numpy.typing import NDArray
from typing_extensions import override

from pftrack.core.model.source import FrameIndex, FrameSequence
from pftrack.sources.decoder import Decoder, measure, orientation_of, stored_size
from pftrack.sources.formats import Format
from pftrack.sources.limits import Limits, SourceError, check_pixels
from pftrack.sources.sequence import BoundedCache

_KEYFRAMES_TRIED = 3
_MOST_KEPT_ON_THE_WAY = 48


class VideoSequence(FrameSequence):
    """The pictures of a video or an animated GIF; may be used from several threads, one at a time."""

    def __init__(
        self,
        file: BinaryIO,
        found: Format,
        *,
        name: str,
        sha256: str,
        limits: Limits,
        index: FrameIndex | None,
        square: bool | None = None,
    ) -> None:
        """Survey the file, unless its index is known already.

        Args:
            file: Open for reading; closed with the sequence.
            found: What its content is.
            name: What people call it.
            sha256: Digest of its content.
            limits: How large it may be.
            index: From an earlier survey of the same content; it is not used if it has pixels taken otherwise.
            square: Whether to make pixels square that are not; None for as the index has it, and yes without one.

        Raises:
            SourceError: It cannot be read, or exceeds the limits.
        """
        self.name = name
        self._file = file
        self._format = found
        self._limits = limits
        self._lock = threading.Lock()
        self._cache: BoundedCache[NDArray[np.uint8] | VideoFrame] = BoundedCache(limits.cache_bytes)
        self._decoder = Decoder(file, found, limits.pixels)
        try:
            suits = index is not None and square in {None, self._is_square(index)}
            self.index = index if index is not None and suits else self._survey(sha256, square=square is not False)
        except BaseException:
            self._decoder.close()
            raise
        self._close_file = weakref.finalize(self, file.close)  # also when nobody remembers to
        self._numbers: dict[int | None, int] = {stamp: number for number, stamp in enumerate(self.index.stamps)}
        self._untrue: set[int] = set()
        self._pass: Iterator[tuple[int, VideoFrame]] | None = None
        self._position = 0
        self._from_start = False

    @property
    @override
    def square(self) -> bool:
        return self._is_square(self.index)

    @override
    def _picture(self, index: int) -> NDArray[np.uint8]:
        with self._lock:
            held = self._cache.get(index)
            if isinstance(held, VideoFrame):
                held = self._convert(index, held)
            return self._reach(index) if held is None else held

    @override
    def close(self) -> None:
        with self._lock:
            self._pass = None
            self._cache.clear()
            self._decoder.close()
            self._close_file()

    def _is_square(self, index: FrameIndex) -> bool:
        """Return whether an index has pixels made square, or they are; one of an earlier version has not."""
        stream = self._decoder.stream
        stored = stream.width, stream.height
        return self._decoder.square_size(*stored)[0] == stored or stored_size(index.size, index.orientation) != stored

    def _survey(self, sha256: str, *, square: bool) -> FrameIndex:
        """Decode everything once."""
        limits, stream = self._limits, self._decoder.stream
        announced = stream.frames
        if announced > limits.frames:
            raise SourceError(f"the video has {announced:,} frames; at most {limits.frames:,} are allowed")
        check_pixels(stream.width, stream.height, limits, "the pictures of the video have")
        # A picture whose side data were looked at is held until the next garbage collection: start again after that.
        orientation = next((orientation_of(frame) for frame in self._decoder.frames()), 0)
        decoder, shape, size, remark = self._begin(), (0, 0), (0, 0), ""
        stamps: list[int | None] = []
        checksums: list[int] = []
        keyframes: list[int] = []
        for number, frame in enumerate(decoder.frames()):
            if number == limits.frames:
                raise SourceError(f"the video has more frames than the {limits.frames:,} that are allowed")
            if number == 0:
                shape = frame.width, frame.height
                check_pixels(*shape, limits, "the pictures of the video have")
                size, remark = decoder.square_size(*shape)
                if not square and size != shape:
                    size, remark = shape, "pixels are not square; they are taken as they are stored, as by the run"
                check_pixels(*size, limits, "in square pixels the pictures of the video have")
            elif (frame.width, frame.height) != shape:
                raise SourceError(
                    f"frame {number} of the video is {frame.width} x {frame.height} px and frame 0 is "
                    f"{shape[0]} x {shape[1]} px; all must be of one size"
                )
            picture = decoder.rgb(frame, orientation, size)
            if self._cache.used_bytes < limits.cache_bytes // 2:
                self._cache.put(number, picture, picture.nbytes)
            if frame.key_frame:
                keyframes.append(number)
            stamps.append(frame.pts)
            checksums.append(zlib.crc32(picture.data))
        if not checksums:
            raise SourceError("none of the video's pictures can be decoded; expected a video that plays elsewhere")
        width, height = stored_size(size, orientation)
        timing = measure(stamps, decoder)
        return FrameIndex(
            kind="gif" if self._format.kind == "gif" else "video",
            sha256=sha256,
            width=width,
            height=height,
            frame_rate_hz=timing.rate_hz,
            times_s=timing.times_s,
            checksums=tuple(checksums),
            stamps=timing.stamps,
            keyframes=tuple(keyframes) if timing.stamps else (),
            orientation=orientation,
            warnings=timing.warnings + ((remark,) if remark else ()),
        )

    def _begin(self) -> Decoder:
        """Return to the start of the file with a fresh decoder."""
        self._decoder.close()
        self._decoder = Decoder(self._file, self._format, self._limits.pixels)
        return self._decoder

    def _reach(self, goal: int) -> NDArray[np.uint8]:
        for keyframe in self._entries(goal):
            picture = self._run_to(goal)
            if picture is not None:
                return picture
            self._pass = None
            if keyframe is not None:
                self._untrue.add(keyframe)
        raise SourceError(f"frame {goal} no longer decodes as it did; the file must not change while it is open")

    def _entries(self, goal: int) -> Iterator[int | None]:
        """Take up a place from which the goal can be reached, the cheapest first; yield the keyframe, if it is one."""
        stamps, keyframes = self.index.stamps, self.index.keyframes
        before = keyframes[: bisect_right(keyframes, goal)][::-1]
        near = [keyframe for keyframe in before[: len(self._untrue) + _KEYFRAMES_TRIED] if keyframe not in self._untrue]
        first_kept = max(0, goal - self._kept_on_the_way)
        skip_before = stamps[first_kept] if stamps else None
        if self._pass is not None and self._position <= goal and (not near or near[0] <= self._position):
            self._decoder.skip_before = None if self._from_start else skip_before
            yield None
        for keyframe in near[:_KEYFRAMES_TRIED]:
            try:
                self._decoder.seek(stamps[keyframe])
            except SourceError:
                break
            self._decoder.skip_before = skip_before
            self._pass = self._number_frames()
            self._from_start = False
            yield keyframe
        self._begin()
        self._pass = self._number_frames()
        self._from_start = True
        yield None

    def _number_frames(self) -> Iterator[tuple[int, VideoFrame]]:
        """Decode on, with each frame's number: from its time or, where times are of no use, counted."""
        for count, frame in enumerate(self._decoder.frames()):
            number = self._numbers.get(frame.pts) if self._numbers else count
            if number is not None:
                yield number, frame

    def _run_to(self, goal: int) -> NDArray[np.uint8] | None:
        """Decode up to the goal; None if it does not come, or comes with other pixels than before."""
        if self._pass is None:
            return None
        for number, frame in self._pass:
            self._position = number + 1
            if number >= goal:
                return self._convert(goal, frame) if number == goal else None
            if number >= goal - self._kept_on_the_way and number not in self._cache:
                if self._from_start:
                    self._convert(number, frame)
                else:
                    self._cache.put(number, frame, sum(plane.buffer_size for plane in frame.planes))
        return None

    def _convert(self, number: int, frame: VideoFrame) -> NDArray[np.uint8] | None:
        """Convert a frame and keep it, if its pixels are those of the survey."""
        # The index alone says whether pixels are made square: one of an earlier version did not.
        size = stored_size(self.size, self.index.orientation)
        picture = self._decoder.rgb(frame, self.index.orientation, size)
        if zlib.crc32(picture.data) != self.index.checksums[number]:
            self._cache.drop(number)
            return None
        self._cache.put(number, picture, picture.nbytes)
        return picture

    @property
    def _kept_on_the_way(self) -> int:
        return min(_MOST_KEPT_ON_THE_WAY, self._limits.cache_bytes // (2 * 3 * self.index.width * self.index.height))
