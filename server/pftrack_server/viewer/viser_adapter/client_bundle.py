"""viser's client, taken out of its one file, so that a browser can keep it and its compiled code.

viser packs style sheet and script into an attribute of the page, which unpacks itself each time that it is opened.
Taken apart they are files that never change, at addresses that name their content.
"""

import gzip
import hashlib
import re
from dataclasses import dataclass

import zstandard

DIGITS = b"!#$%()*+,-./0123456789:;=?@ABCDEFGHIJKLMNOPQRSTUVWXYZ[\\]^_abcdefghijklmnopqrstuvwxyz{|}~"
VALUES = bytes(DIGITS.index(code) if code in DIGITS else 0 for code in range(128))
PACKED = re.compile(r'<script data-p="([^"]+)" data-ss="(\d+)" data-cs="(\d+)">(.*?)</script>', re.DOTALL)
DECODER = re.compile(r'const gzWasm="((?:[^"\\]|\\.)*)"')


@dataclass(frozen=True, slots=True)
class Asset:
    """A file that never changes.

    Attributes:
        name: Made from its content.
        media_type: Of its content.
        content: As it is.
        packed: The same, by gzip.
    """

    name: str
    media_type: str
    content: bytes
    packed: bytes


@dataclass(frozen=True, slots=True)
class Parts:
    """The client in parts.

    Attributes:
        head: The page up to where the packed script stood.
        rest: The page from there on.
        style: Its style sheet.
        script: Its script, a module.
        decoder: WebAssembly that the script finds as `__viserZstdWasm`.
    """

    head: str
    rest: str
    style: Asset
    script: Asset
    decoder: Asset


def take_apart(page: str) -> Parts | None:
    """Return the parts of viser's page, or None if it is packed in another way than is known here."""
    found = PACKED.search(page)
    decoder = DECODER.search(found[4]) if found else None
    if found is None or decoder is None:
        return None
    sizes = int(found[2]), int(found[3])
    plain = zstandard.ZstdDecompressor().decompress(_unpack(found[1]), max_output_size=sum(sizes))
    return Parts(
        head=page[: found.start()],
        rest=page[found.end() :],
        style=_asset("css", "text/css; charset=utf-8", plain[: sizes[0]]),
        script=_asset("js", "text/javascript; charset=utf-8", plain[sizes[0] :]),
        decoder=_asset("wasm", "application/wasm", gzip.decompress(_unpack(decoder[1].replace("\\\\", "\\")))),
    )


def _asset(ending: str, media_type: str, content: bytes) -> Asset:
    digest = hashlib.sha256(content).hexdigest()[:32]
    return Asset(f"{digest}.{ending}", media_type, content, gzip.compress(content, 6, mtime=0))


def _unpack(text: str) -> bytes:
    """Undo viser's packing of bytes: five digits to the base 88 are four bytes."""
    digits = text.encode("ascii").translate(VALUES + bytes(128))
    whole = len(digits) // 5 * 5
    made = bytearray()
    for at in range(0, whole, 5):
        a, b, c, d, e = digits[at : at + 5]
        made += ((((a * 88 + b) * 88 + c) * 88 + d) * 88 + e & 0xFFFFFFFF).to_bytes(4, "big")
    rest = digits[whole:]
    if rest:
        value = 0
        for digit in rest:
            value = value * 88 + digit
        made += value.to_bytes(5, "big")[-(len(rest) - 1) :] if len(rest) > 1 else b""
    return bytes(made)
