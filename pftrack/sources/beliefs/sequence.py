"""A recording of beliefs as a sequence: its pictures are those of its clip, or else blank paper.

So a recording is handled like a video: it is surveyed once, kept with its index, and named by the hash of its content.
The clip is inside the file, or a separate file.
"""

import hashlib
import io
import re
import threading
import weakref
import zlib
from collections.abc import Iterator
from dataclasses import replace
from functools import lru_cache
from pathlib import Path, PurePath
from typing import BinaryIO

import cv2
import numpy as np
from numpy.typing import NDArray
from typing_extensions import override

from pftrack.core.arrays import Floats
from pftrack.core.model.source import Belief, FrameIndex, FrameSequence, Plane
from pftrack.core.refusal import RefusedError
from pftrack.sources.beliefs.content import Content, Entry
from pftrack.sources.formats import sniff
from pftrack.sources.limits import HEAD_BYTES, Limits, check_bytes, check_pixels
from pftrack.sources.sequence import pictures_of
from pftrack.sources.truth import boxes_outside

PAPER, PAPER_PX = 255, (640, 480)
LEAST_PAPER_PX = 240
"""Smaller pictures would be enlarged so much that lines hide them."""
LARGEST_PAPER_PX = 1920
PICTURE = re.compile(r"pictures/([0-9]{6}|[1-9][0-9]{6,7})\.jpg")


