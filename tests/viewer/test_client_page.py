"""viser's client page, prepared to live inside a session's page."""

import gzip
import re
from pathlib import Path
from typing import Any

import viser

from pftrack_server.viewer import CONTENT_SECURITY_POLICY, client_asset, client_page
from pftrack_server.viewer.client_page import ASSETS, CLIENT, take_apart

PAGE_KEYS = Path(__file__).parents[2] / "frontend_static" / "session" / "keys.js"


def test_the_page_of_a_session_is_light_and_ours_first() -> None:
    """Theme and address have to be settled before the client reads them.

    What is the same for all sessions is not in it, so that a browser loads and compiles it once.
    """
    page = client_page().decode()
    assert page.index("pftrack-viser") < page.index("await import(")
    assert "<title>pftrack scene</title>" in page
    assert len(page) < 50_000
    # A page that cannot be taken apart is not.
    assert take_apart("<html><head></head><body>another viser</body></html>") is None


def test_letters_of_the_page_leave_the_scene() -> None:
    """Each letter that the page's help lists is handed on from the scene's frame, with shift or without."""
    listed = set(re.findall(r'keys: "([A-Z])"', PAGE_KEYS.read_text(encoding="utf-8")))
    handed = re.search(r'\.\.\."([^"]+)"', (CLIENT / "keys.js").read_text(encoding="utf-8"))
    assert len(listed) > 8
    assert listed | {letter.lower() for letter in listed} <= set(handed[1])


def test_the_client_is_the_one_of_the_server() -> None:
    """Both come from the same installation, so their versions agree; only the files of the client have names."""
    assert viser.__version__.startswith("1.1.")
    assert client_asset("index.html") is None
    names = re.findall(ASSETS + r"([0-9a-f]{32}\.\w+)", client_page().decode())
    files: list[Any] = [client_asset(name) for name in dict.fromkeys(names)]
    kinds = [file.media_type.partition(";")[0] for file in files]
    assert kinds == ["text/css", "text/javascript", "application/wasm"]
    assert max(len(file.content) for file in files) > 2_000_000
    assert all(gzip.decompress(file.packed) == file.content for file in files)


def test_the_policy_allows_no_evaluation_and_no_other_host() -> None:
    """A page that is led astray by `?websocket=` cannot connect."""
    assert "'unsafe-eval'" not in CONTENT_SECURITY_POLICY.replace("'wasm-unsafe-eval'", "")
    assert "connect-src 'self' data: blob:;" in CONTENT_SECURITY_POLICY
    assert "http" not in CONTENT_SECURITY_POLICY
