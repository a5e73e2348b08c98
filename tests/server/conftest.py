"""Servers for tests, one shared and others of a test's own."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx
import pytest
import structlog
from PIL import Image

from pftrack_server.core.settings import Settings
from pftrack_server.jobs.child_tasks import ChildTasks, Queues
from tests.apart import run
from tests.browser.host import Server as ServerProcess
from tests.installing import install
from tests.making import disc_film
from tests.server.command import PROGRAM
from tests.server.confined import children, descriptors
from tests.server.host import Server, begin, running
from tests.server.misbehaving import FAILING, SCRIBBLING
from tests.waiting import wait_for

# Plain tracebacks: structlog's own, with all locals, take seconds for an exception in an app.
structlog.configure(
    processors=[
        structlog.processors.add_log_level,
        structlog.processors.format_exc_info,
        structlog.processors.LogfmtRenderer(),
    ]
)


@pytest.fixture(scope="session", autouse=True)
def _compiled(compiled: None) -> None:
    """Every server here is ready at once."""


@pytest.fixture(scope="session")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """One server for all tests that do not need one of their own."""
    with running(Settings(data_dir=tmp_path_factory.mktemp("data"))) as shared:
        yield shared


class QuickServer(ServerProcess):
    """A server in a process of its own that takes all experiments for compiled, and whose sweeps stop at a chunk."""

    def command(self) -> list[str]:
        """Return the command line."""
        first = "from pftrack.doctor import memory; memory.ready = frozenset\n"
        first += "import tests.server.sweeping as its; its.functions.compute = its.compute_by_permission"
        arguments = f"port={self._port}, data_dir=Path({str(self.data)!r})"
        return [sys.executable, "-c", PROGRAM.format(first, arguments)]


@pytest.fixture(scope="session")
def beside_misbehaving(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ServerProcess]:
    """A server in a process of its own, beside a package whose experiment does not run, and one that draws nonsense."""
    place = tmp_path_factory.mktemp("installed")
    install(place, "a-failing-one", FAILING, "failing = a_failing_one:EXPERIMENT")
    install(place, "a-scribbling-one", SCRIBBLING, "scribbling = a_scribbling_one:EXPERIMENT")
    server = QuickServer(tmp_path_factory.mktemp("served"), installed=place)
    yield server
    server.stop()


@pytest.fixture
def start_server(tmp_path: Path) -> Iterator[Callable[..., Any]]:
    """Make servers of this test's own, as `start_server(**settings)`, a context."""

    @contextmanager
    def start(**settings: Any) -> Iterator[tuple[Server, httpx.Client]]:
        with (
            running(Settings(**{"data_dir": tmp_path / "data", **settings})) as own,
            httpx.Client(base_url=own.url, timeout=60, verify=False) as client,  # noqa: S501
        ):
            yield own, client

    return start


@pytest.fixture
def client(server: Server) -> Iterator[httpx.Client]:
    """A client of the shared server; the sessions that it leaves behind are ended."""
    # Reading certificates, which nothing here needs, takes 20 ms for each of hundreds of clients.
    with httpx.Client(base_url=server.url, timeout=60, verify=False) as http:  # noqa: S501
        yield http
        for session in http.get("/api/v1/sessions").json():
            http.delete(f"/api/v1/sessions/{session['id']}")


@pytest.fixture
def session(client: httpx.Client) -> dict[str, Any]:
    """A session on the simulated ball."""
    return begin(client)


@pytest.fixture(scope="session")
def walk() -> bytes:
    """A film of a red disc at 40, 60 on grey, 12 frames of 160 x 120 px."""
    return disc_film(12, speed_px=0)


@pytest.fixture
def upload(client: httpx.Client, walk: bytes) -> str:
    """The film as an upload."""
    return str(client.post("/api/v1/uploads", files={"file": ("walk.mp4", walk)}).json()["id"])


@pytest.fixture(scope="session")
def _fork_server() -> None:
    """The fork server runs: within a test that has it start, time would pass and descriptors would be opened."""
    run(ChildTasks(Queues()).check())


@pytest.fixture
def nothing_is_left(_fork_server: None) -> Iterator[None]:
    """A test leaves no more children of the fork server, and no more open descriptors, than it has found.

    It may leave fewer: what another test has dropped is closed whenever it is collected.
    """
    before = len(children()), descriptors()
    yield
    wait_for(lambda: len(children()) <= before[0] and descriptors() <= before[1])


@pytest.fixture(scope="session")
def endless(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A small GIF of 2,000 large pictures, which take long to unfold."""
    frames = [Image.new("P", (2000, 2000), colour) for colour in (0, 1)]
    for frame in frames:
        frame.putpalette([0, 0, 0, 255, 255, 255])
    path = tmp_path_factory.mktemp("endless") / "endless.gif"
    frames[0].save(path, save_all=True, append_images=frames[1:], duration=50)
    content = path.read_bytes()
    second = content.rindex(b"\x21\xf9\x04")  # where the second picture's control block begins
    path.write_bytes(content[:second] + content[second:-1] * 2000 + b";")
    return path
