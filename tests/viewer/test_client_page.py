"""viser's client page, prepared to live inside a session's page."""

import gzip
import re
from pathlib import Path
from typing import Any

import viser

from pftrack_server.viewer import CONTENT_SECURITY_POLICY, client_asset, client_page
from pftrack_server.viewer.client_page import ASSETS, CLIENT, take_apart

PAGE_KEYS = Path(__file__).parents[2] / "frontend_static" / "session" / "keys.js"


def test_the_page_of_a_session_is_small() -> None:
    """Its own scripts run before the client; the parts for all sessions are in other files, which a browser caches."""
    page = client_page().decode()
    assert page.index("pftrack-viser") < page.index("await import(")
    assert "<title>pftrack scene</title>" in page
    assert len(page) < 50_000
    assert take_apart("<html><head></head><body>another viser</body></html>") is None


def test_letters_of_the_page_leave_the_scene() -> None:
    """The frame of the scene passes on each letter in the page's help, with or without shift."""
    listed = set(re.findall(r'keys: "([A-Z])"', PAGE_KEYS.read_text(encoding="utf-8")))
    handed = re.search(r'\.\.\."([^"]+)"', (CLIENT / "keys.js").read_text(encoding="utf-8"))
    assert len(listed) > 8
    assert listed | {letter.lower() for letter in listed} <= set(handed[1])


def test_the_client_is_the_one_of_the_server() -> None:
    """Both come from the same installation, so their versions agree; only the client's files are served."""
    assert viser.__version__.startswith("1.1.")
    assert client_asset("index.html") is None
    names = re.findall(ASSETS + r"([0-9a-f]{32}\.\w+)", client_page().decode())
    files: list[Any] = [client_asset(name) for name in dict.fromkeys(names)]
    kinds = [file.media_type.partition(";")[0] for file in files]
    assert kinds == ["text/css", "text/javascript", "application/wasm"]
    assert max(len(file.content) for file in files) > 2_000_000
    assert all(gzip.decompress(file.packed) == file.content for file in files)


def test_the_policy_allows_no_evaluation_and_no_other_host() -> None:
    """A page with another address in `?websocket=` cannot connect."""
    assert "'unsafe-eval'" not in CONTENT_SECURITY_POLICY.replace("'wasm-unsafe-eval'", "")
    assert "connect-src 'self' data: blob:;" in CONTENT_SECURITY_POLICY
    assert "http" not in CONTENT_SECURITY_POLICY
