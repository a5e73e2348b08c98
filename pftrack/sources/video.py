"""Videos and animated GIFs: any frame in any order, with exactly the pixels of a pass from the first to the last.

A compressed video is a chain: most pictures are differences to others, and decoding can begin only at a keyframe. So
`VideoSequence` first makes one pass and keeps, for each picture, its time and the checksum of its pixels. To reach a
frame it then seeks to the keyframe before it and decodes from there; pictures on the way that no other picture needs
are skipped, and the last ones before the goal are cached, because a step backwards needs them next.

A seek may give other pixels than the pass: some files let pictures refer across keyframes, some containers seek
inexactly, and damage spreads differently. So each picture is compared with its checksum before it is returned. If it is
wrong, the keyframe is not used again, an earlier one is tried, and in the end the pass is repeated from the start. That
repetition repeats the survey exactly: it skips nothing and keeps no decoder's buffers, because a decoder may fill
missing data from an earlier picture in a buffer.
"""

import os
import struct
import threading
import weakref
import zlib
from bisect import bisect_right
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import BinaryIO

import numpy as np
from av.video.frame import VideoFrame
from numpy.typing import NDArray
from typing_extensions import override

from pftrack.core.model.source import FrameIndex, FrameSequence
from pftrack.core.refusal import RefusedError
from pftrack.sources.decoder import Decoder, orientation_of, stored_size
from pftrack.sources.formats import Format
from pftrack.sources.images import unsteady
from pftrack.sources.limits import Limits, check_pixels
from pftrack.sources.sequence import BoundedCache

# Frames are counted; a tracker steps from one to the next. Their times give speeds on a screen, and identify frames
# after a seek; for that they must rise from frame to frame.

USUAL_RATE_HZ = 25.0
"""The rate of a sequence without its own rate."""

_SLOWEST_HZ, _FASTEST_HZ = 0.01, 1000.0
_SAME_RATE = 0.01
_SHORT = 0.9


@dataclass(frozen=True, slots=True)
class Timing:
    """The times of a video's frames.

    Attributes:
        stamps: In the container's ticks, rising; empty if its times are unusable.
        times_s: From 0, s.
        rate_hz: Frames a second, in the mean.
        warnings: Sentences for people about what is odd.
    """

    stamps: tuple[int, ...]
    times_s: tuple[float, ...]
    rate_hz: float
    warnings: tuple[str, ...]


def measure(stamps: Sequence[int | None], decoder: Decoder, *, whole: bool) -> Timing:
    """Judge the times of frames that a pass has decoded.

    Args:
        stamps: One a frame, in the container's ticks, as decoded.
        decoder: The one that made the pass.
        whole: Whether these are all of its frames.
    """
    tick_s = float(decoder.stream.time_base or 0)
    declared = decoder.stream.average_rate or decoder.stream.guessed_rate
    declared_hz = float(declared) if declared else USUAL_RATE_HZ
    warnings = []
    known = tuple(stamp for stamp in stamps if stamp is not None)
    rising = len(known) == len(stamps) and all(one < other for one, other in pairwise(known))
    if rising and tick_s > 0:
        times_s = (np.array(known) - known[0]) * tick_s
        rate_hz = (len(known) - 1) / times_s[-1] if len(known) > 1 else declared_hz
        if abs(declared_hz / rate_hz - 1) < _SAME_RATE:
            rate_hz = declared_hz  # exact, where measured times are rounded to ticks
        warnings += unsteady(times_s, tick_s)
    else:
        known, rate_hz = (), declared_hz
        times_s = np.arange(len(stamps)) / rate_hz
    if not _SLOWEST_HZ <= rate_hz <= _FASTEST_HZ:
        warnings.append(f"the frame rate is given as {rate_hz:.4g} Hz; {USUAL_RATE_HZ:g} Hz are taken instead")
        rate_hz = USUAL_RATE_HZ
        times_s = np.arange(len(stamps)) / rate_hz
    if whole:
        warnings = _missing(len(stamps), float(times_s[-1]) + 1 / rate_hz, decoder) + warnings
    return Timing(known, tuple(times_s.tolist()), float(rate_hz), tuple(warnings))


def _missing(frames: int, lasting_s: float, decoder: Decoder) -> list[str]:
    announced, announced_s = decoder.announced, (decoder.duration_us or 0) / 1e6
    if announced > frames:
        return [f"the file announces {announced} frames and {frames} decode; it is cut short or damaged"]
    if announced == 0 and lasting_s < _SHORT * announced_s:
        return [f"the file announces {announced_s:.3g} s and its pictures end after {lasting_s:.3g} s"]
    if decoder.damaged:
        return [f"{decoder.damaged} pictures are damaged and left out"]
    return []


@dataclass(frozen=True, slots=True)
class _Part:
    """Consecutive frames of one size: the first, their size as stored and as shown, and the result of a pass."""

    first: int
    shape: tuple[int, int]
    size: tuple[int, int]
    remark: str
    stamps: list[int | None] = field(default_factory=list)
    checksums: list[int] = field(default_factory=list)
    keyframes: list[int] = field(default_factory=list)


