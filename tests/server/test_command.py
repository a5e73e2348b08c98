"""The command `serve`: one link, clear sentences, a clean end."""

import signal
import socket
import tempfile
import time
from pathlib import Path

import httpx
import psutil
import pytest
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect
from websockets.typing import Origin

from tests.server.command import failing, link, serving
from tests.server.host import begin, wait_for


def test_prints_the_link_and_ends_cleanly(tmp_path: Path) -> None:
    """The server prints its link when it can be reached, and ends with its workers on an interrupt."""
    with serving(f"port=0, data_dir=Path({str(tmp_path)!r})") as process:
        with httpx.Client(base_url=link(process), timeout=60) as client:
            begin(client)
        workers = psutil.Process(process.pid).children(recursive=True)
        assert len(workers) >= 2
        process.send_signal(signal.SIGINT)
        assert process.wait(20) == 0
        wait_for(lambda: not any(worker.is_running() for worker in workers))


def test_nothing_is_lost_when_it_is_killed(tmp_path: Path) -> None:
    """A server that is killed leaves no worker behind, and its sessions are there when it is back."""
    arguments = f"port=0, data_dir=Path({str(tmp_path)!r})"
    with serving(arguments) as process, httpx.Client(base_url=link(process), timeout=60) as client:
        session = begin(client)
        client.post(f"/api/v1/sessions/{session['id']}/bookmarks", json={"note": "safe"})
        workers = psutil.Process(process.pid).children(recursive=True)
        process.kill()
        process.wait()
        wait_for(lambda: not any(worker.is_running() for worker in workers))
    with serving(arguments) as process, httpx.Client(base_url=link(process), timeout=60) as client:
        assert client.get(f"/api/v1/sessions/{session['id']}").json()["bookmarks"][0]["note"] == "safe"


def test_a_port_in_use(tmp_path: Path) -> None:
    """A port in use is told in one sentence that says what to do."""
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        assert f"Port {port} is in use" in failing(f"port={port}, data_dir=Path({str(tmp_path)!r})")


def test_a_data_directory_in_use(tmp_path: Path) -> None:
    """A data directory is used by one server at a time."""
    arguments = f"port=0, data_dir=Path({str(tmp_path)!r})"
    with serving(arguments) as process:
        link(process)
        assert "in use by another" in failing(arguments)


def test_other_wrong_wishes(tmp_path: Path) -> None:
    """What else is wrong is told in one sentence, too."""
    assert "port" in failing("port=70000", status=2)
    assert "address" in failing(f"host='203.0.113.7', port=0, data_dir=Path({str(tmp_path)!r})")
    (tmp_path / "file").write_text("")
    assert "--data-dir" in failing(f"port=0, data_dir=Path({str(tmp_path / 'file')!r})")


def test_a_refused_websocket_is_one_line_of_the_log(tmp_path: Path) -> None:
    """Many of them are one warning that says why; nothing is taken for a mistake of the server."""
    with serving(f"port=0, data_dir=Path({str(tmp_path)!r})") as process:
        address = link(process).replace("http", "ws") + "viz/x"
        for _ in range(20):
            with pytest.raises(InvalidStatus):
                connect(address, origin=Origin("http://evil.example"), proxy=None)
        process.send_signal(signal.SIGINT)
        _, log = process.communicate(timeout=20)
    lines = [line for line in log.splitlines() if "level=info" not in line]
    assert len(lines) == 1, log
    assert "another site" in lines[0]


def test_a_link_with_a_token(tmp_path: Path) -> None:
    """Bound to all interfaces the link carries a token, and nothing works without it."""
    with serving(f"host='0.0.0.0', port=0, data_dir=Path({str(tmp_path)!r})") as process:
        address = link(process)
        assert "?token=" in address
        bare = address.partition("?")[0]
        time.sleep(0.1)
        assert httpx.get(bare, timeout=20).status_code == 401
        with httpx.Client(follow_redirects=True) as client:
            assert client.get(address).status_code == 200


def test_nothing_stays_in_the_temporary_directory(tmp_path: Path) -> None:
    """A server that is told to end takes away what it has put there."""
    arguments = f"port=0, data_dir=Path({str(tmp_path / 'data')!r})"
    # The names of sockets may be 107 characters long, so not within the test's own directory.
    with tempfile.TemporaryDirectory() as name:
        temporary = Path(name)
        with serving(arguments, TMPDIR=name) as process:
            with httpx.Client(base_url=link(process), timeout=60) as client:
                begin(client)
            assert list(temporary.iterdir())
            process.terminate()
            assert process.wait(30) == 0
        assert list(temporary.iterdir()) == []
