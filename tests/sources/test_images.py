"""Folders of pictures."""

import dataclasses
import io
import struct
import zlib
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

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

Draw = Callable[..., NDArray[np.uint8]]


@pytest.fixture
def folder(tmp_path: Path, make_picture: Draw) -> Path:
    """Twelve PNGs, `frame 1.png` to `frame 12.png`, each showing its number."""
    folder = tmp_path / "pictures"
    folder.mkdir()
    for number in range(1, 13):
        Image.fromarray(make_picture(number)).save(folder / f"frame {number}.png")
    return folder


def only(tmp_path: Path, name: str, content: bytes) -> Path:
    folder = tmp_path / "only"
    folder.mkdir()
    (folder / name).write_bytes(content)
    return folder


def saved(image: Image.Image, kind: str, **options: object) -> bytes:
    file = io.BytesIO()
    image.save(file, kind, **options)
    return file.getvalue()


# ---------------------------------------------------------------- folders


def test_pictures_come_in_natural_order(folder: Path, read_number: Callable[..., int]) -> None:
    """`frame 2.png` comes before `frame 10.png`, and each picture is there to the bit."""
    sequence = open_sequence(folder)
    assert sequence.frame_count == 12
    assert [read_number(sequence.picture(index)) for index in range(12)] == list(range(1, 13))
    assert (sequence.name, sequence.size, sequence.frame_rate_hz) == ("pictures", (96, 64), 25.0)
    np.testing.assert_allclose(sequence.times_s, np.arange(12) / 25)


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
    (folder / "README.txt").write_text("notes", encoding="utf-8")
    (folder / "gt.csv").write_text("frame,x,y,w,h\n", encoding="utf-8")
    (folder / "frame 3b.png").write_text("ffconcat version 1.0", encoding="utf-8")
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
    """With the index of an earlier survey nothing is decoded before it is asked for."""
    index = FrameIndex.from_json(open_sequence(folder).index.to_json())
    monkeypatch.setattr(ImageSequence, "_survey", None)
    sequence = open_sequence(folder, index=index)
    assert sequence.picture(11).shape == (64, 96, 3)


def test_a_picture_that_changes_is_found_out(folder: Path, make_picture: Draw) -> None:
    """A picture replaced while the folder is open is refused."""
    index = open_sequence(folder).index
    sequence = open_sequence(folder, index=index)
    Image.fromarray(make_picture(200)).save(folder / "frame 4.png")
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


@pytest.mark.parametrize("index", [-1, 12])
def test_a_frame_outside_is_refused(folder: Path, index: int) -> None:
    """A frame that does not exist is refused with the range of those that do."""
    with pytest.raises(IndexError, match=f"between 0 and 11, got {index}"):
        open_sequence(folder).picture(index)


# ---------------------------------------------------------------- pixels


def ramp(top: int) -> NDArray[np.uint16]:
    return np.repeat(np.linspace(0, top, 64).round().astype(np.uint16)[np.newaxis], 16, axis=0)


def deep_grey(kind: str) -> bytes:
    return saved(Image.fromarray(ramp(65535)), kind)


def deep_colour(suffix: str) -> bytes:
    return bytes(cv2.imencode(suffix, np.repeat(ramp(65535)[:, :, np.newaxis], 3, axis=2))[1])


@pytest.mark.parametrize(
    "content",
    [deep_grey("PNG"), deep_grey("TIFF"), deep_colour(".png"), deep_colour(".tif")],
    ids=["grey PNG", "grey TIFF", "colour PNG", "colour TIFF"],
)
def test_sixteen_bits_keep_their_scale(tmp_path: Path, content: bytes) -> None:
    """A 16-bit picture, grey or in colour, comes out as 8-bit RGB with black, grey and white where they were."""
    picture = open_sequence(only(tmp_path, "a", content)).picture(0)
    np.testing.assert_allclose(picture, np.broadcast_to((ramp(65535) >> 8)[:, :, np.newaxis], (16, 64, 3)), atol=1)


GREY = ramp(255).astype(np.uint8)


