"""Animated GIF, PNG and WebP."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from pftrack.core.refusal import RefusedError
from pftrack.sources.limits import Limits
from pftrack.sources.sequence import open_sequence
from tests.sources.test_images import saved


def gif(frames: Sequence[Image.Image], durations_ms: Sequence[int], disposal: int = 0) -> bytes:
    return saved(
        frames[0], "GIF", save_all=True, append_images=frames[1:], duration=list(durations_ms), loop=0,
        disposal=disposal,
    )  # fmt: skip


@pytest.fixture
def animation() -> list[Image.Image]:
    """A square that moves over stripes, of few colours."""
    frames = []
    for number in range(8):
        pixels = np.zeros((40, 60, 3), np.uint8)
        pixels[::4] = (0, 90, 180)
        pixels[10:20, 5 * number : 5 * number + 10] = (220, 40, 40)
        frames.append(Image.fromarray(pixels).quantize(8))
    return frames


@pytest.mark.parametrize("disposal", [0, 1, 2])
def test_a_gif_is_composed_as_another_library_composes_it(
    tmp_path: Path, animation: list[Image.Image], disposal: int
) -> None:
    """The partial frames of an animated GIF are laid over one another; Pillow, on its own, gives the same pictures."""
    path = tmp_path / "a.gif"
    path.write_bytes(gif(animation, [50] * 8, disposal))
    sequence = open_sequence(path)
    assert (sequence.index.kind, sequence.frame_count, sequence.size) == ("gif", 8, (60, 40))
    with Image.open(path) as image:
        for index in (7, 2, 5, 0):
            image.seek(index)
            np.testing.assert_array_equal(sequence.picture(index), np.asarray(image.convert("RGB")))


def test_a_gif_tells_its_times(tmp_path: Path, animation: list[Image.Image]) -> None:
    """A GIF's frames are shown at the times that it tells, and a varying rate is said."""
    path = tmp_path / "a.gif"
    path.write_bytes(gif(animation, [100, 50, 200, 100, 30, 30, 100, 100]))
    sequence = open_sequence(path)
    np.testing.assert_allclose(sequence.times_s, [0, 0.1, 0.15, 0.35, 0.45, 0.48, 0.51, 0.61])
    assert sequence.index.warnings[0].startswith("the frame rate varies between 5 and 33.3 Hz")


def test_a_transparent_gif_lies_on_white(tmp_path: Path) -> None:
    """What no frame of a GIF has painted shows white."""
    image = Image.new("P", (16, 16), 1)
    image.putpalette([200, 0, 0, 0, 0, 0])
    image.paste(0, (0, 0, 8, 16))
    path = tmp_path / "a.gif"
    path.write_bytes(saved(image, "GIF", transparency=1))
    picture = open_sequence(path).picture(0)
    assert picture[0, [0, 15]].tolist() == [[200, 0, 0], [255, 255, 255]]


@pytest.mark.parametrize(
    ("side", "sentence"),
    [(7000, "have 7000 x 7000 = 49,000,000 pixels; at most"), (65_535, "have no size that can be read")],
)
def test_a_gif_of_giant_declared_size_is_refused(
    tmp_path: Path, animation: list[Image.Image], side: int, sentence: str
) -> None:
    """A GIF that announces a giant screen is refused by its header."""
    content = bytearray(gif(animation, [50] * 8))
    content[6:10] = side.to_bytes(2, "little") * 2
    path = tmp_path / "a.gif"
    path.write_bytes(content)
    with pytest.raises(RefusedError, match=sentence):
        open_sequence(path)


def test_a_gif_cut_short_gives_what_decodes(tmp_path: Path, animation: list[Image.Image]) -> None:
    """Of a GIF whose end is missing the frames that decode are there."""
    content = gif(animation, [50] * 8)
    path = tmp_path / "a.gif"
    path.write_bytes(content[: len(content) * 2 // 3])
    assert 2 <= open_sequence(path).frame_count < 8


DURATIONS_MS = 100, 50, 200, 100, 30, 30, 100, 100


@pytest.mark.parametrize("form", ["PNG", "WEBP"])
def test_png_and_webp_are_animated(tmp_path: Path, animation: list[Image.Image], form: str) -> None:
    """Their frames come whole, in any order and at their times, whatever the file is called."""
    frames = [image.convert("RGB") for image in animation]
    content = saved(
        frames[0], form, save_all=True, append_images=frames[1:], duration=list(DURATIONS_MS), lossless=True
    )
    path = tmp_path / "a.bin"
    path.write_bytes(content)
    sequence = open_sequence(path)
    assert (sequence.index.kind, sequence.frame_count, sequence.size) == ("gif", 8, (60, 40))
    np.testing.assert_allclose(sequence.times_s, np.cumsum((0, *DURATIONS_MS[:-1])) / 1000)
    assert sequence.index.warnings[0].startswith("the frame rate varies between 5 and 33.3 Hz")
    again = open_sequence(path, Limits(cache_bytes=1), index=sequence.index)
    for index in (7, 2, 5, 0, 6):
        np.testing.assert_array_equal(again.picture(index), np.asarray(frames[index]))
    path.write_bytes(content[: len(content) // 2])
    with pytest.raises(RefusedError, match="broken or cut short"):
        open_sequence(path)


def test_a_picture_beside_the_animation_is_left_out(tmp_path: Path, animation: list[Image.Image]) -> None:
    """What an animated PNG holds for programs that know no animation is not a frame."""
    path = tmp_path / "a.png"
    frames = [image.convert("RGB") for image in animation]
    path.write_bytes(saved(frames[7], "PNG", save_all=True, append_images=frames[:3], default_image=True, duration=40))
    sequence = open_sequence(path)
    assert (sequence.frame_count, sequence.index.frame_rate_hz) == (3, 25.0)
    np.testing.assert_array_equal(sequence.picture(0), np.asarray(frames[0]))


def test_too_large_an_animation_is_refused(tmp_path: Path, animation: list[Image.Image]) -> None:
    """The limits of pictures and frames hold for it."""
    path = tmp_path / "a.png"
    frames = [image.convert("RGB") for image in animation]
    path.write_bytes(saved(frames[0], "PNG", save_all=True, append_images=frames[1:], duration=40))
    with pytest.raises(RefusedError, match="8 frames; at most 7"):
        open_sequence(path, Limits(frames=7))
    with pytest.raises(RefusedError, match="60 x 40 = 2,400 pixels; at most 2,399"):
        open_sequence(path, Limits(pixels=2399))


def test_the_real_animation_is_read(real_clips: Path) -> None:
    """The GIF of a turning head has 23 frames, as Pillow has."""
    path = real_clips / "face_turning" / "head_turn_short.gif"
    sequence = open_sequence(path)
    assert (sequence.frame_count, sequence.size) == (23, (480, 270))
    with Image.open(path) as image:
        for index in (0, 22, 11):
            image.seek(index)
            np.testing.assert_array_equal(sequence.picture(index), np.asarray(image.convert("RGB")))
