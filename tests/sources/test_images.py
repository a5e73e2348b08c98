"""Folders of pictures."""

import io
import struct
import zlib
from collections.abc import Sequence
from contextlib import closing
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from pftrack.core.model.source import FrameIndex
from pftrack.core.refusal import RefusedError
from pftrack.sources.images import ImageSequence
from pftrack.sources.limits import Limits, natural_order
from pftrack.sources.sequence import BoundedCache, open_sequence
from tests.sources.films import Picture, number_in, numbered, refused


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Twelve PNGs, `frame 1.png` to `frame 12.png`, each showing its number."""
    folder = tmp_path / "pictures"
    folder.mkdir()
    for number in range(1, 13):
        Image.fromarray(numbered(number)).save(folder / f"frame {number}.png")
    return folder


def only(tmp_path: Path, content: bytes, name: str = "a") -> Path:
    """Return a folder with one file in it."""
    folder = tmp_path / "only"
    folder.mkdir()
    (folder / name).write_bytes(content)
    return folder


def saved(image: Image.Image, kind: str, **options: Any) -> bytes:
    file = io.BytesIO()
    image.save(file, kind, **options)
    return file.getvalue()


# ---------------------------------------------------------------- folders


def test_pictures_come_in_natural_order(folder: Path) -> None:
    """`frame 2.png` comes before `frame 10.png`, and each picture is there to the bit; others are out of range."""
    sequence = open_sequence(folder)
    assert sequence.frame_count == 12
    assert [number_in(sequence.picture(index)) for index in range(12)] == list(range(1, 13))
    assert not sequence.picture(0).flags.writeable
    assert (sequence.name, sequence.size, sequence.frame_rate_hz) == ("pictures", (96, 64), 25.0)
    np.testing.assert_allclose(sequence.times_s, np.arange(12) / 25)
    for index in (-1, 12):
        with pytest.raises(IndexError, match=f"between 0 and 11, got {index}"):
            sequence.picture(index)


def test_natural_order_counts() -> None:
    """Runs of digits are numbers, and letters' case does not matter."""
    for names in (["a2", "a10", "b1"], ["007.png", "08.png", "9.png"], ["img_2_3", "img_10_1"], ["A1", "a2", "A3"]):
        assert sorted(set(names), key=natural_order) == names


@given(st.lists(st.text(max_size=8), unique=True))
def test_natural_order_is_an_order(names: list[str]) -> None:
    """Any names can be sorted, in one way only."""
    other_way = names[::-1]
    assert sorted(names, key=natural_order) == sorted(other_way, key=natural_order)


def test_what_is_no_picture_is_passed_over(folder: Path) -> None:
    """Notes, tables, folders and hidden files beside the pictures do no harm, and their number is told."""
    for name in ("README.txt", "gt.csv", "frame 3b.png"):
        (folder / name).write_text("ffconcat version 1.0", encoding="utf-8")
    (folder / ".frame 0.png").write_bytes(b"\x89PNG\r\n\x1a\n")
    (folder / "more").mkdir()
    sequence = open_sequence(folder)
    assert sequence.frame_count == 12
    assert sequence.index.warnings == ("3 files that are not pictures are passed over",)


