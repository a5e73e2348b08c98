"""A full disk: nothing large is begun, sessions keep what happened, and deleting always works."""

import shutil
import subprocess
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import httpx
import pytest

from tests.server.follow_jobs import send_run
from tests.server.host import begin, error_of, post, steer
from tests.server.uploads.test_uploads import send, video
from tests.session_requests import session_request

# The first worker waits until the fork server has imported everything, which a shared server has waited for.
pytestmark = pytest.mark.usefixtures("server")

MEBIBYTE = 1024 * 1024
DISK_BYTES = 24 * MEBIBYTE


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A real file system of 24 MiB."""
    folder = tmp_path / "disk"
    folder.mkdir()
    command = ["mount", "-t", "tmpfs", "-o", f"size={DISK_BYTES}", "tmpfs", str(folder)]
    mounted = subprocess.run(command, capture_output=True, text=True, check=False)
    if mounted.returncode:
        pytest.skip(f"no file system can be mounted here: {mounted.stderr.strip()}")
    yield folder
    while folder.is_mount():
        subprocess.run(["umount", "--lazy", str(folder)], check=True)


def fill(disk: Path, leave_bytes: int = 0) -> None:
    """Write a file until there is no more room than this."""
    with (disk / "filler").open("ab", buffering=0) as file, suppress(OSError):
        while (free := free_bytes(disk) - leave_bytes) > 0:
            file.write(bytes(min(free, MEBIBYTE)))


def free_bytes(disk: Path) -> int:
    return shutil.disk_usage(disk).free


def save(client: httpx.Client, session: str) -> httpx.Response:
    return client.post("/api/v1/runs", json={"session": session})


@pytest.fixture(scope="module")
def clip() -> bytes:
    return video()


def test_the_reserve_is_kept(start_server: Any, small_disk: Path, clip: bytes) -> None:
    """Below the reserve nothing new is accepted, with a sentence that names the remedy; sessions continue."""
    with start_server(data_dir=small_disk / "data", reserve_bytes=4 * MEBIBYTE) as (_, client):
        session = begin(client)["id"]
        content = client.get(f"/api/v1/runs/{save(client, session).json()['id']}/download").content
        fill(small_disk, 3 * MEBIBYTE)
        axes = [{"name": "occlusion_width_px", "values": [30]}]
        plan = {"experiment": "ball", "axes": axes, "trials": 2, "trackers": ["apf"]}
        for answer in (
            send(client, ("ball.mp4", clip)),
            save(client, session),
            send_run(client, content),
            client.post("/api/v1/sessions", json=session_request({"experiment": "ball"})),
            client.post("/api/v1/sweeps", json=plan),
        ):
            message = error_of(answer, 507)["message"]
            assert "keeps 4 MiB free" in message
            assert "Delete uploads, saved runs, sweeps or sessions" in message
        assert steer(client, session, "seek", frame=20)["position"] == 20
        (small_disk / "filler").unlink()
        assert save(client, session).status_code == 201


def test_room_can_be_made(start_server: Any, small_disk: Path, clip: bytes) -> None:
    """Without free space sessions keep what happened, and uploads, runs and sessions can be deleted.

    The server also starts on a full disk, with nothing lost.
    """
    with start_server(data_dir=small_disk / "data", reserve_bytes=0) as (_, client):
        upload = send(client, ("ball.mp4", clip)).json()["id"]
        first, second = begin(client)["id"], begin(client)["id"]
        steer(client, first, "seek", frame=20)
        run = save(client, first).json()["id"]
        fill(small_disk)
        assert free_bytes(small_disk) == 0
        post(client, f"sessions/{first}/bookmarks", note="kept")
        fill(small_disk)
        steer(client, first, "branch", frame=5, values={"tracker": "apf"})
        for what in (f"sessions/{second}", f"runs/{run}", f"uploads/{upload}"):
            fill(small_disk)
            assert [client.delete(f"/api/v1/{what}").status_code for _ in range(2)] == [204, 404]
        fill(small_disk)
        assert not list((small_disk / "data" / "uploads").iterdir())
        assert save(client, first).status_code == 507
    fill(small_disk)
    with start_server(data_dir=small_disk / "data", reserve_bytes=0) as (_, client):
        (found,) = client.get("/api/v1/sessions").json()
        assert ([mark["note"] for mark in found["bookmarks"]], len(found["branches"])) == (["kept"], 2)
        assert client.get("/api/v1/runs").json() == client.get("/api/v1/uploads").json() == []
        assert client.delete(f"/api/v1/sessions/{first}").status_code == 204


@pytest.mark.parametrize("harm", ["deleted", "read-only"])
def test_a_data_directory_that_takes_nothing(start_server: Any, small_disk: Path, clip: bytes, harm: str) -> None:
    """Every change is refused, the server is not ready, and runs continue."""
    with start_server(data_dir=small_disk / "data", reserve_bytes=0) as (_, client):
        session = begin(client)["id"]
        if harm == "deleted":
            shutil.rmtree(small_disk / "data")
        else:
            subprocess.run(["mount", "--bind", str(small_disk), str(small_disk)], check=True)
            subprocess.run(["mount", "-o", "remount,bind,ro", str(small_disk)], check=True)
        refused = [
            send(client, ("ball.mp4", clip)),
            save(client, session),
            client.post("/api/v1/sessions", json=session_request({"experiment": "ball"})),
            client.post(f"/api/v1/sessions/{session}/bookmarks", json={"note": "lost"}),
            client.delete("/api/v1/uploads/0123456789abcdef"),
        ]
        for answer in refused:
            assert "data directory was deleted or is read-only" in error_of(answer, 507)["message"]
        assert "its data directory" in error_of(client.get("/readyz"), 503)["message"]
        assert steer(client, session, "seek", frame=20)["position"] == 20


def test_saved_runs_and_uploads_have_limits(start_server: Any, clip: bytes) -> None:
    """Saved and imported runs have a limit of their number; runs and uploads one of their bytes."""
    with start_server(max_runs=1, max_uploads_bytes=len(clip) + 1000) as (_, client):
        session = begin(client)["id"]
        run = save(client, session).json()["id"]
        assert "at most 1 saved runs" in error_of(save(client, session), 409)["message"]
        assert "delete one first" in error_of(send_run(client, b"PK"), 409)["message"]
        client.delete(f"/api/v1/runs/{run}")
        assert save(client, session).status_code == 201
        first = send(client, ("ball.mp4", clip)).json()["id"]
        assert error_of(send(client, ("ball.mp4", clip)), 507)["message"].startswith("Uploads take ")
        client.delete(f"/api/v1/uploads/{first}")
        assert send(client, ("ball.mp4", clip)).status_code == 201
    with start_server(max_runs_bytes=1) as (_, client):
        assert "delete one first" in error_of(save(client, begin(client)["id"]), 507)["message"]
