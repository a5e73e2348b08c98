"""Help: the documentation below the server's base path, and its Markdown until the site is built."""

import re
from collections.abc import Callable
from pathlib import Path

import httpx
import pytest

from pftrack_server.app import create_app
from pftrack_server.core.settings import Settings
from pftrack_server.web import documentation, pages
from tests.apart import run

BASE = "/@/space%20word"
LINK = re.compile(r'(?:href|src)="(help/[^"]*)"')


Get = Callable[..., httpx.Response]


def client(help_folder: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Get:
    """Return a function that asks a server whose documentation is in a folder."""
    monkeypatch.setattr(pages, "HELP", help_folder)
    app = create_app(Settings(data_dir=tmp_path / "data", base_path=BASE))

    async def ask(path: str, **headers: str) -> httpx.Response:
        async with httpx.AsyncClient(transport=httpx.ASGITransport(app), base_url="http://127.0.0.1") as asking:
            return await asking.get(path, headers=headers)

    return lambda path, **headers: run(ask(path, **headers))


def test_the_documentation_is_below_the_base_path(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """The start redirects to a folder, for relative links; browsers revalidate files, which keep the policy.

    A live example has inline scripts and therefore an origin of its own. No address leads out of the folder.
    """
    site = tmp_path / "site"
    for name in ("index.html", "how-to/server.html", "media/ball.html", "_static/site.css", "../secret"):
        (site / name).parent.mkdir(parents=True, exist_ok=True)
        (site / name).write_text(name, "utf-8")
    get = client(site, monkeypatch, tmp_path)
    assert get(f"{BASE}/help").headers["location"] == f"{BASE}/help/"
    for path, text in (("", "index.html"), ("how-to/server.html", "how-to/server.html")):
        answer = get(f"{BASE}/help/{path}")
        assert (answer.status_code, answer.text) == (200, text)
        assert answer.headers["cache-control"] == "no-cache"
        assert "script-src 'self'" in answer.headers["content-security-policy"]
    style = get(f"{BASE}/help/_static/site.css")
    assert style.headers["content-type"].startswith("text/css")
    assert get(f"{BASE}/help/_static/site.css", **{"if-none-match": style.headers["etag"]}).status_code == 304
    assert get("/help/").status_code == 404
    assert get(f"{BASE}/help/media/ball.html").headers["content-security-policy"] == pages.EXAMPLES_POLICY
    assert "allow-same-origin" not in pages.EXAMPLES_POLICY
    for path in ("nowhere.html", "%2e%2e/secret", "media/%2e%2e/%2e%2e/secret", "media/"):
        assert get(f"{BASE}/help/{path}").status_code == 404


def test_without_its_site_the_markdown_is_shown(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Until the site is built a checkout shows every page and picture below `help/`, and no link is broken.

    A package that was installed without documentation says how to build it.
    """
    folder = tmp_path / "later"
    get = client(folder, monkeypatch, tmp_path)
    first = get(f"{BASE}/help/")
    assert first.status_code == 200
    assert 'href="help/how-to/index.html"' in first.text
    assert "make docs" in first.text
    answers, waiting = {"help/index.html": first}, ["help/index.html"]
    while waiting:
        for link in LINK.findall(answers[waiting.pop()].text.partition("<main")[2]):
            path, _, anchor = link.partition("#")
            if path not in answers:
                answers[path] = get(f"{BASE}/{path}")
                assert answers[path].status_code == 200, link
                waiting += [path] if path.endswith(".html") else []
            assert not anchor or f'id="{anchor}"' in answers[path].text, link
    assert {"help/start.html", "help/reference/python.html", "help/session.png"} <= answers.keys()
    assert "<math" in answers["help/methods/filters.html"].text
    assert "<table>" in answers["help/how-to/server.html"].text
    for path in ("nowhere.html", "%2e%2e/README.html", "%2e%2e/README.md", "%00.html", "start"):
        assert get(f"{BASE}/help/{path}").status_code == 404
    with monkeypatch.context() as within:
        within.setattr(documentation, "DOCS", tmp_path / "nowhere")
        answer = get(f"{BASE}/help/")
        assert (answer.status_code, "make docs" in answer.text) == (404, True)
    folder.mkdir()
    (folder / "index.html").write_text("there")
    assert get(f"{BASE}/help/").text == "there"
    assert get(f"{BASE}/help/start.html").status_code == 404


def test_the_rest_reference_shows_text_as_text() -> None:
    """No text of the interface's description becomes markup, since other packages contribute to it."""
    said = '<b>"'
    operation = {"description": said, "parameters": [said], "requestBody": {"content": {said: said}}, "responses": {}}
    paths, shapes = {said: {"get": operation}}, {"schemas": {said: said}}
    shown = documentation.reference({"paths": paths, "components": shapes, "info": {"description": said}})
    assert (shown.count("&lt;b&gt;"), "<b>" in shown, f'id="{said}' in shown) == (9, False, False)
