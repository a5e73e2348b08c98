"""Opening and closing, again and again: nothing is left behind."""

import gc
from pathlib import Path
from typing import Any

import httpx
import psutil
import pytest
from websockets.sync.client import connect

from pftrack_server.core.settings import Settings
from tests.server.host import Server, begin, running, steer
from tests.server.sessions.test_duplex import hear
from tests.session_requests import session_request
from tests.waiting import wait_for

ROUNDS = 12
APPS = 5
"""Servers that start and stop: what each leaves behind shows after the second."""


def descriptors() -> int:
    gc.collect()
    return psutil.Process().num_fds()


def children() -> int:
    return len(psutil.Process().children(recursive=True))


@pytest.fixture
def settled(server: Server, client: httpx.Client) -> None:
    """The shared server has run once, so that what stays for good is there: fork server, threads, connections."""
    session = begin(client)
    client.delete(f"/api/v1/sessions/{session['id']}")


def test_sessions(server: Server, client: httpx.Client, settled: None) -> None:
    """Sessions that begin and end leave no descriptor, process or thread behind."""
    before = (descriptors(), children())
    for seed in range(ROUNDS):
        session = begin(client, seed=seed)
        steer(client, session["id"], "play")
        with connect(f"{server.ws}/api/v1/sessions/{session['id']}/stream") as socket:
            hear(socket)
            hear(socket)
        client.delete(f"/api/v1/sessions/{session['id']}")
    wait_for(lambda: children() <= before[1])
    wait_for(lambda: descriptors() <= before[0] + 1)


def test_scenes(server: Server, client: httpx.Client, settled: None) -> None:
    """Scenes that are looked at and left leave no descriptor behind."""
    counts = []
    for seed in range(6):
        session = begin(client, seed=seed)
        with connect(f"{server.ws}/viz/{session['id']}", subprotocols=[protocol()], max_size=None) as socket:
            socket.recv(timeout=10)
        client.delete(f"/api/v1/sessions/{session['id']}")
        wait_for(lambda: len(server.manager.all) == 0)
        counts.append(descriptors())
    assert counts[-1] <= counts[1] + 2, counts


def test_refused_sessions(client: httpx.Client, settled: None) -> None:
    """Sessions that are refused leave nothing behind either."""
    before = (descriptors(), children())
    for _ in range(ROUNDS):
        client.post(
            "/api/v1/sessions", json=session_request({"experiment": "ball", "parameters": {"sample_count": -1}})
        )
    wait_for(lambda: children() <= before[1])
    wait_for(lambda: descriptors() <= before[0] + 1)


def test_apps(server: Server, settled: None, tmp_path: Path) -> None:
    """Servers that start and stop, with a session each, leave nothing behind."""
    counts = []
    for number in range(APPS):
        with (
            running(Settings(data_dir=tmp_path / str(number % 3))) as own,
            httpx.Client(base_url=own.url, timeout=30) as client,
        ):
            begin(client)
        counts.append((descriptors(), children()))
    assert counts[-1][0] <= counts[1][0] + 1, counts
    assert counts[-1][1] <= counts[1][1], counts


def test_workers_hold_no_descriptors_of_others(server: Server, client: httpx.Client) -> None:
    """A worker holds its own pipe and nothing of the web process or of other sessions."""
    first, second = begin(client), begin(client)
    for session in (first, second):
        folder = Path(f"/proc/{server.pid_of(session['id'])}/fd")
        links = [str(link.readlink()) for link in folder.iterdir()]
        assert len([link for link in links if link.startswith("socket:")]) <= 1, links
        assert not [link for link in links if ".sqlite" in link]


def protocol() -> Any:
    """The subprotocol that viser's client of this version offers."""
    import viser

    return f"viser-v{viser.__version__}"