def _in_parts(parts: Sequence[_Part], chosen: _Part) -> str:
    """Return the remark on a video whose size changes; its longest part is used.

    Raises:
        RefusedError: The times of its frames do not separate the parts.
    """
    spans = [
        f"frames {part.first} to {part.first + len(part.stamps) - 1} are {part.shape[0]} x {part.shape[1]} px"
        for part in parts[:_MOST_PARTS]
    ]
    said = f"the size changes: {', '.join(spans)}{', and so on' if len(parts) > _MOST_PARTS else ''}"
    stamps = [-1 if stamp is None else stamp for part in parts for stamp in part.stamps]
    if any(one >= other for one, other in pairwise(stamps)):
        raise RefusedError(f"{said}; the longest part begins with frame {chosen.first}: cut it out into its own file")
    return f"{said}; the longest part was taken, so that frame 0 is frame {chosen.first} of the file"


def _is_joined(file: BinaryIO) -> bool:
    """Return whether an MP4 has a second list of frames: no program looks for more than one."""
    place, lists, end = 0, 0, file.seek(0, os.SEEK_END)
    while place + 8 <= end:
        file.seek(place)
        size, kind = struct.unpack(">I4s", file.read(8))
        lists += kind == b"moov"
        place += max(int.from_bytes(file.read(8)) if size == 1 else size or end, 8)
    return lists > 1


_MOST_PARTS = 4
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
            found: Format of its content.
            name: Name for users.
            sha256: Digest of its content.
            limits: Its limits.
            index: Index from an earlier survey of the same content; not used if its pixels were read differently.
            square: Whether to make pixels square that are not; None follows the index; without an index the default is
                yes.

        Raises:
            RefusedError: It cannot be read, or exceeds the limits.
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
        self._close_file = weakref.finalize(self, file.close)  # even without a call
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
            raise RefusedError(f"the video has {announced:,} frames; at most {limits.frames:,} are allowed")
        check_pixels(stream.width, stream.height, limits, "the pictures of the video have")
        # Reading a picture's side data keeps the picture until the next garbage collection, so decoding restarts
        # afterwards.
        orientation = next((orientation_of(frame) for frame in self._decoder.frames()), 0)
        decoder = self._begin()
        parts = self._parts(decoder, orientation, square=square)
        part = max(parts, key=lambda one: len(one.stamps))
        if part is not parts[-1]:
            self._cache.clear()
        width, height = stored_size(part.size, orientation)
        timing = measure(part.stamps, decoder, whole=len(parts) == 1)
        told = [*timing.warnings, *([part.remark] if part.remark else []), *decoder.remarks]
        if len(parts) > 1:
            told.insert(0, _in_parts(parts, part))
        if self._format.decoder == "mov" and _is_joined(self._file):
            told.append("a second MP4 follows at the end of the file and is not read; `ffmpeg -f concat` joins clips")
        return FrameIndex(
            kind="gif" if self._format.kind == "gif" else "video",
            sha256=sha256,
            width=width,
            height=height,
            frame_rate_hz=timing.rate_hz,
            times_s=timing.times_s,
            checksums=tuple(part.checksums),
            stamps=timing.stamps,
            keyframes=tuple(part.keyframes) if timing.stamps else (),
            orientation=orientation,
            warnings=tuple(told),
        )

    def _parts(self, decoder: Decoder, orientation: int, *, square: bool) -> list[_Part]:
        """Decode everything, and return the stretches of frames of one size; the last one stays cached."""
        limits, parts = self._limits, list[_Part]()
        for number, frame in enumerate(decoder.frames()):
            if number == limits.frames:
                raise RefusedError(f"the video has more frames than the {limits.frames:,} that are allowed")
            shape = frame.width, frame.height
            if not parts or shape != parts[-1].shape:
                parts.append(_Part(number, shape, *self._shown_size(decoder, shape, square=square)))
                self._cache.clear()
            part = parts[-1]
            picture = decoder.rgb(frame, orientation, part.size)
            if self._cache.used_bytes < limits.cache_bytes // 2:
                self._cache.put(number - part.first, picture, picture.nbytes)
            if frame.key_frame:
                part.keyframes.append(number - part.first)
            part.stamps.append(frame.pts)
            part.checksums.append(zlib.crc32(picture.data))
        if not parts:
            raise RefusedError("none of the video's pictures can be decoded; expected a video that plays elsewhere")
        return parts

    def _shown_size(self, decoder: Decoder, shape: tuple[int, int], *, square: bool) -> tuple[tuple[int, int], str]:
        """Return the size in which pictures are shown, and a remark if their pixels are not square."""
        check_pixels(*shape, self._limits, "the pictures of the video have")
        size, remark = decoder.square_size(*shape)
        if not square and size != shape:
            size, remark = shape, "pixels are not square; they are taken as they are stored, as by the run"
        check_pixels(*size, self._limits, "in square pixels the pictures of the video have")
        return size, remark

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
        raise RefusedError(f"frame {goal} no longer decodes as it did; the file must not change while it is open")

    def _entries(self, goal: int) -> Iterator[int | None]:
        """Start from each place that leads to the goal, the cheapest first; yield the keyframe, if it is one."""
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
            except RefusedError:
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
        """Continue decoding, with each frame's number: from its time or, where times are unusable, by counting."""
        for count, frame in enumerate(self._decoder.frames()):
            number = self._numbers.get(frame.pts) if self._numbers else count
            if number is not None:
                yield number, frame

    def _run_to(self, goal: int) -> NDArray[np.uint8] | None:
        """Decode up to the goal; None if it is missing, or its pixels differ from the survey."""
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
        # The index alone decides whether pixels are made square; that of an earlier version did not.
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
