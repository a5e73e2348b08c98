"""Databases and files that are damaged, of a newer version or of another program."""

import json
import sqlite3
import time
from contextlib import closing
from pathlib import Path
from typing import Any
from unittest.mock import Mock

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
    """A run or an upload with an unreadable row is left out of the list, reported as damaged, and can be deleted."""
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
            delete(client, kind, damaged)
        error_of(client.delete(f"/api/v1/{kind}/nothing"), 404)


def delete(client: httpx.Client, kind: str, name: str) -> None:
    """Delete something, which then is gone."""
    assert [client.delete(f"/api/v1/{kind}/{name}").status_code for _ in range(2)] == [204, 404]


def test_damaged_sessions_and_sweeps(start_server: Any, tmp_path: Path) -> None:
    """Unreadable sessions and sweeps do not affect others, and can be deleted."""
    with start_server() as (_, client):
        whole, first, *others = (begin(client)["id"] for _ in range(4))
    path = tmp_path / "data" / "pftrack.sqlite"
    ((text,),) = execute(path, "SELECT spec FROM sessions WHERE id = ?", first)
    partial = json.dumps({**json.loads(text), "description": {"title": "Ball"}})
    for damaged, spec in {first: partial, **dict(zip(others, ("no JSON", "[]"), strict=True))}.items():
        execute(path, "UPDATE sessions SET spec = ? WHERE id = ?", spec, damaged)
    sweeps = {"a" * 16: "[]", "b" * 16: "no JSON"}
    for name, plan in sweeps.items():
        row = (name, "T", "ball", plan, "stopped", 1, 0, 0, 0.0, "2026")
        columns = "id, title, experiment, plan, state, runs, done, problems, seconds, created"
        execute(path, f"INSERT INTO sweeps ({columns}) VALUES ({', '.join('?' * len(row))})", *row)  # noqa: S608 - ours
    with start_server() as (_, client):
        assert [session["id"] for session in client.get("/api/v1/sessions").json()] == [whole]
        assert client.get("/api/v1/sweeps").json() == []
        for kind, names in (("sessions", (first, *others)), ("sweeps", sweeps)):
            for name in names:
                delete(client, kind, name)
    assert execute(path, "SELECT id FROM sweeps") == []


def test_a_damaged_index_or_truth(start_server: Any, tmp_path: Path) -> None:
    """A damaged or missing index is made again by decoding the upload; a damaged truth counts as none."""
    table = {"file": ("truth.csv", b"frame,x,y,w,h\n0,10,20,10,10\n")}
    with start_server() as (_, client):
        for frames, damage in enumerate((b"", b"{", b'{"kind": "video"}', b"\xff", None), start=8):
            upload = send(client, ("ball.mp4", video(frames))).json()  # one whose index is not in memory
            index = tmp_path / "data" / "uploads" / upload["id"] / "index.json"
            before = index.read_bytes()
            index.unlink() if damage is None else index.write_bytes(damage)
            assert client.get(f"/api/v1/uploads/{upload['id']}/frames/3.jpg").status_code == 200
            assert index.read_bytes() == before
            path = f"/api/v1/uploads/{upload['id']}/truth?experiment=ball"
            assert client.put(path, files=table).json()["frames"] == 1
            (kept,) = index.parent.glob("truth-*.json")
            kept.write_bytes(damage or b'{"rows": 3}')
            assert client.get(path).json() is None
        index.unlink()
        session = begin(client, upload=upload["id"], box=[10, 20, 10, 10])
        assert session["recipe"]["footage"].get("truth") is None
        assert steer(client, session["id"], "step")["position"] == 1
        assert index.read_bytes() == before


def test_a_busy_database_is_not_damaged(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A row that could not be read for a moment is not called damaged: a person might delete it."""
    busy = sqlite3.OperationalError("database is locked")
    busy.sqlite_errorcode = sqlite3.SQLITE_BUSY
    with closing(Store(Settings(data_dir=tmp_path))) as store:
        monkeypatch.setattr(store, "_begin", Mock(side_effect=OperationalError("SELECT", {}, busy)))
        for read in (lambda: store.get(RunRow, "0123456789abcdef"), lambda: store.all(RunRow)):
            with pytest.raises(OperationalError):
                read()


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
