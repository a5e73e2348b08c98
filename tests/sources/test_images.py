"""Folders of pictures."""

import dataclasses
import io
import struct
import zlib
from contextlib import closing
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from PIL import Image

from pftrack.core.model.source import FrameIndex
from pftrack.core.refusal import RefusedError
from pftrack.sources.images import ImageSequence
from pftrack.sources.limits import Limits, natural_order
from pftrack.sources.sequence import open_sequence
from tests.sources.films import number_in, numbered, refused


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
    assert (sequence.name, sequence.size, sequence.frame_rate_hz) == ("pictures", (96, 64), 25.0)
    np.testing.assert_allclose(sequence.times_s, np.arange(12) / 25)
    for index in (-1, 12):
        with pytest.raises(IndexError, match=f"between 0 and 11, got {index}"):
            sequence.picture(index)


@pytest.mark.parametrize(
    "names",
    [
        ["1", "2", "10"],
        ["a2", "a10", "b1"],
        ["007.png", "08.png", "9.png"],
        ["img_1_20", "img_2_3", "img_10_1"],
        ["A1", "a2", "A3"],
        ["a", "a1", "ab"],
    ],
)
def test_natural_order_counts(names: list[str]) -> None:
    """Runs of digits are numbers, and letters' case does not matter."""
    shuffled = names[::-1]
    assert sorted(shuffled, key=natural_order) == names


@given(st.lists(st.text(max_size=8), unique=True))
def test_natural_order_is_an_order(names: list[str]) -> None:
    """Any names can be sorted, in one way only."""
    other_way = names[::-1]
    assert sorted(names, key=natural_order) == sorted(other_way, key=natural_order)


def test_what_is_no_picture_is_passed_over(folder: Path) -> None:
    """Notes, tables, folders and hidden files beside the pictures do no harm, and their number is told."""
    for name, text in (
        ("README.txt", "notes"),
        ("gt.csv", "frame,x,y,w,h\n"),
        ("frame 3b.png", "ffconcat version 1.0"),
    ):
        (folder / name).write_text(text, encoding="utf-8")
    (folder / ".frame 0.png").write_bytes(b"\x89PNG\r\n\x1a\n")
    (folder / "more").mkdir()
    sequence = open_sequence(folder)
    assert sequence.frame_count == 12
    assert sequence.index.warnings == ("3 files that are not pictures are passed over",)


def test_the_content_makes_the_digest(folder: Path, tmp_path: Path) -> None:
    """The same pictures in the same order have the same digest, whatever they are called."""
    first = open_sequence(folder)
    renamed = folder.rename(tmp_path / "elsewhere")
    for number in range(1, 13):
        (renamed / f"frame {number}.png").rename(renamed / f"{number:03}")
    assert open_sequence(renamed).sha256 == first.sha256
    (renamed / "001").rename(renamed / "999")
    assert open_sequence(renamed).sha256 != first.sha256


def test_an_index_spares_the_survey(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """With the index of an earlier survey nothing is decoded before it is asked for; a picture replaced is refused."""
    index = FrameIndex.from_json(open_sequence(folder).index.to_json())
    monkeypatch.setattr(ImageSequence, "_survey", None)
    sequence = open_sequence(folder, index=index)
    assert sequence.picture(11).shape == (64, 96, 3)
    Image.fromarray(numbered(200)).save(folder / "frame 4.png")
    with pytest.raises(RefusedError, match="picture 3 has changed"):
        sequence.picture(3)


def test_the_cache_is_bounded(folder: Path) -> None:
    """Pictures held stay within the limit."""
    sequence = open_sequence(folder, Limits(cache_bytes=50_000))
    assert isinstance(sequence, ImageSequence)
    for index in (0, 5, 11, 0):
        assert not sequence.picture(index).flags.writeable
        assert sequence._cache.used_bytes <= 50_000
    sequence.close()
    assert sequence._cache.used_bytes == 0


# ---------------------------------------------------------------- pixels


def ramp(top: int) -> NDArray[np.uint16]:
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


def test_transparent_parts_lie_on_white(tmp_path: Path) -> None:
    """What is transparent shows white, and what is half transparent half of it; so does a palette's colour."""
    pixels = np.zeros((4, 12, 4), np.uint8)
    pixels[:, :, 0] = 200
    pixels[:, 4:8, 3], pixels[:, 8:, 3] = 128, 255
    folder = only(tmp_path, saved(Image.fromarray(pixels), "PNG"))
    picture = open_sequence(folder).picture(0)
    np.testing.assert_allclose(picture[0, [0, 5, 11]], [[255, 255, 255], [227, 127, 127], [200, 0, 0]], atol=1)
    image = Image.new("P", (8, 8), 1)
    image.putpalette([0, 0, 0, 10, 20, 30])
    (folder / "a").write_bytes(saved(image, "PNG", transparency=1))
    assert (open_sequence(folder).picture(0) == 255).all()


def test_photographs_stand_upright(tmp_path: Path) -> None:
    """A photograph taken with the camera on its side is turned by its own note, and so is its size."""
    exif = Image.Exif()
    exif[0x0112] = 6
    sequence = open_sequence(only(tmp_path, saved(Image.fromarray(numbered(5)), "PNG", exif=exif)))
    assert sequence.size == (64, 96)
    np.testing.assert_array_equal(sequence.picture(0), np.rot90(numbered(5), -1))


# ---------------------------------------------------------------- refusals


def giant_png(width: int, height: int) -> bytes:
    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    data = zlib.compress(bytes(100_000), 9)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", data) + chunk(b"IEND", b"")


PAGES = [Image.fromarray(GREY)] * 3


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        (saved(Image.fromarray(GREY.astype(np.float32)), "TIFF"), "has 32 bits a channel; expected 8 or 16"),
        (saved(PAGES[0], "TIFF", save_all=True, append_images=PAGES[1:]), "holds 3 pictures; expected one a file"),
        (b"\x89PNG\r\n\x1a\n" + bytes(50), "is broken or cut short"),
        (b"\xff\xd8\xff" + b"\x00" * 50, "is broken or cut short"),
        (b"no picture", "the folder holds no pictures; expected PNG, JPEG"),
        *(
            (giant_png(*size), r"^a .*; at most 4,147,200")
            for size in ((5000, 5000), (10_000, 10_000), (60_000, 60_000), (2**31 - 1, 1))
        ),
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


# ---------------------------------------------------------------- the real ones


def test_the_real_hand_is_read(real_clips: Path) -> None:
    """The 301 grey silhouettes are one sequence, and their black is black."""
    sequence = open_sequence(real_clips / "hand_silhouette" / "img")
    assert (sequence.frame_count, sequence.size) == (301, (200, 200))
    assert sequence.picture(0)[0, 0].tolist() == [0, 0, 0]
    changed = dataclasses.replace(sequence.index, sha256="0" * 64)
    assert open_sequence(real_clips / "hand_silhouette" / "img", index=changed).sha256 == sequence.sha256


def test_missing_pictures_are_told(tmp_path: Path) -> None:
    """Frames are counted as the pictures come, so a gap moves all that follow; every fifth is no gap."""
    gap = "pictures are missing between 0002 and 0005, and there are 1 more gaps; frame 2 is 0005"
    for numbers, told in (((1, 2, 5, 6, 8), (gap,)), ((5, 10, 15), ()), ((1, 2, 3), ())):
        folder = tmp_path / str(len(numbers) + numbers[0])
        folder.mkdir()
        for number in numbers:
            Image.new("RGB", (8, 8)).save(folder / f"{number:04}.png")
        with closing(open_sequence(folder)) as sequence:
            assert sequence.index.warnings == told
