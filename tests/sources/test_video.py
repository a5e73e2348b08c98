"""Videos: what decodes is counted, and any frame is the same however it is reached."""

import dataclasses
import itertools
import zlib
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from pathlib import Path

import av
import numpy as np
import pytest
from PIL import Image

from pftrack.core.model.source import FrameIndex
from pftrack.core.refusal import RefusedError
from pftrack.sources.decoder import Decoder
from pftrack.sources.limits import LARGE_LIMITS, Limits
from pftrack.sources.sequence import open_sequence
from pftrack.sources.video import VideoSequence
from tests.sources.films import decoded, film, lossless, number_in, numbered, numbers, opened, refused

# ---------------------------------------------------------------- any order, the same pixels


def test_seeking_gives_the_pixels_of_decoding_in_order(clip: Path) -> None:
    """Frames of a long-GOP H.264 clip with B-frames are the same to the bit in random order as from first to last.

    A cache with room for one picture changes nothing but the time, and holds no more than it may.
    """
    reference = decoded(clip)
    for limits, order in (
        (Limits(), np.random.default_rng(3).permutation(120).tolist()),
        (Limits(cache_bytes=30_000), [119, 0, 71, 70, 69, 3, 119]),
    ):
        sequence = opened(clip, limits)
        assert (sequence.index.keyframes, len(reference)) == ((0, 70), 120)
        for number in order:
            picture = sequence.picture(number)
            assert number_in(picture) == number
            np.testing.assert_array_equal(picture, reference[number])
            assert sequence._cache.used_bytes <= limits.cache_bytes
        sequence.close()


