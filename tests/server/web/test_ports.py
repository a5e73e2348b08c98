"""A server listens on one port, its own, which is guarded."""

import stat
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import urlsplit

import psutil
import pytest
import viser
from websockets.sync.client import connect
from websockets.typing import Origin, Subprotocol

from tests.browser.host import Server, descendants, until
from tests.server.host import refused_socket
from tests.server.sweeping import SMALL, drivers

PROTOCOL = Subprotocol(f"viser-v{viser.__version__}")


@pytest.fixture
def watched(beside_misbehaving: Server) -> Iterator[str]:
    """The websocket's address of a session's scene that has a watcher while a sweep is computed."""
    served = beside_misbehaving
    session = served.start_session()["id"]
    sweep = served.post("sweeps", SMALL)["id"]
    address = f"{served.url.replace('http', 'ws')}/viz/{session}"
    with connect(address, subprotocols=[PROTOCOL], max_size=None, proxy=None) as browser:
        browser.recv(timeout=30)
        until(lambda: served.get(f"sweeps/{sweep}")["done"] > 0, "the sweep is computed", 60)
        # The sweep pauses with everything open.
        until(lambda: len(drivers(served.pid or 0)) == 1, "there is one driver", 300)
        yield address
    served.delete(f"sweeps/{sweep}")


def test_nothing_else_listens(beside_misbehaving: Server, watched: str) -> None:
    """Neither scene, worker, fork server nor sweep opens a port of its own, of any kind.

    The fork server's socket in the file system lies in a directory of the server's user alone. The bridge of a scene
    asks the guard before the upgrade, which refuses a page of another site.
    """
    pid = beside_misbehaving.pid
    assert pid is not None
    family = [psutil.Process(each) for each in (pid, *descendants(pid))]
    assert len(family) >= 5  # server, fork server, worker, sweep and its workers
    connections = [each for process in family for each in process.net_connections("inet")]
    tcp = {each.laddr for each in connections if each.status == psutil.CONN_LISTEN}
    assert {(place.ip, place.port) for place in tcp} == {("127.0.0.1", urlsplit(beside_misbehaving.url).port)}
    assert [each for each in connections if each.status == psutil.CONN_NONE] == []  # datagrams
    foreign = Origin("http://elsewhere.example")
    assert refused_socket(watched, subprotocols=[PROTOCOL], origin=foreign, proxy=None) == 403
    inodes = {link.removeprefix("socket:[").removesuffix("]") for process in family for link in _links(process.pid)}
    for line in Path("/proc/net/unix").read_text().splitlines()[1:]:
        _, _, _, flags, _, _, inode, *path = line.split()
        if inode in inodes and int(flags, 16) & 0x10000:  # it listens
            assert path, "nobody can connect to a listening socket without a name"
            assert not path[0].startswith("@"), f"{path[0]} has no permissions"
            assert stat.S_IMODE(Path(path[0]).parent.stat().st_mode) == 0o700


def _links(pid: int) -> list[str]:
    try:
        return [str(each.readlink()) for each in Path(f"/proc/{pid}/fd").iterdir()]
    except OSError:  # one of the sweep's has just ended
        return []
