"""Imports of saved runs that take long: they report their progress, and can be cancelled."""

import json
import zipfile
from io import BytesIO
from pathlib import Path
from typing import Any

import httpx
import psutil
import pytest

from pftrack.experiments import find
from pftrack.runs import record
from pftrack.runs.run import Run
from tests.server import hostile
from tests.server.follow_jobs import asked, ended, send_run
from tests.server.host import Server, error_of, granted
from tests.server.jobs.test_queue import occupied
from tests.waiting import wait_for

FRAMES = 12


@pytest.fixture(scope="module")
def saved(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """A saved run."""
    run = Run(find("ball"), find("ball").simulate(), frames=60)
    run.seek(FRAMES - 1)
    path = tmp_path_factory.mktemp("saved") / "saved.pft"
    record.save(run, path)
    return path.read_bytes()


def send(client: httpx.Client, content: bytes) -> dict[str, Any]:
    return granted(send_run(client, content, "a run.pft"))


def test_it_can_be_cancelled(
    server: Server, client: httpx.Client, saved: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A cancelled import ends its process and leaves nothing.

    While all places for imports are taken the server is ready, and another import waits for its turn.
    """
    monkeypatch.setattr("pftrack_server.work.run_functions.weigh_record", hostile.weigh_for_ever)
    before = client.get("/api/v1/runs").json()
    begun = send(client, saved)
    wait_for(lambda: asked(client, begun)["done"] > 0, 30)
    computing = [each.pid for each in psutil.Process().children(recursive=True)]
    assert client.delete(f"/api/v1/jobs/{begun['id']}").status_code == 204
    wait_for(lambda: sum(psutil.pid_exists(pid) for pid in computing) < len(computing))
    wait_for(lambda: not list(Path(server.app.state.services.store.files.incoming).iterdir()))
    assert client.get("/api/v1/runs").json() == before
    assert begun["id"] not in [each["id"] for each in client.get("/api/v1/jobs").json()]
    error_of(client.delete(f"/api/v1/jobs/{begun['id']}"), 404)
    with occupied(server, "heavy"):
        waits = send(client, saved)
        wait_for(lambda: server.app.state.services.queues.heavy._waiting)
        assert client.get("/readyz").status_code == 200
        assert asked(client, waits)["total"] == 0
        client.delete(f"/api/v1/jobs/{waits['id']}")


def test_it_goes_on_while_somebody_asks(
    server: Server, client: httpx.Client, saved: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An import reports its progress, and is a saved run in the end; one that nobody asks for is dropped."""
    monkeypatch.setattr("pftrack_server.jobs.jobs.LOOK_S", 0.5)
    monkeypatch.setattr("pftrack_server.jobs.jobs.MOST_LOOKS", 2)
    monkeypatch.setattr("pftrack_server.work.run_functions.weigh_record", hostile.weigh_slowly)
    before = client.get("/api/v1/runs").json()
    jobs: Any = server.app.state.services.house.jobs
    left, wanted = send(client, saved)["id"], send(client, saved)
    told = [wanted[name] for name in ("kind", "state", "name", "result")]
    assert told == ["import", "working", "a run.pft", None]
    seen: set[int] = set()

    def arrived() -> bool:
        now = asked(client, wanted)
        seen.add(now["done"])
        assert now["total"] in {0, FRAMES}
        return bool(now["state"] == "done" and jobs._all[left].task.done())

    wait_for(arrived, 60)
    assert len(seen) > 3
    dropped = client.get(f"/api/v1/jobs/{left}").json()
    assert (dropped["state"], dropped["result"]) == ("failed", None)
    assert "Nobody asked for this import for 1 s" in dropped["error"]
    run = client.get(f"/api/v1/runs/{asked(client, wanted)['result']['id']}").json()
    assert run["summary"]["reproduced"]
    assert [each["id"] for each in client.get("/api/v1/runs").json()] == [run["id"], *(each["id"] for each in before)]
    assert not list(Path(server.app.state.services.store.files.incoming).iterdir())
    client.delete(f"/api/v1/runs/{run['id']}")


def test_a_failed_import_keeps_its_reason(
    server: Server, client: httpx.Client, saved: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The reason of a failed import can be read for a while; a file that is not a run is refused at once."""
    error_of(send_run(client, b"no run"), 422)
    with zipfile.ZipFile(BytesIO(saved)) as archive:
        raw = json.loads(archive.read("run.json"))
    raw["recipe"]["footage"] = {"name": "a clip.mp4"}
    changed = BytesIO()
    with zipfile.ZipFile(changed, "w") as archive:
        archive.writestr("run.json", json.dumps(raw))
    begun = send(client, changed.getvalue())
    assert "a clip.mp4, which is not on this server" in ended(client, begun)["error"]
    assert asked(client, begun)["state"] == "failed"
    monkeypatch.setattr(server.app.state.services.house.jobs, "_kept_s", 0.0)
    error_of(client.get(f"/api/v1/jobs/{begun['id']}"), 404)
    assert begun["id"] not in [each["id"] for each in client.get("/api/v1/jobs").json()]