def test_an_index_spares_the_survey(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """With the index of an earlier survey nothing is decoded before it is asked for; a picture replaced is refused.

    The digest is that of the pictures in their order, whatever they are called.
    """
    index = FrameIndex.from_json(open_sequence(folder).index.to_json())
    monkeypatch.setattr(ImageSequence, "_survey", None)
    sequence = open_sequence(folder, index=index)
    assert sequence.picture(11).shape == (64, 96, 3)
    Image.fromarray(numbered(200)).save(folder / "frame 4.png")
    with pytest.raises(RefusedError, match="picture 3 has changed"):
        sequence.picture(3)
    monkeypatch.undo()
    (folder / "frame 12.png").rename(folder / "frame 0.png")
    other = open_sequence(folder).sha256
    (folder / "frame 0.png").rename(folder / "frame 0a.png")
    assert open_sequence(folder).sha256 == other != index.sha256


# ---------------------------------------------------------------- pixels


def ramp(top: int) -> np.ndarray:
    return np.repeat(np.linspace(0, top, 64).round().astype(np.uint16)[np.newaxis], 16, axis=0)


DEEP, GREY = ramp(65535), ramp(255).astype(np.uint8)
RGB = np.repeat(GREY[:, :, np.newaxis], 3, axis=2)
DEEP_RGB = np.repeat(DEEP[:, :, np.newaxis], 3, axis=2)
PIXELS = {
    # A 16-bit picture, grey or in colour, is 8-bit RGB with black, grey and white where they were.
    "grey PNG": (saved(Image.fromarray(DEEP), "PNG"), 1),
    "grey TIFF": (saved(Image.fromarray(DEEP), "TIFF"), 1),
    "colour PNG": (bytes(cv2.imencode(".png", DEEP_RGB)[1]), 1),
    "colour TIFF": (bytes(cv2.imencode(".tif", DEEP_RGB)[1]), 1),
    # Grey, colour, palette and opaque alpha pictures become the same RGB, to the bit.
    **{
        f"{mode}-{kind}": (saved(Image.fromarray(GREY).convert(mode), kind), 0)
        for kind, modes in (("PNG", ("L", "P", "RGBA", "LA")), ("BMP", ("L", "RGB")), ("TIFF", ("L", "RGB")))
        for mode in modes
    },
    # JPEG, of four printing inks too, and WebP are nearly so.
    **{
        f"{mode}-{kind}": (saved(Image.fromarray(RGB).convert(mode), kind, quality=95), 12)
        for mode, kind in (("L", "JPEG"), ("RGB", "JPEG"), ("CMYK", "JPEG"), ("RGB", "WEBP"))
    },
}


@pytest.mark.parametrize("kind", PIXELS)
def test_pictures_of_every_kind_keep_their_scale(tmp_path: Path, kind: str) -> None:
    """Whatever holds a grey ramp, it is read as the ramp in RGB, lossless kinds to the bit."""
    content, off = PIXELS[kind]
    picture = open_sequence(only(tmp_path, content)).picture(0)
    expected = RGB if off != 1 else DEEP_RGB >> 8
    np.testing.assert_allclose(picture.astype(int), expected, atol=off)


def test_transparent_parts_lie_on_white_and_photographs_stand_upright(tmp_path: Path) -> None:
    """What is transparent shows white, what is half transparent half of it, and so does a palette's colour.

    A photograph taken with the camera on its side is turned by its own note, and so is its size.
    """
    pixels = np.full((4, 3, 4), (200, 0, 0, 0), np.uint8)
    pixels[:, 1, 3], pixels[:, 2, 3] = 128, 255
    folder = only(tmp_path, saved(Image.fromarray(pixels), "PNG"))
    picture = open_sequence(folder).picture(0)
    np.testing.assert_allclose(picture[0], [[255, 255, 255], [227, 127, 127], [200, 0, 0]], atol=1)
    image = Image.new("P", (8, 8), 1)
    image.putpalette([0, 0, 0, 10, 20, 30])
    (folder / "a").write_bytes(saved(image, "PNG", transparency=1))
    assert (open_sequence(folder).picture(0) == 255).all()
    exif = Image.Exif()
    exif[0x0112] = 6
    (folder / "a").write_bytes(saved(Image.fromarray(numbered(5)), "PNG", exif=exif))
    sequence = open_sequence(folder)
    assert sequence.size == (64, 96)
    np.testing.assert_array_equal(sequence.picture(0), np.rot90(numbered(5), -1))


# ---------------------------------------------------------------- refusals


def giant_png(width: int, height: int) -> bytes:
    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    data = zlib.compress(bytes(100_000), 9)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", data) + chunk(b"IEND", b"")


GIANTS = (5000, 5000), (10_000, 10_000), (60_000, 60_000), (2**31 - 1, 1)
PAGES = [Image.fromarray(GREY)] * 3


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        (saved(Image.fromarray(GREY.astype(np.float32)), "TIFF"), "has 32 bits a channel; expected 8 or 16"),
        (saved(PAGES[0], "TIFF", save_all=True, append_images=PAGES[1:]), "holds 3 pictures; expected one a file"),
        (b"\x89PNG\r\n\x1a\n" + bytes(50), "is broken or cut short"),
        (b"\xff\xd8\xff" + b"\x00" * 50, "is broken or cut short"),
        (b"no picture", "the folder holds no pictures; expected PNG, JPEG"),
        *((giant_png(*size), r"^a .*; at most 4,147,200") for size in GIANTS),
    ],
    ids=["float", "stack", "PNG", "JPEG", "text", "25 million", "100 million", "3600 million", "long"],
)
def test_other_pictures_are_refused(tmp_path: Path, content: bytes, sentence: str) -> None:
    """Pictures of 32 bits, stacks and broken ones are refused by what they are, those that unfold to giants unseen."""
    refused(only(tmp_path, content), sentence)


