"""Databases and files that are damaged, of a newer version or of another program."""

import json
import sqlite3
import time
from contextlib import closing
from pathlib import Path
from typing import Any

import httpx
import pytest
from sqlalchemy.exc import OperationalError

from pftrack_server.core.settings import Settings
from pftrack_server.store import Store
from pftrack_server.store.database import BUSY_S, RunRow
from tests.server.host import begin, error_of, steer
from tests.server.store.test_full_disk import save
from tests.server.uploads.test_uploads import png, send, video

# The first worker waits until the fork server has imported everything, which a shared server has waited for.
pytestmark = pytest.mark.usefixtures("server")


def execute(path: Path, statement: str, *values: Any) -> list[Any]:
    """Carry out a statement behind the server's back."""
    with sqlite3.connect(path) as database:
        rows = database.execute(statement, values).fetchall()
    database.close()
    return rows


DAMAGES = {
    "runs": ("summary = 'no JSON'", "summary = '5'", "frames = 'many'", "title = CAST(x'ff' AS TEXT)"),
    "uploads": ("warnings = '{'",),
}


@pytest.mark.parametrize("kind", DAMAGES)
def test_a_damaged_row(start_server: Any, tmp_path: Path, kind: str) -> None:
    """A run or an upload whose row cannot be read is left out of the list, says so by itself, and can be deleted."""
    with start_server() as (_, client):
        session, pictures = begin(client)["id"], [(f"{number}.png", png(number)) for number in range(2)]

        def make() -> str:
            return str((save(client, session) if kind == "runs" else send(client, *pictures)).json()["id"])

        whole = make()
        for damage in DAMAGES[kind]:
            damaged = make()
            statement = f"UPDATE {kind} SET {damage} WHERE id = ?"  # noqa: S608 - ours
            execute(tmp_path / "data" / "pftrack.sqlite", statement, damaged)
            assert [each["id"] for each in client.get(f"/api/v1/{kind}").json()] == [whole]
            assert "damaged" in error_of(client.get(f"/api/v1/{kind}/{damaged}"), 410)["message"]
            if kind == "runs":
                error_of(client.post(f"/api/v1/runs/{damaged}/open"), 410)
            assert client.delete(f"/api/v1/{kind}/{damaged}").status_code == 204
            error_of(client.delete(f"/api/v1/{kind}/{damaged}"), 404)
        error_of(client.delete(f"/api/v1/{kind}/nothing"), 404)


def test_damaged_sessions(start_server: Any, tmp_path: Path) -> None:
    """Sessions that cannot be read leave the others alone, and can be deleted."""
    with start_server() as (_, client):
        whole, first, *others = (begin(client)["id"] for _ in range(5))
    path = tmp_path / "data" / "pftrack.sqlite"
    ((text,),) = execute(path, "SELECT spec FROM sessions WHERE id = ?", first)
    partial = json.dumps({**json.loads(text), "description": {"title": "Ball"}})
    specs = {first: partial, **dict(zip(others, ("no JSON", "[]", '{"id": 5}'), strict=True))}
    for damaged, spec in specs.items():
        execute(path, "UPDATE sessions SET spec = ? WHERE id = ?", spec, damaged)
    with start_server() as (_, client):
        assert [session["id"] for session in client.get("/api/v1/sessions").json()] == [whole]
        for damaged in specs:
            assert client.delete(f"/api/v1/sessions/{damaged}").status_code == 204
            error_of(client.delete(f"/api/v1/sessions/{damaged}"), 404)


def test_a_damaged_sweep(start_server: Any, tmp_path: Path) -> None:
    """A sweep whose plan cannot be read leaves the others alone, and can be deleted."""
    with start_server():
        pass
    path, names = tmp_path / "data" / "pftrack.sqlite", ["a" * 16, "b" * 16]
    columns = "id, title, experiment, plan, state, runs, done, problems, seconds, created"
    for name, plan in zip(names, ("[]", "no JSON"), strict=True):
        row = (name, "T", "ball", plan, "stopped", 1, 0, 0, 0.0, "2026")
        execute(path, f"INSERT INTO sweeps ({columns}) VALUES ({', '.join('?' * len(row))})", *row)  # noqa: S608 - ours
    with start_server() as (_, client):
        assert client.get("/api/v1/sweeps").json() == []
        for name in names:
            assert client.delete(f"/api/v1/sweeps/{name}").status_code == 204
            error_of(client.delete(f"/api/v1/sweeps/{name}"), 404)
    assert execute(path, "SELECT id FROM sweeps") == []


