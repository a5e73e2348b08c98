"""What tests say to a server about sweeps."""

import errno
import os
import socket
from typing import Any

import httpx
import psutil

from server.sweeps import driver
from server.sweeps.task import Resume
from tests.server.host import wait_for

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

# Long enough to be cut off in the middle, in pieces of a second.
LONG = {**SMALL, "trials": 160, "frames": 120, "parameters": {"sample_count": 800}}
LONG_RUNS = 3 * 2 * 2 * 160


def begin_sweep(client: httpx.Client, **changes: Any) -> dict[str, Any]:
    """Start a sweep, the small one unless told otherwise."""
    answer = client.post("/api/v1/sweeps", json={**SMALL, **changes})
    assert answer.status_code == 201, answer.text
    begun: dict[str, Any] = answer.json()
    return begun


def show(client: httpx.Client, sweep: str) -> dict[str, Any]:
    shown: dict[str, Any] = client.get(f"/api/v1/sweeps/{sweep}").json()
    return shown


def until_state(client: httpx.Client, sweep: str, state: str, seconds: float = 60) -> dict[str, Any]:
    """Wait until a sweep is in a state."""
    wait_for(lambda: show(client, sweep)["state"] == state, seconds)
    return show(client, sweep)


def until_some(client: httpx.Client, sweep: str, runs: int = 1) -> int:
    """Wait until some runs are there; return how many."""
    wait_for(lambda: show(client, sweep)["done"] >= runs, 60)
    return int(show(client, sweep)["done"])


def rows(client: httpx.Client, sweep: str, **query: Any) -> dict[str, Any]:
    answer = client.get(f"/api/v1/sweeps/{sweep}/rows", params=query)
    assert answer.status_code == 200, answer.text
    found: dict[str, Any] = answer.json()
    return found


def drivers(server: int) -> list[psutil.Process]:
    """The processes below a server that compute sweeps: forks of the forkserver that lead groups of their own."""
    below = psutil.Process(server).children(recursive=True)
    return [one for one in below if os.getpgid(one.pid) == one.pid and "forkserver" in " ".join(one.cmdline())]


DRIVE = driver.main


def drive_on_a_full_disk(talk: socket.socket, complaint: socket.socket, task: Resume) -> None:
    """What a driver does whose disk is full while there is a file `full` beside its result."""

    def fsync(descriptor: int) -> None:
        if task.out.with_name("full").exists():
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        write(descriptor)

    write, os.fsync = os.fsync, fsync
    DRIVE(talk, complaint, task)
