"""Sequences: random access to the frames of a recording: videos, animations, folders of pictures, tables, and beliefs.

A sequence is surveyed once, from its first frame to its last: only pictures that decode are counted, and each picture
leaves a checksum in the `FrameIndex`. Then any frame can be read in any order, with exactly the pixels of the survey: a
picture reached by a seek is used only if its checksum is right.

The content of a file determines its format, never its name (`pftrack.sources.formats`).
"""

import hashlib
import io
import os
from collections import OrderedDict
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO, Generic, TypeVar

from pftrack.core.model.source import FrameIndex, FrameSequence
from pftrack.core.refusal import RefusedError
from pftrack.sources.formats import ALLOWED, BY_PILLOW, Format, sniff
from pftrack.sources.limits import DEFAULT_LIMITS, HEAD_BYTES, Limits, check_bytes


@dataclass(frozen=True, slots=True)
class Recording:
    """A recording on this machine.

    Attributes:
        path: The file, or the folder of pictures.
        index: The index of its frames, as JSON; None to survey it.
        limits: Its limits.
    """

    path: str
    index: str | None = None
    limits: Limits = DEFAULT_LIMITS

    def open(self, *, square: bool | None = None) -> FrameSequence:
        """Open it; see `open_sequence`.

        Raises:
            RefusedError: It is not a sequence of pictures, is broken, or exceeds the limits.
        """
        index = None if self.index is None else FrameIndex.from_json(self.index)
        return open_sequence(Path(self.path), self.limits, index=index, square=square)


def open_sequence(
    path: Path, limits: Limits = DEFAULT_LIMITS, *, index: FrameIndex | None = None, square: bool | None = None
) -> FrameSequence:
    """Open a video, an animation, a folder of pictures, a table of tracks or a recording of beliefs.

    A folder may also hold the results of a tracker with their clip and their truth (`pftrack.sources.results.parts`).

    A file from a stranger may be hostile: it may crash a decoder, keep it busy for ever, or expand beyond all memory. A
    server for strangers first opens it in a confined child process (`pftrack.process`), and trusts the index from
    there.

    Args:
        path: The file or folder.
        limits: Its limits.
        index: From an earlier survey of the same content; without it the sequence is decoded once from end to end.
        square: Whether to make pixels square that are not; None follows the index; without an index the default is yes.
            A run of an earlier version used pixels as stored.

    Raises:
        RefusedError: It is not a sequence of pictures, is broken, or exceeds the limits.
    """
    # Decoders are imported on demand, so a run on a simulated scene does not load them.
    try:
        if path.is_dir():
            from pftrack.sources.images import ImageSequence  # noqa: PLC0415
            from pftrack.sources.results.parts import open_parts, parts_in  # noqa: PLC0415

            if (parts := parts_in(path)) is not None:
                return open_parts(parts, limits, index=index)
            return ImageSequence(path, limits, index)
        if not path.is_file():
            raise RefusedError(f"the file or folder does not exist; expected {ALLOWED}")
        file = path.open("rb")
    except OSError as error:
        raise RefusedError(f"the file cannot be read ({(error.strerror or 'input or output error').lower()})") from None
    try:
        found = _inspect(file, limits)
        sha256 = hashlib.file_digest(file, "sha256").hexdigest()
        if index is not None and (index.sha256, index.kind) != (sha256, found.kind):
            index = None  # of another content: survey it again
        if found.kind == "tracks":
            from pftrack.sources.tracks import TrackSequence  # noqa: PLC0415

            return TrackSequence(file, name=path.name, sha256=sha256, limits=limits)
        if found.kind == "beliefs":
            from pftrack.sources.beliefs.sequence import BeliefSequence  # noqa: PLC0415

            recording = _recorded(file) if found.decoder == "results" else file
            return BeliefSequence(
                recording, name=path.name, sha256=sha256, limits=limits, index=index, beside=path.parent
            )
        return pictures_of(file, found, name=path.name, sha256=sha256, limits=limits, index=index, square=square)
    except BaseException:
        file.close()
        raise


def pictures_of(file: BinaryIO, found: Format, *, square: bool | None = None, **about: Any) -> FrameSequence:  # noqa: ANN401
    """Return the pictures of a video or an animation in a file; see `VideoSequence`."""
    if found.decoder in BY_PILLOW:
        from pftrack.sources.images import AnimationSequence  # noqa: PLC0415

        return AnimationSequence(file, found, **about)
    from pftrack.sources.video import VideoSequence  # noqa: PLC0415

    return VideoSequence(file, found, square=square, **about)


def _recorded(file: BinaryIO) -> BinaryIO:
    """Return a tracker's results as a recording of beliefs; the file is closed."""
    from pftrack.sources.results.parts import record_results  # noqa: PLC0415
    from pftrack.sources.results.writing import LARGEST_FILE_BYTES, read_results  # noqa: PLC0415

    with file:
        file.seek(0)
        table = read_results(file.read(LARGEST_FILE_BYTES + 1))
    recording = io.BytesIO()
    record_results(table, recording)
    return recording


def _inspect(file: BinaryIO, limits: Limits) -> Format:
    """Return the format of an open file before any decoder sees it."""
    found = sniff(file.read(HEAD_BYTES))
    if found.kind == "picture":
        raise RefusedError(f"the file is one {found.title} picture, not a sequence; expected {ALLOWED}")
    check_bytes(file.seek(0, os.SEEK_END), limits, "the file has")
    file.seek(0)
    return found


T = TypeVar("T")


class BoundedCache(Generic[T]):
    """Values by frame number, within a number of bytes; the newest value is kept even if it alone is larger."""

    def __init__(self, capacity_bytes: int) -> None:
        """Begin empty.

        Args:
            capacity_bytes: Largest total size of the values.
        """
        self.capacity_bytes = capacity_bytes
        self.used_bytes = 0
        self._entries: OrderedDict[int, tuple[T, int]] = OrderedDict()

    def __len__(self) -> int:
        """Count the values."""
        return len(self._entries)

    def __contains__(self, number: int) -> bool:
        """Return whether a frame is cached, without using it."""
        return number in self._entries

    def get(self, number: int) -> T | None:
        """Return a frame's value, which becomes the most recently used, or None."""
        entry = self._entries.get(number)
        if entry is None:
            return None
        self._entries.move_to_end(number)
        return entry[0]

    def put(self, number: int, value: T, size_bytes: int) -> None:
        """Store a value, and drop the least recently used ones if the cache is full."""
        self.drop(number)
        self._entries[number] = (value, size_bytes)
        self.used_bytes += size_bytes
        while self.used_bytes > self.capacity_bytes and len(self._entries) > 1:
            self.drop(next(iter(self._entries)))

    def drop(self, number: int) -> None:
        """Drop a frame's value, if it exists."""
        entry = self._entries.pop(number, None)
        if entry is not None:
            self.used_bytes -= entry[1]

    def clear(self) -> None:
        """Let go of everything."""
        self._entries.clear()
        self.used_bytes = 0
