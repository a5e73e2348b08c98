"""viser's client page, adapted to run inside a session's page.

viser ships its client as one self-contained file that connects to its own address. This module puts the scripts and the
style sheet of `client/` into its head, before the client's own script runs: keys that steer the run, and pointer
positions, are passed to the outer page, the scene reconnects without a click, light or dark follows the system, and
everything that a lecture does not need is hidden. The client's own script and style sheet are served as separate files,
since each session has an address of its own and a browser would otherwise load and compile them again for each. Their
content is not changed, so a new viser brings its own; a page packed in another way is served in one piece.

viser packs style sheet and script into an attribute of the page, which unpacks itself each time that it is opened. As
separate files they never change, at addresses made from their content.
"""

import gzip
import hashlib
import re
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import viser
import zstandard

_DIRECTIVES = (
    "default-src 'none'",
    # The client unpacks data by WebAssembly; it never evaluates text.
    "script-src 'self' 'unsafe-inline' 'wasm-unsafe-eval' blob:",
    "worker-src blob:",
    "style-src 'self' 'unsafe-inline'",
    "img-src 'self' data: blob:",
    "font-src data:",
    # Keeps `?websocket=...` from leading the page, with its keys and pictures, to another host.
    "connect-src 'self' data: blob:",
    "base-uri 'none'",
    "form-action 'none'",
    "frame-ancestors 'self'",
)
CONTENT_SECURITY_POLICY = "; ".join(_DIRECTIVES)

ASSETS = "../client/"
"""Folder of the client's files, relative to the page, since a follower's page has another base path."""

SCRIPTS = ("page.js", "frames.js", "colours.js", "state.js", "keys.js", "pointing.js", "numbers.js", "folds.js")
"""Scripts that run before viser's own script, in this order, each in a scope of its own."""

CLIENT = Path(__file__).parent / "client"
"""Folder of the scripts and the style sheet inserted into the page."""


DIGITS = b"!#$%()*+,-./0123456789:;=?@ABCDEFGHIJKLMNOPQRSTUVWXYZ[\\]^_abcdefghijklmnopqrstuvwxyz{|}~"
VALUES = bytes(DIGITS.index(code) if code in DIGITS else 0 for code in range(128))
PACKED = re.compile(r'<script data-p="([^"]+)" data-ss="(\d+)" data-cs="(\d+)">(.*?)</script>', re.DOTALL)
DECODER = re.compile(r'const gzWasm="((?:[^"\\]|\\.)*)"')


@dataclass(frozen=True, slots=True)
class Asset:
    """A file that never changes.

    Attributes:
        name: Name made from its content.
        media_type: Media type of its content.
        content: The content.
        packed: The content, compressed by gzip.
    """

    name: str
    media_type: str
    content: bytes
    packed: bytes


@dataclass(frozen=True, slots=True)
class Parts:
    """The client in parts.

    Attributes:
        head: The page up to the packed script.
        rest: The page after it.
        style: Its style sheet.
        script: Its script, a module.
        decoder: WebAssembly for the script, named `__viserZstdWasm`.
    """

    head: str
    rest: str
    style: Asset
    script: Asset
    decoder: Asset


def take_apart(page: str) -> Parts | None:
    """Return the parts of viser's page, or None if it is packed in an unknown way."""
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
    """Undo viser's packing of bytes: five base-88 digits are four bytes."""
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


@cache
def client_page() -> bytes:
    """Return the page for `/viz/{session}/`; send it with `CONTENT_SECURITY_POLICY`."""
    page = _split_page() or original_page()
    page = page.replace("<title>Viser</title>", "<title>pftrack scene</title>", 1)
    head = page.index("<head>") + len("<head>")
    body = page.index("</head>")
    style = (CLIENT / "style.css").read_text(encoding="utf-8")
    return f"{page[:head]}{_scripts()}{page[head:body]}<style>{style}</style>{page[body:]}".encode()


def _scripts() -> str:
    texts = ((CLIENT / name).read_text(encoding="utf-8") for name in SCRIPTS)
    return "".join(f'<script>(() => {{\n"use strict";\n{text}}})();</script>' for text in texts)


def client_asset(name: str) -> Asset | None:
    """Return the client's file of a name, or None; browsers may cache it for ever."""
    parts = client_parts()
    files = (parts.style, parts.script, parts.decoder) if parts else ()
    return next((file for file in files if file.name == name), None)


def _split_page() -> str | None:
    """Return viser's page with its script and its style sheet as separate files, or None."""
    parts = client_parts()
    if parts is None:
        return None
    script = ASSETS + parts.script.name
    return (
        f'{parts.head}<link rel="stylesheet" href="{ASSETS}{parts.style.name}">'
        f'<link rel="modulepreload" href="{script}"><script type="module">'
        f'globalThis.__viserZstdWasm = await WebAssembly.compileStreaming(fetch("{ASSETS}{parts.decoder.name}"));'
        f'await import("{script}");</script>{parts.rest}'
    )


@cache
def client_parts() -> Parts | None:
    """Return viser's client in parts, or None if it is packed in an unknown way."""
    return take_apart(original_page())


def original_page() -> str:
    """Return viser's client as its one file."""
    return (Path(viser.__file__).parent / "client" / "build" / "index.html").read_text(encoding="utf-8")