def test_a_damaged_index(start_server: Any, tmp_path: Path) -> None:
    """An upload whose index is damaged or missing is decoded again, and its index is whole from then on."""
    with start_server() as (_, client):
        for frames, damage in enumerate(("", "{", '{"kind": "video"}', "\xff", None), start=8):
            upload = send(client, ("ball.mp4", video(frames))).json()  # one whose index nobody has in memory
            index = tmp_path / "data" / "uploads" / upload["id"] / "index.json"
            before = index.read_bytes()
            index.unlink() if damage is None else index.write_bytes(damage.encode("latin-1"))
            assert client.get(f"/api/v1/uploads/{upload['id']}/frames/3.jpg").status_code == 200
            assert index.read_bytes() == before
            index.unlink()
            session = begin_on(client, upload)
            assert steer(client, session["id"], "step")["position"] == 1
            assert index.read_bytes() == before
            client.delete(f"/api/v1/sessions/{session['id']}")


def test_a_damaged_truth(start_server: Any, tmp_path: Path) -> None:
    """An upload whose truth is damaged is one without truth, until it is given again."""
    table = {"file": ("truth.csv", b"frame,x,y,w,h\n0,10,20,10,10\n")}
    with start_server() as (_, client):
        upload = send(client, ("ball.mp4", video(8))).json()
        path = f"/api/v1/uploads/{upload['id']}/truth?experiment=ball"
        for damage in (b"", b"{", b'{"rows": 3}', b"\xff"):
            given = client.put(path, files=table)
            assert (given.status_code, given.json()["frames"]) == (200, 1)
            (kept,) = (tmp_path / "data" / "uploads" / upload["id"]).glob("truth-*.json")
            kept.write_bytes(damage)
            assert client.get(path).json() is None
            session = begin_on(client, upload)
            assert session["recipe"]["footage"].get("truth") is None
            client.delete(f"/api/v1/sessions/{session['id']}")


def begin_on(client: httpx.Client, upload: dict[str, Any]) -> dict[str, Any]:
    mark = {"kind": "box", "x": 10, "y": 20, "width": 10, "height": 10}
    recipe = {"experiment": "ball", "footage": {"sha256": upload["sha256"], "mark": mark}}
    answer = client.post("/api/v1/sessions", json={"recipe": recipe, "upload": upload["id"]})
    assert answer.status_code == 201, answer.text
    return answer.json()


def test_a_busy_database_is_not_damaged(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What could not be read for a moment is not called damaged, which would have somebody delete it."""
    busy = sqlite3.OperationalError("database is locked")
    busy.sqlite_errorcode = sqlite3.SQLITE_BUSY
    store = Store(Settings(data_dir=tmp_path))

    def refuse() -> None:
        raise OperationalError("SELECT", {}, busy)

    monkeypatch.setattr(store, "_begin", refuse)
    for read in (lambda: store.get(RunRow, "0123456789abcdef"), lambda: store.all(RunRow)):
        with pytest.raises(OperationalError):
            read()
    store.close()


def test_a_locked_database_is_busy(start_server: Any, tmp_path: Path) -> None:
    """While another program keeps the database locked, a request is answered in seconds, and works afterwards."""
    with start_server() as (_, client):
        session = begin(client)["id"]
        other = sqlite3.connect(tmp_path / "data" / "pftrack.sqlite", isolation_level=None)
        with closing(other):
            other.execute("BEGIN IMMEDIATE")
            asked = time.monotonic()
            refused = client.delete("/api/v1/uploads/0123456789abcdef")
            assert "busy with another program; try again" in error_of(refused, 503)["message"]
            assert time.monotonic() - asked < 2 * BUSY_S + 1
        answer = client.post(f"/api/v1/sessions/{session}/bookmarks", json={"note": "kept"})
        assert answer.status_code == 201, answer.text
