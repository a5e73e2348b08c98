"""Nothing is left behind when sessions and servers begin and end again and again."""

import gc
from pathlib import Path

import httpx
import psutil
import pytest
from websockets.sync.client import connect

from pftrack_server.core.settings import Settings
from tests.server.host import Server, begin, error_of, running, steer
from tests.server.sessions.test_duplex import hear
from tests.server.web.test_ports import PROTOCOL
from tests.session_requests import session_request
from tests.waiting import wait_for

ROUNDS = 4
APPS = 4
"""Number of servers that start and stop; a leak shows after the second."""


def descriptors() -> int:
    gc.collect()
    return psutil.Process().num_fds()


def children() -> int:
    return len(psutil.Process().children(recursive=True))


@pytest.fixture
def settled(server: Server, client: httpx.Client) -> None:
    """Run the shared server once, so that its fork server, threads and connections exist."""
    session = begin(client)
    client.delete(f"/api/v1/sessions/{session['id']}")


def test_sessions(server: Server, client: httpx.Client, settled: None) -> None:
    """Sessions that begin, are watched and end, and refused ones, leave no descriptor, process or thread behind."""
    before, counts = children(), []
    refused = session_request({"experiment": "ball", "parameters": {"sample_count": -1}})
    for seed in range(ROUNDS):
        session = begin(client, seed=seed)["id"]
        steer(client, session, "play")
        with (
            connect(f"{server.ws}/api/v1/sessions/{session}/stream") as stream,
            connect(f"{server.ws}/viz/{session}", subprotocols=[PROTOCOL], max_size=None) as scene,
        ):
            hear(stream)
            hear(stream)
            scene.recv(timeout=10)
        client.delete(f"/api/v1/sessions/{session}")
        error_of(client.post("/api/v1/sessions", json=refused), 422)
        wait_for(lambda: len(server.manager.all) == 0)
        counts.append(descriptors())
    wait_for(lambda: children() <= before)
    wait_for(lambda: descriptors() <= counts[1] + 1)


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
