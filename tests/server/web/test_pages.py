"""Pages, experiments, health and metrics."""

import re
import shutil
from pathlib import Path

import httpx
import pytest

from pftrack.core.model.parameters import declarations
from pftrack.experiments import EXPERIMENTS
from pftrack_server.web import pages
from pftrack_server.web.health import METHODS
from tests.server.host import begin, steer


@pytest.mark.parametrize("path", ["/", "/lectures", "/api/v1/experiments", "/static/shared/style.css", "/nowhere"])
def test_heads(client: httpx.Client, path: str) -> None:
    """HEAD returns the headers and status of GET without a body, also for an error."""
    head, whole = client.head(path), client.get(path)
    assert (head.status_code, head.content) == (whole.status_code, b"")
    for name in ("content-type", "content-length", "cache-control"):
        assert head.headers.get(name) == whole.headers.get(name)


PAGES = Path(__file__).parents[3] / "frontend_static"
VERSIONED = re.compile(r"^static/version/\w+/")


def test_files_have_a_version(client: httpx.Client, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """A browser caches files with a version in their names; a changed file has another name.

    Files with an old version or without any are revalidated each time.
    """
    monkeypatch.setattr(pages, "FRONTEND", Path(shutil.copytree(PAGES, tmp_path / "pages")))
    for path in ("/static/shared/style.css", "/static/shared/api.js"):
        answer = client.get(path)
        assert (answer.status_code, answer.headers["cache-control"]) == (200, "no-cache")
        assert client.get(path, headers={"if-none-match": answer.headers["etag"]}).status_code == 304

    def named() -> str:
        found = re.search(r'src="(static/version/\w+/shared/apply_theme.js)"', client.get("/").text)
        assert found
        return found[1]

    first = named()
    assert first == named()
    answer = client.get(first)
    assert answer.text == client.get("/static/shared/apply_theme.js").text
    assert answer.headers["cache-control"] == "max-age=31536000, immutable"
    (tmp_path / "pages" / "shared" / "apply_theme.js").write_text("// another\n")
    assert named() != first
    never_served = client.get("/static/version/0123456789abcdef/shared/apply_theme.js")
    assert (never_served.status_code, never_served.headers["cache-control"]) == (200, "no-cache")


ADDRESSES = "/", "/work", "/lectures", "/lectures/x", "/references", "/session/new", "/session/0123456789abcdef"


@pytest.mark.parametrize("path", [*ADDRESSES, "/sweep/new", "/sweep/x", "/sweep/x/run/y"])
def test_pages(client: httpx.Client, path: str) -> None:
    """Every page comes from this server alone and names every module that its scripts import, however deep, once."""
    answer = client.get(path)
    assert (answer.status_code, answer.headers["content-type"]) == (200, "text/html; charset=utf-8")
    assert "http://" not in answer.text.replace("http://www.w3.org", "")
    named = re.findall(r'<link rel="modulepreload" href="(.+?)">', answer.text)
    files = {VERSIONED.sub("", address) for address in named}
    assert len(named) == len(files)
    assert set(re.findall(r'<script type="module".*? src="(.+?)">', answer.text)) <= set(named)
    for address in named:
        file = PAGES / VERSIONED.sub("", address)
        for line in file.read_text().splitlines():
            if found := re.match(r'(?:import|export|\}).* from "(\..+)";', line):
                other = (file.parent / found[1]).resolve().relative_to(PAGES)
                assert other.as_posix() in files, f"{address} imports {found[1]}"


def test_experiments(client: httpx.Client) -> None:
    """The list has what the start page shows; a picture that a browser has already is not sent again.

    The page of an experiment declares its parameters, layers and worlds.
    """
    listed = client.get("/api/v1/experiments").json()
    assert [item["id"] for item in listed] == list(EXPERIMENTS)
    for item in listed:
        assert item["question"].endswith("?")
        assert item["references"][0]["bibtex"].startswith("@")
        assert item["default_tracker"] in [tracker["id"] for tracker in item["trackers"]]
        assert item["thumbnail"] == f"api/v1/experiments/{item['id']}/thumbnail.webp"
    address = "/api/v1/experiments/sine/thumbnail.webp"
    first = client.get(address)
    assert first.content == EXPERIMENTS["sine"].display.thumbnail.read_bytes()
    assert first.headers["Cache-Control"] == "private, no-cache"
    again = client.get(address, headers={"If-None-Match": first.headers["ETag"]})
    assert (again.status_code, again.content, again.headers["ETag"]) == (304, b"", first.headers["ETag"])
    assert client.get(address, headers={"If-None-Match": '"another"'}).content == first.content
    detail, linkage = client.get("/api/v1/experiments/linkage").json(), EXPERIMENTS["linkage"]
    known = [item.name for item in declarations(type(linkage.simulate().parameters))]
    assert [item["name"] for item in detail["declarations"]] == known
    assert [layer["name"] for layer in detail["layers"]] == [layer.name for layer in linkage.display.layers]
    worlds = [(world["name"], world["unit"]) for world in detail["worlds"]]
    assert worlds == [(world.name, world.unit) for world in linkage.display.worlds]


def test_metrics(client: httpx.Client) -> None:
    """The health checks report that the server works; the metrics count sessions, frames and requests.

    Requests are counted by method; an unknown method has no label of its own.
    """
    assert client.get("/healthz").json() == {"status": "ok"}
    assert client.get("/readyz").json() == {"status": "ready"}
    steer(client, begin(client)["id"], "seek", frame=10)
    client.put("/api/v1/uploads/nothing/truth/nothing")
    client.request("PROPFIND", "/healthz")
    text = client.get("/metrics").text
    assert 'pftrack_sessions{state="ready"} 1.0' in text
    assert "pftrack_frames 10.0" in text
    for label in ('method="POST",status="201"}', 'method="PUT"', 'method="other"'):
        assert f"pftrack_requests_total{{{label}" in text
    served = {method.upper() for path in client.get("/openapi.json").json()["paths"].values() for method in path}
    assert served <= METHODS
    assert "PROPFIND" not in text


def test_openapi(client: httpx.Client) -> None:
    """The interface describes itself, the shape of its errors included."""
    for path, operations in client.get("/openapi.json").json()["paths"].items():
        for operation in operations.values():
            assert operation["description"], path
            assert "4XX" in operation["responses"], path
