"""A data directory of an earlier version: all that people made with it is still there, to the same numbers."""

import base64
import json
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest

from pftrack.runs.record import read_saved
from pftrack_server.settings import Settings
from tests.server.host import running, steer

FORMAT_1 = Path(__file__).parents[1] / "data" / "format_1"
EXPECTED: dict[str, Any] = json.loads((FORMAT_1 / "expected.json").read_text())
CLIP, FACE = EXPECTED["uploads"]


@pytest.fixture(scope="module")
def client(tmp_path_factory: pytest.TempPathFactory) -> Iterator[httpx.Client]:
    """A client of a server on a copy of the data."""
    data = tmp_path_factory.mktemp("earlier") / "data"
    shutil.copytree(FORMAT_1 / "data", data)
    with running(Settings(data_dir=data)) as server, httpx.Client(base_url=server.url, timeout=120) as http:
        assert http.get("/readyz").status_code == 200
        yield http


def estimates(client: httpx.Client, session: str, branch: str) -> list[Any]:
    answer = client.get(f"/api/v1/sessions/{session}/diagnostics", params={"branch": branch})
    estimated: list[Any] = answer.json()["columns"]["estimate"]
    return estimated


def test_all_sessions_are_listed(client: httpx.Client) -> None:
    """Sessions are listed before they go on, though earlier ones had plots that this version does not know."""
    assert {session["id"] for session in client.get("/api/v1/sessions").json()} == set(EXPECTED["sessions"])


def same(found: Any, expected: Any) -> bool:
    """Whether estimates are those of version 0.2, but for last digits; see `tests/runs/test_earlier_formats.py`."""
    one, other = np.array(found, np.float64), np.array(expected, np.float64)
    return one.shape == other.shape and bool(np.allclose(one, other, rtol=0, atol=1e-5, equal_nan=True))


@pytest.mark.parametrize("name", sorted(EXPECTED["sessions"]))
def test_sessions(client: httpx.Client, name: str) -> None:
    """A session goes on where it was: position, branches, timeline, bookmarks, and the estimates of every frame."""
    before = EXPECTED["sessions"][name]
    assert client.post(f"/api/v1/sessions/{name}/resume").status_code == 200
    session = client.get(f"/api/v1/sessions/{name}").json()
    for kept in ("position", "branch", "tracker"):
        assert session[kept] == before[kept], kept
    for kept in ("experiment", "seed", "timeline"):
        assert session["recipe"][kept] == before[kept], kept
    assert [branch["title"] for branch in session["branches"]] == before["branches"]
    assert [[item["frame"], item["note"]] for item in session["bookmarks"]] == before["bookmarks"]
    for branch in before["estimates"]:
        if branch != session["branch"]:
            assert client.post(f"/api/v1/sessions/{name}/branch/{branch}/activate").status_code == 200
        assert same(estimates(client, name, branch), before["estimates"][branch])


@pytest.mark.parametrize("place", range(3), ids=[run["title"] for run in EXPECTED["runs"]])
def test_saved_runs(client: httpx.Client, place: int) -> None:
    """A saved run is listed as it was, opens, and gives the same numbers when it is saved again."""
    before = EXPECTED["runs"][place]
    listed = client.get(f"/api/v1/runs/{before['id']}").json()
    assert [listed[kept] for kept in ("title", "experiment", "outcome")] == [
        before[kept] for kept in ("title", "experiment", "outcome")
    ]
    session = client.post(f"/api/v1/runs/{before['id']}/open").json()
    assert session["remark"].startswith("The numbers differ from the saved ones from frame ")
    again = client.post("/api/v1/runs", json={"session": session["id"]}).json()
    assert again["summary"]["frames"] > 0
    saved = read_saved(FORMAT_1 / "data" / "runs" / f"{before['id']}.pft")
    assert saved.record.estimates_sha256 == before["estimates_sha256"]
    assert same(estimates(client, session["id"], session["branch"]), saved.estimates)


def test_a_sweep(client: httpx.Client) -> None:
    """A sweep is listed with all its runs, and one of them opens."""
    before = EXPECTED["sweep"]
    assert client.get(f"/api/v1/sweeps/{before['id']}").json()["done"] == before["runs"]
    rows = client.get(f"/api/v1/sweeps/{before['id']}/rows").json()["rows"]
    assert rows
    assert client.post(f"/api/v1/sweeps/{before['id']}/rows/{rows[0]['run']}/open").status_code == 201


@pytest.mark.parametrize("name", sorted(EXPECTED["links"]))
def test_share_links(client: httpx.Client, name: str) -> None:
    """What a link holds begins a session with the numbers of the one that was shared."""
    link = EXPECTED["links"][name]
    before = EXPECTED["sessions"][link["session"]]
    wish = json.loads(base64.urlsafe_b64decode(link["fragment"] + "=="))
    answer = client.post("/api/v1/sessions", json=wish)
    assert answer.status_code == 201, answer.text
    session = answer.json()
    shared = before["estimates"][before["branch"]]
    steer(client, session["id"], "seek", frame=before["position"])
    assert same(estimates(client, session["id"], session["branch"])[: len(shared)], shared)
