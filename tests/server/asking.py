"""What tests ask of a session."""

import os
import signal
from typing import Any

import httpx

from tests.server.host import Server, granted
from tests.waiting import wait_for


def get(client: httpx.Client, session: str) -> dict[str, Any]:
    return client.get(f"/api/v1/sessions/{session}").json()


def timeline_of(session: dict[str, Any]) -> list[dict[str, Any]]:
    """Return a session's timeline as a client writes one."""
    return [{"frame": change["frame"], "values": change["values"]} for change in session["timeline"]]


def columns(client: httpx.Client, session: str, branch: str | None = None) -> dict[str, list[Any]]:
    query = {"branch": branch} if branch else {}
    return client.get(f"/api/v1/sessions/{session}/diagnostics", params=query).json()["columns"]


def diagnostics(client: httpx.Client, session: str) -> dict[str, list[Any]]:
    """Return all columns but the time that a step took, which is the only thing that is not the same each time."""
    return {name: column for name, column in columns(client, session).items() if name != "step_ms"}


def kill(server: Server, client: httpx.Client, session: str) -> None:
    """Kill a session's worker, and wait until the session knows."""
    os.kill(server.pid_of(session), signal.SIGKILL)
    wait_for(lambda: get(client, session)["state"] == "crashed")


def resume(client: httpx.Client, session: str) -> dict[str, Any]:
    return granted(client.post(f"/api/v1/sessions/{session}/resume"))
