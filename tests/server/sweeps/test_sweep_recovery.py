"""Sweeps whose process, server or disk fails in the middle are shown as stopped with the reason, and resumed."""

import asyncio
import contextlib
import errno
import io
import os
import threading
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import httpx
import psutil
import pyarrow.parquet as pq
import pytest

from pftrack.core.refusal import RefusedError
from pftrack.sweep import read_result
from pftrack.sweep.axis import SweepError
from pftrack_server.core.settings import Settings
from pftrack_server.store.database import SweepRow
from pftrack_server.sweeps import functions
from pftrack_server.sweeps import sweep as sweep_of_the_server
from pftrack_server.sweeps.planning import SweepCreate
from pftrack_server.sweeps.sweep import NICENESS
from tests.server import sweeping
from tests.server.host import Server, error_of, running
from tests.waiting import wait_for


def new_drivers(others: list[psutil.Process]) -> list[psutil.Process]:
    """The processes that compute sweeps, without those of servers that other tests of this process share."""
    return [one for one in sweeping.drivers(os.getpid()) if one not in others]


def chunks(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.glob("*.parquet")}


@pytest.fixture
def sweeps(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder of the sweeps of a server whose sweeps pause after a chunk until they may continue."""
    monkeypatch.setattr(functions, "compute", sweeping.compute_by_permission)
    return tmp_path / "data" / "sweeps"


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """A server for tests that leave nothing behind."""
    with running(Settings(data_dir=tmp_path_factory.mktemp("data"), sweep_jobs=1)) as server:
        yield server


@pytest.fixture
def own(served: Server, monkeypatch: pytest.MonkeyPatch) -> Iterator[tuple[httpx.Client, Path]]:
    """A client of that server, and the folder of its sweeps, which pause after a chunk and are deleted in the end."""
    monkeypatch.setattr(functions, "compute", sweeping.compute_by_permission)
    folder = Path(served.app.state.services.store.files.sweeps)
    with httpx.Client(base_url=served.url, timeout=60, verify=False) as client:  # noqa: S501
        yield client, folder
        for sweep in client.get("/api/v1/sweeps").json():
            client.delete(f"/api/v1/sweeps/{sweep['id']}").raise_for_status()
    (folder / "allowed").unlink(missing_ok=True)


def test_a_killed_process(own: tuple[httpx.Client, Path], monkeypatch: pytest.MonkeyPatch) -> None:
    """A sweep whose process is killed stops with that reason, keeps its runs, and is completed when it is resumed."""
    monkeypatch.setattr(sweep_of_the_server, "NICENESS", NICENESS)
    client, sweeps = own
    others = sweeping.drivers(os.getpid())
    sweep = sweeping.begin_sweep(client)
    sweeping.until_some(client, sweep["id"])
    [driver] = new_drivers(others)
    workers = driver.children(recursive=True)
    for process in (driver, *workers):
        assert process.nice() == min(psutil.Process().nice() + NICENESS, 19)  # it gives way to what people watch
        assert process.rlimit(psutil.RLIMIT_FSIZE)[0] == Settings().max_sweeps_bytes
    driver.kill()
    monkeypatch.setattr(sweep_of_the_server, "NICENESS", 0)
    stopped = sweeping.until_state(client, sweep["id"], "stopped")
    assert "its process was killed" in stopped["message"]
    assert 0 < stopped["done"] < sweeping.RUNS
    wait_for(lambda: not any(worker.is_running() for worker in workers))
    kept = chunks(sweeps / f"{sweep['id']}.parquet.partial")
    assert kept
    assert client.post(f"/api/v1/sweeps/{sweep['id']}/resume").json()["state"] == "running"
    sweeping.allow(sweeps)
    assert sweeping.until_state(client, sweep["id"], "done")["done"] == sweeping.RUNS
    whole = read_result(sweeps / f"{sweep['id']}.parquet").table
    assert whole["run"].to_pylist() == list(range(sweeping.RUNS))
    for data in kept.values():
        before = pq.read_table(io.BytesIO(data))
        after = whole.slice(before["run"][0].as_py(), len(before))
        # Stored runs were not computed again: even the time of a step is the same.
        assert after["step_ms"].to_pylist() == before["step_ms"].to_pylist()


def test_cancel_stop_and_restart(start_server: Any, sweeps: Path) -> None:
    """A cancelled sweep and one whose server was stopped are resumable, on a new server too."""
    others = sweeping.drivers(os.getpid())
    with start_server(sweep_jobs=1) as (_, client):
        cancelled = sweeping.begin_sweep(client)
        running = sweeping.begin_sweep(client, seed=9)
        sweeping.until_some(client, cancelled["id"])
        sweeping.until_some(client, running["id"])
        assert client.post(f"/api/v1/sweeps/{cancelled['id']}/cancel").json()["state"] == "stopped"
        assert "cancelled" in sweeping.show(client, cancelled["id"])["message"]
        wait_for(lambda: len(new_drivers(others)) == 1, what="the cancelled one has ended")
        [process] = new_drivers(others)
        partial = client.get(f"/api/v1/sweeps/{cancelled['id']}/download", params={"format": "csv"}).text
        assert len(partial.splitlines()) == sweeping.show(client, cancelled["id"])["done"] + 1
    assert not process.is_running()
    with start_server(sweep_jobs=1) as (_, client):
        found = {sweep["id"]: sweep for sweep in client.get("/api/v1/sweeps").json()}
        assert {sweep["state"] for sweep in found.values()} == {"stopped"}
        assert "server was stopped" in found[running["id"]]["message"]
        assert 0 < found[running["id"]]["done"] < sweeping.RUNS
        sweeping.allow(sweeps, 2)
        client.post(f"/api/v1/sweeps/{running['id']}/resume")
        sweeping.until_some(client, running["id"], found[running["id"]]["done"] + 1)
        assert client.delete(f"/api/v1/sweeps/{running['id']}").status_code == 204
        assert [sweep["id"] for sweep in client.get("/api/v1/sweeps").json()] == [cancelled["id"]]


def test_a_full_disk(own: tuple[httpx.Client, Path], monkeypatch: pytest.MonkeyPatch) -> None:
    """A sweep that meets a full disk stops with that reason; with room again it is completed."""
    monkeypatch.setattr(functions, "compute", sweeping.compute_on_a_full_disk)
    client, sweeps = own
    full = sweeps / "full"
    sweep = sweeping.begin_sweep(client)
    sweeping.until_some(client, sweep["id"])
    client.post(f"/api/v1/sweeps/{sweep['id']}/cancel")
    full.touch()
    sweeping.allow(sweeps)
    client.post(f"/api/v1/sweeps/{sweep['id']}/resume")
    stopped = sweeping.until_state(client, sweep["id"], "stopped")
    full.unlink()
    assert stopped["message"].startswith("The disk of the server is full")
    assert stopped["done"] > 0
    client.post(f"/api/v1/sweeps/{sweep['id']}/resume")
    assert sweeping.until_state(client, sweep["id"], "done")["done"] == sweeping.RUNS > stopped["done"]


def test_an_unwilling_database(served: Server, own: tuple[httpx.Client, Path], monkeypatch: pytest.MonkeyPatch) -> None:
    """A sweep whose progress cannot be stored is followed all the same, and can be cancelled."""
    refuse = Mock(side_effect=OSError(errno.ENOSPC, "no room"))
    monkeypatch.setattr(sweep_of_the_server, "WRITE_EVERY_S", 0.0)
    client, sweeps = own
    sweep = sweeping.begin_sweep(client)
    before = sweeping.until_some(client, sweep["id"])
    monkeypatch.setattr(served.app.state.services.store, "save", refuse)
    sweeping.allow(sweeps, 4)
    wait_for(lambda: refuse.call_count > 1, 60)
    sweeping.until_some(client, sweep["id"], before + 1)
    assert client.post(f"/api/v1/sweeps/{sweep['id']}/cancel").json()["state"] == "stopped"


def test_resumed_by_two_at_once(own: tuple[httpx.Client, Path]) -> None:
    """If several requests resume a sweep at the same time, one succeeds, and one process computes the sweep."""
    client, sweeps = own
    sweep = sweeping.begin_sweep(client)
    client.post(f"/api/v1/sweeps/{sweep['id']}/cancel")
    kept = sweeping.show(client, sweep["id"])["done"]
    others = sweeping.drivers(os.getpid())
    with ThreadPoolExecutor(4) as pool:
        answers = list(pool.map(client.post, [f"/api/v1/sweeps/{sweep['id']}/resume"] * 4))
    assert sorted(answer.status_code for answer in answers) == [200, 409, 409, 409]
    sweeping.allow(sweeps, 2)
    sweeping.until_some(client, sweep["id"], kept + 1)
    assert len(new_drivers(others)) == 1


def test_deleted_while_it_begins(served: Server, own: tuple[httpx.Client, Path]) -> None:
    """A sweep that is deleted while it is resumed is not computed afterwards."""
    client, _ = own
    url = f"/api/v1/sweeps/{sweeping.begin_sweep(client)['id']}"
    client.post(f"{url}/cancel")
    found = served.app.state.services.sweeps.get(url.rpartition("/")[2])
    begins, go = threading.Event(), threading.Event()

    async def find(_: Any) -> None:
        begins.set()
        await asyncio.to_thread(go.wait, 60)

    found.find_recording = find
    with ThreadPoolExecutor(2) as pool:
        resumed = pool.submit(client.post, f"{url}/resume")
        assert begins.wait(60)
        deleted = pool.submit(client.delete, url)
        time.sleep(0.2)
        go.set()
        assert (resumed.result().status_code, deleted.result().status_code) == (200, 204)
    assert found.row.state == "stopped"


def test_cancelled_while_it_begins(served: Server, monkeypatch: pytest.MonkeyPatch) -> None:
    """A sweep whose request is cancelled once it computes leaves neither a process nor a row behind."""
    sweeps, store = served.app.state.services.sweeps, served.app.state.services.store
    save, runs, cancelled = store.save, threading.Event(), threading.Event()

    def store_and_tell(row: SweepRow) -> None:
        if row.state == "running" and not runs.is_set():
            runs.set()
            cancelled.wait(60)
        save(row)

    async def cancel() -> Any:
        creating = asyncio.ensure_future(sweeps.create(SweepCreate(**sweeping.SMALL)))
        assert await asyncio.to_thread(runs.wait, 60)
        [begun] = [it for it in sweeps.all if it.row.state == "running"]
        creating.cancel()
        cancelled.set()
        with contextlib.suppress(asyncio.CancelledError):
            await creating
        return begun

    monkeypatch.setattr(store, "save", store_and_tell)
    begun = served.run(cancel())
    assert begun.row.state == "stopped"
    assert begun not in sweeps.all
    assert store.get(SweepRow, begun.row.id) is None


def test_deleted_at_its_end(served: Server, own: tuple[httpx.Client, Path], monkeypatch: pytest.MonkeyPatch) -> None:
    """A sweep that is deleted while its last state is written down is not in the database afterwards."""
    client, sweeps = own
    store = served.app.state.services.store
    save, storing, stored = store.save, threading.Event(), threading.Event()

    def store_slowly(row: SweepRow) -> None:
        if row.state == "done":
            storing.set()
            time.sleep(0.5)
        save(row)
        if row.state == "done":
            stored.set()

    monkeypatch.setattr(store, "save", store_slowly)
    sweep = sweeping.begin_sweep(client, trials=1)
    sweeping.allow(sweeps)
    assert storing.wait(60)
    assert client.delete(f"/api/v1/sweeps/{sweep['id']}").status_code == 204
    assert stored.wait(60)
    assert store.get(SweepRow, sweep["id"]) is None


def test_the_process_names_no_path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A failure while a file of a sweep is written is reported without the paths of the server."""
    for error, words in (
        (OSError(errno.ENOSPC, "No space left on device", "/data/one"), "The disk of the server is full."),
        (PermissionError(errno.EACCES, "Permission denied", "/data/one"), "A file of the sweep cannot be written."),
        (SweepError("/data/one.parquet is no Parquet file"), "a file is no Parquet file"),
    ):
        monkeypatch.setattr(functions, "read_result", Mock(side_effect=error))
        with pytest.raises(RefusedError) as told:
            functions.write(tmp_path / "sweep.parquet", tmp_path / "file", "parquet")
        assert str(told.value) == words


def test_limits(start_server: Any, sweeps: Path) -> None:
    """A server with as many sweeps as it may compute or store refuses another, already in the estimate."""
    with start_server(sweep_jobs=1, max_sweeps_running=1, max_sweeps=2, max_sweeps_bytes=1 << 20) as (_, client):
        sweep = sweeping.begin_sweep(client)
        busy = error_of(client.post("/api/v1/sweeps", json=sweeping.SMALL), 503)["message"]
        assert "at most 1 sweep at a time" in busy
        size = client.post("/api/v1/sweeps/estimate", json={**sweeping.SMALL, "measure": False}).json()
        assert "at most 1 sweep at a time" in size["problem"]
        client.post(f"/api/v1/sweeps/{sweep['id']}/cancel")
        large = {**sweeping.SMALL, "trials": 2000}
        assert "of the 1 MiB for all sweeps" in error_of(client.post("/api/v1/sweeps", json=large), 503)["message"]
        sweeping.allow(sweeps)
        other = sweeping.begin_sweep(client)
        sweeping.until_state(client, other["id"], "done")
        assert "at most 2 sweeps" in error_of(client.post("/api/v1/sweeps", json=sweeping.SMALL), 503)["message"]
        assert sweeping.show(client, other["id"])["done"] == sweeping.RUNS


def test_a_damaged_result(start_server: Any, tmp_path: Path) -> None:
    """On a new server a complete sweep whose file was damaged reports that, and can be deleted."""
    with start_server(sweep_jobs=1) as (_, client):
        sweep = sweeping.begin_sweep(client)
        sweeping.until_state(client, sweep["id"], "done")
    path = tmp_path / "data" / "sweeps" / f"{sweep['id']}.parquet"
    path.write_bytes(path.read_bytes()[:1000])
    with start_server(sweep_jobs=1) as (_, client):
        assert sweeping.show(client, sweep["id"])["state"] == "done"
        for question in ("cells", "rows", "download?format=csv"):
            message = error_of(client.get(f"/api/v1/sweeps/{sweep['id']}/{question}"), 410)["message"]
            assert message == "The files of this sweep are damaged or were removed."
        assert client.delete(f"/api/v1/sweeps/{sweep['id']}").status_code == 204
        assert not path.exists()
