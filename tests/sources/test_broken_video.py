"""Videos that are cut short, damaged, in disguise or too large: read as far as they go, or refused in a sentence."""

import io
import re
from pathlib import Path

import av
import numpy as np
import pytest

from pftrack.core.refusal import RefusedError
from pftrack.sources.limits import Limits
from pftrack.sources.sequence import open_sequence
from tests.sources.films import Draw, Film, Read, opened

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
    # Frames near the cut may be missing in the middle, by how the encoder has spread them; then the rate varies, too.
    assert (
        f"the file announces 60 frames and {sequence.frame_count} decode; it is cut short or damaged"
        in sequence.index.warnings
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
    told = "; ".join(opened(path).index.warnings)
    assert re.search(r"the file announces 2\.4 s and its pictures end after [01]\.\d+ s", told)


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
    with pytest.raises(RefusedError, match="MP4 or MOV file is broken or cut short"):
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
    with pytest.raises(RefusedError, match=what) as refusal:
        open_sequence(path)
    assert str(tmp_path) not in str(refusal.value)


def test_a_list_behind_a_video_signature_opens_nothing(tmp_path: Path, clip: Path) -> None:
    """Even with the signature of a video before it, a list of files is never followed."""
    path = tmp_path / "list.mp4"
    path.write_bytes(b"\x00\x00\x00\x10ftypisom\nffconcat version 1.0\nfile " + clip.name.encode() + b"\n")
    with pytest.raises(RefusedError, match="broken or cut short"):
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
    with pytest.raises(RefusedError, match="the file or folder does not exist"):
        open_sequence(Path("http://127.0.0.1:1/clip.mp4"))


def test_sound_alone_is_refused(sound: Path) -> None:
    """A file with sound and no pictures is refused by saying so."""
    with pytest.raises(RefusedError, match="holds sound, but no pictures; expected"):
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
    with pytest.raises(RefusedError, match="sound, but no pictures"):
        open_sequence(path)


def test_a_codec_that_is_not_known_well_is_refused(tmp_path: Path, make_film: Film, make_picture: Draw) -> None:
    """Only decoders of well-known codecs are let near the bytes; others are refused with the list of those."""
    path = make_film(tmp_path / "a.avi", [make_picture(0)] * 3, "wmv2", between=0)
    with pytest.raises(RefusedError, match=r"unsupported codec; expected one of H\.264"):
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
    with pytest.raises(RefusedError, match=sentence):
        open_sequence(clip, limits)


def test_frames_that_are_not_announced_are_counted(tmp_path: Path, make_film: Film, make_picture: Draw) -> None:
    """A container that tells no number of frames is decoded up to the limit and no further."""
    path = make_film(tmp_path / "a.mkv", [make_picture(number) for number in range(30)])
    with pytest.raises(RefusedError, match="more frames than the 20 that are allowed"):
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
    with pytest.raises(RefusedError, match=sentence):
        open_sequence(path)


def test_sizes_whose_times_overlap_are_refused(tmp_path: Path, make_film: Film, make_picture: Draw) -> None:
    """Two videos in one file are refused if the times of their frames are the same, with the longest part."""
    one = make_film(tmp_path / "one.ts", [make_picture(0)] * 5).read_bytes()
    two = make_film(tmp_path / "two.ts", [make_picture(0, 128, 96)] * 8).read_bytes()
    path = tmp_path / "both.ts"
    path.write_bytes(one + two)
    with pytest.raises(RefusedError, match=r"are 128 x 96 px; the longest part begins with frame [45]: cut it out"):
        open_sequence(path)


def test_of_several_sizes_the_longest_part_is_taken(
    tmp_path: Path, make_film: Film, make_picture: Draw, read_number: Read
) -> None:
    """Its frames are reached in any order, and a sentence tells which frame of the file is the first."""
    films = [([make_picture(n, 128, 96) for n in range(5)]), ([make_picture(n) for n in range(9)])]
    with av.open(str(tmp_path / "both.ts"), "w") as output:
        stream, before = None, 0
        for place, pictures in enumerate(films):
            with av.open(str(make_film(tmp_path / f"{place}.ts", pictures, between=0, group=4))) as part:
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
    assert [read_number(sequence.picture(number)) for number in (8, 0, 5, 1)] == [8, 0, 5, 1]
    assert "frames 0 to 4 are 128 x 96 px" in sequence.index.warnings[0]
    assert "frame 0 is frame 5 of the file" in sequence.index.warnings[0]
    again = opened(tmp_path / "both.ts", index=sequence.index)
    assert read_number(again.picture(7)) == 7


def test_a_second_video_at_the_end_of_an_mp4_is_told(tmp_path: Path, make_film: Film, make_picture: Draw) -> None:
    """No program shows it, so it must not seem to be read."""
    one = make_film(tmp_path / "one.mp4", [make_picture(0)] * 5)
    assert opened(one).index.warnings == ()
    one.write_bytes(2 * one.read_bytes())
    assert "a second MP4 follows" in opened(one).index.warnings[-1]


@pytest.mark.parametrize("name", ["missing.mp4", "/dev/null", "/dev/zero"])
def test_what_is_no_file_is_refused(tmp_path: Path, name: str) -> None:
    """A path that leads nowhere, or to a device, is refused before anything is read."""
    with pytest.raises(RefusedError, match="the file or folder does not exist"):
        open_sequence(tmp_path / name)
