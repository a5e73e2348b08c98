"""What a file is, its first bytes tell."""

import re

import pytest

from pftrack.core.refusal import RefusedError
from pftrack.sources.formats import sniff


def test_formats_are_known_by_their_first_bytes() -> None:
    """Each has its signature, or several; the files of other tests, which have no suffix, show the common ones.

    Tables with places alone are tracks, those with sides or both edges are boxes, by any name that programs use.
    """
    for head, kind in (
        (b"\x00\x00\x00\x08wide\x00\x00", "video"),
        ((bytes(4) + b"G" + bytes(187)) * 3, "video"),
        (b"MM\x00*", "picture"),
        (b"frame,point,x_px,y_px,var_x,var_y\n1,2,3,4,5,6\n", "tracks"),
        (b"u;v\n1;2\n", "tracks"),
        (b"frame,nose_x,nose_y\n1,2,3\n", "tracks"),
        (b"frame,x,y,w,h\n1,2,3,4,5\n", "beliefs"),
        (b"frame,x,y,right,bottom\n1,2,3,4,5\n", "beliefs"),
    ):
        assert sniff(head).kind == kind, head


RAW = {
    b"\0\0\0\1\x40\1\x0c\1": "H.265 (HEVC) in a raw stream",
    b"\0\0\0\1\x67\x64\0\x0a": "H.264 in a raw stream",
    b"\0\0\1\xb3\x14": "MPEG in a raw stream",
    b"YUV4MPEG2 W320 H180 F25:1": "raw pictures (Y4M)",
    b"FLV\1\1\0": "Flash video (FLV)",
    b"\x30\x26\xb2\x75\x8e\x66": "Windows Media (WMV, ASF)",
}
"""Raw streams and other containers, whose refusal has the command that makes an MP4 of them."""


@pytest.mark.parametrize(
    ("head", "what"),
    [
        *((head, f"the file is {what}, which is not supported; put it into MP4") for head, what in RAW.items()),
        (b"", "is empty"),
        (b"ffconcat version 1.0\nfile other.mp4", "list of other files"),
        (b"#EXTM3U\n#EXTINF:1,\n/etc/passwd", "playlist of other files"),
        (b"<?xml version='1.0'?><MPD>", "manifest of other files"),
        (b"<!DOCTYPE html><title>404</title>", "web page"),
        (b"PK\x03\x04", "archive"),
        (b"ID3\x04", "sound"),
        (b"x,y,w,h\n1,2,3,4\n", "table of boxes"),
        (b"\x00\x01\x02\x03\x04\x05\x06\x07\x08", "unknown format"),
        (b"G" * 100, "text"),
    ],
)
def test_everything_else_is_refused_by_what_it_is(head: bytes, what: str) -> None:
    """What cannot be read is refused with a sentence that says what it is and what can."""
    with pytest.raises(RefusedError, match=re.escape(what)) as refusal:
        sniff(head)
    assert head in RAW or "expected an MP4" in str(refusal.value)
