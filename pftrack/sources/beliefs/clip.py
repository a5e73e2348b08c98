"""The clip of a recording of beliefs: in the file, or a file of its own that is known by the digest of its content.

A path in a file is never followed: who opens a stranger's recording opens nothing else. Where a recording names its
clip only, it is looked for under that name beside the recording, and taken if it has the content that is named.
"""

import hashlib
import io
from functools import lru_cache
from pathlib import Path, PurePath
from typing import BinaryIO

from pftrack.core.model.sequence import FrameIndex, FrameSequence
from pftrack.sources.beliefs.archive import Entry
from pftrack.sources.beliefs.content import Content
from pftrack.sources.errors import SourceError
from pftrack.sources.formats import sniff
from pftrack.sources.limits import HEAD_BYTES, Limits, check_bytes

__all__ = ["find_clip", "open_clip"]


def open_clip(file: BinaryIO, name: str, sha256: str, limits: Limits, index: FrameIndex | None = None) -> FrameSequence:
    """Return the pictures of a clip.

    Args:
        file: Open for reading; closed with the sequence.
        name: What people call it.
        sha256: Digest by which it is known.
        limits: How large it may be.
        index: From an earlier survey of the same content.

    Raises:
        SourceError: It is no video and no GIF, or exceeds the limits.
    """
    from pftrack.sources.video import VideoSequence  # noqa: PLC0415 - it loads decoders

    found = sniff(file.read(HEAD_BYTES))
    if found.kind not in {"video", "gif"}:
        raise SourceError("the clip of the recording is no video and no GIF")
    check_bytes(file.seek(0, io.SEEK_END), limits, "the clip has")
    file.seek(0)
    return VideoSequence(file, found, name=name, sha256=sha256, limits=limits, index=index)


def find_clip(
    file: BinaryIO, content: Content, given: Path | None, beside: Path | None, limits: Limits
) -> tuple[BinaryIO | None, str]:
    """Return the clip of a recording, open for reading; or None, and why there is none if there should be one.

    Args:
        file: The recording's.
        content: What it says.
        given: The clip, where somebody says which it is.
        beside: The folder of the recording, where a clip that is named only may be.
        limits: How large it may be.

    Raises:
        SourceError: It has a clip already, or the one that is given is another.
    """
    about = content.about
    if (entry := content.entries.get("clip")) is not None:
        if given is not None:
            raise SourceError(f"the recording has its clip in it, {about.clip or 'without a name'}; open it alone")
        return io.BufferedReader(_Part(file, entry)), ""
    if given is not None:
        if about.clip_sha256 and _digest_of(given, limits) != about.clip_sha256:
            raise SourceError(f"the clip is another one than {about.clip}, of which the recording is")
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
    """A part of a file as a file of its own, read by another descriptor so that it has a place of its own."""

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
