"""Clips made for the tests: every frame carries its number as a row of eight black or white squares."""

from collections.abc import Callable, Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any, TypeAlias

import av
import numpy as np
import pytest
from numpy.typing import NDArray

Picture: TypeAlias = NDArray[np.uint8]
CELL = 12


def numbered(number: int, width: int = 96, height: int = 64) -> Picture:
    """Return a picture that shows its number in the top row, above a coloured slope that moves."""
    rows, columns = np.mgrid[0:height, 0:width]
    picture = np.stack([(columns * 2 + number * 3) % 256, rows * 3 % 256, np.full_like(rows, 90)], axis=2)
    for bit in range(8):
        picture[:CELL, bit * CELL : (bit + 1) * CELL] = 255 * (number >> bit & 1)
    return picture.astype(np.uint8)


def number_in(picture: Picture) -> int:
    """Read the number back."""
    return sum(
        int(picture[2 : CELL - 2, bit * CELL + 2 : (bit + 1) * CELL - 2].mean() > 127) << bit for bit in range(8)
    )


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
        stream = output.add_stream(codec, rate=25)
        stream.height, stream.width = pictures[0].shape[:2]
        stream.pix_fmt = pixels
        # With its macroblock tree x264 writes other bytes now and then, and the same damage hits other frames.
        stream.options = {**({"mbtree": "0"} if codec == "libx264" else {}), **(codec_options or {})}
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


@pytest.fixture
def make_film() -> Callable[..., Path]:
    return film


@pytest.fixture
def make_picture() -> Callable[..., Picture]:
    return numbered


@pytest.fixture
def read_number() -> Callable[[Picture], int]:
    return number_in


@pytest.fixture
def clip(tmp_path: Path) -> Path:
    """Two long groups of H.264 with B-frames: 120 frames, keyframes at 0 and 70."""
    pictures = [numbered(number) for number in range(120)]
    return film(tmp_path / "clip.mp4", pictures, group=70, codec_options={"x264-params": "scenecut=0:b-adapt=0"})


@pytest.fixture
def sound(tmp_path: Path) -> Path:
    path = tmp_path / "sound.mp4"
    with av.open(str(path), "w") as output:
        stream = output.add_stream("aac", rate=8000)
        frame = av.AudioFrame.from_ndarray(np.zeros((1, 8000), np.float32), format="fltp", layout="mono")
        frame.sample_rate = 8000
        output.mux(stream.encode(frame))
        output.mux(stream.encode(None))
    return path


@pytest.fixture
def real_clips() -> Path:
    """The real clips, beside the repository."""
    folder = Path(__file__).parents[2] / ".." / "shared" / "data"
    if not folder.is_dir():
        pytest.skip("the real clips are not beside this repository")
    return folder
