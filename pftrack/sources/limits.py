"""Limits of a sequence, so a stranger's file cannot fill a machine; and the order of files' names."""

import re
from dataclasses import dataclass

from pftrack.core.refusal import RefusedError

HEAD_BYTES = 1024
"""Number of bytes that are read to recognise a file's format."""


@dataclass(frozen=True, slots=True)
class Limits:
    """Limits of a sequence.

    Attributes:
        frames: Most frames.
        pixels: Largest number of pixels of one picture.
        file_bytes: Largest file, or all files of a folder together.
        cache_bytes: Decoded pictures kept at hand by an open sequence.
    """

    frames: int = 20_000
    pixels: int = 1920 * 1080 * 2
    file_bytes: int = 512 * 1024**2
    cache_bytes: int = 64 * 1024**2


DEFAULT_LIMITS = Limits()
LARGE_LIMITS = Limits(pixels=8192 * 4320, file_bytes=16 * 1024**3, cache_bytes=512 * 1024**2)
"""On the user's own machine: pictures of 4K and 8K, which take time and memory."""
SMALLER = (
    "make it smaller with `ffmpeg -i FILE -vf scale=1920:-2 small.mp4`, or on your own machine allow it with --large, "
    "in Python large=True"
)


def check_bytes(size_bytes: int, limits: Limits, subject: str) -> None:
    """Refuse what is larger than the limits allow.

    Raises:
        RefusedError: It exceeds them; the sentence begins with the subject.
    """
    if size_bytes > limits.file_bytes:
        size, most = (f"{number / 1024**2:.4g} MiB" for number in (size_bytes, limits.file_bytes))
        raise RefusedError(f"{subject} {size}; at most {most} are allowed; {SMALLER}")


def check_pixels(width: int, height: int, limits: Limits, subject: str) -> None:
    """Refuse pictures that have more pixels than the limits allow, or none.

    Raises:
        RefusedError: They exceed it; the sentence begins with the subject.
    """
    if width <= 0 or height <= 0:
        raise RefusedError(f"{subject} no size that can be read; expected from 1 to {limits.pixels:,} pixels")
    if width * height > limits.pixels:
        size = f"{width} x {height} = {width * height:,} pixels"
        raise RefusedError(f"{subject} {size}; at most {limits.pixels:,} are allowed; {SMALLER}")


def natural_order(name: str) -> tuple[tuple[int, str], ...]:
    """Return a sorting key that treats runs of digits as numbers and ignores case."""
    parts = re.split(r"(\d+)", name.casefold(), flags=re.ASCII)
    return (*((int(part), "") if part.isdecimal() else (-1, part) for part in parts), (-2, name))