def test_stepping_backwards_decodes_each_group_few_times(clip: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Going backwards enters a group anew only once in as many steps as pictures are kept on the way."""
    reference = decoded(clip)
    sequence = opened(clip, index=opened(clip).index)
    entries, seek = [], Decoder.seek
    monkeypatch.setattr(Decoder, "seek", lambda self, stamp: (entries.append(stamp), seek(self, stamp))[1])
    for number in reversed(range(120)):
        np.testing.assert_array_equal(sequence.picture(number), reference[number])
    assert len(entries) <= 6


@pytest.mark.parametrize(
    ("name", "codec", "between"),
    [
        ("clip.mov", "libx264", 3),
        ("clip.mkv", "libx264", 3),
        ("clip.mkv", "ffv1", 0),
        ("clip.webm", "libvpx-vp9", 0),
        ("clip.avi", "mpeg4", 0),
        ("clip.avi", "mjpeg", 0),
        ("clip.avi", "libx264", 3),
        ("clip.ts", "libx264", 3),
        ("clip.mpg", "mpeg2video", 2),
        ("clip.ogv", "libvpx", 0),
        ("clip.mp4", "libx265", 3),
    ],
)
def test_every_container_gives_the_same_frames_in_any_order(
    tmp_path: Path, name: str, codec: str, between: int
) -> None:
    """MP4, MOV, MKV, WebM, AVI, OGG, MPEG and MPEG-TS are counted and sought alike, whatever their file is called."""
    pixels = "yuvj420p" if codec == "mjpeg" else "yuv420p"
    container = {"format": "ogg"} if name.endswith("ogv") else {}
    options = {"x264-params": "open-gop=1"} if codec == "libx264" else {}
    path = film(tmp_path / name, numbers(40), codec, pixels, 12, between, codec_options=options, **container)
    disguised = path.rename(tmp_path / "noname")
    reference, sequence = decoded(disguised), opened(disguised)
    assert (sequence.frame_count, sequence.size, sequence.frame_rate_hz) == (40, (96, 64), 25.0)
    np.testing.assert_allclose(sequence.times_s, np.arange(40) / 25, atol=2e-3)
    for number in np.random.default_rng(0).permutation(40).tolist():
        np.testing.assert_array_equal(sequence.picture(number), reference[number])
        assert number_in(sequence.picture(number)) == number


def test_a_keyframe_that_is_none_is_found_out(clip: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Pixels are believed by their checksum only: an entry that gives others is dropped for an earlier one."""

    def anywhere(self: Decoder, stamp: int) -> None:
        self._container.seek(stamp, stream=self.stream, any_frame=True)

    monkeypatch.setattr(Decoder, "seek", anywhere)
    reference = decoded(clip)
    sequence = opened(clip, index=dataclasses.replace(opened(clip).index, keyframes=(0, 33, 35, 40)))
    for number in (50, 20, 45):
        np.testing.assert_array_equal(sequence.picture(number), reference[number])
    assert sequence._untrue >= {33, 35, 40}


def test_a_file_that_changes_while_open_is_found_out(clip: Path) -> None:
    """Pictures that no longer have the pixels of the survey are refused, never handed out."""
    sequence = opened(clip, index=dataclasses.replace(opened(clip).index, checksums=(0,) * 120))
    with pytest.raises(RefusedError, match="frame 5 no longer decodes as it did"):
        sequence.picture(5)


def test_many_threads_may_ask_at_once(clip: Path) -> None:
    """One sequence serves several threads, each of which gets the frame it asked for."""
    asked = np.random.default_rng(1).integers(0, 120, 60).tolist()
    with ThreadPoolExecutor(4) as pool:
        assert [number_in(picture) for picture in pool.map(opened(clip).picture, asked)] == asked


# ---------------------------------------------------------------- what a sequence tells


def test_a_picture_is_rgb_and_read_only(clip: Path) -> None:
    """A picture is (height, width, 3) uint8, and nobody can write to what others see; others are out of range."""
    sequence = opened(clip)
    picture = sequence.picture(0)
    assert (picture.shape, picture.dtype, picture.flags.c_contiguous) == ((64, 96, 3), np.uint8, True)
    with pytest.raises(ValueError, match="read-only"):
        picture[0, 0, 0] = 1
    for index in (-1, 120, 10**9):
        with pytest.raises(IndexError, match=f"between 0 and 119, got {index}"):
            sequence.picture(index)


def test_an_index_spares_the_survey(clip: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Opening with the index of an earlier survey decodes nothing, and tells the same; other content is surveyed."""
    first = opened(clip)
    index = FrameIndex.from_json(first.index.to_json())
    assert index == first.index
    assert opened(film(tmp_path / "other.mp4", numbers(9)), index=index).frame_count == 9
    monkeypatch.setattr(VideoSequence, "_survey", None)
    again = opened(clip, index=index)
    np.testing.assert_array_equal(again.picture(77), first.picture(77))
    assert again.sha256 == first.sha256


def test_an_index_is_read_with_suspicion(clip: Path) -> None:
    """Text that is no index is refused as a ValueError, and so is one whose columns differ in length."""
    broken = dataclasses.replace(opened(clip).index, times_s=(0.0,)).to_json()
    for text, words in (*((it, ".") for it in ("", "[]", "{}", '{"kind":"video"}', "null")), (broken, "120 frames")):
        with pytest.raises(ValueError, match=words):
            FrameIndex.from_json(text)


def test_no_file_stays_open(clip: Path, tmp_path: Path) -> None:
    """Opening, reading, refusing and closing leave no descriptor behind."""
    broken = tmp_path / "broken.mp4"
    broken.write_bytes(clip.read_bytes()[:500])
    for _ in range(3):
        with closing(opened(clip)) as sequence:
            sequence.picture(90)
        refused(broken, "broken")
    # Others of this process open and close files meanwhile.
    assert not {clip.resolve(), broken.resolve()} & {one.resolve() for one in Path("/proc/self/fd").iterdir()}


# ---------------------------------------------------------------- what videos are like


def test_a_varying_rate_is_counted_and_told(tmp_path: Path) -> None:
    """With a varying rate a frame's number is its place in the order; its time is told, and the rate is the mean."""
    times = [0, *itertools.accumulate([40, 40, 200, 40, 10, 40, 300, 40, 40])]
    sequence = opened(film(tmp_path / "clip.mkv", numbers(10), times_ms=times))
    assert [number_in(sequence.picture(number)) for number in (9, 3, 0, 5)] == [9, 3, 0, 5]
    np.testing.assert_allclose(sequence.times_s * 1000, times, atol=1)
    assert sequence.frame_rate_hz == pytest.approx(9 / 0.75, rel=0.02)
    assert any("varies between 3.33 and 100 Hz" in warning for warning in sequence.index.warnings)


def test_missing_frames_are_counted(tmp_path: Path) -> None:
    """Times that leave out whole frames tell how many, and after which; numbers count the frames that are there."""
    path = film(tmp_path / "clip.mkv", numbers(8), times_ms=[40 * number for number in (0, 1, 2, 5, 6, 8, 9, 10)])
    assert opened(path).index.warnings[0].startswith("3 frames are missing by the times, first after frame 2")


def test_large_pictures_can_be_allowed(tmp_path: Path) -> None:
    """4K is refused with what to do, and read with the limits of a machine of one's own."""
    path = film(tmp_path / "4k.mp4", [np.zeros((2160, 3840, 3), np.uint8)], codec_options={"preset": "ultrafast"})
    refused(path, r"scale=1920:-2 .* allow it with --large, in Python large=True")
    assert opened(path, LARGE_LIMITS).size == (3840, 2160)


@pytest.mark.parametrize("turns", [0, 1, 2, 3])
@pytest.mark.parametrize("mirrored", [False, True])
def test_a_rotated_clip_stands_upright(tmp_path: Path, turns: int, mirrored: bool) -> None:
    """Pictures are turned, and mirrored, as the file's display matrix asks, and the size is that of what is seen."""
    sequence = opened(lossless(tmp_path / "clip.mp4", numbers(4), rotation=90 * turns, mirrored=mirrored))
    seen = np.rot90(numbered(2), turns)[:, :: -1 if mirrored else 1]
    assert sequence.size == (seen.shape[1], seen.shape[0])
    np.testing.assert_array_equal(sequence.picture(2), seen)


@pytest.mark.parametrize(
    ("codec", "pixels", "source"),
    [
        ("ffv1", "gray16le", "gray16le"),
        ("ffv1", "gray10le", "gray16le"),
        ("png", "rgb48be", "rgb48le"),
        ("libx265", "yuv420p10le", "rgb48le"),
        ("libx264", "yuv420p10le", "rgb48le"),
        ("prores_ks", "yuv422p10le", "rgb48le"),
    ],
)
def test_deep_pictures_keep_their_scale(tmp_path: Path, codec: str, pixels: str, source: str) -> None:
    """Pictures of 10 to 16 bits come out as 8-bit RGB with black, grey and white where they were."""
    slope = np.repeat(np.linspace(0, 65535, 256).round().astype(np.uint16)[np.newaxis], 64, axis=0)
    deep = slope if source.startswith("gray") else np.repeat(slope[:, :, np.newaxis], 3, axis=2)
    path = tmp_path / ("clip.mov" if codec == "png" else "clip.mkv")
    film(path, [deep] * 2, codec, pixels, source=source, codec_options={"crf": "2"} if "libx" in codec else None)  # type: ignore[list-item]
    picture = opened(path).picture(1).astype(int)
    np.testing.assert_allclose(picture, np.broadcast_to((slope >> 8)[:, :, np.newaxis], (64, 256, 3)), atol=4)


@pytest.mark.parametrize(
    ("matrix", "told"),
    [("ITU709", "colormatrix=bt709"), ("ITU601", "colormatrix=smpte170m"), ("ITU601", "fullrange=off")],
)
def test_colours_are_those_of_the_matrix_told(tmp_path: Path, matrix: str, told: str) -> None:
    """Colours are converted by the matrix that the video tells, of HD or of older television, which is the default."""
    colour = np.broadcast_to(np.array([200, 40, 90], np.uint8), (64, 96, 3))
    with av.open(str(tmp_path / "a.mp4"), "w") as output:
        stream = output.add_stream("libx264", rate=25, options={"crf": "1", "x264-params": told})
        stream.width, stream.height, stream.pix_fmt = 96, 64, "yuv420p"
        frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(colour), format="rgb24")
        output.mux(stream.encode(frame.reformat(format="yuv420p", dst_colorspace=matrix)))
        output.mux(stream.encode(None))
    np.testing.assert_allclose(opened(tmp_path / "a.mp4").picture(0), colour, atol=3)


@pytest.mark.parametrize(
    ("ratio", "size", "told"),
    [
        ("2/1", (192, 64), "not square (2:1); pictures of 96 x 64 px are shown and tracked as 192 x 64 px"),
        ("1/2", (96, 128), "not square (1:2); pictures of 96 x 64 px are shown and tracked as 96 x 128 px"),
        ("8/1", (96, 64), "given as 8:1; they are taken to be square"),
        ("1/1", (96, 64), ""),
        ("1000/1001", (96, 64), ""),
    ],
)
def test_pixels_are_made_square(tmp_path: Path, ratio: str, size: tuple[int, int], told: str) -> None:
    """A picture is as wide and as high as it is meant to be seen, in any order, and what was done is said."""
    stored = [np.full((64, 96, 3), 90, np.uint8) for _ in range(6)]
    for number, picture in enumerate(stored):
        picture[20:40, 10 + number : 30 + number] = (220, 60, 60)
    sequence = opened(lossless(tmp_path / "a.mkv", stored, ratio))
    assert sequence.size == size
    warnings = [warning for warning in sequence.index.warnings if "square" in warning]
    assert [told in warning for warning in warnings] == ([True] if told else [])
    across, down = size[0] // 96, size[1] // 64
    for number in (5, 0, 3):
        picture = sequence.picture(number)
        assert picture.shape == (size[1], size[0], 3)
        red = picture[:, :, 0].astype(int) > 155
        assert (red.any(axis=0).sum(), red.any(axis=1).sum()) == (20 * across, 20 * down)
        assert int(np.flatnonzero(red.any(axis=0))[0]) == (10 + number) * across


def test_an_index_of_an_earlier_version_keeps_pictures_as_stored(tmp_path: Path) -> None:
    """A run that was saved when pixels were not made square finds the pictures that it was made on."""
    stored = [np.full((64, 96, 3), 40 * number, np.uint8) for number in range(3)]
    path = lossless(tmp_path / "a.mkv", stored, "2/1")
    checksums = tuple(zlib.crc32(picture.data) for picture in stored)
    assert opened(path).square
    sequence = opened(path, index=dataclasses.replace(opened(path).index, width=96, checksums=checksums))
    assert (sequence.square, sequence.size) == (False, (96, 64))
    np.testing.assert_array_equal(sequence.picture(2), stored[2])


@pytest.mark.parametrize(("turns", "size"), [(1, (64, 192)), (2, (192, 64))])
def test_pixels_are_made_square_before_a_picture_is_turned(tmp_path: Path, turns: int, size: tuple[int, int]) -> None:
    """The shape of pixels is that of the stored picture, which may lie on its side."""
    sequence = opened(lossless(tmp_path / "a.mp4", numbers(3), "2/1", rotation=90 * turns))
    assert (sequence.size, sequence.picture(2).shape[:2]) == (size, size[::-1])


def test_a_single_frame_is_a_sequence(tmp_path: Path) -> None:
    """A video of one frame has one frame at time zero."""
    sequence = opened(film(tmp_path / "a.mkv", [numbered(7)]))
    assert (sequence.frame_count, sequence.times_s.tolist()) == (1, [0.0])


def test_transparent_parts_lie_on_paper(tmp_path: Path) -> None:
    """A video with transparency has the colours of the same picture as PNG: it lies on white."""
    picture = np.zeros((16, 32, 4), np.uint8)
    picture[:, :, 0], picture[:, 16:, 3], picture[:, 8:16, 3] = 200, 255, 100
    folder = tmp_path / "pictures"
    folder.mkdir()
    Image.fromarray(picture).save(folder / "one.png")
    seen = opened(film(tmp_path / "alpha.mov", [picture], "png", "rgba", source="rgba")).picture(0)
    np.testing.assert_array_equal(seen, open_sequence(folder).picture(0))
    assert seen[0, 0].tolist() == [255, 255, 255]


def test_brightness_for_other_displays_is_told(tmp_path: Path) -> None:
    """HLG and PQ are shown as they are stored, and a sentence says so."""
    made = film(tmp_path / "wide.mp4", [numbered(0)], codec_options={"x264-params": "transfer=smpte2084"})
    assert "HDR" in " ".join(opened(made).index.warnings)


# ---------------------------------------------------------------- the real clips


@pytest.mark.parametrize(
    ("name", "frames", "size"),
    [
        ("ball_green_hand/clip.mp4", 290, (640, 360)),
        ("cups_red/clip.mp4", 300, (640, 360)),
        ("occlusion_person/clip.mp4", 69, (640, 480)),
        ("face_turning/clip.mp4", 250, (400, 300)),
        ("fish_above/clip.mp4", 100, (960, 960)),
    ],
)
def test_the_real_clips_are_read(real_clips: Path, name: str, frames: int, size: tuple[int, int]) -> None:
    """The real clips have the frames and sizes that their notes tell, and seeks give the pixels of a plain pass."""
    sequence, reference = opened(real_clips / name), decoded(real_clips / name)
    assert (sequence.frame_count, sequence.size, sequence.index.warnings) == (frames, size, ())
    for number in np.random.default_rng(2).integers(0, frames, 12).tolist():
        np.testing.assert_array_equal(sequence.picture(number), reference[number])


@pytest.mark.parametrize(
    ("name", "frames", "told"), [("editlist.mp4", 50, ""), ("anim.avif", 10, "number 2 was taken")]
)
def test_files_of_other_programs(real_clips: Path, name: str, frames: int, told: str) -> None:
    """What an edit list cuts off is not missing; of several streams that with the most pictures is taken."""
    with closing(open_sequence(real_clips / "files_of_others" / name)) as sequence:
        warnings = sequence.index.warnings
        assert (sequence.frame_count, told in " ".join(warnings), bool(warnings)) == (frames, True, bool(told))
