"""Films for the tests: every frame carries its number as a row of eight black or white squares."""

from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any, TypeAlias

import av
import numpy as np
import pytest

import pftrack
from pftrack.core.model.source import FrameIndex
from pftrack.core.model.tracker import Diagnostics
from pftrack.core.refusal import RefusedError
from pftrack.sources.limits import Limits
from pftrack.sources.sequence import open_sequence
from pftrack.sources.video import VideoSequence

Picture: TypeAlias = np.ndarray
CELL = 12

# With its macroblock tree x264 writes other bytes now and then, and the same damage hits other frames.
OPTIONS = {"libx264": {"mbtree": "0"}, "libx265": {"x265-params": "log-level=none:pools=none"}}


def numbered(number: int, width: int = 96, height: int = 64) -> Picture:
    """Return a picture that shows its number in the top row, above a coloured slope that moves."""
    rows, columns = np.mgrid[0:height, 0:width]
    picture = np.stack([(columns * 2 + number * 3) % 256, rows * 3 % 256, np.full_like(rows, 90)], axis=2)
    for bit in range(8):
        picture[:CELL, bit * CELL : (bit + 1) * CELL] = 255 * (number >> bit & 1)
    return picture.astype(np.uint8)


def numbers(count: int) -> list[Picture]:
    """Return pictures that show the numbers from 0 on."""
    return [numbered(number) for number in range(count)]


def number_in(picture: Picture) -> int:
    """Read the number back."""
    cells = picture[2 : CELL - 2, : 8 * CELL].reshape(CELL - 4, 8, CELL, 3)[:, :, 2:-2].mean(axis=(0, 2, 3))
    return sum(int(level > 127) << bit for bit, level in enumerate(cells))


def film(
    path: Path,
    pictures: Sequence[Picture],
    codec: str = "libx264",
    pixels: str = "yuv420p",
    group: int = 250,
    between: int = 3,
    source: str = "rgb24",
    times_ms: Sequence[int] | None = None,
    rotation: int | None = None,
    mirrored: bool = False,
    codec_options: dict[str, str] | None = None,
    **container: Any,
) -> Path:
    """Encode pictures; `group` frames from keyframe to keyframe, up to `between` B-frames in a row."""
    with av.open(str(path), "w", **container) as output:
        stream = output.add_stream(codec, rate=25, options=OPTIONS.get(codec, {}) | (codec_options or {}))
        stream.height, stream.width = pictures[0].shape[:2]
        stream.pix_fmt = pixels
        stream.codec_context.gop_size = group
        stream.codec_context.max_b_frames = between
        stream.codec_context.thread_count = 1
        if times_ms is not None:
            stream.codec_context.time_base = Fraction(1, 1000)
        if rotation is not None:
            stream.set_display_rotation(rotation, mirrored, False)
        for number, picture in enumerate(pictures):
            frame = av.VideoFrame.from_ndarray(picture, format=source)
            if times_ms is not None:
                frame.pts, frame.time_base = times_ms[number], Fraction(1, 1000)
            output.mux(stream.encode(frame))
        output.mux(stream.encode(None))
    return path


def lossless(path: Path, pictures: Sequence[Picture], sar: str = "1/1", **more: Any) -> Path:
    """Encode pictures so that they come out to the bit; `sar` is width to height of their pixels."""
    options = {"qp": "0", "x264-params": f"sar={sar}"}
    return film(path, pictures, "libx264rgb", "rgb24", codec_options=options, **more)


def opened(path: Path, limits: Limits | None = None, index: FrameIndex | None = None) -> VideoSequence:
    sequence = open_sequence(path, limits or Limits(), index=index)
    assert isinstance(sequence, VideoSequence)
    return sequence


def decoded(path: Path) -> list[Picture]:
    """Decode from first to last in the plainest way."""
    with av.open(str(path)) as container:
        container.streams.video[0].codec_context.thread_count = 1
        return [np.asarray(frame.to_ndarray(format="rgb24"), np.uint8) for frame in container.decode(video=0)]


def refused(path: Path, words: str, limits: Limits | None = None) -> str:
    """Check that a recording is refused in words that match, and return the sentence."""
    with pytest.raises(RefusedError, match=words) as refusal:
        open_sequence(path, limits or Limits())
    return str(refusal.value)


def rows_of(path: Path) -> list[Diagnostics]:
    """Return what a run on a recording of beliefs tells of each frame."""
    run = pftrack.load(path)
    run.finish()
    return run.diagnostics
