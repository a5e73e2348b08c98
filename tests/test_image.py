"""The container: its image is built as docker/Dockerfile says, and run as docker/compose.yaml says."""

import json
import os
import shutil
import signal
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import httpx
import pytest

from tests.image import Container, Image, build, debian, lacking, running
from tests.nginx import free_port
from tests.server.asking import columns
from tests.server.command import link
from tests.server.host import begin, steer

pytestmark = pytest.mark.slow

MOST_BYTES = 1.2e9
GRACE_S = 15
"""That of docker/compose.yaml."""
FRAMES = 20


@pytest.fixture(scope="module")
def image(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Image]:
    if reason := lacking():
        pytest.skip(reason)
    try:
        base = debian()
    except OSError as error:
        pytest.skip(str(error))
    place = tmp_path_factory.mktemp("image")
    try:
        yield build(base, place)
    finally:
        subprocess.run(["rm", "-rf", place], check=True)  # tens of thousands of files, which Python takes a minute for


@pytest.fixture
def data(image: Image, tmp_path: Path) -> Path:
    """A volume, as a daemon makes one: it is whose the folder of the image is."""
    folder = tmp_path / "data"
    shutil.copytree(image.root / "data", folder)
    owner = (image.root / "data").stat()
    shutil.chown(folder, owner.st_uid, owner.st_gid)
    return folder


@contextmanager
def visiting(container: Container) -> Iterator[httpx.Client]:
    """Open the link that the container prints."""
    address = urlsplit(link(container.outside))
    origin = f"{address.scheme}://{address.netloc}"
    with httpx.Client(base_url=origin, timeout=60, follow_redirects=True) as client:
        assert client.get("/healthz").status_code == 200
        assert client.get("/api/v1/sessions").status_code == 401
        assert client.get(f"{address.path}?{address.query}").status_code == 200
        yield client


def numbers(client: httpx.Client, session: str) -> dict[str, list[Any]]:
    """Return all that a run has come to, but for how long that took."""
    return {name: values for name, values in columns(client, session).items() if name != "step_ms"}


def end(container: Container) -> None:
    """End the container as a daemon does."""
    os.kill(container.pid, signal.SIGTERM)
    assert container.outside.wait(GRACE_S) == 0


def test_its_size(image: Image) -> None:
    """With the system below it, it has at most 1.2 GB."""
    assert image.size <= MOST_BYTES


def test_it_keeps_what_it_does(image: Image, data: Path) -> None:
    """Ended and started again, it has its sessions, to the same numbers; it writes nowhere but to /data and /tmp."""
    port = str(free_port())
    with running(image, data, PFTRACK_PORT=port) as container, visiting(container) as client:
        session = begin(client)["id"]
        steer(client, session, "seek", frame=FRAMES)
        before = numbers(client, session)
        end(container)
    with running(image, data, PFTRACK_PORT=port) as container, visiting(container) as client:
        assert [it["id"] for it in client.get("/api/v1/sessions").json()] == [session]
        assert client.post(f"/api/v1/sessions/{session}/resume").json()["computed"] >= FRAMES
        assert numbers(client, session) == before
        end(container)


def test_nothing_is_compiled_anew(image: Image, data: Path) -> None:
    """All is ready at once; called once, everything that is compiled is found, and nothing is added to it."""
    with running(image, data, PFTRACK_PORT=str(free_port())) as container, visiting(container) as client:
        compilation = client.get("/api/v1/compilation").json()
        assert (compilation["finished"], compilation["total"]) == (True, 0)
        begin(client)
        doctor = container.execute("pftrack", "doctor", "--warm", "--json")
        found = {check["name"]: check for check in json.loads(doctor.stdout)["checks"]}
        assert found["compiled code"]["found"].startswith("0 functions compiled now"), found["compiled code"]
        assert container.execute("find", "/tmp/compiled", "-type", "f").stdout == ""  # noqa: S108 - the container's


def test_it_may_do_nothing_but_its_work(image: Image, data: Path) -> None:
    """Its health check passes while it serves, also below a path; it is nobody in particular and changes no program."""
    kind, *check = image.config["Healthcheck"]["Test"]
    assert kind == "CMD"
    port = str(free_port())
    with running(image, data, PFTRACK_PORT=port, PFTRACK_BASE_PATH="/any/prefix") as container:
        assert link(container.outside).startswith(f"http://localhost:{port}/any/prefix/")
        assert container.execute(*check).returncode == 0
        lines = container.execute("cat", "/proc/1/status").stdout.splitlines()
        status = {name: value.split() for name, _, value in (line.partition(":") for line in lines)}
        assert status["Uid"] == ["10001"] * 4
        assert status["CapBnd"] == status["CapPrm"] == ["0" * 16]
        for place in ("/opt/compiled/numba", "/opt/pftrack/bin", "/usr/local/bin", "/etc"):
            assert container.execute("touch", f"{place}/new").returncode != 0
