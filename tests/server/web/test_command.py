"""The command `serve`: one link, clear sentences, a clean end, and failures of whole processes."""

import html
import os
import re
import resource
import signal
import socket
import sqlite3
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import httpx
import psutil
import pytest
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect
from websockets.typing import Origin

from pftrack_server.app import create_app
from pftrack_server.core.settings import Settings
from pftrack_server.store import Store
from pftrack_server.web import serving
from tests.conftest import UNMEASURED
from tests.server.command import PATH, link, serve
from tests.server.host import begin, error_of, steer
from tests.server.sessions.test_crashes import state
from tests.server.sweeping import RUNS, begin_sweep, drivers, show, until_some
from tests.server.uploads.test_uploads import send
from tests.waiting import wait_for


def workers_of(process: subprocess.Popen[str]) -> list[psutil.Process]:
    found = psutil.Process(process.pid).children(recursive=True)
    assert len(found) >= 2  # fork server and worker
    return found


MEBIBYTE = 1024 * 1024
TOKEN = "token-of-this-test"
SHORT_OF_ROOM = f"import resource; resource.setrlimit(resource.RLIMIT_FSIZE, ({MEBIBYTE}, {MEBIBYTE}))"


def test_a_life(tmp_path: Path) -> None:
    """An interrupted server ends cleanly and leaves nothing behind.

    It prints its link, with the token, as soon as it can be reached. Nothing works without the token, and no process
    has it in its environment. The server warns of the shell's limit for files at the start and names it in a refusal.
    Requests of strangers are not logged as its errors.
    """
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    arguments = f"host='0.0.0.0', port=0, data_dir=Path({str(tmp_path / 'data')!r})"
    with serve(arguments, SHORT_OF_ROOM, TMPDIR=str(temporary), PFTRACK_TOKEN=TOKEN, **UNMEASURED) as process:
        address = link(process)
        assert address.endswith(f"?token={TOKEN}")
        bare = address.partition("?")[0]
        with httpx.Client(base_url=bare, timeout=60, follow_redirects=True) as client:
            assert client.get(bare).status_code == 401
            assert client.get(address).status_code == 200  # from here on a cookie says it
            begin(client)
            message = error_of(send(client, ("long.mp4", bytes(2 * MEBIBYTE))), 507)["message"]
            assert "ulimit -f" in message
            assert not list((tmp_path / "data" / "incoming").iterdir())
            known = {"Cookie": "; ".join(f"{name}={value}" for name, value in client.cookies.items())}
        scene = bare.replace("http", "ws") + "viz/x"
        for _ in range(20):
            with pytest.raises(InvalidStatus):
                connect(scene, origin=Origin("http://evil.example"), additional_headers=known, proxy=None)
        workers = workers_of(process)
        for each in (psutil.Process(process.pid), *workers):
            assert TOKEN not in each.environ().values()
        process.send_signal(signal.SIGINT)
        assert process.wait(60) == 0
        wait_for(lambda: not any(worker.is_running() for worker in workers))
        _, log = process.communicate(timeout=60)
    assert list(temporary.iterdir()) == []
    lines = [line for line in log.splitlines() if "level=info" not in line]
    assert len(lines) == 3, log
    assert "file size limit (ulimit -f) is 1 MiB" in lines[0]
    assert "ulimit -f" in lines[1]
    assert "another site" in lines[2]  # many refused websockets are one warning that says why