def test_a_folder_is_refused_by_the_name_of_what_is_wrong(folder: Path, tmp_path: Path) -> None:
    """Beyond the limits, of another size, cut short, none but a picture, or empty: with what it has and what may be."""
    refused(folder, "the folder has 12 files; at most 11 are allowed", Limits(frames=11))
    refused(folder, r"frame 1\.png has 96 x 64 = 6,144 pixels; at most 6,000 are allowed", Limits(pixels=6000))
    refused(folder, "the folder's files have .* MiB; at most 0.001953 MiB are allowed", Limits(file_bytes=2048))
    refused(folder / "frame 1.png", "the file is one PNG picture, not a sequence")
    path = folder / "frame 9.png"
    whole = path.read_bytes()
    path.write_bytes(whole[:-200])
    refused(folder, r"^frame 9\.png is broken or cut short")
    path.write_bytes(whole)
    Image.fromarray(numbered(1, 100, 64)).save(folder / "frame 7.png")
    sizes = r"frame 7\.png is 100 x 64 px and frame 1\.png is 96 x 64 px; all pictures must be of one size"
    refused(folder, sizes)
    (tmp_path / "empty").mkdir()
    refused(tmp_path / "empty", "the folder is empty; expected PNG")


def test_names_are_shown_harmlessly(tmp_path: Path) -> None:
    """Control characters, undecodable bytes and length of a file's name do not reach the message."""
    folder = only(tmp_path, b"\x89PNG\r\n\x1a\n", "bad\n\x1b[31mna\udcffme" + "x" * 200)
    assert len(refused(folder, r"^bad\?\?\[31mna\?me" + "x" * 40)) < 200


def test_missing_pictures_are_told(tmp_path: Path) -> None:
    """A gap in the numbers of pictures is reported; where every fifth number exists there is none."""
    gap = "pictures are missing between 0002 and 0005, and there are 1 more gaps; frame 2 is 0005"
    for numbers, told in (((1, 2, 5, 6, 8), (gap,)), ((5, 10, 15), ()), ((1, 2, 3), ())):
        folder = tmp_path / str(len(numbers) + numbers[0])
        folder.mkdir()
        for number in numbers:
            Image.new("RGB", (8, 8)).save(folder / f"{number:04}.png")
        with closing(open_sequence(folder)) as sequence:
            assert sequence.index.warnings == told


# Animated GIF, PNG and WebP.


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


