"""What tests say to a server about sweeps."""

import errno
import os
import time
from functools import partial
from pathlib import Path
from typing import Any

import httpx
import psutil

from pftrack.core.files import write_whole
from pftrack.sweep import driver as driving
from pftrack.sweep.journal import partial_of
from pftrack.sweep.work import compute_chunk
from pftrack_server.sweeps import functions
from tests.waiting import wait_for

SMALL: dict[str, Any] = {
    "experiment": "ball",
    "axes": [
        {"name": "occlusion_width_px", "start": 5, "stop": 105, "step": 50},
        {"name": "distracter_radius_px", "values": [1, 20]},
    ],
    "trackers": ["h-spf", "pc-pf"],
    "trials": 6,
    "frames": 40,
    "seed": 3,
    "parameters": {"sample_count": 100},
}
RUNS = 3 * 2 * 2 * 6


def begin_sweep(client: httpx.Client, **changes: Any) -> dict[str, Any]:
    """Start a sweep, the small one unless told otherwise."""
    answer = client.post("/api/v1/sweeps", json={**SMALL, **changes})
    assert answer.status_code == 201, answer.text
    return answer.json()


def show(client: httpx.Client, sweep: str) -> dict[str, Any]:
    return client.get(f"/api/v1/sweeps/{sweep}").json()


def until_state(client: httpx.Client, sweep: str, state: str, seconds: float = 240) -> dict[str, Any]:
    """Wait until a sweep is in a state."""
    wait_for(lambda: show(client, sweep)["state"] == state, seconds)
    return show(client, sweep)


def until_some(client: httpx.Client, sweep: str, runs: int = 1) -> int:
    """Wait until some runs are there; return how many."""
    wait_for(lambda: show(client, sweep)["done"] >= runs, 240)
    return int(show(client, sweep)["done"])


def rows(client: httpx.Client, sweep: str, **query: Any) -> dict[str, Any]:
    return client.get(f"/api/v1/sweeps/{sweep}/rows", params=query).raise_for_status().json()


def drivers(server: int) -> list[psutil.Process]:
    """The processes below a server that compute sweeps: forks that lead groups of their own, and may write one file.

    A session's worker has no limit of its own for files, and what decodes an upload may write none.
    """
    below = psutil.Process(server).children(recursive=True)
    servers = [one.pid for one in below if one.ppid() == server]
    leading = [one for one in below if os.getpgid(one.pid) == one.pid and one.ppid() in servers]
    return [one for one in leading if one.rlimit(psutil.RLIMIT_FSIZE)[0] > 0]


COMPUTE = functions.compute


def compute_unmeasured(out: Path, jobs: int, *recording: Any) -> None:
    """What a process does that cuts its sweep into chunks without half a second of runs that are measured."""
    driving.measure = measured_at_once
    COMPUTE(out, jobs, *recording)


def compute_by_permission(out: Path, jobs: int, *recording: Any) -> None:
    """What a process does that stands still in the middle of a sweep, until it is allowed to go on.

    It cuts the sweep into chunks of some milliseconds, so that a test computes little, and works on the first one alone
    until `allow` is called. A sweep that stands still can be looked at, cancelled or killed at any speed of a machine.
    """
    driving.SMALLEST_CHUNK_S = driving.PATIENCE_S = 0.0
    driving.compute_chunk = partial(computed_by_permission, out)  # type: ignore[attr-defined]
    compute_unmeasured(out, jobs, *recording)


def measured_at_once(*_: Any) -> float:
    """Return about how long a run takes, s."""
    return 0.005


def computed_by_permission(out: Path, *chunk: Any) -> bytes:
    """Compute a chunk of a sweep as soon as fewer are kept than may be."""
    allowed = out.with_name("allowed")
    while len(list(partial_of(out).glob("0*.parquet"))) >= (int(allowed.read_text()) if allowed.exists() else 1):
        time.sleep(0.005)
    return compute_chunk(*chunk)


def allow(sweeps: Path, chunks: int = 1_000_000) -> None:
    """Let every sweep in a folder go on until so many chunks are kept."""
    write_whole(sweeps / "allowed", str(chunks).encode())


def compute_on_a_full_disk(out: Path, jobs: int, *recording: Any) -> None:
    """What such a process does whose disk is full while there is a file `full` beside its result."""

    def fsync(descriptor: int) -> None:
        if out.with_name("full").exists():
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        write(descriptor)

    write, os.fsync = os.fsync, fsync
    compute_by_permission(out, jobs, *recording)
