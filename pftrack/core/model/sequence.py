"""What a recording is to all that use one: pictures by number, and the index of what decodes.

How files are opened, surveyed and decoded is the business of `pftrack.sources.sequence`.
"""

from dataclasses import dataclass
from typing import Literal, Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray
from pydantic import TypeAdapter

__all__ = ["FrameIndex", "FrameSequence", "Kind"]

Kind: TypeAlias = Literal["video", "gif", "images", "tracks", "beliefs"]


@dataclass(frozen=True, slots=True)
class FrameIndex:
    """What one pass over a sequence has found; opening with it again skips the pass.

    Attributes:
        kind: What the sequence is made of.
        sha256: Of the file's content; of a folder, of its pictures' digests in order.
        width: Of every picture, turned upright, px.
        height: Of every picture, turned upright, px.
        frame_rate_hz: Frames a second; the mean where the rate varies.
        times_s: When each frame is shown, from 0, s.
        checksums: CRC-32 of each frame's RGB bytes.
        stamps: Each frame's time in the container's own ticks, rising; empty where they cannot be used to seek.
        keyframes: Numbers of the frames at which decoding can begin.
        orientation: How stored pictures are turned upright, see `pftrack.sources.video`.
        warnings: Sentences for people about what is odd.
    """

    kind: Kind
    sha256: str
    width: int
    height: int
    frame_rate_hz: float
    times_s: tuple[float, ...]
    checksums: tuple[int, ...]
    stamps: tuple[int, ...] = ()
    keyframes: tuple[int, ...] = ()
    orientation: int = 0
    warnings: tuple[str, ...] = ()

    @property
    def frame_count(self) -> int:
        """How many frames there are."""
        return len(self.checksums)

    @property
    def duration_s(self) -> float:
        """How long it lasts, s; the last frame is shown as long as the mean one."""
        return self.times_s[-1] + 1 / self.frame_rate_hz

    def to_json(self) -> str:
        """Write the index as one line of JSON."""
        return _ADAPTER.dump_json(self).decode()

    @classmethod
    def from_json(cls, text: str) -> "FrameIndex":
        """Read what `to_json` wrote.

        Raises:
            ValueError: It is something else.
        """
        index = _ADAPTER.validate_json(text)
        if len(index.times_s) != index.frame_count or len(index.stamps) not in {0, index.frame_count}:
            raise ValueError(f"expected a time and a stamp for each of {index.frame_count} frames, got others")
        return index


_ADAPTER = TypeAdapter(FrameIndex)


class FrameSequence(Protocol):
    """Random access to pictures of one size."""

    @property
    def name(self) -> str:
        """The file's or folder's own name, without its path."""

    @property
    def frame_count(self) -> int:
        """How many frames really decode."""

    @property
    def frame_rate_hz(self) -> float:
        """Frames a second; the mean where the rate varies."""

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of every picture, px."""

    @property
    def sha256(self) -> str:
        """Digest of the content."""

    @property
    def times_s(self) -> NDArray[np.float64]:
        """When each frame is shown, (frame_count,), from 0, s."""

    @property
    def square(self) -> bool:
        """Whether pixels are square, or were made so; an earlier version took oblong ones as they are stored."""

    @property
    def index(self) -> FrameIndex:
        """All that the survey found."""

    def picture(self, index: int) -> NDArray[np.uint8]:
        """Return a frame, (height, width, 3) RGB, read-only.

        Args:
            index: Its number, from 0.

        Raises:
            IndexError: There is no such frame.
            SourceError: The file has changed since it was surveyed.
        """

    def close(self) -> None:
        """Let go of files and cached pictures."""
