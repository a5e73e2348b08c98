"""Videos: what decodes is counted, and any frame is the same however it is reached."""

import dataclasses
import io
import itertools
import re
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


def test_seeking_gives_the_pixels_of_decoding_in_order(clip: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Frames of a long-GOP H.264 clip with B-frames are the same to the bit in random order as from first to last.

    A cache with room for one picture changes nothing but the time, and holds no more than it may. Several threads may
    ask at once. Backwards a group is entered anew only once in as many steps as pictures are kept on the way. Pictures
    are read-only RGB.
    """
    reference = decoded(clip)
    shuffled = np.random.default_rng(3).permutation(120).tolist()
    for limits, order in ((Limits(), shuffled), (Limits(cache_bytes=30_000), [119, 0, 71, 70, 69, 3, 119])):
        sequence = opened(clip, limits)
        assert (sequence.index.keyframes, len(reference)) == ((0, 70), 120)
        for number in order:
            picture = sequence.picture(number)
            assert number_in(picture) == number
            np.testing.assert_array_equal(picture, reference[number])
            assert sequence._cache.used_bytes <= limits.cache_bytes
    assert (picture.shape, picture.dtype, picture.flags.c_contiguous) == ((64, 96, 3), np.uint8, True)
    with pytest.raises(ValueError, match="read-only"):
        picture[0, 0, 0] = 1
    for index in (-1, 120, 10**9):
        with pytest.raises(IndexError, match=f"between 0 and 119, got {index}"):
            sequence.picture(index)
    sequence = opened(clip, index=sequence.index)
    asked = np.random.default_rng(1).integers(0, 120, 40).tolist()
    with ThreadPoolExecutor(4) as pool:
        assert [number_in(picture) for picture in pool.map(sequence.picture, asked)] == asked
    sequence, entries, seek = opened(clip, index=sequence.index), [], Decoder.seek
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
def test_every_container_has_the_same_frames_in_any_order(tmp_path: Path, name: str, codec: str, between: int) -> None:
    """MP4, MOV, MKV, WebM, AVI, OGG, MPEG and MPEG-TS are counted and sought alike, whatever their file is called."""
    pixels = "yuvj420p" if codec == "mjpeg" else "yuv420p"
    container = {"format": "ogg"} if name.endswith("ogv") else {}
    options = {"x264-params": "open-gop=1"} if codec == "libx264" else {}
    path = film(tmp_path / name, numbers(24), codec, pixels, 8, between, codec_options=options, **container)
    disguised = path.rename(tmp_path / "noname")
    reference, sequence = decoded(disguised), opened(disguised)
    assert (sequence.frame_count, sequence.size, sequence.frame_rate_hz) == (24, (96, 64), 25.0)
    np.testing.assert_allclose(sequence.times_s, np.arange(24) / 25, atol=2e-3)
    for number in np.random.default_rng(0).permutation(24).tolist():
        np.testing.assert_array_equal(sequence.picture(number), reference[number])
        assert number_in(sequence.picture(number)) == number


def test_a_keyframe_that_is_none_is_found_out(clip: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Pixels are believed by their checksum only: an entry that gives others is dropped for an earlier one.

    If none gives those of the survey, as when the file changes while it is open, the picture is refused.
    """

    def anywhere(self: Decoder, stamp: int) -> None:
        self._container.seek(stamp, stream=self.stream, any_frame=True)

    monkeypatch.setattr(Decoder, "seek", anywhere)
    reference = decoded(clip)
    sequence = opened(clip, index=dataclasses.replace(opened(clip).index, keyframes=(0, 33, 35, 40)))
    for number in (50, 20, 45):
        np.testing.assert_array_equal(sequence.picture(number), reference[number])
    assert sequence._untrue >= {33, 35, 40}
    sequence = opened(clip, index=dataclasses.replace(sequence.index, checksums=(0,) * 120))
    with pytest.raises(RefusedError, match="frame 5 no longer decodes as it did"):
        sequence.picture(5)


# ---------------------------------------------------------------- what a sequence tells


def test_an_index_spares_the_survey(clip: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Opening with the index of an earlier survey decodes nothing, and gives the same; other content is surveyed.

    Text that is not an index is refused as a ValueError, and so is one whose columns differ in length.
    """
    first = opened(clip)
    index = FrameIndex.from_json(first.index.to_json())
    assert index == first.index
    assert opened(film(tmp_path / "other.mp4", numbers(9)), index=index).frame_count == 9
    monkeypatch.setattr(VideoSequence, "_survey", None)
    again = opened(clip, index=index)
    np.testing.assert_array_equal(again.picture(77), first.picture(77))
    assert again.sha256 == first.sha256
    broken = dataclasses.replace(index, times_s=(0.0,)).to_json()
    for text, words in (("", "."), ("[]", "."), ('{"kind":"video"}', "."), (broken, "120 frames")):
        with pytest.raises(ValueError, match=words):
            FrameIndex.from_json(text)


# ---------------------------------------------------------------- what videos are like


def test_warnings_name_what_is_unusual(tmp_path: Path) -> None:
    """With a varying rate a frame's number is its place in the order, and the rate is the mean.

    Times that leave out whole frames give their number; HLG and PQ are shown as they are stored.
    """
    times = [0, *itertools.accumulate([40, 40, 200, 40, 10, 40, 300, 40, 40])]
    sequence = opened(film(tmp_path / "clip.mkv", numbers(10), times_ms=times))
    assert [number_in(sequence.picture(number)) for number in (9, 3, 0, 5)] == [9, 3, 0, 5]
    np.testing.assert_allclose(sequence.times_s * 1000, times, atol=1)
    assert sequence.frame_rate_hz == pytest.approx(9 / 0.75, rel=0.02)
    assert any("varies between 3.33 and 100 Hz" in warning for warning in sequence.index.warnings)
    path = film(tmp_path / "gap.mkv", numbers(8), times_ms=[40 * number for number in (0, 1, 2, 5, 6, 8, 9, 10)])
    assert opened(path).index.warnings[0].startswith("3 frames are missing by the times, first after frame 2")
    hdr = film(tmp_path / "wide.mp4", [numbered(0)], codec_options={"x264-params": "transfer=smpte2084"})
    assert "HDR" in " ".join(opened(hdr).index.warnings)


def test_large_pictures_can_be_allowed(tmp_path: Path) -> None:
    """4K is refused with what to do, and read with the limits of a machine of one's own."""
    path = film(tmp_path / "4k.mp4", [np.zeros((2160, 3840, 3), np.uint8)], codec_options={"preset": "ultrafast"})
    refused(path, r"scale=1920:-2 .* allow it with --large, in Python large=True")
    assert opened(path, LARGE_LIMITS).size == (3840, 2160)


@pytest.mark.parametrize("turns", [0, 1, 2, 3])
@pytest.mark.parametrize("mirrored", [False, True])
def test_a_rotated_clip_stands_upright(tmp_path: Path, turns: int, mirrored: bool) -> None:
    """Pictures are turned, and mirrored, as the file's display matrix asks, and the size is that of what is seen.

    Pixels are made square before a picture is turned, since their shape is that of the stored picture.
    """
    sequence = opened(lossless(tmp_path / "clip.mp4", numbers(3), rotation=90 * turns, mirrored=mirrored))
    seen = np.rot90(numbered(2), turns)[:, :: -1 if mirrored else 1]
    assert sequence.size == (seen.shape[1], seen.shape[0])
    np.testing.assert_array_equal(sequence.picture(2), seen)
    oblong = opened(lossless(tmp_path / "oblong.mp4", numbers(1), "2/1", rotation=90 * turns, mirrored=mirrored))
    assert oblong.size == oblong.picture(0).shape[1::-1] == ((192, 64) if turns % 2 == 0 else (64, 192))


@pytest.mark.parametrize(
    ("codec", "pixels", "source"),
    [
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
        ("1000/1001", (96, 64), ""),
    ],
)
def test_pixels_are_made_square(tmp_path: Path, ratio: str, size: tuple[int, int], told: str) -> None:
    """A picture is as wide and as high as it is meant to be seen, in any order, and what was done is said."""
    stored = np.full((6, 64, 96, 3), 90, np.uint8)
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


def test_files_of_other_programs(real_clips: Path) -> None:
    """What an edit list cuts off is not missing; of several streams that with the most pictures is taken."""
    for name, frames, told in (("editlist.mp4", 50, ""), ("anim.avif", 10, "number 2 was taken")):
        with closing(open_sequence(real_clips / "files_of_others" / name)) as sequence:
            warnings = sequence.index.warnings
            assert (sequence.frame_count, told in " ".join(warnings), bool(warnings)) == (frames, True, bool(told))


# Videos that are cut short, damaged, in disguise or too large: read as far as they go, or refused.

# ---------------------------------------------------------------- cut short and damaged


def test_a_file_cut_short_gives_the_frames_that_decode(tmp_path: Path) -> None:
    """A file without its end has the frames that decode, in any order.

    A warning names how many are missing of an MP4, and the length of an MKV, which does not announce their number.
    """
    path = film(tmp_path / "a.mp4", numbers(60), group=20, container_options={"movflags": "faststart"})
    path.write_bytes(path.read_bytes()[: path.stat().st_size * 2 // 3])
    sequence = opened(path)
    assert 10 < sequence.frame_count < 60
    # Frames near the cut may be missing in the middle, by how the encoder has spread them; then the rate varies, too.
    told = f"the file announces 60 frames and {sequence.frame_count} decode; it is cut short or damaged"
    assert told in sequence.index.warnings
    for number in np.random.default_rng(0).permutation(sequence.frame_count).tolist():
        assert number_in(sequence.picture(number)) == number
    path = film(tmp_path / "a.mkv", numbers(60), group=20)
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    told = "; ".join(opened(path).index.warnings)
    assert re.search(r"the file announces 2\.4 s and its pictures end after [01]\.\d+ s", told)


@pytest.mark.parametrize(
    ("name", "codec"), [("a.mkv", "libx264"), ("a.mpg", "mpeg2video"), ("a.avi", "mjpeg"), ("a.avi", "mpeg4")]
)
def test_damage_is_the_same_in_any_order(tmp_path: Path, name: str, codec: str) -> None:
    """A damaged file decodes to the same pictures at each opening and in any order, guesses included."""
    pixels, between = ("yuvj420p", 0) if codec == "mjpeg" else ("yuv420p", 2)
    path = film(tmp_path / name, numbers(50), codec, pixels, 20, between)
    content, random = bytearray(path.read_bytes()), np.random.default_rng(0)
    for _ in range(2):
        for position in random.integers(len(content) // 3, len(content) * 9 // 10, 8).tolist():
            content[position] ^= 0x5A
        path.write_bytes(content)
        first, second = opened(path), opened(path, Limits(cache_bytes=100_000))
        assert first.index == second.index
        assert first.frame_count > 5
        for number in random.permutation(first.frame_count).tolist():
            np.testing.assert_array_equal(second.picture(number), first.picture(number))


# ---------------------------------------------------------------- refusals


def test_things_in_disguise_are_refused(tmp_path: Path, clip: Path) -> None:
    """A file called .mp4 that is something else is refused by what it is, and nothing that it names is opened.

    Even with the signature of a video before it a list of files is never followed, and half an MP4 is one cut short.
    """
    path, absolute, listed = tmp_path / "disguised.mp4", clip.absolute(), f"ffconcat version 1.0\nfile {clip.name}\n"
    for content, what in (
        (listed.encode(), "a list of other files"),
        (f"#EXTM3U\n#EXT-X-TARGETDURATION:4\n#EXTINF:4,\n{absolute}\n#EXT-X-ENDLIST\n".encode(), "a playlist"),
        (f"file '{absolute}'\n".encode(), "a text"),
        (b"\x00\x00\x00\x10ftypisom\n" + listed.encode(), "broken or cut short"),
        (clip.read_bytes()[: clip.stat().st_size // 2], "MP4 or MOV file is broken or cut short"),
    ):
        path.write_bytes(content)
        assert str(tmp_path) not in refused(path, what)


def test_a_name_is_never_an_address(tmp_path: Path, clip: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A file whose path looks like an address is the local file; one that does not exist, or a device, is refused."""
    path = tmp_path / "http:" / "127.0.0.1:1" / "concat:clip.mp4|other.mp4"
    path.parent.mkdir(parents=True)
    path.write_bytes(clip.read_bytes())
    sequence = opened(path)
    assert (sequence.picture(100).shape, sequence.name) == ((64, 96, 3), "concat:clip.mp4|other.mp4")
    monkeypatch.chdir(tmp_path)
    for name in ("http://127.0.0.1:1/clip.mp4", "missing.mp4", "/dev/zero"):
        refused(Path(name), "the file or folder does not exist")


def test_sound_is_not_a_video(tmp_path: Path) -> None:
    """A song with a cover picture is refused because it holds no video."""
    blank = av.VideoFrame.from_ndarray(np.zeros((32, 32, 3), np.uint8), format="rgb24")
    with av.open(io.BytesIO(), "w", format="image2pipe") as output:
        stream = output.add_stream("mjpeg", rate=1, width=32, height=32, pix_fmt="yuvj420p")
        cover = [*stream.encode(blank), *stream.encode(None)][0]
    with av.open(str(tmp_path / "song.mp4"), "w") as output:
        sound = output.add_stream("aac", rate=8000)
        frame = av.AudioFrame.from_ndarray(np.zeros((1, 8000), np.float32), format="fltp", layout="mono")
        frame.sample_rate = 8000
        picture = output.add_stream("mjpeg", rate=1, width=32, height=32, pix_fmt="yuvj420p")
        picture.disposition = av.stream.Disposition.attached_pic
        output.mux([*sound.encode(frame), *sound.encode(None)])
        cover.stream, cover.pts, cover.dts = picture, 0, 0
        output.mux(cover)
    refused(tmp_path / "song.mp4", "holds sound, but no pictures; expected")


def test_a_codec_that_is_not_known_well_is_refused(tmp_path: Path) -> None:
    """Only decoders of well-known codecs are let near the bytes; others are refused with the list of those."""
    path = film(tmp_path / "a.avi", numbers(3), "wmv2", between=0)
    refused(path, r"unsupported codec; expected one of H\.264")


def test_what_is_too_large_is_refused_with_the_limit(tmp_path: Path, clip: Path) -> None:
    """Pictures, frames and files beyond the limits are refused with what they have and what is allowed.

    A file that tells no number of frames is decoded up to the limit and no further.
    """
    pixels = "the pictures of the video have 96 x 64 = 6,144 pixels; at most 6,000 are allowed"
    refused(clip, pixels, Limits(pixels=6000))
    refused(clip, "the video has 120 frames; at most 119 are allowed", Limits(frames=119))
    refused(clip, r"the file has 0\.\d+ MiB; at most 0\.0009766 MiB are allowed", Limits(file_bytes=1024))
    path = film(tmp_path / "a.mkv", numbers(30))
    refused(path, "more frames than the 20 that are allowed", Limits(frames=20))


def test_a_giant_declared_size_is_refused_unseen(tmp_path: Path) -> None:
    """A header that announces a giant picture is refused before memory is asked for."""
    path = film(tmp_path / "a.avi", numbers(3), "ffv1", between=0)
    content, small = path.read_bytes(), (96).to_bytes(4, "little") + (64).to_bytes(4, "little")
    assert small in content
    for side, sentence in ((8_000, "have 8000 x 8000 = 64,000,000 pixels; at most"), (60_000, "have no size that can")):
        path.write_bytes(content.replace(small, 2 * side.to_bytes(4, "little")))
        refused(path, sentence)


def test_sizes_whose_times_overlap_are_refused(tmp_path: Path) -> None:
    """Two videos in one file are refused if the times of their frames are the same, with the longest part.

    A second MP4 after the first, which no program shows, is reported.
    """
    path = film(tmp_path / "one.ts", numbers(5))
    two = film(tmp_path / "two.ts", [numbered(0, 128, 96)] * 8)
    path.write_bytes(path.read_bytes() + two.read_bytes())
    refused(path, r"are 128 x 96 px; the longest part begins with frame [45]: cut it out")
    path = film(tmp_path / "one.mp4", numbers(5))
    assert opened(path).index.warnings == ()
    path.write_bytes(2 * path.read_bytes())
    assert "a second MP4 follows" in opened(path).index.warnings[-1]


def test_of_several_sizes_the_longest_part_is_taken(tmp_path: Path) -> None:
    """Its frames are reached in any order, and a sentence tells which frame of the file is the first."""
    parts = (range(0, 200, 40), [numbered(number, 128, 96) for number in range(5)]), (range(200, 560, 40), numbers(9))
    files = [film(tmp_path / f"{len(times)}.ts", shown, between=0, group=4, times_ms=times) for times, shown in parts]
    (tmp_path / "both.ts").write_bytes(b"".join(file.read_bytes() for file in files))
    sequence = opened(tmp_path / "both.ts")
    assert (sequence.frame_count, sequence.size) == (9, (96, 64))
    assert [number_in(sequence.picture(number)) for number in (8, 0, 5, 1)] == [8, 0, 5, 1]
    # The last frame before the change is lost where a decoder learns of the change by the next one.
    told = re.search(r"frames 0 to ([34]) are 128 x 96 px.* frame 0 is frame ([45]) of", sequence.index.warnings[0])
    assert int(told[2]) == int(told[1]) + 1
    assert number_in(opened(tmp_path / "both.ts", index=sequence.index).picture(7)) == 7