@pytest.mark.parametrize(
    ("kind", "options"),
    [*(("GIF", {"disposal": number}) for number in range(3)), ("PNG", {}), ("WEBP", {"lossless": True})],
)
def test_frames_are_whole_in_any_order_at_their_times(tmp_path: Path, kind: str, options: dict[str, object]) -> None:
    """Partial frames are composed, whatever the file is called; a varying rate is reported."""
    path = animated(tmp_path / "a.bin", kind, FEW if kind == "GIF" else FRAMES, list(DURATIONS_MS), **options)
    sequence = open_sequence(path)
    assert (sequence.index.kind, sequence.frame_count, sequence.size) == ("gif", 8, (60, 40))
    np.testing.assert_allclose(sequence.times_s, np.cumsum((0, *DURATIONS_MS[:-1])) / 1000)
    assert sequence.index.warnings[0].startswith("the frame rate varies between 5 and 33.3 Hz")
    again = open_sequence(path, Limits(cache_bytes=1), index=sequence.index)
    for index in (7, 2, 5, 0, 6):
        np.testing.assert_array_equal(again.picture(index), np.asarray(FRAMES[index]))
    path.write_bytes(path.read_bytes()[: path.stat().st_size * 2 // 3])
    if kind == "GIF":
        assert 2 <= open_sequence(path).frame_count < 8
    else:
        refused(path, "broken or cut short")


def test_a_transparent_gif_lies_on_white(tmp_path: Path) -> None:
    """Pixels that no frame of a GIF has painted are white."""
    image = Image.new("P", (16, 16), 1)
    image.putpalette([200, 0, 0, 0, 0, 0])
    image.paste(0, (0, 0, 8, 16))
    (tmp_path / "a.gif").write_bytes(saved(image, "GIF", transparency=1))
    assert open_sequence(tmp_path / "a.gif").picture(0)[0, [0, 15]].tolist() == [[200, 0, 0], [255, 255, 255]]


def test_animations_have_limits(tmp_path: Path) -> None:
    """A GIF with a giant screen is refused by its header, a PNG beyond the limits by what it has.

    The default picture of an animated PNG, for programs that cannot animate, is not a frame.
    """
    path = animated(tmp_path / "a.gif", "GIF", FEW)
    content = path.read_bytes()
    for side, sentence in ((7000, "have 7000 x 7000 = 49,000,000 pixels; at most"), (65_535, "have no size that can")):
        path.write_bytes(content[:6] + side.to_bytes(2, "little") * 2 + content[10:])
        refused(path, sentence)
    sequence = open_sequence(animated(path, "PNG", [FRAMES[7], *FRAMES[:3]], default_image=True))
    assert (sequence.frame_count, sequence.index.frame_rate_hz) == (3, 25.0)
    np.testing.assert_array_equal(sequence.picture(0), np.asarray(FRAMES[0]))
    refused(path, "3 frames; at most 2", Limits(frames=2))
    refused(path, "60 x 40 = 2,400 pixels; at most 2,399", Limits(pixels=2399))


# The bounded cache of pictures.


def test_the_least_recently_used_goes_first() -> None:
    """Without room left, what was not asked for longest is let go; a value larger than the cache is kept alone.

    One picture is always kept, or a cache too small would decode each picture twice.
    """
    cache: BoundedCache[str] = BoundedCache(30)
    for number, value in enumerate("abc"):
        cache.put(number, value, 10)
    assert cache.get(0) == "a"
    cache.put(3, "d", 10)
    assert [number in cache for number in range(4)] == [True, False, True, True]
    cache.put(1, "b", 50)
    assert (cache.get(1), len(cache)) == ("b", 1)


@given(st.lists(st.tuples(st.integers(0, 9), st.integers(1, 12)), max_size=40))
def test_it_never_holds_more_than_it_may(puts: list[tuple[int, int]]) -> None:
    """Whatever is put in, the bytes held are counted right and stay within the capacity, but for a single value."""
    cache: BoundedCache[int] = BoundedCache(30)
    for number, size in puts:
        cache.put(number, size, size)
        held = [value for value in (cache.get(each) for each in range(10)) if value is not None]
        assert cache.used_bytes == sum(held) <= 30
    cache.clear()
    assert cache.used_bytes == len(cache) == 0
