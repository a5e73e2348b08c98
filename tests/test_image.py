"""The container: its image is built as docker/Dockerfile says, and run as docker/compose.yaml says.

All is one test, since processes that share the tests would each build an image.
"""

import json
import os
import shutil
import signal
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx
import pytest

from tests.image import Container, Image, build, debian, lacking, running
from tests.nginx import free_port
from tests.server.asking import columns
from tests.server.command import link
from tests.server.host import begin, steer

MOST_BYTES = 1.2e9
GRACE_S = 15
"""That of docker/compose.yaml."""
FRAMES = 20
PROGRAMS = "/opt/pftrack/bin", "/usr/local/bin", "/etc"


@pytest.fixture
def image(tmp_path: Path) -> Iterator[Image]:
    if reason := lacking():
        pytest.skip(reason)
    try:
        base = debian()
    except OSError as error:
        pytest.skip(str(error))
    place = tmp_path / "image"
    place.mkdir()
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


@pytest.mark.slow
def test_a_life(image: Image, data: Path) -> None:
    """It is small, uses what was compiled with it, is confined, and finds its sessions again when it was ended.

    So it is at the root of an address as well as below a path.
    """
    assert image.size <= MOST_BYTES
    with visited(image, data, path="") as (container, client):
        assert_confined(container)
        session = begin(client)["id"]
        steer(client, session, "seek", frame=FRAMES)
        before = numbers(client, session)
        assert_nothing_compiled(container, client)
        end(container)
    with visited(image, data, path="/any/prefix") as (container, client):
        assert [it["id"] for it in client.get("/api/v1/sessions").json()] == [session]
        assert client.post(f"/api/v1/sessions/{session}/resume").json()["computed"] >= FRAMES
        assert numbers(client, session) == before
        end(container)


@contextmanager
def visited(image: Image, data: Path, *, path: str) -> Iterator[tuple[Container, httpx.Client]]:
    """Run a container, and open the link that it prints."""
    port = str(free_port())
    with running(image, data, PFTRACK_PORT=port, PFTRACK_BASE_PATH=path) as container:
        address = link(container.outside)
        bare = f"http://localhost:{port}{path}"
        assert address.startswith(f"{bare}/?token=")
        kind, *check = image.config["Healthcheck"]["Test"]
        assert (kind, container.execute(*check).returncode) == ("CMD", 0)
        with httpx.Client(base_url=bare, timeout=60, follow_redirects=True) as client:
            assert client.get("/healthz").status_code == 200
            assert client.get("/api/v1/sessions").status_code == 401
            assert client.get(address).status_code == 200  # from here on a cookie says it
            yield container, client


def assert_confined(container: Container) -> None:
    """Check that it is nobody in particular, may do nothing that others may not, and changes no program."""
    lines = container.execute("cat", "/proc/1/status").stdout.splitlines()
    status = {name: value.split() for name, _, value in (line.partition(":") for line in lines)}
    assert status["Uid"] == ["10001"] * 4
    assert status["CapBnd"] == status["CapPrm"] == ["0" * 16]
    for place in PROGRAMS:
        assert container.execute("touch", f"{place}/new").returncode != 0


def assert_nothing_compiled(container: Container, client: httpx.Client) -> None:
    """Check that all was ready at once, and that everything that is compiled is found when it is called."""
    compilation = client.get("/api/v1/compilation").json()
    assert (compilation["finished"], compilation["total"]) == (True, 0)
    doctor = container.execute("pftrack", "doctor", "--warm", "--json")
    found = {check["name"]: check for check in json.loads(doctor.stdout)["checks"]}
    assert found["compiled code"]["found"].startswith("0 functions compiled now"), found["compiled code"]
    assert container.execute("find", "/tmp", "-name", "*.nb?").stdout == ""  # noqa: S108 - the container's


def numbers(client: httpx.Client, session: str) -> dict[str, list[Any]]:
    """Return all that a run has come to, but for how long that took."""
    return {name: values for name, values in columns(client, session).items() if name != "step_ms"}


def end(container: Container) -> None:
    """End the container as a daemon does."""
    os.kill(container.pid, signal.SIGTERM)
    assert container.outside.wait(GRACE_S) == 0
