"""Videos: what decodes is counted, and any frame is the same however it is reached."""

import concurrent.futures
import dataclasses
import io
import itertools
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import av
import numpy as np
import pytest
from numpy.typing import NDArray

from pftrack.sources.decoder import Decoder
from pftrack.sources.sequence import FrameIndex, Limits, SourceError, open_sequence
from pftrack.sources.video import VideoSequence

Film = Callable[..., Path]
Draw = Callable[..., NDArray[np.uint8]]
Read = Callable[[NDArray[np.uint8]], int]


def opened(path: Path, limits: Limits | None = None, index: FrameIndex | None = None) -> VideoSequence:
    sequence = open_sequence(path, limits or Limits(), index=index)
    assert isinstance(sequence, VideoSequence)
    return sequence


def decoded(path: Path) -> list[NDArray[np.uint8]]:
    """Decode from first to last in the plainest way."""
    with av.open(str(path)) as container:
        container.streams.video[0].codec_context.thread_count = 1
        return [np.asarray(frame.to_ndarray(format="rgb24"), np.uint8) for frame in container.decode(video=0)]


# ---------------------------------------------------------------- any order, the same pixels


def test_seeking_gives_the_pixels_of_decoding_in_order(clip: Path, read_number: Read) -> None:
    """Frames of a long-GOP H.264 clip with B-frames are the same to the bit in random order as from first to last."""
    reference = decoded(clip)
    sequence = opened(clip)
    assert sequence.index.keyframes == (0, 70)
    for number in np.random.default_rng(3).permutation(len(reference)).tolist():
        picture = sequence.picture(number)
        assert read_number(picture) == number
        np.testing.assert_array_equal(picture, reference[number])
    sequence.close()