class BeliefSequence(FrameSequence):
    """The frames of a recording of beliefs.

    Attributes:
        content: Its content.
        first: Number that the loop had for frame 0 of the sequence.
        has_pictures: Whether its frames have pictures; else they are paper.
    """

    def __init__(
        self,
        file: BinaryIO,
        *,
        name: str,
        sha256: str,
        limits: Limits,
        index: FrameIndex | None = None,
        clip: Path | None = None,
        beside: Path | None = None,
    ) -> None:
        """Read a file, which is closed with the sequence.

        Args:
            file: Open for reading.
            name: Name for users.
            sha256: Digest of its content.
            limits: Its limits.
            index: From an earlier survey of the same content.
            clip: The clip, where it is a separate file.
            beside: Folder in which a clip is searched that the recording only names.

        Raises:
            RefusedError: It is not a recording of beliefs, its clip cannot be read, or it exceeds the limits.
        """
        self.name = name
        self._file, self._lock = file, threading.Lock()
        self.content = Content(file)
        found, self._missing = find_clip(file, self.content, clip, beside, limits)
        self._clip: FrameSequence | None = None
        if found is not None:
            known = None if index is None else replace(index, kind="video", warnings=())
            try:
                self._clip = open_clip(found, self.content.about.clip or name, sha256, limits, known)
            except BaseException:
                found.close()
                raise
        pictures = map(PICTURE.fullmatch, self.content.entries)
        self._pictures = sorted(int(each[1]) for each in pictures if each)
        self.has_pictures = self._clip is not None or bool(self._pictures)
        self.index = self._survey(sha256, limits)
        self._close_file = weakref.finalize(self, file.close)  # even without a call

    @property
    def first(self) -> int:
        """The loop's number of frame 0: 0 where a clip, times or a number of frames define frame 0."""
        counted = self._clip is not None or "times.npy" in self.content.entries or self.content.about.frames > 0
        return 0 if counted else min([self.content.first, *self._pictures[:1]])

    @override
    def _picture(self, index: int) -> NDArray[np.uint8]:
        """Return a frame; white paper where it has no picture."""
        if self._clip is not None:
            return self._clip.picture(index)
        name = f"pictures/{self.first + index:06d}.jpg"
        if name in self.content.entries:
            image = _decode(self.content.bytes_of(name))
            if image is None or image.shape[1::-1] != self.size:
                raise RefusedError(f"picture {index} of the recording cannot be read, or is of another size")
        else:
            image = np.full((self.size[1], self.size[0], 3), PAPER, dtype=np.uint8)
        image.flags.writeable = False
        return image

    def unit_of(self, component: int) -> str:
        """Return the unit of a component: the given one, else px for places in a picture."""
        units = self.content.about.units
        if component < len(units):
            return units[component]
        return "px" if component < 2 and (self.has_pictures or not self.content.has_states) else ""

    def plane(self, components: tuple[int, ...]) -> Plane:
        """Return the drawing of states: in the picture if there is one, else scaled to fill the paper."""
        if self.has_pictures or not self.content.has_states:
            return Plane(self.size)
        low, high = self._extent()
        across, down = components[0], components[-1]
        scale, shift = [], []
        for component, side, sign in ((across, self.size[0], 1.0), (down, self.size[1], -1.0)):
            span = max(float(high[component] - low[component]), 1e-12)
            middle = float(high[component] + low[component]) / 2.0
            scale.append(sign * 0.84 * side / span)
            shift.append(side / 2.0 - scale[-1] * middle)
        if len(components) == 1:
            scale[1], shift[1] = 0.0, self.size[1] / 2.0
        return Plane(self.size, (scale[0], scale[1]), (shift[0], shift[1]))

    @override
    def close(self) -> None:
        if self._clip is not None:
            self._clip.close()
        self._close_file()

    def _survey(self, sha256: str, limits: Limits) -> FrameIndex:
        content, warnings = self.content, [*self.content.about.remarks, *filter(None, [self._missing])]
        if self._clip is not None:
            known = self._clip.index
            warnings += [*known.warnings, *_outside(content.last + 1, known.frame_count)]
            warnings += self._misfits(known.width, known.height, known.frame_count)
            return replace(known, kind="beliefs", sha256=sha256, warnings=tuple(warnings))
        times = content.times_s
        last = max([content.last, content.about.frames - 1, *self._pictures[-1:]])
        count = (last + 1 - self.first) if times is None else len(times)
        if count > limits.frames:
            raise RefusedError(f"the recording spans {count:,} frames; at most {limits.frames:,} are allowed")
        rate = content.about.frame_rate_hz
        if times is None:
            times = np.arange(count) / rate
        else:
            warnings += _outside(content.last + 1, count)
            times = times - times[0]
            rate = float((count - 1) / times[-1]) if count > 1 else rate
        if self.first:
            warnings.append(f"Frame 0 is frame {self.first} of the file, the first with a record.")
        width, height = self._paper(limits)
        if self._pictures:
            warnings += self._misfits(width, height, count)
        checksums = tuple(zlib.crc32(f"{self.first + number}".encode()) for number in range(count))
        return FrameIndex(
            kind="beliefs",
            sha256=sha256,
            width=width,
            height=height,
            frame_rate_hz=rate,
            times_s=tuple(times.tolist()),
            checksums=checksums,
            warnings=tuple(warnings),
        )

    def _misfits(self, width: int, height: int, count: int) -> tuple[str, ...]:
        """Return reasons to doubt that the true boxes belong to these pictures."""
        boxes = ((frame - self.first, box) for frame, box in self.content.true_boxes())
        return boxes_outside(((frame, box) for frame, box in boxes if 0 <= frame < count), width, height)

    def _paper(self, limits: Limits) -> tuple[int, int]:
        """Return width and height of the pictures, or of paper that has room for all boxes."""
        if self._pictures:
            image = _decode(self.content.bytes_of(f"pictures/{self._pictures[0]:06d}.jpg"))
            if image is None:
                raise RefusedError("the first picture of the recording cannot be read")
            height, width, _ = image.shape
            check_pixels(width, height, limits, "the pictures of the recording have")
            return width, height
        if self.content.has_states:
            return PAPER_PX
        reach = np.zeros(2)
        for frames, target in ((frames, target) for target, frames in self.content.targets.items()):
            for frame in frames:
                box = self.content.belief(frame, target).box
                if box is not None:
                    reach = np.fmax(reach, box[:2] + box[2:])
        width, height = np.clip(np.ceil(1.02 * reach), LEAST_PAPER_PX, LARGEST_PAPER_PX).astype(int).tolist()
        return width, height

    def _extent(self) -> tuple[Floats, Floats]:
        """Return the least and the greatest value of each component, believed or true, in some of the frames."""
        low, high = np.full((2, self.content.dimension), np.nan)
        for known in self._some_of_it():
            states = known.particles if known.particles is not None else known.mean
            if states is not None:
                rows = np.where(np.isfinite(states), states, np.nan).reshape(-1, states.shape[-1])
                said = slice(states.shape[-1])  # a truth may have only the first components
                low[said] = np.fmin(low[said], np.fmin.reduce(rows))
                high[said] = np.fmax(high[said], np.fmax.reduce(rows))
        return np.nan_to_num(low), np.nan_to_num(high)

    def _some_of_it(self) -> Iterator[Belief]:
        """Yield beliefs and truths of about a hundred frames of each target."""
        content = self.content
        for target, frames in content.targets.items():
            for frame in frames[:: max(len(frames) // 100, 1)]:
                yield content.belief(frame, target)
        for frame in range(content.first, content.last + 1, max((content.last - content.first) // 100, 1)):
            for target in content.true_targets_in(frame):
                yield content.truth(frame, target)


def _outside(said: int, count: int) -> list[str]:
    if said <= count:
        return []
    return [f"Records of frames beyond the last, {count - 1}, are left out."]


def _decode(data: bytes) -> NDArray[np.uint8] | None:
    """Return a JPEG's pixels as RGB; None if it is none."""
    if not data.startswith(b"\xff\xd8\xff"):
        return None
    image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR_RGB)
    return None if image is None else np.asarray(image, np.uint8)


# A path to a clip in a file is never followed, so opening a stranger's recording opens no other file. If a recording
# only names its clip, a file of that name next to the recording is used if its content matches.


def open_clip(file: BinaryIO, name: str, sha256: str, limits: Limits, index: FrameIndex | None = None) -> FrameSequence:
    """Return the pictures of a clip.

    Args:
        file: Open for reading; closed with the sequence.
        name: Name for users.
        sha256: Its digest.
        limits: Its limits.
        index: From an earlier survey of the same content.

    Raises:
        RefusedError: It is neither a video nor an animation, or exceeds the limits.
    """
    found = sniff(file.read(HEAD_BYTES))
    if found.kind not in {"video", "gif"}:
        raise RefusedError("the clip of the recording is neither a video nor an animation")
    check_bytes(file.seek(0, io.SEEK_END), limits, "the clip has")
    return pictures_of(file, found, name=name, sha256=sha256, limits=limits, index=index)


def find_clip(
    file: BinaryIO, content: Content, given: Path | None, beside: Path | None, limits: Limits
) -> tuple[BinaryIO | None, str]:
    """Return the clip of a recording, open for reading; or None, and the reason if a clip is missing.

    Args:
        file: The recording's.
        content: Its content.
        given: The clip, if the user names it.
        beside: The folder of the recording, which may hold a clip that is only named.
        limits: Its limits.

    Raises:
        RefusedError: It has a clip already, or the one that is given is another.
    """
    about = content.about
    if (entry := content.entries.get("clip")) is not None:
        if given is not None:
            raise RefusedError(f"the recording has its clip in it, {about.clip or 'without a name'}; open it alone")
        return io.BufferedReader(_Part(file, entry)), ""
    if given is not None:
        if about.clip_sha256 and _digest_of(given, limits) != about.clip_sha256:
            raise RefusedError(f"the clip is not {about.clip}, on which the recording was made")
        return given.open("rb"), ""
    if not about.clip_sha256:
        return None, ""
    named = None if beside is None or PurePath(about.clip).name != about.clip else beside / about.clip
    if named is None or not named.is_file():
        absent = f"Its clip, {about.clip}, is not here, so there are no pictures"
        return None, f"{absent}; put it beside the recording, or give both together."
    if _digest_of(named, limits) != about.clip_sha256:
        return None, f"The file {about.clip} beside it is another clip than its own, so there are no pictures."
    return named.open("rb"), ""


def _digest_of(path: Path, limits: Limits) -> str:
    about = path.stat()
    check_bytes(about.st_size, limits, "the clip has")
    return _digest(path.absolute(), about.st_size, about.st_mtime_ns)


@lru_cache(64)
def _digest(path: Path, size: int, changed_ns: int) -> str:  # noqa: ARG001 - by which a file is known to be the same
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


class _Part(io.RawIOBase):
    """A part of a file as a separate file, read by another descriptor with its own position."""

    def __init__(self, file: BinaryIO, entry: Entry) -> None:
        self._file = Path(file.name).open("rb")  # noqa: SIM115 - closed with this
        self._entry, self._place = entry, 0

    def readable(self) -> bool:
        return True

    def seekable(self) -> bool:
        return True

    def seek(self, offset: int, whence: int = io.SEEK_SET) -> int:
        base = {io.SEEK_SET: 0, io.SEEK_CUR: self._place, io.SEEK_END: self._entry.size}[whence]
        self._place = max(base + offset, 0)
        return self._place

    def tell(self) -> int:
        return self._place

    def readinto(self, buffer: "memoryview[int]") -> int:  # type: ignore[override]  # any writable buffer
        room = min(len(buffer), max(self._entry.size - self._place, 0))
        self._file.seek(self._entry.start + self._place)
        count = self._file.readinto(memoryview(buffer)[:room])
        self._place += count
        return count

    def close(self) -> None:
        self._file.close()
        super().close()