@pytest.mark.parametrize(
    ("image", "kind"),
    [
        (Image.fromarray(GREY), "PNG"),
        (Image.fromarray(GREY), "BMP"),
        (Image.fromarray(GREY), "TIFF"),
        (Image.fromarray(GREY).convert("RGB"), "BMP"),
        (Image.fromarray(GREY).convert("P"), "PNG"),
        (Image.fromarray(GREY).convert("RGBA"), "PNG"),
        (Image.fromarray(GREY).convert("LA"), "PNG"),
        (Image.fromarray(GREY).convert("RGB"), "TIFF"),
    ],
    ids=["L-PNG", "L-BMP", "L-TIFF", "RGB-BMP", "P-PNG", "RGBA-PNG", "LA-PNG", "RGB-TIFF"],
)
def test_lossless_pictures_come_out_to_the_bit(tmp_path: Path, image: Image.Image, kind: str) -> None:
    """Grey, colour, palette and opaque alpha pictures become the same RGB."""
    picture = open_sequence(only(tmp_path, "a", saved(image, kind))).picture(0)
    np.testing.assert_array_equal(picture, np.repeat(GREY[:, :, np.newaxis], 3, axis=2))


@pytest.mark.parametrize(("mode", "kind"), [("L", "JPEG"), ("RGB", "JPEG"), ("CMYK", "JPEG"), ("RGB", "WEBP")])
def test_lossy_pictures_come_out_nearly(tmp_path: Path, mode: str, kind: str) -> None:
    """JPEG, of four printing inks too, and WebP are read."""
    image = Image.fromarray(GREY).convert("RGB").convert(mode)
    picture = open_sequence(only(tmp_path, "a", saved(image, kind, quality=95))).picture(0)
    np.testing.assert_allclose(picture.astype(int), np.repeat(GREY[:, :, np.newaxis], 3, axis=2), atol=12)


def test_transparent_parts_lie_on_white(tmp_path: Path) -> None:
    """What is transparent shows white, and what is half transparent half of it."""
    pixels = np.zeros((4, 12, 4), np.uint8)
    pixels[:, :, 0] = 200
    pixels[:, 4:8, 3], pixels[:, 8:, 3] = 128, 255
    picture = open_sequence(only(tmp_path, "a.png", saved(Image.fromarray(pixels), "PNG"))).picture(0)
    np.testing.assert_allclose(picture[0, [0, 5, 11]], [[255, 255, 255], [227, 127, 127], [200, 0, 0]], atol=1)


def test_a_transparent_colour_of_a_palette_lies_on_white(tmp_path: Path) -> None:
    """A palette's transparent colour shows white."""
    image = Image.new("P", (8, 8), 1)
    image.putpalette([0, 0, 0, 10, 20, 30])
    picture = open_sequence(only(tmp_path, "a.png", saved(image, "PNG", transparency=1))).picture(0)
    assert (picture == 255).all()


def test_photographs_stand_upright(tmp_path: Path, make_picture: Draw) -> None:
    """A photograph taken with the camera on its side is turned by its own note, and so is its size."""
    exif = Image.Exif()
    exif[0x0112] = 6
    stored = make_picture(5)
    sequence = open_sequence(only(tmp_path, "a.png", saved(Image.fromarray(stored), "PNG", exif=exif)))
    assert sequence.size == (64, 96)
    np.testing.assert_array_equal(sequence.picture(0), np.rot90(stored, -1))


# ---------------------------------------------------------------- refusals


def test_one_size_for_all(folder: Path, make_picture: Draw) -> None:
    """A picture of another size is refused by its name, with both sizes."""
    Image.fromarray(make_picture(1, 100, 64)).save(folder / "frame 7.png")
    sentence = r"frame 7\.png is 100 x 64 px and frame 1\.png is 96 x 64 px; all pictures must be of one size"
    with pytest.raises(RefusedError, match=sentence):
        open_sequence(folder)


def test_a_broken_picture_is_named(folder: Path) -> None:
    """A picture that is cut short is refused by its name, without a path."""
    path = folder / "frame 9.png"
    path.write_bytes(path.read_bytes()[:-200])
    with pytest.raises(RefusedError, match=r"^frame 9\.png is broken or cut short"):
        open_sequence(folder)


