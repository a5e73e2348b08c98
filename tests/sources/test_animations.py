"""Animated GIF, PNG and WebP."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from pftrack.core.model.source import FrameSequence
from pftrack.sources.limits import Limits
from pftrack.sources.sequence import open_sequence
from tests.sources.films import Picture, refused
from tests.sources.test_images import saved

DURATIONS_MS = 100, 50, 200, 100, 30, 30, 100, 100


def square(number: int) -> Picture:
    """A square that moves over stripes."""
    pixels = np.zeros((40, 60, 3), np.uint8)
    pixels[::4] = (0, 90, 180)
    pixels[10:20, 5 * number : 5 * number + 10] = (220, 40, 40)
    return pixels


FEW = [Image.fromarray(square(number)).quantize(8) for number in range(8)]
FRAMES = [image.convert("RGB") for image in FEW]


def animated(path: Path, kind: str, frames: Sequence[Image.Image], duration: object = 40, **options: object) -> Path:
    path.write_bytes(saved(frames[0], kind, save_all=True, append_images=frames[1:], duration=duration, **options))
    return path


def gif(path: Path, disposal: int = 0, durations_ms: Sequence[int] = (50,) * 8) -> Path:
    return animated(path, "GIF", FEW, list(durations_ms), loop=0, disposal=disposal)


def same_as_pillow(sequence: FrameSequence, path: Path, numbers: Sequence[int]) -> None:
    """Check that pictures are those that Pillow, on its own, composes."""
    with Image.open(path) as image:
        for index in numbers:
            image.seek(index)
            np.testing.assert_array_equal(sequence.picture(index), np.asarray(image.convert("RGB")))


@pytest.mark.parametrize("disposal", [0, 1, 2])
def test_a_gif_is_composed_as_another_library_composes_it(tmp_path: Path, disposal: int) -> None:
    """The partial frames of an animated GIF are laid over one another."""
    path = gif(tmp_path / "a.gif", disposal)
    sequence = open_sequence(path)
    assert (sequence.index.kind, sequence.frame_count, sequence.size) == ("gif", 8, (60, 40))
    same_as_pillow(sequence, path, (7, 2, 5, 0))


def test_a_gif_tells_its_times(tmp_path: Path) -> None:
    """A GIF's frames are shown at the times that it tells, and a varying rate is said."""
    sequence = open_sequence(gif(tmp_path / "a.gif", durations_ms=DURATIONS_MS))
    np.testing.assert_allclose(sequence.times_s, [0, 0.1, 0.15, 0.35, 0.45, 0.48, 0.51, 0.61])
    assert sequence.index.warnings[0].startswith("the frame rate varies between 5 and 33.3 Hz")


def test_a_transparent_gif_lies_on_white(tmp_path: Path) -> None:
    """What no frame of a GIF has painted shows white."""
    image = Image.new("P", (16, 16), 1)
    image.putpalette([200, 0, 0, 0, 0, 0])
    image.paste(0, (0, 0, 8, 16))
    (tmp_path / "a.gif").write_bytes(saved(image, "GIF", transparency=1))
    assert open_sequence(tmp_path / "a.gif").picture(0)[0, [0, 15]].tolist() == [[200, 0, 0], [255, 255, 255]]


def test_a_gif_that_is_not_as_it_says(tmp_path: Path) -> None:
    """One that announces a giant screen is refused by its header; cut short it has the frames that decode."""
    path = gif(tmp_path / "a.gif")
    content = path.read_bytes()
    for side, sentence in ((7000, "have 7000 x 7000 = 49,000,000 pixels; at most"), (65_535, "have no size that can")):
        path.write_bytes(content[:6] + side.to_bytes(2, "little") * 2 + content[10:])
        refused(path, sentence)
    path.write_bytes(content[: len(content) * 2 // 3])
    assert 2 <= open_sequence(path).frame_count < 8


@pytest.mark.parametrize("kind", ["PNG", "WEBP"])
def test_png_and_webp_are_animated(tmp_path: Path, kind: str) -> None:
    """Their frames come whole, in any order and at their times, whatever the file is called."""
    path = animated(tmp_path / "a.bin", kind, FRAMES, list(DURATIONS_MS), lossless=True)
    sequence = open_sequence(path)
    assert (sequence.index.kind, sequence.frame_count, sequence.size) == ("gif", 8, (60, 40))
    np.testing.assert_allclose(sequence.times_s, np.cumsum((0, *DURATIONS_MS[:-1])) / 1000)
    assert sequence.index.warnings[0].startswith("the frame rate varies between 5 and 33.3 Hz")
    again = open_sequence(path, Limits(cache_bytes=1), index=sequence.index)
    for index in (7, 2, 5, 0, 6):
        np.testing.assert_array_equal(again.picture(index), np.asarray(FRAMES[index]))
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    refused(path, "broken or cut short")


def test_an_animated_png_has_its_frames_and_limits(tmp_path: Path) -> None:
    """What it holds for programs that know no animation is not a frame; the limits of pictures and frames hold."""
    path = animated(tmp_path / "a.png", "PNG", [FRAMES[7], *FRAMES[:3]], default_image=True)
    sequence = open_sequence(path)
    assert (sequence.frame_count, sequence.index.frame_rate_hz) == (3, 25.0)
    np.testing.assert_array_equal(sequence.picture(0), np.asarray(FRAMES[0]))
    animated(path, "PNG", FRAMES)
    refused(path, "8 frames; at most 7", Limits(frames=7))
    refused(path, "60 x 40 = 2,400 pixels; at most 2,399", Limits(pixels=2399))


def test_the_real_animation_is_read(real_clips: Path) -> None:
    """The GIF of a turning head has 23 frames, as Pillow has."""
    path = real_clips / "face_turning" / "head_turn_short.gif"
    sequence = open_sequence(path)
    assert (sequence.frame_count, sequence.size) == (23, (480, 270))
    same_as_pillow(sequence, path, (0, 22, 11))
