"""A server listens on one port: its own, where everybody is asked who they are."""

import stat
import threading
from collections.abc import Iterator
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import psutil
import pytest
import viser
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect
from websockets.typing import Origin, Subprotocol

from tests.browser.host import Server, descendants, until
from tests.conftest import CHROMIUM
from tests.server.sweeping import SMALL, drivers

PROTOCOL = Subprotocol(f"viser-v{viser.__version__}")


@pytest.fixture(scope="module")
def served(beside_misbehaving: Server) -> Server:
    return beside_misbehaving


@pytest.fixture(scope="module")
def watched(served: Server) -> Iterator[str]:
    """The websocket's address of a session's scene, which somebody looks at, while a sweep is computed."""
    session = served.start_session()["id"]
    sweep = served.post("sweeps", SMALL)["id"]
    address = f"{served.url.replace('http', 'ws')}/viz/{session}"
    with connect(address, subprotocols=[PROTOCOL], max_size=None, proxy=None) as browser:
        browser.recv(timeout=30)
        until(lambda: served.get(f"sweeps/{sweep}")["done"] > 0, "the sweep is computed", 60)
        # It stands still meanwhile, with all that it has opened; what warms the caches has ended.
        until(lambda: len(drivers(served.pid or 0)) == 1, "there is one driver", 300)
        yield address
    served.delete(f"sweeps/{sweep}")


def processes(served: Server) -> list[psutil.Process]:
    assert served.pid is not None
    return [psutil.Process(pid) for pid in (served.pid, *descendants(served.pid))]


def test_nothing_else_listens(served: Server, watched: str) -> None:
    """Neither scene, worker, fork server nor sweep opens a port of its own, of any kind.

    The bridge asks a program before the upgrade, and refuses one that claims to be a page of another site.
    """
    family = processes(served)
    assert len(family) >= 5  # server, fork server, worker, sweep and its workers
    connections = [each for process in family for each in process.net_connections("inet")]
    tcp = {each.laddr for each in connections if each.status == psutil.CONN_LISTEN}
    assert {(place.ip, place.port) for place in tcp} == {("127.0.0.1", urlsplit(served.url).port)}
    assert [each for each in connections if each.status == psutil.CONN_NONE] == []  # datagrams
    with pytest.raises(InvalidStatus) as refused:
        connect(watched, subprotocols=[PROTOCOL], origin=Origin("http://elsewhere.example"), proxy=None)
    assert refused.value.response.status_code == 403


def test_sockets_in_the_file_system_are_in_private_directories(served: Server, watched: str) -> None:
    """The fork server has one; nobody but the user of the server may reach it."""
    links = (link for process in processes(served) for link in _links(process.pid))
    inodes = {link.removeprefix("socket:[").removesuffix("]") for link in links}
    for line in Path("/proc/net/unix").read_text().splitlines()[1:]:
        _, _, _, flags, _, _, inode, *path = line.split()
        if inode in inodes and int(flags, 16) & 0x10000:  # it listens
            assert path, "a listening socket without a name can be connected to by nobody"
            assert not path[0].startswith("@"), f"{path[0]} has no permissions"
            assert stat.S_IMODE(Path(path[0]).parent.stat().st_mode) == 0o700


def _links(pid: int) -> list[str]:
    try:
        return [str(each.readlink()) for each in Path(f"/proc/{pid}/fd").iterdir()]
    except OSError:  # one of the sweep's has just ended
        return []


ATTACK = """async ([ports, path, protocol]) => {
    const attempts = ports.flatMap((port) => [`ws://127.0.0.1:${port}`, `ws://127.0.0.1:${port}${path}`]);
    const outcomes = await Promise.all(attempts.map((address) => new Promise((resolve) => {
        const socket = new WebSocket(address, [protocol]);
        socket.binaryType = "arraybuffer";
        socket.onmessage = (event) => resolve(`read ${event.data.byteLength} bytes from ${address}`);
        socket.onerror = () => resolve("refused");
        setTimeout(() => resolve("silent"), 5000);
    })));
    const reads = await Promise.all(ports.map((port) => fetch(`http://127.0.0.1:${port}${path}/`).then(
        (answer) => answer.text().then((text) => `read ${text.length} characters`), () => "refused")));
    return [...outcomes, ...reads];
}"""


@pytest.fixture
def elsewhere(tmp_path: Path) -> Iterator[str]:
    """Another origin: a page of a stranger, without any policy, on another port of this machine."""
    (tmp_path / "index.html").write_text("<!doctype html><title>Elsewhere</title>")
    with ThreadingHTTPServer(("127.0.0.1", 0), partial(SimpleHTTPRequestHandler, directory=str(tmp_path))) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}/"
        server.shutdown()


@pytest.mark.browser
@pytest.mark.skipif(not CHROMIUM.exists(), reason="needs Debian's chromium at /usr/bin/chromium")
def test_another_sites_page_reads_nothing(served: Server, watched: str, elsewhere: str, chromium: Any) -> None:
    """A page of a foreign origin, in a real browser that has the scene open as well, gets no byte of it."""
    path = urlsplit(watched).path
    context = chromium.new_context()
    own = context.new_page()
    own.goto(f"{served.origin}{path}/")
    ports = {each.laddr.port for process in processes(served) for each in process.net_connections("tcp") if each.laddr}
    page = context.new_page()
    page.goto(elsewhere)
    outcomes = page.evaluate(ATTACK, [sorted(ports), path, PROTOCOL])
    context.close()
    assert set(outcomes) == {"refused"}
