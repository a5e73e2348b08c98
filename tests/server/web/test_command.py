"""The command `serve`: one link, clear sentences, a clean end, and what happens to whole processes."""

import html
import os
import re
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
from urllib.parse import urlsplit

import httpx
import psutil
import pytest
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect
from websockets.typing import Origin

from pftrack_server.core.settings import Settings
from pftrack_server.store import Store
from tests.server.command import PATH, Wish, link, refused, serving
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
    """Interrupted, it ends cleanly and leaves nothing behind.

    Its link is printed when it can be reached, with the token, and nothing works without that, which no process has in
    its environment. A file that is longer than its shell allows is refused with the name of the limit, told at the
    start, too; what strangers ask for is no mistake of the server.
    """
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    arguments = f"host='0.0.0.0', port=0, data_dir=Path({str(tmp_path / 'data')!r})"
    with serving(arguments, SHORT_OF_ROOM, TMPDIR=str(temporary), PFTRACK_TOKEN=TOKEN) as process:
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
    assert "files of at most 1 MiB (ulimit -f)" in lines[0]
    assert "ulimit -f" in lines[1]
    assert "another site" in lines[2]  # many refused websockets are one warning that says why


def test_the_commands_of_the_start_page(tmp_path: Path) -> None:
    """Pasted into the shell in which `make serve` runs, they write a filter and serve it, beside the server that runs.

    That shell does not find the program by its name, and its port and data directory are taken.
    """
    (tmp_path / ".venv" / "bin").mkdir(parents=True)
    (tmp_path / ".venv" / "bin" / "pftrack").symlink_to(Path(sys.executable).with_name("pftrack"))
    shell = {**os.environ, "PATH": os.defpath, "PYTHONPATH": PATH, "PFTRACK_DATA_DIR": str(tmp_path / "data")}

    @contextmanager
    def started(*arguments: str, **more: str) -> Iterator[subprocess.Popen[str]]:
        own: dict[str, Any] = {"stdout": subprocess.PIPE, "text": True, "start_new_session": True}
        with subprocess.Popen(arguments, cwd=tmp_path, env={**shell, **more}, **own) as process:
            try:
                yield process
            finally:
                os.killpg(process.pid, signal.SIGKILL)

    with started(".venv/bin/pftrack", "serve", "--port", "0") as first:
        address = link(first)
        found = re.search('data-commands="([^"]*)"', httpx.get(address).text)
        assert found
        with started("sh", "-c", html.unescape(found[1]), PFTRACK_PORT=str(urlsplit(address).port)) as second:
            own, _, token = link(second).partition("?token=")
            served = httpx.get(f"{own}api/v1/filters", headers={"Authorization": f"Bearer {token}"}).json()
            assert [(each["file"], each["experiment"]) for each in served] == [("my_filter.py", "ball")]
            assert first.poll() is None


@contextmanager
def at_rest(processes: list[psutil.Process]) -> Iterator[None]:
    """Stop processes for as long as the context lasts; who has been ended meanwhile stays so."""
    for each in processes:
        with suppress(psutil.NoSuchProcess):  # a short task
            each.suspend()
    yield
    for each in processes:
        with suppress(psutil.NoSuchProcess):
            each.resume()


def test_a_freeze_and_a_sudden_end(start_server: Any, tmp_path: Path) -> None:
    """Sessions outlive a pause of the whole process tree, though it is longer than a worker may be silent.

    Without the process from which workers are forked the next session begins all the same. When the server itself is
    killed its sweep and its sessions stop with it, and no process is left behind. The next server shows the sweep as
    stopped, and the session with all that was noted in it.
    """
    first = "import tests.server.sweeping as its; its.functions.compute = its.compute_by_permission"
    arguments = f"port=0, data_dir=Path({str(tmp_path / 'data')!r})"
    with serving(arguments, first, PFTRACK_HANG_SECONDS="4") as process:
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
            for each in web.children():
                each.kill()
            begin(client)  # by another fork server
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


def database_of(folder: Path) -> Path:
    """The database of a data directory, empty but for its tables."""
    Store(Settings(data_dir=folder)).close()
    return folder / "pftrack.sqlite"


def execute(path: Path, statement: str) -> None:
    """Carry out a statement behind the server's back."""
    with sqlite3.connect(path) as database:
        database.execute(statement)
    database.close()


def databases(below: Path) -> dict[str, Path]:
    """Folders with a file that is not a database, and with one that is damaged, newer or another program's."""
    folders = {name: below / name for name in ("none", "damaged", "newer", "older", "foreign")}
    folders["none"].mkdir()
    (folders["none"] / "pftrack.sqlite").write_bytes(b"certainly no database" * 100)
    path = database_of(folders["damaged"])
    content = bytearray(path.read_bytes())
    content[4096 + 8 : 3 * 4096] = b"\xff" * (2 * 4096 - 8)
    path.write_bytes(content)
    execute(database_of(folders["newer"]), "PRAGMA user_version = 9999")
    execute(database_of(folders["older"]), "PRAGMA application_id = 0")
    execute(folders["older"] / "pftrack.sqlite", "CREATE TABLE alembic_version (version_num)")
    folders["foreign"].mkdir()
    execute(folders["foreign"] / "pftrack.sqlite", "CREATE TABLE invoices (number INTEGER)")
    return folders


@pytest.fixture(scope="module")
def said(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """What each server says that cannot start, and the port that is in use."""
    below = tmp_path_factory.mktemp("refused")
    (below / "file").write_text("")
    held = Store(Settings(data_dir=below / "held"))
    with closing(held), socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        data = f"data_dir=Path({str(below / 'data')!r})"
        place = f"port=0, {data}"
        wishes = {
            "port in use": Wish(f"port={port}, {data}"),
            "elsewhere": Wish(f"{place}, host='203.0.113.7'"),
            "held": Wish(f"port=0, data_dir=Path({str(below / 'held')!r})"),
            "no folder": Wish(f"port=0, data_dir=Path({str(below / 'file')!r})"),
            "no port": Wish("port=70000", status=2),
            "few files": Wish(place, "import resource; resource.setrlimit(resource.RLIMIT_NOFILE, (200, 200))"),
            **{name: Wish(f"port=0, data_dir=Path({str(folder)!r})") for name, folder in databases(below).items()},
        }
        return {**dict(zip(wishes, refused(*wishes.values()), strict=True)), "port": str(port)}


WORDS = {
    "elsewhere": ["address"],
    "no folder": ["--data-dir"],
    "held": ["in use by another"],
    "no port": ["port"],
    "few files": ["200 open files (ulimit -n)", "at least 256"],
    "none": ["is not a database, or is damaged", "--data-dir"],
    "damaged": ["is damaged: restore a copy of it"],
    "newer": ["newer version of pftrack", "9999", "update pftrack"],
    "older": ["before the first release: move it away"],
    "foreign": ["belongs to another program, since it has tables invoices"],
}


def test_it_says_why_it_cannot_start(said: dict[str, str]) -> None:
    """A port in use, an address of another machine, a file in the place of a folder, one that another server has.

    With too few open files it is said what to raise. A file that is not a database, is damaged, or is another version's
    or program's.
    """
    assert f"Port {said['port']} is in use" in said["port in use"]
    for name, words in WORDS.items():
        assert [each for each in words if each not in said[name]] == [], name
