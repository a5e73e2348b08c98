"""viser's client page, prepared to live inside a session's page.

viser ships its client as one self-contained file that connects to its own address. This module puts a style sheet and a
script into its head, before the client's own script runs: keys that steer the run are handed to the page around, the
scene reconnects without being clicked, light or dark follows the system, and everything is hidden that a lecture does
not need. The file itself is left as it is, so that a new viser brings its own.
"""

from functools import cache
from pathlib import Path

import viser

__all__ = ["CONTENT_SECURITY_POLICY", "client_page"]

_DIRECTIVES = (
    "default-src 'none'",
    # The client is one file of inline scripts and unpacks itself by WebAssembly; it never evaluates text.
    "script-src 'unsafe-inline' 'wasm-unsafe-eval' blob:",
    "worker-src blob:",
    "style-src 'unsafe-inline'",
    "img-src 'self' data: blob:",
    "font-src data:",
    # Keeps `?websocket=...` from leading the page, with its keys and pictures, to another host.
    "connect-src 'self' data: blob:",
    "base-uri 'none'",
    "form-action 'none'",
    "frame-ancestors 'self'",
)
CONTENT_SECURITY_POLICY = "; ".join(_DIRECTIVES)

_HERE = Path(__file__).parent


@cache
def client_page() -> bytes:
    """Return the page for `/viz/{session}/`, to be sent with `CONTENT_SECURITY_POLICY`."""
    page = (Path(viser.__file__).parent / "client" / "build" / "index.html").read_text(encoding="utf-8")
    script = (_HERE / "client.js").read_text(encoding="utf-8")
    style = (_HERE / "client.css").read_text(encoding="utf-8")
    page = page.replace("<title>Viser</title>", "<title>pftrack scene</title>", 1)
    head = page.index("<head>") + len("<head>")
    body = page.index("</head>")
    return f"{page[:head]}<script>{script}</script>{page[head:body]}<style>{style}</style>{page[body:]}".encode()
