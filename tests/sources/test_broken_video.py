"""Videos that are cut short, damaged, in disguise or too large: read as far as they go, or refused in a sentence."""

import io
import re
from pathlib import Path

import av
import numpy as np
import pytest

from pftrack.sources.limits import Limits
from tests.sources.films import film, number_in, numbered, numbers, opened, refused

# ---------------------------------------------------------------- cut short and damaged


def test_a_file_cut_short_gives_the_frames_that_decode(tmp_path: Path) -> None:
    """Of an MP4 whose end is missing, the frames that decode are there in any order, and the rest is told."""
    path = film(tmp_path / "a.mp4", numbers(60), group=20, container_options={"movflags": "faststart"})
    path.write_bytes(path.read_bytes()[: path.stat().st_size * 2 // 3])
    sequence = opened(path)
    assert 10 < sequence.frame_count < 60
    # Frames near the cut may be missing in the middle, by how the encoder has spread them; then the rate varies, too.
    told = f"the file announces 60 frames and {sequence.frame_count} decode; it is cut short or damaged"
    assert told in sequence.index.warnings
    for number in np.random.default_rng(0).permutation(sequence.frame_count).tolist():
        assert number_in(sequence.picture(number)) == number


def test_a_file_that_announces_a_length_and_is_cut_short_says_so(tmp_path: Path) -> None:
    """An MKV announces no frames but a length; that its pictures end early is told."""
    path = film(tmp_path / "a.mkv", numbers(60), group=20)
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    told = "; ".join(opened(path).index.warnings)
    assert re.search(r"the file announces 2\.4 s and its pictures end after [01]\.\d+ s", told)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize(
    ("name", "codec"), [("a.mkv", "libx264"), ("a.mpg", "mpeg2video"), ("a.avi", "mjpeg"), ("a.avi", "mpeg4")]
)
def test_damage_is_the_same_in_any_order(tmp_path: Path, name: str, codec: str, seed: int) -> None:
    """What decodes of a damaged file is the same from one open to the next and in any order, guesses included."""
    pixels, between = ("yuvj420p", 0) if codec == "mjpeg" else ("yuv420p", 2)
    path = film(tmp_path / name, numbers(50), codec, pixels, 20, between)
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


# ---------------------------------------------------------------- refusals


def test_things_in_disguise_are_refused(tmp_path: Path, clip: Path) -> None:
    """A file called .mp4 that is something else is refused by what it is, and nothing that it names is opened.

    Even with the signature of a video before it a list of files is never followed, and half an MP4 is one cut short.
    """
    path, absolute, listed = tmp_path / "disguised.mp4", clip.absolute(), f"ffconcat version 1.0\nfile {clip.name}\n"
    for content, what in (
        (b"", "the file is empty"),
        (listed.encode(), "a list of other files"),
        (f"#EXTM3U\n#EXT-X-TARGETDURATION:4\n#EXTINF:4,\n{absolute}\n#EXT-X-ENDLIST\n".encode(), "a playlist"),
        (b"<!DOCTYPE html><html><body>Not found</body></html>", "a web page"),
        (f"file '{absolute}'\n".encode(), "a text"),
        (b"PK\x03\x04" + bytes(100), "an archive"),
        (bytes(range(200, 256)) * 20, "of an unknown format"),
        (b"\x00\x00\x00\x10ftypisom\n" + listed.encode(), "broken or cut short"),
        (clip.read_bytes()[: clip.stat().st_size // 2], "MP4 or MOV file is broken or cut short"),
    ):
        path.write_bytes(content)
        assert str(tmp_path) not in refused(path, what)


def test_a_name_is_never_an_address(tmp_path: Path, clip: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A file whose path looks like an address is the local file, and is looked for in no network."""
    path = tmp_path / "http:" / "127.0.0.1:1" / "concat:clip.mp4|other.mp4"
    path.parent.mkdir(parents=True)
    path.write_bytes(clip.read_bytes())
    sequence = opened(path)
    assert (sequence.picture(100).shape, sequence.name) == ((64, 96, 3), "concat:clip.mp4|other.mp4")
    monkeypatch.chdir(tmp_path)
    refused(Path("http://127.0.0.1:1/clip.mp4"), "the file or folder does not exist")


def write_sound(path: Path, cover: bytes = b"") -> Path:
    """Write a second of silence, with or without the cover picture of a song."""
    with av.open(str(path), "w") as output:
        sound = output.add_stream("aac", rate=8000)
        frame = av.AudioFrame.from_ndarray(np.zeros((1, 8000), np.float32), format="fltp", layout="mono")
        frame.sample_rate = 8000
        packet = av.Packet(cover)
        if cover:
            picture = output.add_stream("mjpeg", rate=1, width=32, height=32, pix_fmt="yuvj420p")
            picture.disposition = av.stream.Disposition.attached_pic
            packet.stream, packet.pts, packet.dts = picture, 0, 0
        output.mux(sound.encode(frame))
        output.mux(sound.encode(None))
        if cover:
            output.mux(packet)
    return path


def test_sound_is_not_a_video(tmp_path: Path) -> None:
    """A file with sound and no pictures is refused by saying so, and a cover picture makes no video of it."""
    refused(write_sound(tmp_path / "sound.mp4"), "holds sound, but no pictures; expected")
    cover = io.BytesIO()
    with av.open(cover, "w", format="image2pipe") as output:
        stream = output.add_stream("mjpeg", rate=1, width=32, height=32, pix_fmt="yuvj420p")
        output.mux(stream.encode(av.VideoFrame.from_ndarray(np.zeros((32, 32, 3), np.uint8), format="rgb24")))
        output.mux(stream.encode(None))
    refused(write_sound(tmp_path / "song.mp4", cover.getvalue()), "sound, but no pictures")


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


@pytest.mark.parametrize(
    ("width", "height", "sentence"),
    [(10_000, 6_000, "have 10000 x 6000 = 60,000,000 pixels; at most"), (60_000, 60_000, "have no size that can be")],
)
def test_a_giant_declared_size_is_refused_unseen(tmp_path: Path, width: int, height: int, sentence: str) -> None:
    """A header that announces a giant picture is refused before memory is asked for."""
    path = film(tmp_path / "a.avi", numbers(3), "ffv1", between=0)
    content = path.read_bytes()
    small, giant = (w.to_bytes(4, "little") + h.to_bytes(4, "little") for w, h in ((96, 64), (width, height)))
    assert small in content
    path.write_bytes(content.replace(small, giant))
    refused(path, sentence)


def test_sizes_whose_times_overlap_are_refused(tmp_path: Path) -> None:
    """Two videos in one file are refused if the times of their frames are the same, with the longest part."""
    path = film(tmp_path / "one.ts", numbers(5))
    two = film(tmp_path / "two.ts", [numbered(0, 128, 96)] * 8)
    path.write_bytes(path.read_bytes() + two.read_bytes())
    refused(path, r"are 128 x 96 px; the longest part begins with frame [45]: cut it out")


def test_of_several_sizes_the_longest_part_is_taken(tmp_path: Path) -> None:
    """Its frames are reached in any order, and a sentence tells which frame of the file is the first."""
    with av.open(str(tmp_path / "both.ts"), "w") as output:
        stream, before = None, 0
        for pictures in ([numbered(n, 128, 96) for n in range(5)], numbers(9)):
            with av.open(str(film(tmp_path / f"{len(pictures)}.ts", pictures, between=0, group=4))) as part:
                stream = stream or output.add_stream_from_template(part.streams.video[0])
                packets = [packet for packet in part.demux(part.streams.video[0]) if packet.dts is not None]
                first = packets[0].dts
                for packet in packets:
                    packet.pts, packet.dts = packet.pts - first + before, packet.dts - first + before
                    packet.stream = stream
                    output.mux(packet)
                before += 3600 * len(pictures)
    sequence = opened(tmp_path / "both.ts")
    assert (sequence.frame_count, sequence.size) == (9, (96, 64))
    assert [number_in(sequence.picture(number)) for number in (8, 0, 5, 1)] == [8, 0, 5, 1]
    assert "frames 0 to 4 are 128 x 96 px" in sequence.index.warnings[0]
    assert "frame 0 is frame 5 of the file" in sequence.index.warnings[0]
    assert number_in(opened(tmp_path / "both.ts", index=sequence.index).picture(7)) == 7


def test_a_second_video_at_the_end_of_an_mp4_is_told(tmp_path: Path) -> None:
    """No program shows it, so it must not seem to be read."""
    one = film(tmp_path / "one.mp4", numbers(5))
    assert opened(one).index.warnings == ()
    one.write_bytes(2 * one.read_bytes())
    assert "a second MP4 follows" in opened(one).index.warnings[-1]


@pytest.mark.parametrize("name", ["missing.mp4", "/dev/null", "/dev/zero"])
def test_what_is_no_file_is_refused(tmp_path: Path, name: str) -> None:
    """A path that leads nowhere, or to a device, is refused before anything is read."""
    refused(tmp_path / name, "the file or folder does not exist")