def giant_png(width: int, height: int) -> bytes:
    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    data = zlib.compress(bytes(100_000), 9)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", data) + chunk(b"IEND", b"")


@pytest.mark.parametrize(("width", "height"), [(5000, 5000), (10_000, 10_000), (60_000, 60_000), (2**31 - 1, 1)])
def test_a_picture_that_unfolds_to_a_giant_is_refused_unseen(tmp_path: Path, width: int, height: int) -> None:
    """A small file that announces a giant picture is refused by its header."""
    with pytest.raises(RefusedError, match=r"bomb\.png .*; at most 4,147,200"):
        open_sequence(only(tmp_path, "bomb.png", giant_png(width, height)))


def stack() -> bytes:
    pages = [Image.fromarray(GREY)] * 3
    return saved(pages[0], "TIFF", save_all=True, append_images=pages[1:])


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        (saved(Image.fromarray(GREY.astype(np.float32)), "TIFF"), "has 32 bits a channel; expected 8 or 16"),
        (stack(), "holds 3 pictures; expected one a file"),
        (b"\x89PNG\r\n\x1a\n" + bytes(50), "is broken or cut short"),
        (b"\xff\xd8\xff" + b"\x00" * 50, "is broken or cut short"),
        (b"no picture", "the folder holds no pictures; expected PNG, JPEG"),
    ],
    ids=["float", "stack", "PNG", "JPEG", "text"],
)
def test_other_pictures_are_refused(tmp_path: Path, content: bytes, sentence: str) -> None:
    """Pictures of 32 bits, stacks of them and broken ones are refused by what they are."""
    with pytest.raises(RefusedError, match=sentence):
        open_sequence(only(tmp_path, "a", content))


def test_an_empty_folder_is_refused(tmp_path: Path) -> None:
    """A folder with nothing in it is refused by saying so."""
    with pytest.raises(RefusedError, match="the folder is empty; expected PNG"):
        open_sequence(tmp_path)


@pytest.mark.parametrize(
    ("limits", "sentence"),
    [
        (Limits(frames=11), "the folder has 12 files; at most 11 are allowed"),
        (Limits(pixels=6000), r"frame 1\.png has 96 x 64 = 6,144 pixels; at most 6,000 are allowed"),
        (Limits(file_bytes=2048), "the folder's files have .* MiB; at most 0.001953 MiB are allowed"),
    ],
)
def test_what_is_too_large_is_refused_with_the_limit(folder: Path, limits: Limits, sentence: str) -> None:
    """Folders beyond the limits are refused with what they have and what is allowed."""
    with pytest.raises(RefusedError, match=sentence):
        open_sequence(folder, limits)


def test_names_are_shown_harmlessly(tmp_path: Path) -> None:
    """Control characters, undecodable bytes and length of a file's name do not reach the message."""
    with pytest.raises(RefusedError, match=r"^bad\?\?\[31mna\?me" + "x" * 40) as refusal:
        open_sequence(only(tmp_path, "bad\n\x1b[31mna\udcffme" + "x" * 200, b"\x89PNG\r\n\x1a\n"))
    assert len(str(refusal.value)) < 200


def test_one_picture_is_no_sequence(folder: Path) -> None:
    """A single picture file is refused with what is expected."""
    with pytest.raises(RefusedError, match="the file is one PNG picture, not a sequence"):
        open_sequence(folder / "frame 1.png")


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
    for numbers, told in (((1, 2, 5, 6, 8), 1), ((5, 10, 15), 0), ((1, 2, 3), 0)):
        folder = tmp_path / str(len(numbers) + numbers[0])
        folder.mkdir()
        for number in numbers:
            Image.new("RGB", (8, 8)).save(folder / f"{number:04}.png")
        with closing(open_sequence(folder)) as sequence:
            assert len(sequence.index.warnings) == told
            if told:
                wanted = "pictures are missing between 0002 and 0005, and there are 1 more gaps; frame 2 is 0005"
                assert sequence.index.warnings == (wanted,)