def test_stepping_backwards_decodes_each_group_few_times(clip: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Going backwards enters a group anew only once in as many steps as pictures are kept on the way."""
    reference = decoded(clip)
    sequence = opened(clip, index=opened(clip).index)
    entries = []
    seek = type(sequence._decoder).seek
    monkeypatch.setattr(
        type(sequence._decoder), "seek", lambda self, stamp: (entries.append(stamp), seek(self, stamp))[1]
    )
    for number in reversed(range(120)):
        np.testing.assert_array_equal(sequence.picture(number), reference[number])
    assert len(entries) <= 6
    sequence.close()


def test_a_small_cache_changes_nothing_but_the_time(clip: Path) -> None:
    """A cache with room for one picture gives the same pictures, and holds no more than it may."""
    reference = decoded(clip)
    sequence = opened(clip, Limits(cache_bytes=30_000))
    for number in (119, 0, 71, 70, 69, 3, 119):
        np.testing.assert_array_equal(sequence.picture(number), reference[number])
        assert sequence._cache.used_bytes <= 30_000
    sequence.close()


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
    tmp_path: Path, make_film: Film, make_picture: Draw, read_number: Read, name: str, codec: str, between: int
) -> None:
    """MP4, MOV, MKV, WebM, AVI, OGG, MPEG and MPEG-TS are counted and sought alike, whatever their file is called."""
    pictures = [make_picture(number) for number in range(40)]
    options = {"libx265": {"x265-params": "log-level=none:pools=none"}, "libx264": {"x264-params": "open-gop=1"}}
    pixels = "yuvj420p" if codec == "mjpeg" else "yuv420p"
    container = {"format": "ogg"} if name.endswith("ogv") else {}
    path = make_film(
        tmp_path / name, pictures, codec, pixels, 12, between, codec_options=options.get(codec), **container
    )
    disguised = path.rename(tmp_path / "noname")
    reference = decoded(disguised)
    sequence = opened(disguised)
    assert sequence.frame_count == 40
    assert sequence.size == (96, 64)
    assert sequence.frame_rate_hz == 25.0
    np.testing.assert_allclose(sequence.times_s, np.arange(40) / 25, atol=2e-3)
    for number in np.random.default_rng(0).permutation(40).tolist():
        np.testing.assert_array_equal(sequence.picture(number), reference[number])
        assert read_number(sequence.picture(number)) == number
    sequence.close()


def test_a_keyframe_that_is_none_is_found_out(clip: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Pixels are believed by their checksum only: an entry that gives others is dropped for an earlier one."""

    def anywhere(self: Decoder, stamp: int) -> None:
        self._container.seek(stamp, stream=self.stream, any_frame=True)

    monkeypatch.setattr(Decoder, "seek", anywhere)
    reference = decoded(clip)
    index = dataclasses.replace(opened(clip).index, keyframes=(0, 33, 35, 40))
    sequence = opened(clip, index=index)
    for number in (50, 20, 45):
        np.testing.assert_array_equal(sequence.picture(number), reference[number])
    assert sequence._untrue >= {33, 35, 40}
    sequence.close()


def test_a_file_that_changes_while_open_is_found_out(clip: Path) -> None:
    """Pictures that no longer have the pixels of the survey are refused, never handed out."""
    index = opened(clip).index
    sequence = opened(clip, index=dataclasses.replace(index, checksums=(0,) * 120))
    with pytest.raises(SourceError, match="frame 5 no longer decodes as it did"):
        sequence.picture(5)
    sequence.close()


def test_many_threads_may_ask_at_once(clip: Path, read_number: Read) -> None:
    """One sequence serves several threads, each of which gets the frame it asked for."""
    sequence = opened(clip)
    numbers = np.random.default_rng(1).integers(0, 120, 60).tolist()
    with concurrent.futures.ThreadPoolExecutor(4) as pool:
        assert [read_number(picture) for picture in pool.map(sequence.picture, numbers)] == numbers
    sequence.close()


# ---------------------------------------------------------------- what a sequence tells


def test_a_picture_is_rgb_and_read_only(clip: Path) -> None:
    """A picture is (height, width, 3) uint8, and nobody can write to what others see."""
    picture = opened(clip).picture(0)
    assert (picture.shape, picture.dtype) == ((64, 96, 3), np.uint8)
    assert picture.flags.c_contiguous
    with pytest.raises(ValueError, match="read-only"):
        picture[0, 0, 0] = 1


@pytest.mark.parametrize("index", [-1, 120, 10**9])
def test_a_frame_outside_is_refused(clip: Path, index: int) -> None:
    """A frame that does not exist is refused with the range of those that do."""
    with pytest.raises(IndexError, match=f"between 0 and 119, got {index}"):
        opened(clip).picture(index)


def test_an_index_spares_the_survey(clip: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Opening with the index of an earlier survey decodes nothing, and tells the same."""
    first = opened(clip)
    index = FrameIndex.from_json(first.index.to_json())
    assert index == first.index
    monkeypatch.setattr(VideoSequence, "_survey", None)
    again = opened(clip, index=index)
    np.testing.assert_array_equal(again.picture(77), first.picture(77))
    assert again.sha256 == first.sha256


def test_an_index_of_other_content_is_not_used(clip: Path, tmp_path: Path, make_film: Film, make_picture: Draw) -> None:
    """An index belongs to content, not to a name: with another one the file is surveyed anew."""
    other = make_film(tmp_path / "other.mp4", [make_picture(number) for number in range(9)])
    assert opened(other, index=opened(clip).index).frame_count == 9


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"kind":"video"}', "null"])
def test_an_index_is_read_with_suspicion(text: str) -> None:
    """Text that is no index is refused as a ValueError."""
    with pytest.raises(ValueError, match=r"."):
        FrameIndex.from_json(text)


def test_an_index_must_be_of_one_piece(clip: Path) -> None:
    """An index whose columns differ in length is refused."""
    broken = dataclasses.replace(opened(clip).index, times_s=(0.0,))
    with pytest.raises(ValueError, match="120 frames"):
        FrameIndex.from_json(broken.to_json())


def test_no_file_stays_open(clip: Path, tmp_path: Path) -> None:
    """Opening, reading, refusing and closing fifty times leaves no descriptor behind."""
    broken = tmp_path / "broken.mp4"
    broken.write_bytes(clip.read_bytes()[:500])
    before = len(list(Path("/proc/self/fd").iterdir()))
    for _ in range(50):
        sequence = opened(clip)
        sequence.picture(90)
        sequence.close()
        with pytest.raises(SourceError):
            open_sequence(broken)
    assert len(list(Path("/proc/self/fd").iterdir())) == before


# ---------------------------------------------------------------- what videos are like


def test_a_varying_rate_is_counted_and_told(
    tmp_path: Path, make_film: Film, make_picture: Draw, read_number: Read
) -> None:
    """With a varying rate a frame's number is its place in the order; its time is told, and the rate is the mean."""
    gaps = [40, 40, 200, 40, 10, 40, 300, 40, 40]
    times = [0, *itertools.accumulate(gaps)]
    path = make_film(tmp_path / "clip.mkv", [make_picture(number) for number in range(10)], times_ms=times)
    sequence = opened(path)
    assert [read_number(sequence.picture(number)) for number in (9, 3, 0, 5)] == [9, 3, 0, 5]
    np.testing.assert_allclose(sequence.times_s * 1000, times, atol=1)
    assert sequence.frame_rate_hz == pytest.approx(9 / 0.75, rel=0.02)
    assert any("varies between 3.33 and 100 Hz" in warning for warning in sequence.index.warnings)


@pytest.mark.parametrize("turns", [0, 1, 2, 3])
@pytest.mark.parametrize("mirrored", [False, True])
def test_a_rotated_clip_stands_upright(
    tmp_path: Path, make_film: Film, make_picture: Draw, turns: int, mirrored: bool
) -> None:
    """Pictures are turned, and mirrored, as the file's display matrix asks, and the size is that of what is seen."""
    stored = [make_picture(number) for number in range(4)]
    path = make_film(
        tmp_path / "clip.mp4", stored, "libx264rgb", "rgb24", rotation=90 * turns, mirrored=mirrored,
        codec_options={"qp": "0"},
    )  # fmt: skip
    seen = np.rot90(stored[2], turns)
    seen = seen[:, ::-1] if mirrored else seen
    sequence = opened(path)
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
def test_deep_pictures_keep_their_scale(tmp_path: Path, make_film: Film, codec: str, pixels: str, source: str) -> None:
    """Pictures of 10 to 16 bits come out as 8-bit RGB with black, grey and white where they were."""
    slope = np.repeat(np.linspace(0, 65535, 256).round().astype(np.uint16)[np.newaxis], 64, axis=0)
    deep = slope if source.startswith("gray") else np.repeat(slope[:, :, np.newaxis], 3, axis=2)
    options = {"libx265": {"x265-params": "log-level=none:pools=none", "crf": "2"}, "libx264": {"crf": "2"}}
    path = tmp_path / ("clip.mov" if codec == "png" else "clip.mkv")
    make_film(path, [deep] * 2, codec, pixels, source=source, codec_options=options.get(codec))
    picture = opened(path).picture(1).astype(int)
    np.testing.assert_allclose(picture, np.broadcast_to((slope >> 8)[:, :, np.newaxis], (64, 256, 3)), atol=4)


@pytest.mark.parametrize(
    ("matrix", "told"),
    [("ITU709", "colormatrix=bt709"), ("ITU601", "colormatrix=smpte170m"), ("ITU601", "fullrange=off")],
)
def test_colours_are_those_of_the_matrix_told(tmp_path: Path, matrix: str, told: str) -> None:
    """Colours are converted by the matrix that the video tells, of HD or of older television, which is the default."""
    path = tmp_path / "a.mp4"
    colour = np.broadcast_to(np.array([200, 40, 90], np.uint8), (64, 96, 3))
    with av.open(str(path), "w") as output:
        stream = output.add_stream("libx264", rate=25, options={"crf": "1", "x264-params": told})
        stream.width, stream.height, stream.pix_fmt = 96, 64, "yuv420p"
        frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(colour), format="rgb24")
        output.mux(stream.encode(frame.reformat(format="yuv420p", dst_colorspace=matrix)))
        output.mux(stream.encode(None))
    np.testing.assert_allclose(opened(path).picture(0), colour, atol=3)


def test_pixels_that_are_not_square_are_told(tmp_path: Path, make_film: Film, make_picture: Draw) -> None:
    """Pictures are tracked as stored; that their pixels are not square is said."""
    path = make_film(tmp_path / "a.mkv", [make_picture(0)] * 3, codec_options={"x264-params": "sar=4/3"})
    assert any("not square (4:3)" in warning for warning in opened(path).index.warnings)


def test_a_single_frame_is_a_sequence(tmp_path: Path, make_film: Film, make_picture: Draw) -> None:
    """A video of one frame has one frame at time zero."""
    sequence = opened(make_film(tmp_path / "a.mkv", [make_picture(7)]))
    assert (sequence.frame_count, sequence.times_s.tolist()) == (1, [0.0])


# ---------------------------------------------------------------- cut short and damaged


def test_a_file_cut_short_gives_the_frames_that_decode(
    tmp_path: Path, make_film: Film, make_picture: Draw, read_number: Read
) -> None:
    """Of an MP4 whose end is missing, the frames that decode are there in any order, and the rest is told."""
    pictures = [make_picture(number) for number in range(60)]
    whole = make_film(tmp_path / "a.mp4", pictures, group=20, container_options={"movflags": "faststart"}).read_bytes()
    path = tmp_path / "short.mp4"
    path.write_bytes(whole[: len(whole) * 2 // 3])
    sequence = opened(path)
    assert 10 < sequence.frame_count < 60
    assert sequence.index.warnings == (
        f"the file announces 60 frames and {sequence.frame_count} decode; it is cut short or damaged",
    )
    for number in np.random.default_rng(0).permutation(sequence.frame_count).tolist():
        assert read_number(sequence.picture(number)) == number


def test_a_file_that_announces_a_length_and_is_cut_short_says_so(
    tmp_path: Path, make_film: Film, make_picture: Draw
) -> None:
    """An MKV announces no frames but a length; that its pictures end early is told."""
    whole = make_film(tmp_path / "a.mkv", [make_picture(number) for number in range(60)], group=20).read_bytes()
    path = tmp_path / "short.mkv"
    path.write_bytes(whole[: len(whole) // 2])
    (warning,) = opened(path).index.warnings
    assert re.fullmatch(r"the file announces 2\.4 s and its pictures end after [01]\.\d+ s", warning)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize(
    ("name", "codec"), [("a.mkv", "libx264"), ("a.mpg", "mpeg2video"), ("a.avi", "mjpeg"), ("a.avi", "mpeg4")]
)
def test_damage_is_the_same_in_any_order(
    tmp_path: Path, make_film: Film, make_picture: Draw, name: str, codec: str, seed: int
) -> None:
    """What decodes of a damaged file is the same from one open to the next and in any order, guesses included."""
    pictures = [make_picture(number) for number in range(50)]
    pixels, between = ("yuvj420p", 0) if codec == "mjpeg" else ("yuv420p", 2)
    path = make_film(tmp_path / name, pictures, codec, pixels, 20, between)
    content = bytearray(path.read_bytes())
    random = np.random.default_rng(seed)
    for position in random.integers(len(content) // 3, len(content) * 9 // 10, 12).tolist():
        content[position] ^= 0x5A
    path.write_bytes(content)
    first, second = opened(path), opened(path, Limits(cache_bytes=100_000))
    assert first.index == second.index
    assert first.frame_count > 5
    for number in random.permutation(first.frame_count).tolist():
        np.testing.assert_array_equal(second.picture(number), first.picture(number))


def test_a_file_without_its_table_is_refused(clip: Path, tmp_path: Path) -> None:
    """An MP4 that ends before its table of contents is refused as broken or cut short."""
    path = tmp_path / "half.mp4"
    path.write_bytes(clip.read_bytes()[: clip.stat().st_size // 2])
    with pytest.raises(SourceError, match="MP4 or MOV file is broken or cut short"):
        open_sequence(path)


# ---------------------------------------------------------------- refusals


def disguises(tmp_path: Path, clip: Path) -> list[tuple[bytes, str]]:
    absolute = clip.absolute()
    return [
        (b"", "the file is empty"),
        (f"ffconcat version 1.0\nfile {clip.name}\n".encode(), "a list of other files"),
        (f"#EXTM3U\n#EXT-X-TARGETDURATION:4\n#EXTINF:4,\n{absolute}\n#EXT-X-ENDLIST\n".encode(), "a playlist"),
        (b"<!DOCTYPE html><html><body>Not found</body></html>", "a web page"),
        (f"file '{absolute}'\n".encode(), "a text"),
        (b"PK\x03\x04" + bytes(100), "an archive"),
        (bytes(range(200, 256)) * 20, "of an unknown format"),
    ]


@pytest.mark.parametrize("case", range(7))
def test_lists_and_other_things_in_disguise_are_refused(tmp_path: Path, clip: Path, case: int) -> None:
    """A file called .mp4 that is something else is refused by what it is, and nothing that it names is opened."""
    content, what = disguises(tmp_path, clip)[case]
    path = tmp_path / "disguised.mp4"
    path.write_bytes(content)
    with pytest.raises(SourceError, match=what) as refusal:
        open_sequence(path)
    assert str(tmp_path) not in str(refusal.value)


def test_a_list_behind_a_video_signature_opens_nothing(tmp_path: Path, clip: Path) -> None:
    """Even with the signature of a video before it, a list of files is never followed."""
    path = tmp_path / "list.mp4"
    path.write_bytes(b"\x00\x00\x00\x10ftypisom\nffconcat version 1.0\nfile " + clip.name.encode() + b"\n")
    with pytest.raises(SourceError, match="broken or cut short"):
        open_sequence(path)


def test_a_name_is_never_an_address(tmp_path: Path, clip: Path) -> None:
    """A file whose path looks like an address is the local file."""
    folder = tmp_path / "http:" / "127.0.0.1:1"
    folder.mkdir(parents=True)
    path = folder / "concat:clip.mp4|other.mp4"
    path.write_bytes(clip.read_bytes())
    sequence = opened(path)
    assert sequence.picture(100).shape == (64, 96, 3)
    assert sequence.name == "concat:clip.mp4|other.mp4"


def test_a_relative_path_that_looks_like_an_address_is_a_file(
    tmp_path: Path, clip: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A relative path such as `http:/host/clip.mp4` is looked for in the folder, not in the network."""
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SourceError, match="no such file or folder"):
        open_sequence(Path("http://127.0.0.1:1/clip.mp4"))


def test_sound_alone_is_refused(sound: Path) -> None:
    """A file with sound and no pictures is refused by saying so."""
    with pytest.raises(SourceError, match="holds sound, but no pictures; expected"):
        open_sequence(sound)


def test_a_cover_is_not_a_video(tmp_path: Path) -> None:
    """The cover picture of a song does not make it a video."""
    cover = io.BytesIO()
    with av.open(cover, "w", format="image2pipe") as output:
        stream = output.add_stream("mjpeg", rate=1, width=32, height=32, pix_fmt="yuvj420p")
        output.mux(stream.encode(av.VideoFrame.from_ndarray(np.zeros((32, 32, 3), np.uint8), format="rgb24")))
        output.mux(stream.encode(None))
    path = tmp_path / "song.mp4"
    with av.open(str(path), "w") as output:
        sound = output.add_stream("aac", rate=8000)
        picture = output.add_stream("mjpeg", rate=1, width=32, height=32, pix_fmt="yuvj420p")
        picture.disposition = av.stream.Disposition.attached_pic
        frame = av.AudioFrame.from_ndarray(np.zeros((1, 8000), np.float32), format="fltp", layout="mono")
        frame.sample_rate = 8000
        packet = av.Packet(cover.getvalue())
        packet.stream, packet.pts, packet.dts = picture, 0, 0
        output.mux(sound.encode(frame))
        output.mux(sound.encode(None))
        output.mux(packet)
    with pytest.raises(SourceError, match="sound, but no pictures"):
        open_sequence(path)


def test_a_codec_that_is_not_known_well_is_refused(tmp_path: Path, make_film: Film, make_picture: Draw) -> None:
    """Only decoders of well-known codecs are let near the bytes; others are refused with the list of those."""
    path = make_film(tmp_path / "a.avi", [make_picture(0)] * 3, "wmv2", between=0)
    with pytest.raises(SourceError, match=r"coded in a way that is not read here; expected one of H\.264"):
        open_sequence(path)


@pytest.mark.parametrize(
    ("limits", "sentence"),
    [
        (Limits(pixels=6000), "the pictures of the video have 96 x 64 = 6,144 pixels; at most 6,000 are allowed"),
        (Limits(frames=119), "the video has 120 frames; at most 119 are allowed"),
        (Limits(file_bytes=1024), r"the file has 0\.\d+ MiB; at most 0\.0009766 MiB are allowed"),
    ],
)
def test_what_is_too_large_is_refused_with_the_limit(clip: Path, limits: Limits, sentence: str) -> None:
    """Pictures, frames and files beyond the limits are refused with what they have and what is allowed."""
    with pytest.raises(SourceError, match=sentence):
        open_sequence(clip, limits)


def test_frames_that_are_not_announced_are_counted(tmp_path: Path, make_film: Film, make_picture: Draw) -> None:
    """A container that tells no number of frames is decoded up to the limit and no further."""
    path = make_film(tmp_path / "a.mkv", [make_picture(number) for number in range(30)])
    with pytest.raises(SourceError, match="more frames than the 20 that are allowed"):
        open_sequence(path, Limits(frames=20))


@pytest.mark.parametrize(
    ("width", "height", "sentence"),
    [(10_000, 6_000, "have 10000 x 6000 = 60,000,000 pixels; at most"), (60_000, 60_000, "have no size that can be")],
)
def test_a_giant_declared_size_is_refused_unseen(
    tmp_path: Path, make_film: Film, make_picture: Draw, width: int, height: int, sentence: str
) -> None:
    """A header that announces a giant picture is refused before memory is asked for."""
    path = make_film(tmp_path / "a.avi", [make_picture(0)] * 3, "ffv1", between=0)
    content = path.read_bytes()
    small, giant = (w.to_bytes(4, "little") + h.to_bytes(4, "little") for w, h in ((96, 64), (width, height)))
    assert small in content
    path.write_bytes(content.replace(small, giant))
    with pytest.raises(SourceError, match=sentence):
        open_sequence(path)


def test_pictures_of_different_sizes_are_refused(tmp_path: Path, make_film: Film, make_picture: Draw) -> None:
    """A video whose pictures change their size is refused with the frame and both sizes."""
    one = make_film(tmp_path / "one.ts", [make_picture(0)] * 5).read_bytes()
    two = make_film(tmp_path / "two.ts", [make_picture(0, 128, 96)] * 5).read_bytes()
    path = tmp_path / "both.ts"
    path.write_bytes(one + two)
    with pytest.raises(SourceError, match="is 128 x 96 px and frame 0 is 96 x 64 px; all must be of one size"):
        open_sequence(path)


@pytest.mark.parametrize("name", ["missing.mp4", "/dev/null", "/dev/zero"])
def test_what_is_no_file_is_refused(tmp_path: Path, name: str) -> None:
    """A path that leads nowhere, or to a device, is refused before anything is read."""
    with pytest.raises(SourceError, match="there is no such file or folder"):
        open_sequence(tmp_path / name)


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
    sequence = opened(real_clips / name)
    assert (sequence.frame_count, sequence.size, sequence.index.warnings) == (frames, size, ())
    reference: dict[int, Any] = dict(enumerate(decoded(real_clips / name)))
    for number in np.random.default_rng(2).integers(0, frames, 25).tolist():
        np.testing.assert_array_equal(sequence.picture(number), reference[number])
    sequence.close()