def test_the_commands_of_the_start_page(client: httpx.Client, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Pasted into the shell in which `make serve` runs, they write a filter and serve it beside the running server.

    That shell does not find the program by its name, and its port and data directory are taken.
    """
    (tmp_path / ".venv" / "bin").mkdir(parents=True)
    (tmp_path / ".venv" / "bin" / "pftrack").symlink_to(Path(sys.executable).with_name("pftrack"))
    monkeypatch.setattr(sys, "argv", [".venv/bin/pftrack"])
    found = re.search('data-commands="([^"]*)"', client.get("/").text)
    assert found
    held = Store(Settings(data_dir=tmp_path / "data"))
    taken = {"PFTRACK_DATA_DIR": str(tmp_path / "data"), "PFTRACK_PORT": str(client.base_url.port)}
    shell = {**os.environ, "PATH": os.defpath, "PYTHONPATH": PATH, **taken}
    options: dict[str, Any] = {"cwd": tmp_path, "env": shell, "stdout": subprocess.PIPE, "text": True}
    with (
        closing(held),
        subprocess.Popen(["sh", "-c", html.unescape(found[1])], start_new_session=True, **options) as process,
    ):
        try:
            own, _, token = link(process).partition("?token=")
            served = httpx.get(f"{own}api/v1/filters", headers={"Authorization": f"Bearer {token}"}).json()
        finally:
            os.killpg(process.pid, signal.SIGKILL)
    assert [(each["file"], each["experiment"]) for each in served] == [("my_filter.py", "ball")]


@contextmanager
def at_rest(processes: list[psutil.Process]) -> Iterator[None]:
    """Suspend processes for as long as the context lasts; one that ends meanwhile stays ended."""
    for each in processes:
        with suppress(psutil.NoSuchProcess):  # a short task
            each.suspend()
    yield
    for each in processes:
        with suppress(psutil.NoSuchProcess):
            each.resume()


def test_a_freeze_and_a_sudden_end(start_server: Any, tmp_path: Path) -> None:
    """Sessions outlive a pause of the whole process tree that is longer than a worker may be silent.

    If the server itself is killed, its sweep and sessions end with it, and no process is left. The next server shows
    the sweep as stopped and the session with its bookmarks.
    """
    first = "import tests.server.sweeping as its; its.functions.compute = its.compute_by_permission"
    arguments = f"port=0, data_dir=Path({str(tmp_path / 'data')!r})"
    with serve(arguments, first, PFTRACK_HANG_SECONDS="4") as process:
        with httpx.Client(base_url=link(process), timeout=110) as client:
            session = begin(client)["id"]
            steer(client, session, "seek", frame=10)
            client.post(f"/api/v1/sessions/{session}/bookmarks", json={"note": "safe"})
            web, others = psutil.Process(process.pid), workers_of(process)
            for late_s in (0.0, 1.0):
                with at_rest(others):
                    with at_rest([web]):
                        time.sleep(5)
                    time.sleep(late_s)
                time.sleep(2)
                assert state(client, session) == "ready"
            with at_rest(others):  # who is still silent after it is ended as ever
                wait_for(lambda: state(client, session) == "crashed", 60)
            begin(client)
            sweep = begin_sweep(client)["id"]
            until_some(client, sweep)
            of_the_sweep = [child for one in drivers(process.pid) for child in (one, *one.children(recursive=True))]
            assert len(of_the_sweep) > 2  # with a fork server and those that it has started
            children = web.children(recursive=True)
            assert len(children) >= len(of_the_sweep) + 2  # the fork server and the session's worker
        process.kill()
        wait_for(lambda: not any(child.is_running() for child in (*children, *of_the_sweep)), 60)
    with start_server() as (_, client):
        assert client.get(f"/api/v1/sessions/{session}").json()["bookmarks"][0]["note"] == "safe"
        found = show(client, sweep)
        assert found["state"] == "stopped"
        assert "server was stopped" in found["message"]
        assert 0 < found["done"] < RUNS


def database_of(folder: Path, *statements: str, is_ours: bool = True) -> Path:
    """Return a data directory with an empty database, ours unless told otherwise, after these statements."""
    if is_ours:
        Store(Settings(data_dir=folder)).close()
    folder.mkdir(exist_ok=True)
    with closing(sqlite3.connect(folder / "pftrack.sqlite")) as database:
        for statement in statements:
            database.execute(statement)
        database.commit()
    return folder


def damaged(folder: Path) -> Path:
    """Return a data directory with a database whose second and third page are damaged."""
    path = database_of(folder) / "pftrack.sqlite"
    content = bytearray(path.read_bytes())
    content[4096 + 8 : 3 * 4096] = b"\xff" * (2 * 4096 - 8)
    path.write_bytes(content)
    return folder


def test_it_says_why_it_cannot_start(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """One line names the port, host, folder, limit or database that is wrong, before anything starts."""
    (tmp_path / "file").write_text("")
    (tmp_path / "none").mkdir()
    (tmp_path / "none" / "pftrack.sqlite").write_bytes(b"certainly not a database" * 100)
    foreign = database_of(tmp_path / "foreign", "CREATE TABLE invoices (number INTEGER)", is_ours=False)
    newer = database_of(tmp_path / "newer", "PRAGMA user_version = 9999")
    older = "PRAGMA application_id = 0", "CREATE TABLE alembic_version (version_num)"
    monkeypatch.setattr(serving, "_log_to_stderr", lambda: None)
    monkeypatch.setattr(serving, "signal", Mock())
    with closing(Store(Settings(data_dir=tmp_path / "held"))), socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        for given, files, words in (
            ({"port": port}, 8192, [f"Port {port} is in use"]),
            ({"host": "203.0.113.7"}, 8192, ["address"]),
            ({"data_dir": tmp_path / "held"}, 8192, ["in use by another"]),
            ({"data_dir": tmp_path / "file"}, 8192, ["--data-dir"]),
            ({"port": 70000}, 8192, ["pftrack: --port must be less than or equal to 65535, got 70000"]),
            ({}, 200, ["The open-file limit (ulimit -n) is 200", "at least 256"]),
            ({"data_dir": tmp_path / "none"}, 8192, ["is not a database, or is damaged", "--data-dir"]),
            ({"data_dir": damaged(tmp_path / "damaged")}, 8192, ["is damaged: restore a copy of it"]),
            ({"data_dir": newer}, 8192, ["newer version of pftrack", "9999", "update pftrack"]),
            ({"data_dir": database_of(tmp_path / "older", *older)}, 8192, ["before the first release: move it away"]),
            ({"data_dir": foreign}, 8192, ["belongs to another program, since it has tables invoices"]),
        ):
            monkeypatch.setattr(resource, "getrlimit", lambda _, files=files: (files, files))
            with pytest.raises(SystemExit) as ended:
                serving.run(create_app, {"port": 0, "data_dir": tmp_path / "data", **given})
            said = capsys.readouterr().err
            assert (ended.value.code, said.count("\n")) == (2 if given.get("port") == 70000 else 1, 1), said
            assert [each for each in words if each not in said] == []
