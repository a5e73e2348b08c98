"""Formats: file types, recognised by the first bytes.

Decoders never guess. A file named `.mp4` may be a list of other files (`ffconcat`, `m3u8`), and a decoder that guesses
would open the named files on this machine, or addresses in its network. So this module inspects the content, and the
decoder gets that container format and no other.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from pftrack.core.refusal import RefusedError
from pftrack.sources.cells import BOX_NAMES, COLUMN_NAMES, decode, find_columns, places_of, read_table
from pftrack.sources.limits import HEAD_BYTES
from pftrack.sources.results.table import WAYS, form_of

ALLOWED = (
    "an MP4, MOV, MKV, WebM, AVI, OGG, MPEG or MPEG-TS video, an animated GIF, "
    "PNG or WebP, a folder of PNG, JPEG, BMP, TIFF or WebP pictures, a table of tracks with the columns "
    "frame, point, x_px, y_px, var_x, var_y, a recording of beliefs, or "
    "results of a tracker (MOTChallenge, OTB or VOT text, CVAT's video XML, COCO's video JSON, or a table of boxes)"
)
BY_PILLOW = {"PNG", "WEBP"}
"""Decoders of animations that Pillow reads; FFmpeg reads all other films."""
TRACKS_COLUMNS = ("frame", "point", "x_px", "y_px", "var_x", "var_y")
"""Columns of a table of tracks; see `pftrack.sources.tracks` for other forms."""

RECORDING_ENTRY = "recording.json"
"""Name of the first entry of a recording of beliefs."""


@dataclass(frozen=True, slots=True)
class Format:
    """A format that can be read.

    Attributes:
        kind: Its decoder.
        title: Name for users.
        decoder: The name that selects FFmpeg's demuxer or Pillow's plug-in; "results" for beliefs from
            another tracker's file.
    """

    kind: Literal["video", "gif", "picture", "tracks", "beliefs"]
    title: str
    decoder: str


def sniff(head: bytes) -> Format:
    """Return a file's format by its first bytes.

    Args:
        head: The first `HEAD_BYTES` of the file, fewer only if it is shorter.

    Raises:
        RefusedError: It is empty, or its format is not supported.
    """
    if not head:
        raise RefusedError(f"the file is empty; expected {ALLOWED}")
    for found, matches in _READABLE:
        if matches(head):
            return found
    if contained := next((what for what, matches in _CONTAINED if matches(head)), None):
        raise RefusedError(
            f"the file is {contained}, which is not supported; put it into MP4 with `ffmpeg -i FILE -c copy clip.mp4`, "
            "or without `-c copy` if MP4 does not take it"
        )
    what = next((what for what, matches in _KNOWN if matches(head)), "of an unknown format")
    raise RefusedError(f"the file is {what}, which is not supported; expected {ALLOWED}")


def is_beliefs(path: Path) -> bool:
    """Return whether a file is a recording of beliefs or holds results of a tracker, by its first bytes."""
    try:
        with path.open("rb") as file:
            return sniff(file.read(HEAD_BYTES)).kind == "beliefs"
    except (OSError, RefusedError):
        return False


def _tracks(head: bytes) -> bool:
    """Look for the header of a table with x and y, or with a frame and separate columns for points."""
    names = _columns(head)
    if {"x", "y"} <= find_columns(names, COLUMN_NAMES.tracks).keys():
        return not _boxes(head)
    return "frame" in names and (
        "point" in names or any(f"{name[:-2]}_y" in names for name in names if name.endswith("_x"))
    )


def _boxes(head: bytes) -> bool:
    """Look for the header of a table of boxes, whose x and y are corners."""
    found = find_columns(_columns(head), BOX_NAMES).keys()
    return any(set(way) <= found for way in WAYS)


def _columns(head: bytes) -> dict[str, int]:
    return places_of(read_table(decode(head)).header)


def _starts(*signatures: bytes) -> Callable[[bytes], bool]:
    return lambda head: head.startswith(signatures)


def _riff(form: bytes) -> Callable[[bytes], bool]:
    return lambda head: head[:4] == b"RIFF" and head[8:12] == form


def _animated_png(head: bytes) -> bool:
    return head.startswith(b"\x89PNG\r\n\x1a\n") and b"acTL" in head.partition(b"IDAT")[0]


def _animated_webp(head: bytes) -> bool:
    return _riff(b"WEBP")(head) and head[12:16] == b"VP8X" and bool(head[20:21] and head[20] & 2)


def _mp4(head: bytes) -> bool:
    return head[4:8] in {b"ftyp", b"moov", b"mdat", b"free", b"skip", b"wide", b"pnot"}


def _transport_stream(head: bytes) -> bool:
    """Look for three packets in a row: of 188 bytes, or of 192 where four bytes of time go before each."""
    return any(
        all(head[start + number * length : start + number * length + 1] == b"G" for number in range(3))
        for start, length in ((0, 188), (4, 192))
    )


def _raw(*units: bytes) -> Callable[[bytes], bool]:
    """Look for the first unit of a raw stream, after its start code."""
    return _starts(*(start + unit for start in (b"\0\0\1", b"\0\0\0\1") for unit in units))


def _text(*words: bytes) -> Callable[[bytes], bool]:
    return lambda head: head.removeprefix(b"\xef\xbb\xbf").lstrip().lower().startswith(words)


def _recording(head: bytes) -> bool:
    """Look for the first entry of an archive, whose name begins 30 bytes after it."""
    return head.startswith(b"PK\x03\x04") and head[30:].startswith(RECORDING_ENTRY.encode())


def _any_text(head: bytes) -> bool:
    printable = bytes(range(32, 127)) + b"\t\r\n"
    return not head.translate(None, printable)


_READABLE: tuple[tuple[Format, Callable[[bytes], bool]], ...] = (
    (Format("video", "MP4 or MOV", "mov"), _mp4),
    (Format("video", "MKV or WebM", "matroska"), _starts(b"\x1a\x45\xdf\xa3")),
    (Format("video", "AVI", "avi"), _riff(b"AVI ")),
    (Format("video", "OGG", "ogg"), _starts(b"OggS")),
    (Format("video", "MPEG", "mpeg"), _starts(b"\x00\x00\x01\xba")),
    (Format("gif", "GIF", "gif"), _starts(b"GIF87a", b"GIF89a")),
    (Format("gif", "animated PNG", "PNG"), _animated_png),
    (Format("gif", "animated WebP", "WEBP"), _animated_webp),
    (Format("picture", "PNG", "PNG"), _starts(b"\x89PNG\r\n\x1a\n")),
    (Format("picture", "JPEG", "JPEG"), _starts(b"\xff\xd8\xff")),
    (Format("picture", "BMP", "BMP"), _starts(b"BM")),
    (Format("picture", "TIFF", "TIFF"), _starts(b"II*\x00", b"MM\x00*")),
    (Format("picture", "WebP", "WEBP"), _riff(b"WEBP")),
    (Format("video", "MPEG-TS", "mpegts"), _transport_stream),
    (Format("tracks", "table of tracks", ""), _tracks),
    (Format("beliefs", "recording of beliefs", ""), _recording),
    (Format("beliefs", "results of a tracker", "results"), lambda head: form_of(head) is not None),
)

_CONTAINED: tuple[tuple[str, Callable[[bytes], bool]], ...] = (
    ("H.265 (HEVC) in a raw stream", _raw(b"\x40\1", b"\x42\1", b"\x46\1", b"\x4e\1")),
    ("H.264 in a raw stream", _raw(b"\x06", b"\x09", b"\x27", b"\x47", b"\x67")),
    ("MPEG in a raw stream", _raw(b"\xb0", b"\xb3", b"\xb5")),
    ("AV1 in a raw stream", _starts(b"\x12\0\x0a")),
    ("an IVF file", _starts(b"DKIF")),
    ("raw pictures (Y4M)", _starts(b"YUV4MPEG2")),
    ("Flash video (FLV)", _starts(b"FLV\1")),
    ("Windows Media (WMV, ASF)", _starts(b"\x30\x26\xb2\x75")),
    ("MXF", _starts(b"\x06\x0e\x2b\x34")),
)
"""Videos that FFmpeg puts into a container that is read here."""

_KNOWN: tuple[tuple[str, Callable[[bytes], bool]], ...] = (
    ("a list of other files (ffconcat)", _text(b"ffconcat")),
    ("a playlist of other files (m3u8)", _text(b"#extm3u")),
    ("a manifest of other files (DASH)", lambda head: b"<MPD" in head),
    ("a web page", _text(b"<!doctype html", b"<html")),
    ("an SVG drawing", lambda head: b"<svg" in head),
    ("a PDF document", _starts(b"%PDF")),
    ("an archive", _starts(b"PK\x03\x04", b"\x1f\x8b", b"7z\xbc\xaf", b"Rar!", b"BZh", b"\xfd7zXZ", b"(\xb5/\xfd")),
    ("a sound", _starts(b"ID3", b"fLaC", b"\xff\xfb", b"\xff\xf3", b"\xff\xf2", b"\xff\xf1", b"\xff\xf9")),
    ("a sound", _riff(b"WAVE")),
    ("a table of boxes that does not say their frame", _boxes),
    ("a text", _any_text),
)
